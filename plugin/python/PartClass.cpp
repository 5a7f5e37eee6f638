#include <pybind11/stl/filesystem.h>

#include <cmath>

#include "simflex/model/parts/PartSource.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/python/Values.h"

namespace simflex {
namespace python {

namespace {

using Shape = std::vector<py::ssize_t>;
using PartPointer = std::shared_ptr<const ReducedBody>;
using Path = std::filesystem::path;

/** A part, shared by the views of its arrays. **/
struct Part {
    PartPointer body;
};

/** A view of a column-major array that cannot be written to and keeps the part alive. **/
template <class Number>
py::array view(const Part& part, const std::vector<Number>& values, const Shape& shape) {
    Shape strides;
    py::ssize_t stride = sizeof(Number);
    for (const py::ssize_t size : shape) {
        strides.push_back(stride);
        stride *= size;
    }
    const py::capsule owner(new PartPointer(part.body),
                            [](void* pointer) { delete static_cast<PartPointer*>(pointer); });
    py::array array(py::dtype::of<Number>(), shape, strides, values.data(), owner);
    array.attr("setflags")(py::arg("write") = false);
    return array;
}

py::array_t<double> makeTensor(const std::array<double, 6>& c) {
    return toArray({{c[0], c[3], c[4]}, {c[3], c[1], c[5]}, {c[4], c[5], c[2]}}, 0, 3);
}

py::array_t<double> calcFrequencies(const Part& part) {
    std::vector<double> frequencies;
    for (const double square : part.body->omegaSquared)
        frequencies.push_back(std::sqrt(square) / (2 * M_PI));
    return toArray(frequencies);
}

py::dict listInterfaces(const Part& part) {
    const py::ssize_t n = part.body->numModes;
    py::dict all;
    for (const ReducedBody::Interface& interface : part.body->interfaces) {
        py::dict one;
        one["position"] = py::array_t<double>(3, interface.position.data());
        one["translation"] = view(part, interface.Phi, {3, n});
        one["rotation"] = view(part, interface.Psi, {3, n});
        one["nodes"] = view(part, interface.nodes, {py::ssize_t(interface.nodes.size())});
        all[py::str(interface.name)] = makeNamespace(one);
    }
    return all;
}

Part reduce(const std::string& name, const Path& folder, const py::kwargs& keys) {
    ModelText text;
    text.path = (folder / "parts.yaml").string();
    text.set("parts." + name, toYaml(keys));
    ModelOptions options;
    options.listener = makeListener();
    const py::gil_scoped_release unlocked;
    const model::ModelValue entry = readModel(text).get("parts").get(name);
    if (entry.has("file")) entry.get("file").fail("this is a part already: Part(path) reads it");
    return {std::make_shared<const ReducedBody>(model::reducePart(entry, options))};
}

}  // namespace

void addPart(py::module_& module) {
    py::class_<Part>(
        module, "Part",
        "A reduced part: modes in the mean-axis frame, origin at the centre of mass.\n\n"
        "Arrays are views that keep the part's memory; they cannot be written to.")
        .def(py::init([](const std::filesystem::path& path) {
                 const py::gil_scoped_release unlocked;
                 return Part{std::make_shared<const ReducedBody>(readReducedBody(path.string()))};
             }),
             py::arg("path"), "Reads a file that `simflex reduce` has written.")
        .def(
            "write",
            [](const Part& part, const Path& path) {
                const py::gil_scoped_release unlocked;
                writeReducedBody(path.string(), *part.body);
            },
            py::arg("path"), "Writes a file that models take as a part.")
        .def_property_readonly("name", [](const Part& part) { return part.body->name; })
        .def_property_readonly(
            "mass", [](const Part& part) { return part.body->mass; }, "[kg]")
        .def_property_readonly(
            "center_of_mass",
            [](const Part& part) { return py::array_t<double>(3, part.body->centerOfMass.data()); },
            "In coordinates of the deck [m].")
        .def_property_readonly(
            "inertia", [](const Part& part) { return makeTensor(part.body->inertia); },
            "3×3, about the centre of mass [kg m²].")
        .def_property_readonly("num_modes", [](const Part& part) { return part.body->numModes; })
        .def_property_readonly("frequencies", &calcFrequencies, "Of the modes [Hz].")
        .def_property_readonly(
            "shapes",
            [](const Part& part) {
                const py::ssize_t n = part.body->numModes;
                return view(
                    part, part.body->Phi,
                    {3, py::ssize_t(part.body->Phi.size()) / (3 * std::max<py::ssize_t>(n, 1)), n});
            },
            "3×nodes×modes: translations of the mesh's nodes for ξ = 1.")
        .def_property_readonly("interfaces", &listInterfaces,
                               "By name: position [m], translation and rotation (3×modes), nodes.")
        .def("__repr__", [](const Part& part) {
            return "<simflex.Part '" + part.body->name + "', " +
                   std::to_string(part.body->numModes) + " modes>";
        });

    module.def("reduce", &reduce, py::arg("name"), py::arg("folder") = ".",
               "Reduces a finite element model; keys are those of `parts` in a model file:\n"
               "reduce('rod', deck='rod.inp', interfaces={'end': 'END'}, modes=30). What has been\n"
               "reduced before is taken from the cache. Relative paths begin in `folder`.");
}

}  // namespace python
}  // namespace simflex
