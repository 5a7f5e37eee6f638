/** @file
simflex reduce: a CalculiX deck becomes a part file. **/

#include <cstdio>
#include <filesystem>
#include <memory>

#include "Commands.h"
#include "ProgressBar.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace cli {
namespace {

namespace fs = std::filesystem;

/** Shares of the time, measured on the 1 mm connecting rod (45 000 DOF, 50 modes). **/
const std::vector<std::pair<std::string, double>> kPhases = {
    {"reading the deck", 1},  {"CalculiX assembles K and M", 36},
    {"reading K", 3},         {"reading M", 2},
    {"checking K and M", 1},  {"factoring K", 10},
    {"constraint modes", 2},  {"normal modes", 42},
    {"orthonormal modes", 2}, {"invariants", 1}};

/** The same for geometric stiffness, with two interfaces and two processors. **/
const std::vector<std::pair<std::string, double>> kStiffeningPhases = {
    {"loads that stiffen", 2}, {"geometric stiffness", 400}};

struct ReduceArguments {
    std::string deck, output, name, program;
    std::vector<std::string> interfaces, masters;
    int numModes = 50;
    bool stiffening = false, quiet = false, timings = false;
};

/** Splits "NAME=REST"; @throws CLI::ValidationError if it is not of that form. **/
std::pair<std::string, std::string> splitAssignment(const std::string& option,
                                                    const std::string& text) {
    const size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
        throw CLI::ValidationError(option, "'" + text + "' is not of the form NAME=VALUE");
    return {text.substr(0, equals), text.substr(equals + 1)};
}

std::vector<InterfaceOptions> parseInterfaces(const ReduceArguments& arguments) {
    std::vector<InterfaceOptions> interfaces;
    for (const std::string& text : arguments.interfaces) {
        const auto [name, set] = splitAssignment("--interface", text);
        interfaces.emplace_back(name, set);
    }
    for (const std::string& text : arguments.masters) {
        const auto [name, point] = splitAssignment("--master", text);
        std::array<double, 3> x{};
        char end = 0;
        if (std::sscanf(point.c_str(), "%lf,%lf,%lf%c", &x[0], &x[1], &x[2], &end) != 3)
            throw CLI::ValidationError("--master", "'" + text + "' is not of the form NAME=X,Y,Z");
        bool found = false;
        for (InterfaceOptions& interface : interfaces)
            if (interface.name == name) interface.master = x, found = true;
        if (!found) throw CLI::ValidationError("--master", "there is no interface '" + name + "'");
    }
    return interfaces;
}

void printTimings(const ReductionTimings& t, double deckSeconds) {
    std::printf(
        "deck and CalculiX %.2f s, factor %.2f s (%d DOF, %.1f M entries), constraint modes %.2f "
        "s, normal "
        "modes %.2f s, orthonormal modes %.2f s, invariants %.2f s, geometric stiffness %.2f s, "
        "total %.2f s\n",
        deckSeconds, t.factor, t.numDofs, double(t.numFactorEntries) * 1e-6, t.constraintModes,
        t.normalModes, t.orthonormalize, t.invariants, t.stiffening, deckSeconds + t.total);
}

void runReduce(const ReduceArguments& arguments) {
    ReductionOptions options;
    options.interfaces = parseInterfaces(arguments);
    options.numModes = arguments.numModes;
    if (arguments.stiffening) {
        options.stiffening.emplace();
        options.stiffening->program = arguments.program;
    }
    const std::string output = arguments.output.empty()
                                   ? fs::path(arguments.deck).stem().string() + ".h5"
                                   : arguments.output;
    options.name = arguments.name.empty() ? fs::path(output).stem().string() : arguments.name;
    const fs::path folder = fs::absolute(output).parent_path();
    if (!fs::is_directory(folder))
        throw std::runtime_error("there is no folder '" + folder.string() + "' to write to");

    auto phases = kPhases;
    if (arguments.stiffening)
        phases.insert(phases.end(), kStiffeningPhases.begin(), kStiffeningPhases.end());
    ProgressBar bar(arguments.quiet, phases);
    const ProgressCallback progress = [&](const std::string& phase, double fraction) {
        return bar.show(phase, fraction);
    };
    CalculixOptions calculix;
    calculix.program = arguments.program;
    calculix.progress = progress;
    calculix.note = [&](const std::string& note) {
        bar.clear();
        if (!arguments.quiet) std::fprintf(stderr, "simflex: note: %s\n", note.c_str());
    };
    auto lap = std::chrono::steady_clock::now();
    const FeModel model = readCalculixDeck(arguments.deck, calculix);
    const double deckSeconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - lap).count();
    ReductionTimings timings;
    const ReducedBody body = reduce(model, options, progress, &timings);
    if (wasInterrupted()) throw Cancelled();
    writeReducedBody(output, body);
    bar.clear();

    if (!arguments.quiet)
        std::printf("%s: %d modes, %zu interfaces, %.6g kg, lowest frequency %.6g Hz%s -> %s\n",
                    body.name.c_str(), body.numModes, body.interfaces.size(), body.mass,
                    std::sqrt(body.omegaSquared[0]) / (2 * M_PI),
                    body.stiffening ? ", geometric stiffness" : "", output.c_str());
    if (arguments.timings) printTimings(timings, deckSeconds);
}

}  // namespace

void addReduceCommand(CLI::App& app) {
    auto arguments = std::make_shared<ReduceArguments>();
    CLI::App* command =
        app.add_subcommand("reduce", "Reduce a CalculiX deck to a flexible part (Craig-Bampton)");
    command->add_option("DECK", arguments->deck, "CalculiX input deck (.inp), SI units")
        ->required();
    command
        ->add_option("-i,--interface", arguments->interfaces,
                     "joint seat: NAME=NSET ties a node set of the deck rigidly to its mean point")
        ->type_name("NAME=NSET")
        ->expected(1)
        ->take_all();
    command
        ->add_option("--master", arguments->masters,
                     "master point of an interface, deck coordinates [m]")
        ->type_name("NAME=X,Y,Z")
        ->expected(1)
        ->take_all();
    command
        ->add_option("-m,--modes", arguments->numModes,
                     "Craig-Bampton modes, 6 per interface among them; the part keeps 6 fewer")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command
        ->add_option("-o,--output", arguments->output,
                     "part file to write (default: deck's name .h5, here)")
        ->type_name("PART.h5");
    command->add_option("--name", arguments->name,
                        "name of the part (default: that of the part file)");
    command->add_flag("--stiffening", arguments->stiffening,
                      "geometric stiffness too, for fast rotation and large loads on interfaces: 6 "
                      "static runs of CalculiX and 6 more an interface");
    command->add_option("--ccx", arguments->program,
                        "CalculiX program (default: $SIMFLEX_CCX, else ccx)");
    command->add_flag("-q,--quiet", arguments->quiet, "print errors only");
    command->add_flag("--timings", arguments->timings, "print the wall time of each phase");
    command->callback([arguments] { runReduce(*arguments); });
}

}  // namespace cli
}  // namespace simflex
