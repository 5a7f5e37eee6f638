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

/** A read-only view of a column-major array, which keeps the part alive. **/
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

template <size_t Count>
py::tuple viewEach(const Part& part, const std::array<std::vector<double>, Count>& matrices) {
    const py::ssize_t n = part.body->numModes;
    py::tuple views(Count);
    for (size_t i = 0; i < Count; ++i) views[i] = view(part, matrices[i], {n, n});
    return views;
}

py::object findStress(const Part& part) {
    if (!part.body->modalStress) return py::none();
    const ReducedBody::ModalStress& stress = *part.body->modalStress;
    const py::ssize_t count = py::ssize_t(stress.nodes.size()), n = part.body->numModes;
    py::dict all;
    all["nodes"] = view(part, stress.nodes, {count});
    all["stress"] = view(part, stress.stress, {6, count, n});
    all["strain"] = view(part, stress.strain, {6, count, n});
    return makeNamespace(all);
}

py::object findStiffening(const Part& part) {
    if (!part.body->stiffening) return py::none();
    py::dict interfaces, all;
    for (size_t i = 0; i < part.body->interfaces.size(); ++i)
        interfaces[py::str(part.body->interfaces[i].name)] =
            viewEach(part, part.body->stiffening->interfaces[i]);
    all["turning"] = viewEach(part, part.body->stiffening->turning);
    all["interfaces"] = interfaces;
    return makeNamespace(all);
}

py::dict listDerivatives(const Part& part) {
    const py::ssize_t n = part.body->numModes;
    py::dict all;
    for (const ReducedBody::Derivative& derivative : part.body->derivatives) {
        py::dict one;
        one["value"] = derivative.value;
        one["unit"] = derivative.unit;
        one["K"] = view(part, derivative.K, {n, n});
        one["M"] = view(part, derivative.M, {n, n});
        all[py::str(derivative.parameter)] = makeNamespace(one);
    }
    return all;
}

py::dict listElements(const Part& part) {
    const char* const names[] = {"tet4", "tet10", "hex8", "hex20", "wedge6", "wedge15"};
    py::dict all;
    for (const ElementBlock& block : part.body->mesh.elements) {
        const py::str name(names[size_t(block.type)]);
        py::list blocks = all.contains(name) ? py::list(all[name]) : py::list();
        blocks.append(view(part, block.nodes, {numNodesOf(block.type), block.numElements()}));
        all[name] = blocks;
    }
    return all;
}

py::dict listNodeSets(const Part& part) {
    py::dict all;
    for (const auto& [name, nodes] : part.body->mesh.nodeSets)
        all[py::str(name)] = view(part, nodes, {py::ssize_t(nodes.size())});
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
        .def_property_readonly("frequencies", &calcFrequencies, "Frequencies of the modes [Hz].")
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
        .def_property_readonly(
            "omega_squared",
            [](const Part& part) {
                return view(part, part.body->omegaSquared, {part.body->numModes});
            },
            "Stiffness of the modes, whose mass is 1 [1/s²].")
        .def_property_readonly(
            "I1",
            [](const Part& part) {
                return view(part, part.body->I1, {6, part.body->numModes});
            },
            "6×modes: first change of inertia, components xx yy zz xy xz yz.")
        .def_property_readonly(
            "I2", [](const Part& part) { return viewEach(part, part.body->I2); },
            "Second change of inertia: modes×modes for each of xx yy zz xy xz yz.")
        .def_property_readonly(
            "N", [](const Part& part) { return viewEach(part, part.body->N); },
            "Σm(φᵢ × φⱼ): modes×modes for each of x, y, z.")
        .def_property_readonly(
            "positions",
            [](const Part& part) {
                return view(part, part.body->mesh.positions, {3, part.body->mesh.numNodes()});
            },
            "3×nodes: of the mesh, from the centre of mass [m].")
        .def_property_readonly(
            "node_numbers",
            [](const Part& part) {
                return view(part, part.body->mesh.nodeNumbers, {part.body->mesh.numNodes()});
            },
            "Of the deck.")
        .def_property_readonly("node_sets", &listNodeSets, "By name: indices of nodes, from 0.")
        .def_property_readonly(
            "elements", &listElements,
            "By type (tet4, hex20 …), in blocks: nodes of an element × elements, from 0.")
        .def_property_readonly(
            "stress", &findStress,
            "None, or where the part knows it: nodes, stress [Pa] and strain of ξ = 1, both\n"
            "6×nodes×modes, components xx yy zz xy xz yz.")
        .def_property_readonly(
            "stiffening", &findStiffening,
            "None, or geometric stiffness, modes×modes: `turning` by ω² of xx yy zz xy xz yz,\n"
            "`interfaces` by name for unit forces x, y, z and moments x, y, z.")
        .def_property_readonly("derivatives", &listDerivatives,
                               "By parameter (thickness:SKIN), of the modes as they are: its "
                               "value, unit, and K and M,\n"
                               "modes×modes; dΩ²/dp = diag(K) − Ω² diag(M).")
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
