/** @file
simflex run: runs the analyses of a model file. **/

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>

#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/model/RunSummary.h"
#include "simflex/model/analyses/ModelRun.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace cli {

using namespace model;
namespace {

/** Quotes a word for a shell. **/
std::string quote(const std::string& text) {
    const std::string plain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=:,./%@";
    if (!text.empty() && text.find_first_not_of(plain) == std::string::npos) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

struct RunArguments {
    std::string model;
    std::vector<std::string> settings;
    RunOptions options;
    bool isRigidToo = false, verifies = false, isQuiet = false;
};

/** Returns the command that resumes such a run. **/
std::string makeResumeCommand(const RunArguments& arguments) {
    const RunOptions& options = arguments.options;
    std::string command = "simflex run " + quote(arguments.model);
    if (!options.output.empty()) command += " -o " + quote(options.output);
    for (const std::string& setting : arguments.settings) command += " --set " + quote(setting);
    for (const std::string& name : options.only) command += " --only " + quote(name);
    if (arguments.isRigidToo) command += " --rigid";
    if (arguments.verifies) command += " --verify";
    if (options.hasErrorBars) command += " --error-bar";
    if (options.writesCsv) command += " --csv";
    if (!options.drawsPictures) command += " --no-pictures";
    if (!options.animation.empty()) command += " --animation " + quote(options.animation);
    for (const std::string& option : listCodeOptions(options.code)) command += ' ' + option;
    return command + " --resume";
}

/** Repeats the run with smaller steps and prints the change of every probe.
@param text  the run's own model: the file may have changed since **/
void verify(ModelText text, const ModelRun& run, RunOptions options) {
    const ModelValue solver = readModel(text).get("solver");
    const auto divide = [&](const char* key, double by) {
        const std::string path = std::string("solver.") + key;
        const std::string value = writeGeneral(solver.get(key).getNumber() / by, 12);
        text.set(path, value);
        return path + "=" + value;
    };
    const bool isFixed = solver.get("fixed_step").isGiven();
    const std::string change = isFixed ? divide("fixed_step", 2) : divide("accuracy", 10);
    if (solver.get("maximum_step").isGiven()) divide("maximum_step", 2);
    options.output = makePathBeside(run.getResultPath(), ".fine.h5");
    options.longestStep = 0.5;  // in case the step size limits the accuracy
    options.drawsPictures = options.writesCsv = false;
    options.animation.clear();
    options.listener = makeListenerOfNews(options.listener);
    ModelRun fine(text, ModelOptions::Bodies::AsGiven, options);
    fine.perform();
    ProgressBar::clearLine();
    printVerification(readResults(run.getResultPath(), ReadStates::No),
                      readResults(fine.getResultPath(), ReadStates::No), change);
    writeOut("results of the finer run: %s\n", fine.getResultPath().c_str());
    fine.refuseFailures();
}

template <class List, class Condition>
void eraseIf(List& list, const Condition& condition) {
    list.erase(std::remove_if(list.begin(), list.end(), condition), list.end());
}

bool hasSteps(const ModelRun& run) {
    const ModelValue analyses = run.getModel().getFile().get("analyses");
    for (const std::string& name : analyses.getKeys())
        if (run.isWanted(name) && analyses.get(name).get("type").getText() == "transient")
            return true;
    return false;
}

void perform(const RunArguments& arguments) {
    const auto started = std::chrono::steady_clock::now();
    RunOptions options = arguments.options;
    options.resumeCommand = makeResumeCommand(arguments);
    options.listener = makeListener(arguments.isQuiet);
    const ModelText text = loadModelText(arguments.model, arguments.settings);
    ModelRun run(text, ModelOptions::Bodies::AsGiven, options);
    if (options.onlyChecks) {
        ProgressBar::clearLine();
        printAssembly(run);
        return;
    }
    const bool isRigidToo = arguments.isRigidToo && run.canBend();
    if (arguments.isRigidToo && !isRigidToo)
        options.listener.tellWarning(
            "no body of the model can bend: it is rigid as it is, so --rigid changes nothing and "
            "it is run once");
    std::optional<ErrorBarRun> twin;
    if (options.hasErrorBars) twin.emplace(run, options);
    try {
        if (twin)
            twin->perform(run);
        else
            run.perform();
    } catch (const Cancelled&) {
        throw;
    } catch (const std::exception&) {
        ProgressBar::clearLine();
        if (run.hasResults()) printComplete(run);
        throw;
    }
    ProgressBar::clearLine();
    printSummary(run);
    if (twin) {
        ErrorBars bars = twin->keep(run);
        Results results = readResults(run.getResultPath(), ReadStates::No);
        // Omit analyses of earlier runs, which have been reported.
        eraseIf(results.analyses, [&](const auto& one) { return !run.isWanted(one.name); });
        eraseIf(bars.comparison.missing,
                [&](const auto& one) { return !run.isWanted(one.analysis); });
        printErrorBars(results, bars);
        writeOut("results with further modes: %s\n", twin->getFiner().getResultPath().c_str());
        twin->getFiner().refuseFailures();
    }
    if (isRigidToo) {
        RunOptions ofRigid = options;
        ofRigid.listener = makeListenerOfNews(options.listener);
        ModelRun rigid(text, ModelOptions::Bodies::Rigid, ofRigid);
        rigid.perform();
        ProgressBar::clearLine();
        printDifference(readResults(run.getResultPath(), ReadStates::No),
                        readResults(rigid.getResultPath(), ReadStates::No));
        writeOut("results of the rigid model: %s\n", rigid.getResultPath().c_str());
        rigid.refuseFailures();
    }
    if (arguments.verifies && hasSteps(run))
        verify(text, run, options);
    else if (arguments.verifies)
        writeOut(
            "nothing to verify: no transient analysis was run, and others take no steps in "
            "time\n");
    run.refuseFailures();
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - started;
    std::fflush(stdout);
    char seconds[40];
    std::snprintf(seconds, sizeof seconds, "%.1f s", elapsed.count());
    const std::string parts = describeSeconds(run);
    options.listener.tellNote(parts.empty() ? seconds : seconds + (": " + parts));
}

}  // namespace

void addRunCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand("run", "Run the analyses of a model file");
    auto arguments = std::make_shared<RunArguments>();
    RunOptions* options = &arguments->options;
    addModelFile(*command, arguments->model);
    command
        ->add_option("-o,--output", options->output,
                     "Result file to write, replacing any that exists (default: MODEL.results.h5 "
                     "in the current folder)")
        ->type_name("FILE");
    addSettings(*command, arguments->settings);
    addAnalyses(*command, options->only, "Run");
    command->add_flag("--rigid", arguments->isRigidToo,
                      "Run the model with all bodies rigid as well, and print the differences");
    command->add_flag(
        "--verify", arguments->verifies,
        "Run once more with a tenth of solver.accuracy and half the longest step, and print how "
        "much each probe changes: an estimate of the integration error");
    command->add_flag("--error-bar", options->hasErrorBars,
                      "Run once more with further modes of all parts, and print the error of each "
                      "probe due to reduction and how many modes would suffice");
    command->add_flag("--resume", options->resumes,
                      "Continue where the last run of this model was stopped");
    addOutputs(*command, *options);
    command->add_flag("--check", options->onlyChecks,
                      "Build and assemble the model, list its contents and run nothing");
    command
        ->add_option("--threads", options->threads,
                     "Number of threads, on which results do not depend (default: solver.threads)")
        ->check(CLI::Range(1, 1024))
        ->type_name("N");
    addCodeOptions(*command, options->code);
    addQuietFlag(*command, arguments->isQuiet, "warnings and results");
    command->callback([arguments] { perform(*arguments); });
}

}  // namespace cli
}  // namespace simflex
