/** @file
simflex info: what is in a part file, for people or as JSON. **/

#include <cmath>
#include <cstdio>
#include <memory>

#include "Commands.h"
#include "Json.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace cli {
namespace {

struct InfoArguments {
    std::string part;
    bool json = false;
};

std::vector<double> calcFrequencies(const ReducedBody& body) {
    std::vector<double> hertz;
    for (const double omegaSquared : body.omegaSquared)
        hertz.push_back(std::sqrt(omegaSquared) / (2 * M_PI));
    return hertz;
}

std::array<double, 3> inDeck(const ReducedBody& body, const std::array<double, 3>& s) {
    return {s[0] + body.centerOfMass[0], s[1] + body.centerOfMass[1], s[2] + body.centerOfMass[2]};
}

int countElements(const Mesh& mesh) {
    int count = 0;
    for (const ElementBlock& block : mesh.elements) count += block.numElements();
    return count;
}

void printJson(const ReducedBody& body) {
    JsonWriter json;
    json.beginObject();
    json.add("name", body.name);
    json.add("mass", body.mass);
    json.add("center_of_mass", body.centerOfMass);
    json.add("inertia", body.inertia);
    json.add("num_modes", body.numModes);
    json.add("frequencies", calcFrequencies(body));
    json.add("geometric_stiffness", body.stiffening.has_value());
    json.beginArray("interfaces");
    for (const auto& interface : body.interfaces) {
        json.beginObject();
        json.add("name", interface.name);
        json.add("position", interface.position);
        json.add("deck_position", inDeck(body, interface.position));
        json.add("num_nodes", int(interface.nodes.size()));
        json.endObject();
    }
    json.endArray();
    json.beginObject("mesh");
    json.add("num_nodes", body.mesh.numNodes());
    json.add("num_elements", countElements(body.mesh));
    json.endObject();
    json.beginObject("provenance");
    json.add("source", body.provenance.source);
    json.add("program", body.provenance.program);
    json.add("created", body.provenance.created);
    json.add("units", body.provenance.units);
    json.endObject();
    json.endObject();
    std::puts(json.text().c_str());
}

void printTable(const ReducedBody& body) {
    const auto& c = body.centerOfMass;
    const auto& I = body.inertia;
    std::printf("part            %s\n", body.name.c_str());
    std::printf("mass            %.9g kg\n", body.mass);
    std::printf("centre of mass  %.6g %.6g %.6g m (deck)\n", c[0], c[1], c[2]);
    std::printf("inertia         xx %.6g  yy %.6g  zz %.6g  xy %.6g  xz %.6g  yz %.6g kg m2\n",
                I[0], I[1], I[2], I[3], I[4], I[5]);
    std::printf("mesh            %d nodes, %d elements\n", body.mesh.numNodes(),
                countElements(body.mesh));
    std::printf("source          %s\n", body.provenance.source.c_str());
    std::printf("program         %s\n", body.provenance.program.c_str());
    std::printf("units           %s\n", body.provenance.units.c_str());
    if (!body.provenance.created.empty())
        std::printf("created         %s\n", body.provenance.created.c_str());
    std::printf("interfaces      %zu\n", body.interfaces.size());
    for (const auto& interface : body.interfaces) {
        const auto x = inDeck(body, interface.position);
        std::printf("  %-13s %zu nodes, master at %.6g %.6g %.6g m (deck)\n",
                    interface.name.c_str(), interface.nodes.size(), x[0], x[1], x[2]);
    }
    std::printf("stiffening      %s\n",
                body.stiffening ? "yes: geometric stiffness by rotation and interface loads"
                                : "none (simflex reduce --stiffening)");
    std::printf("modes           %d, free-free frequencies in Hz:\n", body.numModes);
    const auto hertz = calcFrequencies(body);
    constexpr size_t kPerLine = 6;
    for (size_t i = 0; i < hertz.size(); ++i)
        std::printf("%12.6g%s", hertz[i],
                    i + 1 == hertz.size() || (i + 1) % kPerLine == 0 ? "\n" : "");
}

}  // namespace

void addInfoCommand(CLI::App& app) {
    auto arguments = std::make_shared<InfoArguments>();
    CLI::App* command =
        app.add_subcommand("info", "Show mass, inertia, interfaces and frequencies of a part file");
    command->add_option("PART", arguments->part, "part file (.h5)")->required();
    command->add_flag("--json", arguments->json,
                      "print one JSON object; SI units, frequencies in Hz");
    command->callback([arguments] {
        const ReducedBody body = readReducedBody(arguments->part);
        if (arguments->json) {
            printJson(body);
        } else {
            printTable(body);
        }
    });
}

}  // namespace cli
}  // namespace simflex
