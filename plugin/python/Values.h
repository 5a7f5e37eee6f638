#pragma once
/** @file
Conversion of values between Python and the library. **/

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simflex/model/Listener.h"
#include "simflex/model/Results.h"

namespace simflex {
struct ModelText;
namespace python {

namespace py = pybind11;

/** Converts numbers, strings, lists, dicts and NumPy arrays to YAML.
@param model  receives callables as functions of its formulas; null: callables are refused
@param key  the value's key, for errors
@throws py::error_already_set for unsupported types. **/
std::string toYaml(const py::handle& value, ModelText* model = nullptr,
                   const std::string& key = "");

/** Returns a copy. **/
py::array_t<double> toArray(const std::vector<double>& values);
/** Returns n×k, or n values for a single column. **/
py::array_t<double> toArray(const std::vector<std::vector<double>>& rows, size_t firstColumn,
                            size_t numColumns);
/** Returns a number, or an array of several. **/
py::object toNumberOrArray(const std::vector<double>& values);
/** Converts a number or a sequence of numbers. @throws py::type_error. **/
std::vector<double> toNumbers(const py::handle& value);

/** Acquires the interpreter's lock in a thread that runs without it. When the program ends,
background threads block here, because there is no interpreter for them. **/
class InterpreterLock {
public:
    InterpreterLock();
    ~InterpreterLock();
    InterpreterLock(const InterpreterLock&) = delete;
    InterpreterLock& operator=(const InterpreterLock&) = delete;
    /** Called by atexit. **/
    static void end();

private:
    std::optional<py::gil_scoped_acquire> m_lock;
};

class Callables;

/** Returns a pandas data frame, indexed by time if there is any. **/
py::object makeDataFrame(const py::dict& columns, const std::vector<double>& time);
/** Returns the name of a column: "tip.x". **/
std::string nameColumn(const std::string& probe, const std::string& column);

/** Returns a types.SimpleNamespace with these attributes. **/
py::object makeNamespace(const py::dict& attributes);

/** Checks for Ctrl-C from time to time; called without the interpreter's lock. **/
class Interrupts {
public:
    /** @param callables  must outlive this object **/
    explicit Interrupts(const Callables* callables = nullptr) : m_callables(callables) {}
    /** Returns false once a Python exception is pending, or if the progress callable returns false.
    @param told  arguments of the progress callable **/
    template <class... Told>
    bool goesOn(const Told&... told) {
        return !isOver() && (!isTimeToLook() || look([&] { return py::make_tuple(told...); }));
    }

private:
    const Callables* m_callables;
    bool isOver() const;
    bool isTimeToLook();
    bool look(const std::function<py::tuple()>& makeTold) const;
    std::chrono::steady_clock::time_point m_lastLook = std::chrono::steady_clock::now();
};
/** Converts warnings to Python warnings; Ctrl-C and failing callables cancel the work. **/
Listener makeListener(const Callables* callables = nullptr);

/** Runs a single analysis of a model, whether or not its file contains it. @throws as
runAnalyses(). **/
Results::Analysis analyse(ModelText model, const std::string& type, const AllowedCode& code,
                          const py::kwargs& keys);

/** Converts Python arguments to the permissions of FMUs. **/
AllowedCode allowFmus(bool areAllowed, bool inProcess, double timeout);

/** Add the classes of a module. **/
/** Adds the model's keys as attributes of Model. **/
void addKeys(py::module_& module, py::class_<ModelText>& model);
void addModel(py::module_& module);
void addPart(py::module_& module);
void addResults(py::module_& module);
void addSession(py::module_& module);

}  // namespace python
}  // namespace simflex
