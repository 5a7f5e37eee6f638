/** @file
Part files: bytes changed despite the checksum must be detected; objects changed by another program
(data sets of other sizes, types and values, other attributes, missing objects) give a valid part or
a refusal. **/

#include "FuzzHdf5.h"
#include "simflex/part/ReducedBodyFile.h"
#include "support/PointMassPart.h"

using namespace simflex;

namespace {

/** Returns the file of a part with every kind of content. **/
const std::string& getFile() {
    static const std::string bytes = [] {
        test::PointMassPartOptions options;
        options.numModes = 2;
        options.cells = {1, 1, 1};
        options.stiffening = 1;
        ReducedBody body = *test::makePointMassPart(options).body;
        body.mesh.nodeSets["LEFT"] = {0, 1, 2};
        body.report.emplace();
        body.report->normalFrequencies = {1, 2};
        body.report->effectiveMasses.assign(12, 0.1);
        body.modalStress.emplace();
        body.modalStress->nodes = {0, 3};
        body.modalStress->stress.assign(24, 1.0f);
        body.modalStress->strain.assign(24, 1e-6f);
        body.derivatives = {
            {"thickness:SKIN", "m", 0.01, std::vector<double>(4, 1e6), std::vector<double>(4, 1)}};
        body.interfaces[1].tie = TieType::Distributing;
        body.interfaces[1].weights.assign(body.interfaces[1].nodes.size(),
                                          1.0 / double(body.interfaces[1].nodes.size()));
        const std::string path = fuzz::getFolder() / "base.h5";
        writeReducedBody(path, body);
        std::ifstream in(path, std::ios::binary);
        return std::string(std::istreambuf_iterator<char>(in), {});
    }();
    return bytes;
}

const char* const kObjects[] = {"mass",
                                "center_of_mass",
                                "inertia",
                                "omega_squared",
                                "I1",
                                "I2",
                                "N",
                                "Phi",
                                "interfaces",
                                "interfaces/0",
                                "interfaces/0/position",
                                "interfaces/0/Phi",
                                "interfaces/0/Psi",
                                "interfaces/0/nodes",
                                "interfaces/1/weights",
                                "interfaces/1",
                                "stiffening",
                                "stiffening/turning",
                                "stiffening/interfaces",
                                "stiffening/interfaces/0",
                                "modal_stress",
                                "modal_stress/nodes",
                                "modal_stress/stress",
                                "modal_stress/strain",
                                "derivatives",
                                "derivatives/0",
                                "derivatives/0/value",
                                "derivatives/0/K",
                                "derivatives/0/M",
                                "report",
                                "report/normal_frequencies",
                                "report/effective_masses",
                                "report/rigid_masses",
                                "report/residuals",
                                "report/full_frequencies",
                                "mesh",
                                "mesh/node_numbers",
                                "mesh/positions",
                                "mesh/elements",
                                "mesh/elements/0",
                                "mesh/elements/0/nodes",
                                "mesh/node_sets",
                                "mesh/node_sets/0",
                                "mesh/node_sets/0/nodes",
                                "."};

const char* const kAttributes[] = {"format",    "version", "name",
                                   "units",     "type",    "num_constraint_modes",
                                   "created",   "source",  "num_attachment_modes",
                                   "parameter", "unit"};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    fuzz::Input input(data, size);
    std::string bytes = getFile();
    const bool changesBytes = input.take() % 8 == 0;
    if (changesBytes && !fuzz::changeBytes(bytes, input)) return 0;
    const std::string path = fuzz::getFolder().write("part.h5", bytes);
    if (!changesBytes) fuzz::changeHdf5(path, kObjects, kAttributes, input);
    const bool accepted = fuzz::accepts([&] { readReducedBody(path).validate(); });
    if (accepted && changesBytes) fuzz::fail("a damaged file was accepted");
    return 0;
}
