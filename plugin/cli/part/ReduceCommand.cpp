/** @file
simflex reduce: reduces a finite element model to a part file. **/

#include <cstdio>
#include <filesystem>
#include <memory>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/part/ReductionArguments.h"
#include "simflex/part/PartWarnings.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace cli {
namespace {

namespace fs = std::filesystem;

/** Shares of the time, measured for the 1 mm connecting rod (45 000 DOF, 50 modes). **/
const std::vector<std::pair<std::string, double>> UsualPhases = {
    {"reading the deck", 2}, {"K and M", 1},           {"checking K and M", 1},
    {"ordering K", 4},       {"factoring K", 8},       {"constraint modes", 2},
    {"normal modes", 13},    {"orthonormal modes", 2}, {"invariants", 1}};

/** Share of the frequencies of the full model. **/
const std::pair<std::string, double> CheckPhase{"frequencies of the full model", 45};

/** Shares of geometric stiffness, with two interfaces and two processors. **/
const std::vector<std::pair<std::string, double>> StiffeningPhases = {{"loads that stiffen", 2},
                                                                      {"geometric stiffness", 4}};

/** Results of shorter phases are not stored for resuming [s]. **/
constexpr double WorthKeeping = 5;

struct ReduceArguments {
    SourceArguments source;
    std::string output, name, picture;
    ReductionArguments reduction;
    bool resume = true;
    bool stiffening = false, quiet = false;
};

/** Relative static deflection error that is round-off. **/
constexpr double NoStaticError = 1e-9;

/** Prints the part's frequencies and deflections beside those of the full model. **/
void printCheck(const ReducedBody& body) {
    writeOut("  mode     part [Hz]    full [Hz]   error\n");
    for (size_t i = 0; i < body.report->fullFrequencies.size(); ++i) {
        const double part = std::sqrt(body.omegaSquared[i]) / (2 * M_PI),
                     full = body.report->fullFrequencies[i];
        writeOut("%6zu  %12.6g %12.6g  %.1e\n", i + 1, part, full, part / full - 1);
    }
    writeOut("  missing part of the free part's static deflection under\n");
    for (const StaticError& error : body.report->staticErrors)
        writeOut("  %-40s %.1e\n", error.load.c_str(),
                 std::abs(error.error) > NoStaticError ? error.error : 0.0);
}

std::string findOutput(const ReduceArguments& arguments) {
    return arguments.output.empty() ? fs::path(arguments.source.path()).stem().string() + ".h5"
                                    : arguments.output;
}

using Draw = std::function<void(const ReducedBody&, const std::string&)>;

void runReduce(const ReduceArguments& arguments, const std::shared_ptr<StiffnessSolver>& solver,
               const Draw& draw) {
    ReductionOptions options = arguments.reduction.parse();
    options.solver = solver;
    if (solver && options.numCheckedModes > 0)
        throw std::runtime_error("--check is not possible over MPI: check with simflex");
    options.hasStiffening = arguments.stiffening;
    const std::string output = findOutput(arguments);
    options.name = arguments.name.empty() ? fs::path(output).stem().string() : arguments.name;
    checkPartFile(output);
    if (!arguments.picture.empty()) checkWritable(arguments.picture);

    SourceOptions source = arguments.source.parse();
    auto phases = UsualPhases;
    if (arguments.stiffening)
        phases.insert(phases.end(), StiffeningPhases.begin(), StiffeningPhases.end());
    if (options.stress) phases.emplace_back("modal stress", 4);
    if (!source.calculix.derivatives.empty())
        phases.emplace_back("derivatives", 2 * double(source.calculix.derivatives.size()));
    if (options.numCheckedModes > 0) phases.push_back(CheckPhase);
    ProgressBar bar(arguments.quiet, phases);
    const ProgressCallback progress = [&](const std::string& phase, double fraction) {
        return bar.show(phase, fraction);
    };
    CalculixOptions& calculix = source.calculix;
    calculix.progress = progress;
    const Listener listener = makeListener(arguments.quiet);
    calculix.note = listener.note;
    calculix.warn = listener.warn;
    const ReductionCheckpoint checkpoint(output + ".resume", WorthKeeping, calculix.note);
    if (arguments.resume) calculix.checkpoint = options.checkpoint = &checkpoint;
    FeModel model = readModelSource(source);
    for (const std::string& warning : listInterfaceWarnings(model, options)) {
        listener.tellWarning(warning);
        model.warnings.push_back(warning);
    }
    const ReducedBody body = reduce(model, options, progress);
    if (wasInterrupted()) throw Cancelled();
    if (const std::string equal = describeEqualModes(body, options); !equal.empty())
        listener.tellNote(equal);
    writeReducedBody(output, body, model.warnings);
    if (!arguments.picture.empty()) draw(body, arguments.picture);
    if (arguments.resume) checkpoint.remove();
    bar.clear();

    const std::string stress =
        body.modalStress
            ? ", stress at " + std::to_string(body.modalStress->nodes.size()) + " nodes"
            : "";
    if (!arguments.quiet)
        writeOut("%s: %d modes, %zu interface%s, %.6g kg, lowest frequency %.6g Hz%s%s -> %s\n",
                 body.name.c_str(), body.numModes, body.interfaces.size(),
                 body.interfaces.size() == 1 ? "" : "s", body.mass,
                 std::sqrt(body.omegaSquared[0]) / (2 * M_PI),
                 body.stiffening ? ", geometric stiffness" : "", stress.c_str(), output.c_str());
    if (!arguments.quiet && options.numCheckedModes > 0) printCheck(body);
}

}  // namespace

void addReduceCommand(CLI::App& app, const std::shared_ptr<StiffnessSolver>& solver,
                      const Draw& draw) {
    auto arguments = std::make_shared<ReduceArguments>();
    CLI::App* command = app.add_subcommand(
        "reduce", "Reduce a finite element model to a flexible part (Craig-Bampton)");
    arguments->source.addTo(*command);
    arguments->reduction.addTo(*command);
    command
        ->add_option("-o,--output", arguments->output,
                     "Part file to write (default: SOURCE.h5 in the current folder)")
        ->type_name("PART.h5");
    command->add_option("--name", arguments->name,
                        "Name of the part (default: that of the part file)");
    command->add_flag("--stiffening", arguments->stiffening,
                      "Compute geometric stiffness, for fast rotation and large loads on "
                      "interfaces");
    command->add_flag_callback(
        "--no-resume", [arguments] { arguments->resume = false; },
        "Start anew, and keep no PART.h5.resume from which a stopped run could continue");
    if (draw)
        command
            ->add_option("--picture", arguments->picture,
                         "Draw the part with the tied nodes of its interfaces")
            ->type_name("FILE.png");
    addQuietFlag(*command, arguments->quiet, "warnings");
    command->callback([arguments, solver, draw] {
        try {
            runReduce(*arguments, solver, draw);
        } catch (const Cancelled&) {
            const std::string kept = findOutput(*arguments) + ".resume";
            if (!fs::exists(kept)) throw;
            throw Cancelled("what was done is kept in " + kept +
                            ": the same command continues from it");
        }
    });
}

}  // namespace cli
}  // namespace simflex
