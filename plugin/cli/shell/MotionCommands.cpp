/** @file
Commands of the prompt that change time or configuration: run, step, static, reset. **/

#include <stdexcept>

#include "simflex/base/Interruption.h"
#include "simflex/base/Progress.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/cli/shell/Shell.h"

namespace simflex {
namespace cli {
namespace {

constexpr int RowsOfRun = 200;
constexpr int MostSteps = 1000000;

struct Span {
    double end, interval;
};

/** Returns the first transient analysis of the model. **/
Span findAnalysis(const Session& session) {
    const ModelValue analyses = session.getModel().getFile().get("analyses");
    for (const std::string& name : analyses.getKeys()) {
        const ModelValue analysis = analyses.get(name);
        if (analysis.get("type").getText() != "transient") continue;
        const double duration = analysis.get("duration").getNumber();
        const ModelValue interval = analysis.get("interval");
        return {session.getTime() + duration,
                interval.isGiven() ? interval.getNumber() : duration / RowsOfRun};
    }
    throw std::runtime_error("the model has no transient analysis: write 'run TIME'");
}

Span readSpan(Shell& shell, Words words) {
    const double now = shell.updSession().getTime();
    double interval = 0;
    if (words.size() >= 2 && words[words.size() - 2] == "every") {
        interval = shell.calcNumber(words.back());
        if (!(interval > 0)) throw std::runtime_error("the interval must be positive");
        words.resize(words.size() - 2);
    }
    Span span{};
    if (words.empty()) {
        span = findAnalysis(shell.updSession());
    } else if (words.size() == 1) {
        span.end = shell.calcNumber(words[0]);
    } else if (words.size() == 2 && (words[0] == "for" || words[0] == "to")) {
        span.end = (words[0] == "for" ? now : 0) + shell.calcNumber(words[1]);
    } else {
        throw std::runtime_error("write 'run TIME' or 'run for DURATION', then 'every INTERVAL'");
    }
    if (!(span.end > now))
        throw std::runtime_error("the time is " + formatNumber(now) + " s, " +
                                 formatNumber(span.end) + " s has passed; write 'run for " +
                                 "DURATION', or 'reset' first");
    if (interval > 0)
        span.interval = interval;
    else if (span.interval == 0)
        span.interval = (span.end - now) / RowsOfRun;
    if ((span.end - now) / span.interval > 1e8)
        throw std::runtime_error("the interval is too short for this duration");
    return span;
}

constexpr size_t MostToldEvents = 20;  // events printed at most

void reportOutcome(Shell& shell, Session::Outcome outcome) {
    const double time = shell.updSession().getTime();
    const auto events = shell.updSession().getModel().takeOccurrences();
    for (const std::string& warning : shell.updSession().getModel().takeEventWarnings())
        writeOut("warning: %s\n", warning.c_str());
    const size_t numLeftOut = events.size() > MostToldEvents ? events.size() - MostToldEvents : 0;
    if (numLeftOut > 0) writeOut("%zu events, the last of them:\n", events.size());
    for (size_t i = numLeftOut; i < events.size(); ++i)
        writeOut("event '%s' at t = %s s\n", events[i].first.c_str(),
                 formatNumber(events[i].second).c_str());
    if (outcome == Session::Outcome::Stopped)
        throw Cancelled("the time is " + formatNumber(time) + " s");
    if (outcome == Session::Outcome::Terminated)
        writeOut("the model ended its motion at t = %s s\n", formatNumber(time).c_str());
}

void run(Shell& shell, const Words& words) {
    const Span span = readSpan(shell, words);
    Session& session = shell.updSession();
    const IntegratorStatistics before = session.getIntegrator().getStatistics();
    const std::string phase = "to t = " + formatNumber(span.end) + " s";
    ProgressBar bar(!shell.showsProgress(), {{phase, 1}});
    const Session::Outcome outcome = session.runTo(
        span.end, span.interval, [&](double fraction) { return bar.show(phase, fraction); });
    bar.clear();
    reportOutcome(shell, outcome);
    const IntegratorStatistics& now = session.getIntegrator().getStatistics();
    writeOut("t = %s s: %ld steps, %ld Newton iterations\n",
             formatNumber(session.getTime()).c_str(), now.stepsTaken - before.stepsTaken,
             now.newtonIterations - before.newtonIterations);
}

void step(Shell& shell, const Words& words) {
    Session& session = shell.updSession();
    const int count = words.empty() ? 1 : shell.calcCount(words[0], MostSteps);
    const Session::Outcome outcome = session.step(count, [](double) { return !wasInterrupted(); });
    reportOutcome(shell, outcome);
    writeOut("t = %s s: last step %s s, order %d\n", formatNumber(session.getTime()).c_str(),
             formatNumber(session.getIntegrator().getLastStepSize()).c_str(),
             session.getIntegrator().getLastOrder());
}

void findStatic(Shell& shell, const Words&) {
    Session& session = shell.updSession();
    const Session::Equilibrium found = session.settle([] { return !wasInterrupted(); });
    writeOut("at rest after %d iterations\n", found.numIterations);
    for (const std::string& motion : found.freeMotions) writeOut("%s\n", motion.c_str());
    if (!found.branch.empty()) writeOut("warning: %s\n", found.branch.c_str());
    if (found.isByDampedMotion)
        writeOut(
            "Newton's iteration did not converge: a strongly damped motion came to rest "
            "here\n");
    for (const std::string& motion : found.unstableMotions)
        writeOut("unstable: %s\n", motion.c_str());
}

void reset(Shell& shell, const Words&) {
    shell.updSession().reset();
    writeOut("back at the start, t = %s s\n", formatNumber(shell.updSession().getTime()).c_str());
}

}  // namespace

void addMotionCommands(std::vector<Command>& commands) {
    const std::string group = "Motion";
    commands.push_back({group, "run", "[TIME | for DURATION] [every INTERVAL]",
                        "Run to a time, or for a duration",
                        "Alone: the model's first transient analysis. Probes are recorded every "
                        "INTERVAL (default: 200 times\n"
                        "in a run). Ctrl-C stops the run; the state reached is kept.",
                        0, 4, run, [](const Shell&, const Words& before, const std::string&) {
                            return before.empty() ? std::vector<std::string>{"for", "every"}
                                                  : std::vector<std::string>{"every"};
                        }});
    commands.push_back(
        {group, "step", "[N]", "Take one step of the integrator, or several", "", 0, 1, step});
    commands.push_back({group, "static", "", "Go to the nearest static equilibrium, at rest",
                        "Time does not change; loads and motions are those of that time.", 0, 0,
                        findStatic});
    commands.push_back(
        {group, "reset", "", "Go back to the start; the record begins anew", "", 0, 0, reset});
}

}  // namespace cli
}  // namespace simflex
