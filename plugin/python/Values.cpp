#include "simflex/python/Values.h"

#include <atomic>
#include <memory>
#include <thread>

#include "simflex/python/Callables.h"

namespace simflex {
namespace python {

namespace {

std::atomic<bool> isEnding{false};
std::atomic<int> numInside{0};
std::thread::id endingThread;

}  // namespace

InterpreterLock::InterpreterLock() {
    ++numInside;
    if (isEnding && std::this_thread::get_id() != endingThread) {
        --numInside;
        for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
    m_lock.emplace();
}

InterpreterLock::~InterpreterLock() {
    m_lock.reset();
    --numInside;
}

void InterpreterLock::end() {
    const int patience = 500;  // for Python functions still running [10 ms]
    endingThread = std::this_thread::get_id();
    isEnding = true;
    const py::gil_scoped_release unlocked;
    for (int i = 0; i < patience && numInside > 0; ++i)
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

std::string toYaml(const py::handle& value, ModelText* model, const std::string& key) {
    // JSON is valid YAML.
    const py::cpp_function makePlain([&](const py::object& other) -> py::object {
        if (py::hasattr(other, "tolist")) return other.attr("tolist")();
        if (model && PyCallable_Check(other.ptr())) return py::str(addCall(*model, other));
        throw py::type_error((key.empty() ? "" : "'" + key + "': ") + "a model file has no " +
                             std::string(py::str(py::type::of(other).attr("__name__"))));
    });
    try {
        return py::str(py::module_::import("json").attr("dumps")(
            value, py::arg("default") = makePlain, py::arg("ensure_ascii") = false,
            py::arg("allow_nan") = false, py::arg("indent") = py::none()));
    } catch (py::error_already_set& error) {
        if (!error.matches(PyExc_ValueError) || key.empty()) throw;
        py::raise_from(error, PyExc_ValueError,
                       ("'" + key + "': " + std::string(py::str(error.value()))).c_str());
        throw py::error_already_set();
    }
}

py::array_t<double> toArray(const std::vector<double>& values) {
    return py::array_t<double>(py::ssize_t(values.size()), values.data());
}

py::array_t<double> toArray(const std::vector<std::vector<double>>& rows, size_t firstColumn,
                            size_t numColumns) {
    std::vector<py::ssize_t> shape{py::ssize_t(rows.size())};
    if (numColumns != 1) shape.push_back(py::ssize_t(numColumns));
    py::array_t<double> array(shape);
    double* next = array.mutable_data();
    for (const std::vector<double>& row : rows)
        for (size_t k = 0; k < numColumns; ++k) *next++ = row.at(firstColumn + k);
    return array;
}

py::object toNumberOrArray(const std::vector<double>& values) {
    if (values.size() == 1) return py::float_(values[0]);
    return toArray(values);
}

std::vector<double> toNumbers(const py::handle& value) {
    const auto array =
        py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
    if (!array || array.ndim() > 1) {
        PyErr_Clear();
        throw py::type_error("expected a number or a sequence of numbers, not " +
                             std::string(py::repr(value)));
    }
    return std::vector<double>(array.data(), array.data() + array.size());
}

py::object makeDataFrame(const py::dict& columns, const std::vector<double>& time) {
    const py::object pandas = py::module_::import("pandas");
    if (time.empty()) return pandas.attr("DataFrame")(columns);
    return pandas.attr("DataFrame")(
        columns, py::arg("index") = pandas.attr("Index")(toArray(time), py::arg("name") = "time"));
}

std::string nameColumn(const std::string& probe, const std::string& column) {
    return column.empty() ? probe : probe + '.' + column;
}

py::object makeNamespace(const py::dict& attributes) {
    return py::module_::import("types").attr("SimpleNamespace")(**attributes);
}

AllowedCode allowFmus(bool areAllowed, bool inProcess, double timeout) {
    AllowedCode code;
    if (areAllowed) code.fmus = AllowedCode::Fmus::ChildProcess;
    if (inProcess) code.fmus = AllowedCode::Fmus::ThisProcess;
    if (!(timeout > 0)) throw std::invalid_argument("fmu_timeout must be positive");
    code.fmuTimeout = timeout;
    return code;
}

bool Interrupts::isOver() const {
    return m_callables && m_callables->haveFailed();
}

bool Interrupts::isTimeToLook() {
    const auto now = std::chrono::steady_clock::now();
    if (now - m_lastLook < std::chrono::milliseconds(50)) return false;
    m_lastLook = now;
    return true;
}

bool Interrupts::look(const std::function<py::tuple()>& makeTold) const {
    const InterpreterLock lock;
    return PyErr_CheckSignals() == 0 && (!m_callables || m_callables->tell(makeTold));
}

Listener makeListener(const Callables* callables) {
    Listener listener;
    listener.warn = [](const std::string& text) {
        const InterpreterLock lock;
        const py::object category = py::module_::import("simflex").attr("SimflexWarning");
        if (PyErr_WarnEx(category.ptr(), text.c_str(), 2) != 0) throw py::error_already_set();
    };
    listener.progress = [interrupts = std::make_shared<Interrupts>(callables)](
                            const std::string& what, double fraction, const Listener::Detail&) {
        return interrupts->goesOn(what, fraction);
    };
    return listener;
}

}  // namespace python
}  // namespace simflex
