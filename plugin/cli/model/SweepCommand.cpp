/** @file
simflex sweep: many runs of one model, each with other values. **/


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
    bool isDry = false, isQuiet = false;
};

/** The program `simflex` that this process runs, or that stands beside simflex_mpi. **/
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
    std::printf("%s: %s\n", table.c_str(), text.c_str());
    std::fflush(stdout);
    if (counts[int(Status::Interrupted)] > 0 || wasInterrupted())
        throw Cancelled(text + "; the same command goes on with the others");
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
    if (options.folder.empty())
        options.folder = fs::path(arguments.model).stem().string() + ".sweep";
    if (arguments.isDry) {
        for (const SweepCase& one : plan.cases)
            std::printf("%s%s%s\n", one.folder.c_str(), one.error.empty() ? "" : ": ",
                        one.error.c_str());
        return;
    }
    options.program = findProgram();
    options.listener = makeListener(arguments.isQuiet);
    options.share = SweepShare::fromEnvironment();
    const std::vector<SweepOutcome> outcomes = runSweep(plan, options);
    // mpirun ends all ranks as soon as one of them fails: the first one tells.
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
        "Without --vary or --list the model's own analysis of type sweep is done. Each case has a "
        "folder\n"
        "of its own in FOLDER; FOLDER/sweep.csv and .h5 are the table. The same command again goes "
        "on:\n"
        "what is complete and unchanged is skipped. Processes share a sweep: by mpirun or srun, as "
        "tasks\n"
        "of a Slurm job array, or started by hand with the same FOLDER (on a disk with file "
        "locks).\n\n"
        "  simflex sweep crank.yaml --vary speed=50,100,150 --vary length=0.1:0.2:5\n"
        "  mpirun -n 8 simflex sweep crank.yaml --list cases.csv --jobs 1\n"
        "  sbatch --array=0-9 --wrap 'simflex sweep crank.yaml --vary speed=10:500:50'");
    sweep->add_option("MODEL.yaml", arguments->model, "The model")
        ->required()
        ->check(CLI::ExistingFile);
    addRepeated(*sweep, "--vary", arguments->vary,
                "NAME=VALUE,VALUE… or NAME=FROM:TO:COUNT; NAME is a parameter, or a path like\n"
                "solver.accuracy. Several: all combinations",
                "NAME=VALUES");
    sweep->add_option("--list", arguments->list,
                      "Cases of a CSV file: names in the first line, then a line for each case");
    addRepeated(*sweep, "--set", arguments->settings,
                "A setting that all cases share (one value), as of simflex run", "PATH=VALUE");
    sweep->add_option("--analysis", arguments->analysis, "Which of the model's sweeps");
    sweep->add_option("--only", arguments->only, "Analyses to do, NAME,NAME (default: all)")
        ->delimiter(',')
        ->type_name("NAME")
        ->allow_extra_args(false);
    sweep
        ->add_option("--of", arguments->of,
                     "Columns of the table: PROBE.maximum, .minimum, .mean, .rms, .final, .range\n"
                     "(default: maximum, minimum and final value of all)")
        ->delimiter(',')
        ->type_name("PROBE,PROBE")
        ->allow_extra_args(false);
    sweep->add_option("-o,--output", arguments->options.folder,
                      "FOLDER (default: MODEL.sweep here)");
    sweep->add_option("--jobs", arguments->options.numJobs, "Processes at once (default: cores)")
        ->check(CLI::Range(1, 4096));
    sweep
        ->add_option("--threads", arguments->options.numThreads,
                     "Threads of each (default: the cores shared out)")
        ->check(CLI::Range(1, 1024));
    sweep->add_flag("--dry-run", arguments->isDry, "Lists the cases, checks each, runs none");
    sweep->add_flag("--pictures", arguments->options.hasPictures,
                    "Draws the pictures of the model for each case");
    addScriptsFlag(*sweep, arguments->options.allowsScripts);
    sweep->add_flag("-q,--quiet", arguments->isQuiet, "No progress");
    sweep->callback([arguments] { runSweepCommand(*arguments); });
}

}  // namespace cli
}  // namespace simflex
