/** @file
simflex sweep: runs a model with many sets of values. **/

#include <cstdio>
#include <filesystem>
#include <memory>
#include <stdexcept>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/model/sweep/SweepPlan.h"
#include "simflex/model/sweep/SweepRunner.h"
#include "simflex/model/sweep/SweepTable.h"

namespace simflex {
namespace cli {

using namespace model;
namespace {

namespace fs = std::filesystem;

struct SweepArguments {
    std::string model, list, analysis;
    std::vector<std::string> settings, vary, only, of;
    SweepOptions options;
    AllowedCode code;
    bool hasPictures = false, isDry = false, isQuiet = false;
};

/** Returns the program `simflex` that this process runs, or the one beside simflex_mpi. **/
std::string findProgram() {
    const fs::path self = fs::read_symlink("/proc/self/exe");
    const fs::path plain = self.parent_path() / "simflex";
    return self.filename() == "simflex_mpi" && fs::exists(plain) ? plain.string() : self.string();
}

SweepPlan makePlan(const SweepArguments& arguments) {
    SweepPlan plan;
    plan.model = loadModelText(fs::absolute(arguments.model).lexically_normal().string(),
                               arguments.settings);
    plan.of = arguments.of;
    plan.hasPictures = arguments.hasPictures;
    checkSweepSettings(plan.model);
    if (arguments.vary.empty() && arguments.list.empty()) {
        takeModelSweep(plan, arguments.analysis);
    } else {
        if (!arguments.vary.empty() && !arguments.list.empty())
            throw std::runtime_error("--vary and --list exclude each other");
        if (!arguments.analysis.empty())
            throw std::runtime_error(
                "--analysis chooses a sweep of the model; with --vary and --list say --only");
        plan.only = arguments.only;
        for (const std::string& text : arguments.vary) plan.keys.push_back(parseSweptKey(text));
        if (!arguments.list.empty()) plan.keys = readSweptKeys(arguments.list);
        makeSweepCases(plan, arguments.list.empty() ? SweepOrder::Grid : SweepOrder::List);
    }
    checkSweepColumns(plan);
    checkSweepCases(plan);
    return plan;
}

void report(const SweepPlan& plan, const std::vector<SweepOutcome>& outcomes,
            const std::string& table) {
    int counts[4] = {}, numDone = 0;
    for (const SweepOutcome& outcome : outcomes) {
        ++counts[int(outcome.status)];
        numDone += outcome.wasDone;
    }
    using Status = SweepOutcome::Status;
    const int numComplete = counts[int(Status::Complete)], numFailed = counts[int(Status::Failed)];
    std::string text = std::to_string(numComplete) + " of " + std::to_string(plan.cases.size()) +
                       " cases are complete";
    if (numDone > 0) text += " (" + std::to_string(numDone) + " were before)";
    if (numFailed > 0) text += ", " + std::to_string(numFailed) + " failed";
    writeOut("%s: %s\n", table.c_str(), text.c_str());
    std::fflush(stdout);
    if (counts[int(Status::Interrupted)] > 0 || wasInterrupted())
        throw Cancelled(text + "; the same command continues with the others");
    if (numFailed == 0) return;
    for (size_t k = 0; k < outcomes.size(); ++k)
        if (outcomes[k].status == Status::Failed)
            throw std::runtime_error(std::to_string(numFailed) + " of " +
                                     std::to_string(plan.cases.size()) + " cases failed, first " +
                                     plan.cases[k].folder + ": " + outcomes[k].error);
}

void runSweepCommand(const SweepArguments& arguments) {
    const SweepPlan plan = makePlan(arguments);
    SweepOptions options = arguments.options;
    options.arguments = listCodeOptions(arguments.code);
    if (options.folder.empty())
        options.folder = fs::path(arguments.model).stem().string() +
                         (plan.name.empty() ? "" : "." + plan.name) + ".sweep";
    if (arguments.isDry) {
        for (const SweepCase& one : plan.cases)
            writeOut("%s%s%s\n", one.folder.c_str(), one.error.empty() ? "" : ": ",
                     one.error.c_str());
        return;
    }
    refuseOtherSweep(plan, options.folder);
    options.program = findProgram();
    options.listener = makeListener(arguments.isQuiet);
    options.share = SweepShare::fromEnvironment();
    const std::vector<SweepOutcome> outcomes = runSweep(plan, options);
    // mpirun ends all ranks as soon as one fails, so only the first one reports.
    const bool isHelper = options.share.kind == SweepShare::Kind::Rank && options.share.index > 0;
    if (isHelper) return;
    const std::string table = writeSweepTable(plan, options.folder, options.listener);
    ProgressBar::clearLine();
    report(plan, outcomes, table);
}

}  // namespace

void addSweepCommand(CLI::App& app) {
    const auto arguments = std::make_shared<SweepArguments>();
    CLI::App* sweep = app.add_subcommand("sweep", "Run a model for many values of its parameters");
    sweep->footer(
        "Without --vary or --list the model's own analysis of type sweep is run. Each case has a "
        "folder\n"
        "of its own in FOLDER; FOLDER/sweep.csv and .h5 are the table. Run again, the same command "
        "continues:\n"
        "what is complete and unchanged is skipped. Processes share a sweep: by mpirun or srun, as "
        "tasks\n"
        "of a Slurm job array, or started by hand with the same FOLDER (on a disk with file "
        "locks).\n\n"
        "  simflex sweep crank.yaml --vary speed=50,100,150 --vary length=0.1:0.2:5\n"
        "  mpirun -n 8 simflex sweep crank.yaml --list cases.csv --jobs 1\n"
        "  sbatch --array=0-9 --wrap 'simflex sweep crank.yaml --vary speed=10:500:50'");
    addModelFile(*sweep, arguments->model);
    addRepeated(*sweep, "--vary", arguments->vary,
                "NAME=VALUE,VALUE… or NAME=FROM:TO:COUNT; NAME is a parameter or a path such as\n"
                "solver.accuracy; several --vary make all combinations",
                "NAME=VALUES");
    sweep->add_option("--list", arguments->list,
                      "CSV file of cases: names in the first line, then one line for each case");
    addSettings(*sweep, arguments->settings,
                "Change the value of a key for all cases, for example solver.accuracy=1e-5");
    sweep->add_option("--analysis", arguments->analysis,
                      "Run this sweep of the model (default: its only one)");
    addAnalyses(*sweep, arguments->only, "Run");
    sweep
        ->add_option("--of", arguments->of,
                     "Columns of the table: PROBE.maximum, .minimum, .mean, .rms, .final, .range\n"
                     "(default: maximum, minimum and final value of all)")
        ->delimiter(',')
        ->type_name("PROBE,PROBE")
        ->allow_extra_args(false);
    sweep->add_option(
        "-o,--output", arguments->options.folder,
        "Folder to write (default: MODEL.sweep in the current folder; of a model with\n"
        "several sweeps MODEL.ANALYSIS.sweep)");
    sweep
        ->add_option("--jobs", arguments->options.numJobs,
                     "Number of processes at once (default: one for each core)")
        ->check(CLI::Range(1, 4096));
    sweep
        ->add_option("--threads", arguments->options.numThreads,
                     "Number of threads of each process (default: cores divided by processes)")
        ->check(CLI::Range(1, 1024));
    sweep->add_flag("--dry-run", arguments->isDry, "List and check the cases, and run none");
    sweep->add_flag("--pictures", arguments->hasPictures,
                    "Draw the model's pictures for each case");
    addCodeOptions(*sweep, arguments->code);
    addQuietFlag(*sweep, arguments->isQuiet, "warnings and results");
    sweep->callback([arguments] { runSweepCommand(*arguments); });
}

}  // namespace cli
}  // namespace simflex
