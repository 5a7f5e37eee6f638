#pragma once
/** @file
Python callables as functions in a model's formulas. **/

#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "simflex/model/file/ModelReader.h"
#include "simflex/python/Values.h"

namespace simflex {
namespace python {

/** A callable and the exception it has raised. **/
class Callable {
public:
    explicit Callable(py::object callable) : m_callable(std::move(callable)) {}
    ~Callable();
    Callable(const Callable&) = delete;
    Callable& operator=(const Callable&) = delete;

    /** Callable from any thread; returns NaN once it has failed. **/
    double calc(const double* arguments, int count);
    /** Returns the callable's result, nothing once it has failed. @pre the interpreter's lock is
    held. **/
    std::optional<py::object> call(const py::tuple& arguments);
    bool hasFailed() const { return m_failure != nullptr; }
    /** Reports a failure once. @throws py::error_already_set if the callable has failed. **/
    void raise();
    const py::object& get() const { return m_callable; }

private:
    py::object m_callable;
    std::unique_ptr<py::error_already_set> m_failure;
};

/** Registers a callable for the model's formulas, by default under its own name.
@returns the name. @throws py::type_error, py::value_error. **/
std::string addCallable(ModelText& model, const py::object& callable, std::string name = "");
/** Returns a call such as "torque(angle, speed)", whose arguments are named as the callable's
parameters. **/
std::string addCall(ModelText& model, const py::object& callable);

class Callables {
public:
    /** Gives the model its own copies, so that a failure in one copy does not affect others. **/
    explicit Callables(ModelText& model);
    /** Sets the callable that receives progress, or None. **/
    void setProgress(const py::object& progress);
    /** Reports progress. Returns false if the progress callable does, or fails. @pre the
    interpreter's lock is held. **/
    bool tell(const std::function<py::tuple()>& makeTold) const;

    bool isEmpty() const { return m_all.empty(); }
    bool haveFailed() const;
    /** Returns the result of work(). @throws the exception that a callable has raised
    meanwhile. **/
    template <class Work>
    auto watch(const Work& work) const -> decltype(work()) {
        try {
            if constexpr (std::is_void<decltype(work())>::value) {
                work();
                raise();
            } else {
                auto result = work();
                raise();
                return result;
            }
        } catch (const py::error_already_set&) {
            throw;
        } catch (...) {
            raise();
            throw;
        }
    }

private:
    std::vector<std::shared_ptr<Callable>> m_all;
    std::shared_ptr<Callable> m_progress;
    void raise() const;
};

/** Returns the callables by name, for pickling. **/
py::dict listCallables(const ModelText& model);

}  // namespace python
}  // namespace simflex
