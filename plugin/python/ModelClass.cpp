#include <pybind11/stl/filesystem.h>

#include "simflex/model/Model.h"
#include "simflex/model/Results.h"
#include "simflex/python/Values.h"

namespace simflex {
namespace python {

namespace {

using Path = std::filesystem::path;

void setKey(ModelText& model, const std::string& key, const py::handle& value) {
    model.set(key, toYaml(value));
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
    return makeFromText(toYaml(all), folder);
}

Results run(const ModelText& model, const std::optional<Path>& output,
            const std::vector<std::string>& only, int threads, bool resumes, bool draws) {
    RunOptions options;
    if (output) options.output = output->string();
    options.only = only;
    options.threads = threads;
    options.resumes = resumes;
    options.drawsPictures = draws;
    options.listener = makeListener();
    const py::gil_scoped_release unlocked;
    return runAnalyses(model, options);
}

}  // namespace

void addModel(py::module_& module) {
    py::class_<ModelText>(module, "Model",
                          "What a model file says; see the guide's reference of keys.\n\n"
                          "Values are numbers, texts, lists, dicts and arrays. Nothing is read or\n"
                          "built before a Session or run() asks for it.")
        .def(py::init(&load), py::arg("path"), py::arg("settings") = py::dict(),
             "Model('ruler.yaml', {'solver.accuracy': 1e-7}, load=0.1): a file, with other values\n"
             "of keys, and of parameters by their names.")
        .def_static("from_dict", &makeFromDict, py::arg("keys"), py::arg("folder") = ".",
                    "Of the keys of a model file. Relative paths begin in `folder`.")
        .def_static("from_text", &makeFromText, py::arg("text"), py::arg("folder") = ".",
                    "Of the text of a model file.")
        .def("set", &setKey, py::arg("key"), py::arg("value"),
             "Gives what stands at a key ('joints.bearing.axis') another value.")
        .def_readonly("path", &ModelText::path)
        .def_readonly("text", &ModelText::text)
        .def_readonly("settings", &ModelText::settings)
        .def("run", &run, py::arg("output") = py::none(),
             py::arg("analyses") = std::vector<std::string>(), py::arg("threads") = 0,
             py::arg("resume") = false, py::arg("pictures") = false,
             "Does the analyses (all, or those named) as `simflex run` does, and writes the file\n"
             "of results: beside the model unless `output` says where. Ctrl-C keeps what is done.")
        .def("__copy__", [](const ModelText& model) { return model; })
        .def("__repr__",
             [](const ModelText& model) { return "<simflex.Model " + model.path + ">"; });
}

}  // namespace python
}  // namespace simflex
