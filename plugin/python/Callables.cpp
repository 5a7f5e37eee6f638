#include "simflex/python/Callables.h"

#include <limits>

#include "simflex/model/file/Formula.h"

namespace simflex {
namespace python {

namespace {

constexpr double NoValue = std::numeric_limits<double>::quiet_NaN();
constexpr int Many = 1000;  // stands for any number of arguments

/** Implementation of a model function, shared by all copies of the model. **/
struct CallableReference {
    std::shared_ptr<Callable> callable;
    double operator()(const double* arguments, int count) const {
        return callable->calc(arguments, count);
    }
};

struct Signature {
    int fewest = 0, most = 0;
    std::vector<std::string> names;  ///< parameters without default
};
/** Returns nothing if Python does not know the signature. **/
std::optional<Signature> findSignature(const py::object& callable) {
    const py::module_ inspect = py::module_::import("inspect");
    Signature signature;
    py::object parameters;
    try {
        parameters = inspect.attr("signature")(callable).attr("parameters");
    } catch (const py::error_already_set& error) {
        if (error.matches(PyExc_ValueError) || error.matches(PyExc_TypeError)) return {};
        throw;
    }
    for (const auto& parameter : parameters.attr("values")()) {
        const std::string kind = py::str(parameter.attr("kind").attr("name"));
        if (kind == "VAR_POSITIONAL") signature.most = Many;
        if (kind != "POSITIONAL_ONLY" && kind != "POSITIONAL_OR_KEYWORD") continue;
        if (signature.most < Many) ++signature.most;
        if (!parameter.attr("default").is(parameter.attr("empty"))) continue;
        ++signature.fewest;
        signature.names.push_back(py::str(parameter.attr("name")));
    }
    return signature;
}

const CallableReference* findReference(const formula::OwnFunction& function) {
    return function.calc.target<CallableReference>();
}

std::string chooseName(const ModelText& model, const py::object& callable,
                       const std::string& prefix = "") {
    const auto isFree = [&](const std::string& name) {
        const auto known = model.functions.find(name);
        if (known == model.functions.end()) return true;
        const CallableReference* const reference = findReference(known->second);
        return reference && reference->callable->get().is(callable);
    };
    std::string name = py::str(py::getattr(callable, "__name__", py::str("")));
    const bool isWord = py::cast<bool>(py::str(name).attr("isidentifier")()) &&
                        py::cast<bool>(py::str(name).attr("isascii")());
    if (!isWord || (prefix.empty() && model::isFormulaWord(name))) name = "function";
    name = prefix + name;
    std::string own = name;
    for (int i = 2; !isFree(own); ++i) own = name + '_' + std::to_string(i);
    return own;
}

}  // namespace

Callable::~Callable() {
    if (!Py_IsInitialized()) {
        m_callable.release();
        static_cast<void>(m_failure.release());
        return;
    }
    const py::gil_scoped_acquire lock;
    m_failure.reset();
    m_callable = {};
}

double Callable::calc(const double* arguments, int count) {
    const InterpreterLock lock;
    py::tuple all(count);
    for (int i = 0; i < count; ++i) all[size_t(i)] = py::float_(arguments[i]);
    const std::optional<py::object> result = call(all);
    if (!result) return NoValue;
    const double value = PyFloat_AsDouble(result->ptr());
    if (!PyErr_Occurred()) return value;
    m_failure = std::make_unique<py::error_already_set>();
    return NoValue;
}

std::optional<py::object> Callable::call(const py::tuple& arguments) {
    if (m_failure) return {};
    try {
        return m_callable(*arguments);
    } catch (const py::error_already_set& error) {
        m_failure = std::make_unique<py::error_already_set>(error);
        return {};
    }
}

void Callable::raise() {
    if (!m_failure) return;
    const std::unique_ptr<py::error_already_set> failure = std::move(m_failure);
    throw py::error_already_set(*failure);
}

std::string addCallable(ModelText& model, const py::object& callable, std::string name) {
    if (!PyCallable_Check(callable.ptr()))
        throw py::type_error("expected a function, not " + std::string(py::repr(callable)));
    if (name.empty()) name = chooseName(model, callable);
    formula::OwnFunction function;
    function.most = Many;
    if (const auto signature = findSignature(callable)) {
        if (signature->most == 0)
            throw py::value_error("the function '" + name +
                                  "' has no parameters: what does it depend on? At least on t");
        function.fewest = std::max(1, signature->fewest);
        function.most = signature->most;
    }
    function.calc = CallableReference{std::make_shared<Callable>(callable)};
    model.functions[name] = function;
    return name;
}

std::string addCall(ModelText& model, const py::object& callable) {
    const auto signature = findSignature(callable);
    if (!signature || signature->names.empty())
        throw py::value_error(
            "a function as a value is called with what its parameters are named after: t, probes, "
            "states; " +
            std::string(py::repr(callable)) + " names none: add it by Model.function()");
    std::string arguments;
    for (const std::string& name : signature->names)
        arguments += (arguments.empty() ? "" : ", ") + name;
    // Probes and states may have the function's own name.
    return addCallable(model, callable, chooseName(model, callable, "call_")) + '(' + arguments +
           ')';
}

Callables::Callables(ModelText& model) {
    for (auto& entry : model.functions)
        if (const CallableReference* const reference = findReference(entry.second)) {
            m_all.push_back(std::make_shared<Callable>(reference->callable->get()));
            entry.second.calc = CallableReference{m_all.back()};
        }
}

void Callables::setProgress(const py::object& progress) {
    if (progress.is_none()) return;
    if (!PyCallable_Check(progress.ptr()))
        throw py::type_error("progress: expected a function, not " +
                             std::string(py::repr(progress)));
    m_progress = std::make_shared<Callable>(progress);
    m_all.push_back(m_progress);
}

bool Callables::tell(const std::function<py::tuple()>& makeTold) const {
    if (!m_progress) return true;
    const std::optional<py::object> answer = m_progress->call(makeTold());
    return answer && !answer->is(py::bool_(false));
}

bool Callables::haveFailed() const {
    for (const auto& callable : m_all)
        if (callable->hasFailed()) return true;
    return false;
}

void Callables::raise() const {
    if (!haveFailed()) return;
    const py::gil_scoped_acquire lock;
    for (const auto& callable : m_all) callable->raise();
}

py::dict listCallables(const ModelText& model) {
    py::dict all;
    for (const auto& [name, function] : model.functions)
        if (const CallableReference* const reference = findReference(function))
            all[py::str(name)] = reference->callable->get();
    return all;
}

}  // namespace python
}  // namespace simflex
