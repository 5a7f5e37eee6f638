#include "simflex/part/ReducedBodyFile.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "FileChecksum.h"
#include "Hdf5.h"
#include "PartWarnings.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/UnfinishedFile.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
constexpr const char* Format = "simflex reduced body";
constexpr std::pair<ElementType, const char*> ElementNames[] = {
    {ElementType::Tet4, "Tet4"},     {ElementType::Tet10, "Tet10"},
    {ElementType::Hex8, "Hex8"},     {ElementType::Hex20, "Hex20"},
    {ElementType::Wedge6, "Wedge6"}, {ElementType::Wedge15, "Wedge15"}};

const char* nameOf(ElementType type) {
    for (const auto& [candidate, name] : ElementNames)
        if (candidate == type) return name;
    throw std::invalid_argument("unknown element type");
}

ElementType elementTypeOf(const std::string& text) {
    for (const auto& [type, name] : ElementNames)
        if (text == name) return type;
    throw std::runtime_error("unknown element type '" + text + "'");
}

void writeMesh(hid_t file, const Mesh& mesh) {
    const auto group = hdf5::createGroup(file, "mesh");
    const hsize_t numNodes = hsize_t(mesh.numNodes());
    hdf5::write(group, "node_numbers", {numNodes}, mesh.nodeNumbers.data());
    hdf5::write(group, "positions", {numNodes, 3}, mesh.positions.data());
    const auto elements = hdf5::createGroup(group, "elements");
    int index = 0;
    for (const ElementBlock& block : mesh.elements) {
        const auto one = hdf5::createGroup(elements, std::to_string(index++));
        hdf5::writeText(one, "type", nameOf(block.type));
        hdf5::write(one, "nodes", {hsize_t(block.numElements()), hsize_t(numNodesOf(block.type))},
                    block.nodes.data());
        if (block.isShell) hdf5::writeTexts(one, "upper_side", {"last corners"});
    }
    const auto sets = hdf5::createGroup(group, "node_sets");
    index = 0;
    for (const auto& [name, nodes] : mesh.nodeSets) {
        const auto one = hdf5::createGroup(sets, std::to_string(index++));
        hdf5::writeText(one, "name", name);
        hdf5::write(one, "nodes", {nodes.size()}, nodes.data());
    }
    if (mesh.expandedNodes.empty()) return;
    std::vector<int> numbers, counts, nodes;
    for (const auto& [number, expanded] : mesh.expandedNodes) {
        numbers.push_back(number);
        counts.push_back(int(expanded.size()));
        nodes.insert(nodes.end(), expanded.begin(), expanded.end());
    }
    const auto ofThin = hdf5::createGroup(group, "expanded_nodes");
    hdf5::write(ofThin, "numbers", {numbers.size()}, numbers.data());
    hdf5::write(ofThin, "counts", {counts.size()}, counts.data());
    hdf5::write(ofThin, "nodes", {nodes.size()}, nodes.data());
}

/** Writes square matrices one after another. **/
template <size_t count>
void writeSquares(hid_t parent, const std::string& name,
                  const std::array<std::vector<double>, count>& matrices, hsize_t n) {
    std::vector<double> joined;
    for (const auto& matrix : matrices) joined.insert(joined.end(), matrix.begin(), matrix.end());
    hdf5::write(parent, name, {count, n, n}, joined.data());
}

template <size_t count>
void readSquares(hid_t parent, const std::string& name, hsize_t n,
                 std::array<std::vector<double>, count>& matrices) {
    const auto joined = hdf5::readNumbers(parent, name, {count, n, n});
    for (size_t c = 0; c < count; ++c)
        matrices[c].assign(joined.begin() + c * n * n, joined.begin() + (c + 1) * n * n);
}

/** Returns the oldest version that can represent the part. **/
int findVersion(const ReducedBody& body) {
    if (!body.derivatives.empty()) return 5;
    if (body.finer || body.further || (body.report && !body.report->staticErrors.empty())) return 4;
    for (const auto& interface : body.interfaces)
        if (interface.tie != TieType::Rigid) return 3;
    if (body.modalStress || body.report) return 3;
    return body.stiffening ? 2 : 1;
}

void writeReport(hid_t file, const ReductionReport& report) {
    const auto group = hdf5::createGroup(file, "report");
    hdf5::writeInteger(group, "num_constraint_modes", report.numConstraintModes);
    hdf5::writeInteger(group, "num_attachment_modes", report.numAttachmentModes);
    hdf5::write(group, "normal_frequencies", {report.normalFrequencies.size()},
                report.normalFrequencies.data());
    hdf5::write(group, "effective_masses", {report.effectiveMasses.size() / 6, 6},
                report.effectiveMasses.data());
    hdf5::write(group, "rigid_masses", {6}, report.rigidMasses.data());
    const double residuals[5] = {report.massOrthogonality, report.stiffnessOrthogonality,
                                 report.rigidResidual, report.rigidEnergy, report.conditionNumber};
    hdf5::write(group, "residuals", {5}, residuals);
    hdf5::write(group, "full_frequencies", {report.fullFrequencies.size()},
                report.fullFrequencies.data());
    if (report.staticErrors.empty()) return;
    std::vector<std::string> loads;
    std::vector<double> errors;
    for (const StaticError& error : report.staticErrors) {
        loads.push_back(error.load);
        errors.push_back(error.error);
    }
    hdf5::writeTexts(group, "static_loads", loads);
    hdf5::write(group, "static_errors", {errors.size()}, errors.data());
}

void writeModalStress(hid_t file, const ReducedBody::ModalStress& modal, hsize_t numModes) {
    const auto group = hdf5::createGroup(file, "modal_stress");
    const hsize_t numRows = 6 * modal.nodes.size();
    hdf5::write(group, "nodes", {modal.nodes.size()}, modal.nodes.data());
    hdf5::write(group, "stress", {numModes, numRows}, modal.stress.data());
    hdf5::write(group, "strain", {numModes, numRows}, modal.strain.data());
}

void writeDerivatives(hid_t file, const std::vector<ReducedBody::Derivative>& derivatives,
                      hsize_t n) {
    const auto group = hdf5::createGroup(file, "derivatives");
    int index = 0;
    for (const ReducedBody::Derivative& derivative : derivatives) {
        const auto one = hdf5::createGroup(group, std::to_string(index++));
        hdf5::writeText(one, "parameter", derivative.parameter);
        hdf5::writeText(one, "unit", derivative.unit);
        hdf5::write(one, "value", {1}, &derivative.value);
        hdf5::write(one, "K", {n, n}, derivative.K.data());
        hdf5::write(one, "M", {n, n}, derivative.M.data());
    }
}

void writeBody(hid_t file, const ReducedBody& body) {
    hdf5::writeText(file, "format", Format);
    hdf5::writeInteger(file, "version", findVersion(body));
    hdf5::writeText(file, "name", body.name);
    hdf5::writeText(file, "units", body.provenance.units);
    hdf5::writeText(file, "source", body.provenance.source);
    hdf5::writeText(file, "program", body.provenance.program);
    hdf5::writeText(file, "created", body.provenance.created);

    const hsize_t n = hsize_t(body.numModes);
    hdf5::write(file, "mass", {1}, &body.mass);
    hdf5::write(file, "center_of_mass", {3}, body.centerOfMass.data());
    hdf5::write(file, "inertia", {6}, body.inertia.data());
    hdf5::write(file, "omega_squared", {n}, body.omegaSquared.data());
    hdf5::write(file, "I1", {n, 6}, body.I1.data());
    writeSquares(file, "I2", body.I2, n);
    writeSquares(file, "N", body.N, n);
    hdf5::write(file, "Phi", {n, 3 * hsize_t(body.mesh.numNodes())}, body.Phi.data());

    const auto interfaces = hdf5::createGroup(file, "interfaces");
    int index = 0;
    for (const auto& interface : body.interfaces) {
        const auto one = hdf5::createGroup(interfaces, std::to_string(index++));
        hdf5::writeText(one, "name", interface.name);
        hdf5::write(one, "position", {3}, interface.position.data());
        hdf5::write(one, "Phi", {n, 3}, interface.Phi.data());
        hdf5::write(one, "Psi", {n, 3}, interface.Psi.data());
        hdf5::write(one, "nodes", {interface.nodes.size()}, interface.nodes.data());
        if (interface.tie == TieType::Distributing)
            hdf5::write(one, "weights", {interface.weights.size()}, interface.weights.data());
    }
    if (body.modalStress) writeModalStress(file, *body.modalStress, n);
    if (body.report) writeReport(file, *body.report);
    if (body.stiffening) {
        const auto stiffening = hdf5::createGroup(file, "stiffening");
        writeSquares(stiffening, "turning", body.stiffening->turning, n);
        const auto perInterface = hdf5::createGroup(stiffening, "interfaces");
        index = 0;
        for (const auto& matrices : body.stiffening->interfaces)
            writeSquares(perInterface, std::to_string(index++), matrices, n);
    }
    if (!body.derivatives.empty()) writeDerivatives(file, body.derivatives, n);
    if (body.further) {
        const auto further = hdf5::createGroup(file, "further");
        const hsize_t m = body.further->displacements.size();
        hdf5::write(further, "coordinates", {n, m}, body.further->coordinates.data());
        hdf5::write(further, "displacements", {m}, body.further->displacements.data());
    }
    writeMesh(file, body.mesh);
    if (body.finer) writeBody(hdf5::createGroup(file, "finer"), *body.finer);
}

template <size_t size>
std::array<double, size> readArray(hid_t parent, const std::string& name) {
    const auto values = hdf5::readNumbers(parent, name, {size});
    std::array<double, size> result{};
    std::copy(values.begin(), values.end(), result.begin());
    return result;
}

void checkNodes(const std::vector<int>& nodes, int numNodes, const std::string& what) {
    for (const int node : nodes)
        if (node < 0 || node >= numNodes)
            throw std::runtime_error(what + " names mesh index " + std::to_string(node) + " of " +
                                     std::to_string(numNodes));
}

Mesh readMesh(hid_t file) {
    Mesh mesh;
    const auto group = hdf5::openGroup(file, "mesh");
    mesh.nodeNumbers = hdf5::readIndices(group, "node_numbers", {0});
    mesh.positions = hdf5::readNumbers(group, "positions", {hsize_t(mesh.numNodes()), 3});
    const auto elements = hdf5::openGroup(group, "elements");
    for (size_t k = 0; k < hdf5::countLinks(elements); ++k) {
        const auto one = hdf5::openGroup(elements, std::to_string(k));
        ElementBlock block;
        block.type = elementTypeOf(hdf5::readText(one, "type"));
        block.nodes = hdf5::readIndices(one, "nodes", {0, hsize_t(numNodesOf(block.type))});
        checkNodes(block.nodes, mesh.numNodes(), "an element");
        block.isShell = hdf5::hasLink(one, "upper_side");
        mesh.elements.push_back(std::move(block));
    }
    const auto sets = hdf5::openGroup(group, "node_sets");
    for (size_t k = 0; k < hdf5::countLinks(sets); ++k) {
        const auto one = hdf5::openGroup(sets, std::to_string(k));
        const std::string name = hdf5::readText(one, "name");
        mesh.nodeSets[name] = hdf5::readIndices(one, "nodes", {0});
        checkNodes(mesh.nodeSets[name], mesh.numNodes(), "node set '" + name + "'");
    }
    if (!hdf5::hasLink(group, "expanded_nodes")) return mesh;
    const auto ofThin = hdf5::openGroup(group, "expanded_nodes");
    const auto numbers = hdf5::readIndices(ofThin, "numbers", {0}),
               counts = hdf5::readIndices(ofThin, "counts", {hsize_t(numbers.size())}),
               nodes = hdf5::readIndices(ofThin, "nodes", {0});
    checkNodes(nodes, mesh.numNodes(), "a shell or beam");
    size_t next = 0;
    for (size_t k = 0; k < numbers.size(); ++k) {
        if (counts[k] < 0 || size_t(counts[k]) > nodes.size() - next)
            throw std::runtime_error("expanded nodes are counted wrongly");
        mesh.expandedNodes[numbers[k]].assign(nodes.begin() + long(next),
                                              nodes.begin() + long(next) + counts[k]);
        next += size_t(counts[k]);
    }
    return mesh;
}

ReductionReport readReport(hid_t file) {
    const auto group = hdf5::openGroup(file, "report");
    ReductionReport report;
    report.numConstraintModes = hdf5::readInteger(group, "num_constraint_modes");
    report.numAttachmentModes = hdf5::readInteger(group, "num_attachment_modes");
    report.normalFrequencies = hdf5::readNumbers(group, "normal_frequencies", {0});
    report.effectiveMasses = hdf5::readNumbers(group, "effective_masses", {0, 6});
    report.rigidMasses = readArray<6>(group, "rigid_masses");
    const auto residuals = readArray<5>(group, "residuals");
    report.massOrthogonality = residuals[0];
    report.stiffnessOrthogonality = residuals[1];
    report.rigidResidual = residuals[2];
    report.rigidEnergy = residuals[3];
    report.conditionNumber = residuals[4];
    report.fullFrequencies = hdf5::readNumbers(group, "full_frequencies", {0});
    if (!hdf5::hasLink(group, "static_loads")) return report;
    const auto loads = hdf5::readTexts(group, "static_loads");
    const auto errors = hdf5::readNumbers(group, "static_errors", {loads.size()});
    for (size_t k = 0; k < loads.size(); ++k) report.staticErrors.push_back({loads[k], errors[k]});
    return report;
}

ReducedBody::ModalStress readModalStress(hid_t file, hsize_t numModes, int numNodes) {
    const auto group = hdf5::openGroup(file, "modal_stress");
    ReducedBody::ModalStress modal;
    modal.nodes = hdf5::readIndices(group, "nodes", {0});
    checkNodes(modal.nodes, numNodes, "modal stress");
    modal.stress = hdf5::readFloats(group, "stress", {numModes, 6 * modal.nodes.size()});
    modal.strain = hdf5::readFloats(group, "strain", {numModes, 6 * modal.nodes.size()});
    return modal;
}

std::vector<ReducedBody::Derivative> readDerivatives(hid_t file, hsize_t n) {
    const auto group = hdf5::openGroup(file, "derivatives");
    std::vector<ReducedBody::Derivative> derivatives;
    for (size_t k = 0; k < hdf5::countLinks(group); ++k) {
        const auto one = hdf5::openGroup(group, std::to_string(k));
        ReducedBody::Derivative& derivative = derivatives.emplace_back();
        derivative.parameter = hdf5::readText(one, "parameter");
        derivative.unit = hdf5::readText(one, "unit");
        derivative.value = readArray<1>(one, "value")[0];
        derivative.K = hdf5::readNumbers(one, "K", {n, n});
        derivative.M = hdf5::readNumbers(one, "M", {n, n});
    }
    return derivatives;
}

/** Whether a body may have a finer twin: twins themselves may not. **/
enum class Twin { MayBeThere, IsRefused };

bool isOfPart(hid_t file) {
    try {
        return hdf5::readText(file, "format") == Format;
    } catch (const std::runtime_error&) {
        return false;  // other HDF5 files lack this attribute
    }
}

ReducedBody readBody(hid_t file, Twin twin) {
    if (!isOfPart(file)) throw std::runtime_error("it is an HDF5 file, but not of a reduced part");
    const int version = hdf5::readInteger(file, "version");
    if (version < 1 || version > ReducedBodyFileVersion)
        throw std::runtime_error("its format has version " + std::to_string(version) +
                                 ", this simflex reads versions 1 to " +
                                 std::to_string(ReducedBodyFileVersion) + "; use a newer simflex");
    ReducedBody body;
    body.name = hdf5::readText(file, "name");
    body.provenance.units = hdf5::readText(file, "units");
    body.provenance.source = hdf5::readText(file, "source");
    body.provenance.program = hdf5::readText(file, "program");
    body.provenance.created = hdf5::readText(file, "created");

    body.mesh = readMesh(file);
    body.mass = readArray<1>(file, "mass")[0];
    body.centerOfMass = readArray<3>(file, "center_of_mass");
    body.inertia = readArray<6>(file, "inertia");
    body.omegaSquared = hdf5::readNumbers(file, "omega_squared", {0});
    body.numModes = int(body.omegaSquared.size());
    const hsize_t n = hsize_t(body.numModes);
    body.I1 = hdf5::readNumbers(file, "I1", {n, 6});
    readSquares(file, "I2", n, body.I2);
    readSquares(file, "N", n, body.N);
    body.Phi = hdf5::readNumbers(file, "Phi", {n, 3 * hsize_t(body.mesh.numNodes())});

    const auto interfaces = hdf5::openGroup(file, "interfaces");
    for (size_t k = 0; k < hdf5::countLinks(interfaces); ++k) {
        const auto one = hdf5::openGroup(interfaces, std::to_string(k));
        ReducedBody::Interface interface;
        interface.name = hdf5::readText(one, "name");
        interface.position = readArray<3>(one, "position");
        interface.Phi = hdf5::readNumbers(one, "Phi", {n, 3});
        interface.Psi = hdf5::readNumbers(one, "Psi", {n, 3});
        interface.nodes = hdf5::readIndices(one, "nodes", {0});
        if (version >= 3 && hdf5::hasLink(one, "weights")) {
            interface.tie = TieType::Distributing;
            interface.weights = hdf5::readNumbers(one, "weights", {interface.nodes.size()});
        }
        body.interfaces.push_back(std::move(interface));
    }
    if (version >= 3 && hdf5::hasLink(file, "modal_stress"))
        body.modalStress = readModalStress(file, n, body.mesh.numNodes());
    if (version >= 3 && hdf5::hasLink(file, "report")) body.report = readReport(file);
    if (version >= 2 && hdf5::hasLink(file, "stiffening")) {
        const auto stiffening = hdf5::openGroup(file, "stiffening");
        body.stiffening.emplace();
        readSquares(stiffening, "turning", n, body.stiffening->turning);
        const auto perInterface = hdf5::openGroup(stiffening, "interfaces");
        body.stiffening->interfaces.resize(hdf5::countLinks(perInterface));
        for (size_t k = 0; k < body.stiffening->interfaces.size(); ++k)
            readSquares(perInterface, std::to_string(k), n, body.stiffening->interfaces[k]);
    }
    if (version >= 5 && hdf5::hasLink(file, "derivatives"))
        body.derivatives = readDerivatives(file, n);
    if (version >= 4 && hdf5::hasLink(file, "further")) {
        const auto further = hdf5::openGroup(file, "further");
        body.further.emplace();
        body.further->displacements = hdf5::readNumbers(further, "displacements", {0});
        body.further->coordinates =
            hdf5::readNumbers(further, "coordinates", {n, body.further->displacements.size()});
    }
    if (version >= 4 && hdf5::hasLink(file, "finer")) {
        if (twin == Twin::IsRefused) throw std::runtime_error("its finer twin has a finer twin");
        body.finer = std::make_shared<const ReducedBody>(
            readBody(hdf5::openGroup(file, "finer"), Twin::IsRefused));
    }
    body.validate();
    return body;
}

}  // namespace

void checkPartFile(const std::string& path) {
    const std::string kind = "part file";
    checkReplaceable(path, "\x89HDF", kind);
    if (!fs::exists(path) || fs::file_size(path) == 0) return;
    const hdf5::Quiet quiet;
    bool isForeign = false;
    try {
        isForeign = !isOfPart(hdf5::openFile(path));
    } catch (const std::runtime_error&) {
        // A damaged part file may be replaced.
    }
    if (isForeign) refuseReplacing(path, kind);
}

void writeReducedBody(const std::string& path, const ReducedBody& body) {
    writeReducedBody(path, body, {});
}

void writeReducedBody(const std::string& path, const ReducedBody& body,
                      const std::vector<std::string>& warnings) {
    body.validate();
    checkPartFile(path);
    const hdf5::Quiet quiet;
    UnfinishedFile unfinished(path);
    try {
        {
            const auto file = hdf5::createFile(unfinished.getPath());
            writeBody(file, body);
            if (!warnings.empty()) hdf5::writeTexts(file, "warnings", warnings);
            if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0)
                throw std::runtime_error("cannot write all of it; is the disk full?");
        }
        appendChecksum(unfinished.getPath());
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("cannot write part file '" + path + "': " + error.what());
    }
    unfinished.finish();
}

namespace {

/** Opens a part file and returns the result of `read`; errors name the file. **/
template <class Read>
auto readPartFile(const std::string& path, const Read& read) {
    const hdf5::Quiet quiet;
    if (!isInputFile(path)) throw std::runtime_error("part file '" + path + "' does not exist");
    try {
        checkChecksum(path);
        return read(hdf5::openFile(path));
    } catch (const std::exception& error) {
        const bool isMbdyn = fs::path(path).extension() == ".fem";
        throw std::runtime_error(
            "part file '" + path + "' cannot be used: " + error.what() +
            (isMbdyn ? "; 'simflex export " + path + " -o PART.h5' makes a part file of MBDyn's"
                     : ""));
    }
}

}  // namespace

ReducedBody readReducedBody(const std::string& path) {
    return readPartFile(path,
                        [](const hdf5::Handle& file) { return readBody(file, Twin::MayBeThere); });
}

std::vector<std::string> readPartWarnings(const std::string& path) {
    return readPartFile(path, [](const hdf5::Handle& file) {
        return hdf5::hasLink(file, "warnings") ? hdf5::readTexts(file, "warnings")
                                               : std::vector<std::string>();
    });
}

}  // namespace simflex
