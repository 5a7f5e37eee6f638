#include <pybind11/stl/filesystem.h>

#include "simflex/base/TemporaryFolder.h"
#include "simflex/model/Model.h"
#include "simflex/model/Results.h"
#include "simflex/python/Callables.h"

namespace simflex {
namespace python {

namespace {

using Path = std::filesystem::path;

void setKey(ModelText& model, const std::string& key, const py::handle& value) {
    model.set(key, toYaml(value, &model, key));
}

ModelText load(const Path& path, const py::dict& settings, const py::kwargs& parameters) {
    ModelText model = loadModelText(path.string());
    for (const auto& [key, value] : settings) setKey(model, py::cast<std::string>(key), value);
    for (const auto& [name, value] : parameters)
        setKey(model, "parameters." + py::cast<std::string>(name), value);
    return model;
}

ModelText makeFromText(const std::string& text, const Path& folder) {
    ModelText model;
    model.path = (folder / "model.yaml").string();
    model.text = text;
    return model;
}

ModelText makeFromDict(const py::dict& keys, const Path& folder) {
    py::dict all;
    all["simflex"] = 1;
    for (const auto& [key, value] : keys) all[key] = value;
    ModelText model = makeFromText("", folder);
    model.text = toYaml(all, &model);
    return model;
}

Results run(ModelText model, const std::optional<Path>& output,
            const std::vector<std::string>& only, int threads, bool resumes, bool draws,
            const py::object& progress, bool hasErrorBars, const AllowedCode& code) {
    RunOptions options;
    options.code = code;
    if (output) options.output = output->string();
    options.only = only;
    options.threads = threads;
    options.resumes = resumes;
    options.drawsPictures = draws;
    options.hasErrorBars = hasErrorBars;
    Callables callables(model);
    callables.setProgress(progress);
    options.listener = makeListener(&callables);
    return callables.watch([&] {
        const py::gil_scoped_release unlocked;
        return runAnalyses(model, options);
    });
}

}  // namespace

Results::Analysis analyse(ModelText model, const std::string& type, const AllowedCode& code,
                          const py::kwargs& keys) {
    py::dict entry;
    entry["type"] = type;
    for (const auto& [key, value] : keys) entry[key] = value;
    setKey(model, "analyses." + type, entry);
    const TemporaryFolder folder;
    const Results results =
        run(model, folder.path() / "results.h5", {type}, 0, false, false, py::none(), false, code);
    return results.findAnalysis(type);
}

void addModel(py::module_& module) {
    py::class_<ModelText> modelClass(
        module, "Model",
        "What a model file says; see the guide's reference of keys.\n\n"
        "Values are numbers, texts, lists, dicts, arrays and functions. Its attributes\n"
        "are the file's keys: model.gravity = [0, -9.81, 0]. Nothing is read or built\n"
        "before a Session or run() asks for it.");
    modelClass.def(py::init([] { return makeFromText(ModelText().text, "."); }), "An empty model.")
        .def(py::init(&load), py::arg("path"), py::arg("settings") = py::dict(),
             "Model('ruler.yaml', {'solver.accuracy': 1e-7}, load=0.1): a file, with other values\n"
             "of keys, and of parameters by their names.")
        .def_static("from_dict", &makeFromDict, py::arg("keys"), py::arg("folder") = ".",
                    "From the keys of a model file. Relative paths begin in `folder`.")
        .def_static("from_text", &makeFromText, py::arg("text"), py::arg("folder") = ".",
                    "From the text of a model file.")
        .def(
            "function",
            [](ModelText& model, const py::object& function, const std::string& name) {
                addCallable(model, function, name);
                return function;
            },
            py::arg("function"), py::arg("name") = "",
            "Makes a function of numbers known to the model's formulas: '@model.function' before\n"
            "'def torque(angle, speed)', then model.set('loads.motor.torque', [0, 0, "
            "'torque(angle,\n"
            "speed)']). As the value of a key it is called with what its parameters are named\n"
            "after. Each evaluation waits for Python (about 1 µs), and a Newton matrix takes two\n"
            "for each argument; with `sample_and_hold` one for each sample. Equal arguments are "
            "to\n"
            "give equal values.")
        .def("set", &setKey, py::arg("key"), py::arg("value"),
             "Sets the value of a key ('joints.bearing.axis').")
        .def_readonly("path", &ModelText::path)
        .def_readonly("text", &ModelText::text)
        .def_readonly("settings", &ModelText::settings)
        .def(
            "run",
            [](const ModelText& model, const std::optional<Path>& output,
               const std::vector<std::string>& only, int threads, bool resumes, bool draws,
               const py::object& progress, bool hasErrorBars, bool allowsFmus, bool inProcess,
               double timeout) {
                return run(model, output, only, threads, resumes, draws, progress, hasErrorBars,
                           allowFmus(allowsFmus, inProcess, timeout));
            },
            py::arg("output") = py::none(), py::arg("analyses") = std::vector<std::string>(),
            py::arg("threads") = 0, py::arg("resume") = false, py::arg("pictures") = false,
            py::arg("progress") = py::none(), py::arg("error_bar") = false,
            py::arg("allow_fmus") = false, py::arg("fmus_in_process") = false,
            py::arg("fmu_timeout") = 60.,
            "Runs the analyses (all, or those named) as `simflex run` does, and writes the file\n"
            "of results: beside the model unless `output` says where. Ctrl-C keeps what is done, "
            "and so\n"
            "does progress(what, fraction), told now and then, by returning False: Cancelled.\n"
            "With `error_bar` each probe has its error, 'tip error', by what parts have left out.\n"
            "FMUs of controllers are programs: they run if `allow_fmus` says so, each in a "
            "process\n"
            "of its own, which may take `fmu_timeout` seconds for an answer; with\n"
            "`fmus_in_process` in this one.")
        .def(
            "analyse",
            [](const ModelText& model, const std::string& type, bool allowsFmus,
               const py::kwargs& keys) {
                return analyse(model, type, allowFmus(allowsFmus, false, 60), keys);
            },
            py::arg("type"), py::arg("allow_fmus") = false,
            "Runs one analysis that the file need not have, with the keys of `analyses`, and\n"
            "returns its Analysis: analyse('campbell', parameter='speed', speeds=[0, 50, 100]).")
        .def("__copy__", [](const ModelText& model) { return model; })
        .def("__deepcopy__", [](const ModelText& model, const py::dict&) { return model; })
        .def(py::pickle(
            [](const ModelText& model) {
                return py::make_tuple(model.path, model.text, model.settings, listCallables(model));
            },
            [](const py::tuple& state) {
                ModelText model;
                model.path = py::cast<std::string>(state[0]);
                model.text = py::cast<std::string>(state[1]);
                model.settings = py::cast<std::vector<std::string>>(state[2]);
                for (const auto& [name, function] : py::cast<py::dict>(state[3]))
                    addCallable(model, py::reinterpret_borrow<py::object>(function),
                                py::cast<std::string>(name));
                return model;
            }))
        .def("__repr__",
             [](const ModelText& model) { return "<simflex.Model " + model.path + ">"; });
    addKeys(module, modelClass);
}

}  // namespace python
}  // namespace simflex
