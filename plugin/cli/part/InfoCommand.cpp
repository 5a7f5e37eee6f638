/** @file
simflex info: prints the contents of a part file, as text or JSON. **/

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "simflex/base/Json.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Utf8.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/part/InterfacePicture.h"
#include "simflex/part/Frequency.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/ReducedBodyFile.h"

namespace simflex {
namespace cli {
namespace {

struct InfoArguments {
    std::string part;
    std::string picture;
    bool json = false;
};

std::array<double, 3> inDeck(const ReducedBody& body, const std::array<double, 3>& s) {
    return {s[0] + body.centerOfMass[0], s[1] + body.centerOfMass[1], s[2] + body.centerOfMass[2]};
}

int countElements(const Mesh& mesh) {
    int count = 0;
    for (const ElementBlock& block : mesh.elements) count += block.numElements();
    return count;
}

/** Returns the distance of the farthest tied node from the master [m]. **/
double calcReach(const ReducedBody& body, const ReducedBody::Interface& interface) {
    double reach = 0;
    for (const int node : interface.nodes) {
        const auto x = body.mesh.position(node);
        reach =
            std::max(reach, std::hypot(x[0] - interface.position[0], x[1] - interface.position[1],
                                       x[2] - interface.position[2]));
    }
    return reach;
}

/** A line of the table of modes. **/
struct ModeLine {
    double frequency = 0;            ///< [Hz]
    double largestDisplacement = 0;  ///< for ξ = 1 [m]
    int node = 0;                    ///< deck number of the node with the largest displacement
    double fullFrequency = NAN;      ///< of the full model [Hz]

    double error() const { return frequency / fullFrequency - 1; }
};

std::vector<ModeLine> calcModeLines(const ReducedBody& body) {
    const std::vector<double> hertz = calcFrequencies(body);
    const size_t numNodes = size_t(body.mesh.numNodes());
    std::vector<ModeLine> lines(hertz.size());
    for (size_t i = 0; i < lines.size(); ++i) {
        ModeLine& line = lines[i];
        line.frequency = hertz[i];
        const double* Phi = body.Phi.data() + 3 * numNodes * i;
        for (size_t node = 0; node < numNodes; ++node) {
            const double moved = std::hypot(Phi[3 * node], Phi[3 * node + 1], Phi[3 * node + 2]);
            if (moved <= line.largestDisplacement) continue;
            line.largestDisplacement = moved;
            line.node = body.mesh.nodeNumbers[node];
        }
        if (body.report && i < body.report->fullFrequencies.size())
            line.fullFrequency = body.report->fullFrequencies[i];
    }
    return lines;
}

/** Returns df/dp of each mode [Hz per unit of the parameter]. **/
std::vector<double> calcFrequencyDerivatives(const ReducedBody& body,
                                             const ReducedBody::Derivative& derivative) {
    std::vector<double> result = calcFrequencies(body);
    for (size_t i = 0; i < result.size(); ++i) {
        const size_t at = i * (result.size() + 1);
        result[i] *= 0.5 * (derivative.K[at] / body.omegaSquared[i] - derivative.M[at]);
    }
    return result;
}

Json describe(const ReductionReport& report) {
    Json json = Json::object();
    json.add("num_constraint_modes", report.numConstraintModes);
    json.add("num_attachment_modes", report.numAttachmentModes);
    json.add("mass_orthogonality", report.massOrthogonality);
    json.add("stiffness_orthogonality", report.stiffnessOrthogonality);
    json.add("rigid_residual", report.rigidResidual);
    json.add("rigid_energy", report.rigidEnergy);
    json.add("condition_number", report.conditionNumber);
    json.add("rigid_masses", report.rigidMasses);
    json.add("full_frequencies", report.fullFrequencies);
    if (!report.staticErrors.empty()) {
        Json errors = Json::object();
        for (const StaticError& error : report.staticErrors) errors.add(error.load, error.error);
        json.add("static_errors", errors);
    }
    Json modes = Json::list();
    for (size_t i = 0; i < report.normalFrequencies.size(); ++i) {
        Json mode = Json::object();
        mode.add("frequency", report.normalFrequencies[i]);
        if (report.effectiveMasses.size() >= 6 * (i + 1))
            mode.add(
                "effective_masses",
                std::vector<double>(report.effectiveMasses.begin() + std::ptrdiff_t(6 * i),
                                    report.effectiveMasses.begin() + std::ptrdiff_t(6 * i + 6)));
        modes.add(mode);
    }
    json.add("normal_modes", modes);
    return json;
}

void printJson(const ReducedBody& body, const std::vector<std::string>& warnings,
               std::uintmax_t fileSize) {
    Json json = Json::object();
    json.add("name", body.name);
    json.add("mass", body.mass);
    json.add("center_of_mass", body.centerOfMass);
    json.add("inertia", body.inertia);
    json.add("num_modes", body.numModes);
    json.add("frequencies", calcFrequencies(body));
    json.add("geometric_stiffness", body.stiffening.has_value());
    json.add("modal_stress", body.modalStress.has_value());
    json.add("num_stress_nodes", body.modalStress ? int(body.modalStress->nodes.size()) : 0);
    json.add("file_size", double(fileSize));
    Json derivatives = Json::list();
    for (const ReducedBody::Derivative& derivative : body.derivatives)
        derivatives.add(Json::object()
                            .add("parameter", derivative.parameter)
                            .add("value", derivative.value)
                            .add("unit", derivative.unit)
                            .add("frequencies", calcFrequencyDerivatives(body, derivative)));
    json.add("derivatives", derivatives);
    json.add("warnings", warnings);
    Json interfaces = Json::list();
    for (const auto& interface : body.interfaces)
        interfaces.add(Json::object()
                           .add("name", interface.name)
                           .add("tie", nameOf(interface.tie))
                           .add("position", interface.position)
                           .add("deck_position", inDeck(body, interface.position))
                           .add("num_nodes", int(interface.nodes.size()))
                           .add("reach", calcReach(body, interface)));
    json.add("interfaces", interfaces);
    Json modes = Json::list();
    int number = 0;
    for (const ModeLine& line : calcModeLines(body)) {
        Json mode = Json::object();
        mode.add("number", ++number);
        mode.add("frequency", line.frequency);
        mode.add("largest_displacement", line.largestDisplacement);
        mode.add("node", line.node);
        if (std::isfinite(line.fullFrequency)) {
            mode.add("full_frequency", line.fullFrequency);
            mode.add("frequency_error", line.error());
        }
        modes.add(mode);
    }
    json.add("modes", modes);
    if (body.report) json.add("report", describe(*body.report));
    json.add("mesh", Json::object()
                         .add("num_nodes", body.mesh.numNodes())
                         .add("num_elements", countElements(body.mesh)));
    json.add("provenance", Json::object()
                               .add("source", body.provenance.source)
                               .add("program", body.provenance.program)
                               .add("created", body.provenance.created)
                               .add("units", body.provenance.units));
    std::puts(json.write(2).c_str());
}

/** Returns zero for round-off relative to `size`. **/
double withoutNoise(double number, double size) {
    return std::abs(number) < 1e-12 * size ? 0 : number;
}

/** Pads UTF-8 text with spaces to `width` characters. **/
std::string pad(const std::string& text, int width) {
    return text + std::string(size_t(std::max(0, width - int(countCharacters(text)))), ' ');
}

void printInterfaces(const ReducedBody& body) {
    writeOut("interfaces      %zu\n", body.interfaces.size());
    if (body.interfaces.empty()) return;
    writeOut("  %s  %-12s %8s  %36s  %12s\n", pad("name", 20).c_str(), "tie", "nodes",
             "master x, y, z in the deck [m]", "reach [m]");
    for (const auto& interface : body.interfaces) {
        auto x = inDeck(body, interface.position);
        for (double& number : x) number = withoutNoise(number, body.calcRadius());
        writeOut("  %s  %-12s %8zu  %12.6g%12.6g%12.6g  %12.6g\n", pad(interface.name, 20).c_str(),
                 nameOf(interface.tie), interface.nodes.size(), x[0], x[1], x[2],
                 calcReach(body, interface));
    }
}

void printModes(const ReducedBody& body) {
    writeOut("modes           %d, free-free\n", body.numModes);
    if (body.numModes == 0) return;
    const std::vector<ModeLine> lines = calcModeLines(body);
    const bool hasFull = body.report && !body.report->fullFrequencies.empty();
    writeOut("  %4s  %14s  %16s  %10s%s\n", "mode", "frequency [Hz]", "largest [m/unit]", "at node",
             hasFull ? "  full model [Hz]   error [%]" : "");
    for (size_t i = 0; i < lines.size(); ++i) {
        const ModeLine& line = lines[i];
        writeOut("  %4zu  %14.7g  %16.6g  %10d", i + 1, line.frequency, line.largestDisplacement,
                 line.node);
        if (std::isfinite(line.fullFrequency))
            writeOut("  %15.7g  %10.2g", line.fullFrequency, 100 * line.error());
        writeOut("\n");
    }
}

/** Prints the sensitivity of frequencies to each parameter: d ln f / d ln p. **/
void printDerivatives(const ReducedBody& body) {
    constexpr size_t Most = 6;
    if (body.derivatives.empty()) return;
    const std::vector<double> hertz = calcFrequencies(body);
    const size_t count = std::min(Most, hertz.size());
    writeOut("derivatives     %% of frequency per %% of the parameter, modes 1 to %zu\n", count);
    for (const ReducedBody::Derivative& derivative : body.derivatives) {
        const std::string value = writeGeneral(derivative.value, 6) +
                                  (derivative.unit == "1" ? "" : " " + derivative.unit);
        writeOut("  %s  %-16s", pad(derivative.parameter, 28).c_str(), value.c_str());
        const std::vector<double> slopes = calcFrequencyDerivatives(body, derivative);
        for (size_t i = 0; i < count; ++i)
            writeOut(" %8.4f", slopes[i] * derivative.value / hertz[i]);
        writeOut("\n");
    }
    writeOut("\n");
}

void printReport(const ReducedBody& body) {
    if (!body.report) {
        writeOut("reduction       no report in this file\n");
        return;
    }
    const ReductionReport& report = *body.report;
    writeOut("reduction       %d constraint, %d attachment, %zu normal modes\n",
             report.numConstraintModes, report.numAttachmentModes, report.normalFrequencies.size());
    if (body.finer) writeOut("for error bars  %d modes of the finer twin\n", body.finer->numModes);
    writeOut("residuals       of unit modal mass %.1e, stiffness %.1e, rigid motion %.1e\n",
             report.massOrthogonality, report.stiffnessOrthogonality, report.rigidResidual);
    writeOut("                rigid energy %.1e of the lowest mode; condition of the factor %.1e\n",
             report.rigidEnergy, report.conditionNumber);
    if (!report.staticErrors.empty())
        writeOut("missing         of the free part's static deflection under\n");
    for (const StaticError& error : report.staticErrors)
        writeOut("  %-40s %.1e\n", error.load.c_str(), error.error);
    if (report.normalFrequencies.empty()) return;

    const bool hasMasses = report.effectiveMasses.size() == 6 * report.normalFrequencies.size();
    writeOut("normal modes    with the interfaces held%s\n",
             hasMasses ? "; effective mass and inertia in % of the part's" : "");
    writeOut("  %4s  %14s", "mode", "frequency [Hz]");
    if (hasMasses)
        writeOut("  %9s%9s%9s  %9s%9s%9s", "x", "y", "z", "about x", "about y", "about z");
    writeOut("\n");
    std::array<double, 6> sum{};
    const auto printMasses = [&](const double* masses) {
        for (size_t c = 0; c < 6; ++c)
            writeOut("%s%9.3f", c % 3 == 0 ? "  " : "", 100 * masses[c] / report.rigidMasses[c]);
    };
    for (size_t i = 0; i < report.normalFrequencies.size(); ++i) {
        writeOut("  %4zu  %14.7g", i + 1, report.normalFrequencies[i]);
        if (hasMasses) {
            printMasses(&report.effectiveMasses[6 * i]);
            for (size_t c = 0; c < 6; ++c) sum[c] += report.effectiveMasses[6 * i + c];
        }
        writeOut("\n");
    }
    if (!hasMasses) return;
    writeOut("  %4s  %14s", "sum", "");
    printMasses(sum.data());
    writeOut("\n");
}

void printTable(const ReducedBody& body, const std::vector<std::string>& warnings,
                const std::string& path, std::uintmax_t fileSize) {
    auto c = body.centerOfMass;
    auto I = body.inertia;
    const double radius = body.calcRadius();
    for (double& number : c) number = withoutNoise(number, radius);
    for (double& number : I) number = withoutNoise(number, body.mass * radius * radius);
    writeOut("part            %s\n", body.name.c_str());
    writeOut("file            %s, %s\n", path.c_str(), writeFileSize(double(fileSize)).c_str());
    writeOut("source          %s\n", body.provenance.source.c_str());
    writeOut("program         %s\n", body.provenance.program.c_str());
    writeOut("units           %s\n", body.provenance.units.c_str());
    for (const std::string& warning : warnings)
        writeOut("warning         %s\n", wrapText(warning, 84, std::string(16, ' ')).c_str());
    if (!body.provenance.created.empty())
        writeOut("created         %s\n", body.provenance.created.c_str());
    writeOut("mesh            %d nodes, %d elements\n", body.mesh.numNodes(),
             countElements(body.mesh));
    writeOut("mass            %.9g kg\n", body.mass);
    writeOut("centre of mass  %.6g %.6g %.6g m (deck)\n", c[0], c[1], c[2]);
    writeOut("inertia         xx %.6g  yy %.6g  zz %.6g kg m2, about the centre of mass\n", I[0],
             I[1], I[2]);
    writeOut("                xy %.6g  xz %.6g  yz %.6g kg m2\n", I[3], I[4], I[5]);
    writeOut("stiffening      %s\n",
             body.stiffening ? "yes: geometric stiffness by rotation and interface loads"
                             : "none (simflex reduce --stiffening)");
    if (body.modalStress) {
        writeOut("stress          yes: stress and strain of each mode at %zu of %d nodes\n",
                 body.modalStress->nodes.size(), body.mesh.numNodes());
    } else {
        writeOut("stress          none (simflex reduce --stress)\n");
    }
    writeOut("\n");
    printInterfaces(body);
    writeOut("\n");
    printModes(body);
    writeOut("\n");
    printDerivatives(body);
    printReport(body);
}

}  // namespace

void addInfoCommand(CLI::App& app) {
    auto arguments = std::make_shared<InfoArguments>();
    CLI::App* command = app.add_subcommand(
        "info", "Show mass, interfaces, modes and quality of the reduction of a part file");
    command->add_option("PART", arguments->part, "Part file (.h5)")->required();
    command->add_flag("--json", arguments->json,
                      "Print one JSON object (SI units, frequencies in Hz)");
    command
        ->add_option("--picture", arguments->picture,
                     "Draw the part with the tied nodes of its interfaces as well")
        ->type_name("FILE.png");
    command->callback([arguments] {
        const ReducedBody body = readReducedBody(arguments->part);
        std::vector<std::string> warnings = readPartWarnings(arguments->part);
        for (const std::string& doubt : listPartDoubts(body)) warnings.push_back(doubt);
        if (!arguments->picture.empty()) drawInterfaces(body).writePng(arguments->picture);
        const auto fileSize = std::filesystem::file_size(arguments->part);
        if (arguments->json) {
            printJson(body, warnings, fileSize);
        } else {
            printTable(body, warnings, arguments->part, fileSize);
        }
    });
}

}  // namespace cli
}  // namespace simflex
