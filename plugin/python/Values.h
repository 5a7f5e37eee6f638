#pragma once
/** @file
Values on their way between Python and the library. **/

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

/** YAML of numbers, texts, lists, dicts and arrays of NumPy.
@param model  callables become functions of its formulas; null: they are refused
@param key  where it is to stand, for errors
@throws py::error_already_set for what has none. **/
std::string toYaml(const py::handle& value, ModelText* model = nullptr,
                   const std::string& key = "");

/** A copy. **/
py::array_t<double> toArray(const std::vector<double>& values);
/** n×k, or n values of a single column. **/
py::array_t<double> toArray(const std::vector<std::vector<double>>& rows, size_t firstColumn,
                            size_t numColumns);
/** A number, or an array of several. **/
py::object toNumberOrArray(const std::vector<double>& values);
/** Of a number, or of a sequence of numbers. @throws py::type_error. **/
std::vector<double> toNumbers(const py::handle& value);

/** Holds the interpreter's lock in a thread that works without it. Once the program ends, threads
of its that are not waited for stop here: there is no interpreter for them. **/
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

/** Of pandas, by time if there is any. **/
py::object makeDataFrame(const py::dict& columns, const std::vector<double>& time);
/** The name of a column: "tip.x". **/
std::string nameColumn(const std::string& probe, const std::string& column);

/** Some attributes under a name, as types.SimpleNamespace has them. **/
py::object makeNamespace(const py::dict& attributes);

/** Looks every now and then whether somebody has pressed Ctrl-C; called without the interpreter's
lock. **/
class Interrupts {
public:
    /** @param callables  outlive it **/
    explicit Interrupts(const Callables* callables = nullptr) : m_callables(callables) {}
    /** False once a Python exception is waiting, or where somebody who is told says so.
    @param told  arguments of who is told of progress **/
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
/** Warnings become Python's, of this category; Ctrl-C stops, and so does a callable that fails. **/
Listener makeListener(const Callables* callables = nullptr);

/** One analysis of a model, whether its file has it or not. @throws as runAnalyses(). **/
Results::Analysis analyse(ModelText model, const std::string& type, const AllowedCode& code,
                          const py::kwargs& keys);

/** What FMUs may do, as arguments say it. **/
AllowedCode allowFmus(bool areAllowed, bool inProcess, double timeout);

/** Adds the classes of a module. **/
/** Those that models have for keys are the Model's attributes. **/
void addKeys(py::module_& module, py::class_<ModelText>& model);
void addModel(py::module_& module);
void addPart(py::module_& module);
void addResults(py::module_& module);
void addSession(py::module_& module);

}  // namespace python
}  // namespace simflex
