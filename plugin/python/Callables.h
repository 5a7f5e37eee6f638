#pragma once
/** @file
Callables of Python as functions of a model's formulas. **/

#include <memory>
#include <optional>
#include <type_traits>
#include <vector>

#include "simflex/model/file/ModelReader.h"
#include "simflex/python/Values.h"

namespace simflex {
namespace python {

/** A callable, and the exception that it has raised. **/
class Callable {
public:
    explicit Callable(py::object callable) : m_callable(std::move(callable)) {}
    ~Callable();
    Callable(const Callable&) = delete;
    Callable& operator=(const Callable&) = delete;

    /** From any thread; NaN once it has failed. **/
    double calc(const double* arguments, int count);
    /** What it returns; nothing once it has failed. Holding the interpreter's lock. **/
    std::optional<py::object> call(const py::tuple& arguments);
    bool hasFailed() const { return m_failure != nullptr; }
    /** Once. @throws py::error_already_set, if it has failed. **/
    void raise();
    const py::object& get() const { return m_callable; }

private:
    py::object m_callable;
    std::unique_ptr<py::error_already_set> m_failure;
};

/** Makes it known to the model's formulas, by its own name unless there is one.
@returns the name. @throws py::type_error, py::value_error. **/
std::string addCallable(ModelText& model, const py::object& callable, std::string name = "");
/** "torque(angle, speed)": called with what its parameters are named after. **/
std::string addCall(ModelText& model, const py::object& callable);

/** Those of a model. **/
class Callables {
public:
    /** They become the model's own: what fails in one copy of it fails in no other. **/
    explicit Callables(ModelText& model);
    /** Who is told of progress, or None. **/
    void setProgress(const py::object& progress);
    /** False where who is told of progress says so, or fails. Holding the interpreter's lock. **/
    bool tell(const std::function<py::tuple()>& makeTold) const;

    bool isEmpty() const { return m_all.empty(); }
    bool haveFailed() const;
    /** What work() returns. @throws what a callable has raised meanwhile. **/
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

/** By name, for pickles. **/
py::dict listCallables(const ModelText& model);

}  // namespace python
}  // namespace simflex
