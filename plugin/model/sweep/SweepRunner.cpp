#include "simflex/model/sweep/SweepRunner.h"

#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <list>
#include <set>
#include <sstream>
#include <stdexcept>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/Results.h"
#include "simflex/model/analyses/EarlierResults.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;
using Status = SweepOutcome::Status;
constexpr int StoppedStatus = 130;            // exit status after Ctrl-C
constexpr useconds_t ShortPause = 20 * 1000;  // between polls of running cases [µs]
constexpr useconds_t LongPause = 200 * 1000;  // while other processes run the remaining cases
constexpr char CaseFile[] = "case.txt";

int countCores() {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    if (sched_getaffinity(0, sizeof cores, &cores) != 0) return 1;
    return std::max(1, CPU_COUNT(&cores));
}

std::string readFile(const std::string& path) {
    std::ifstream in = openInputFile(path);
    return std::string(std::istreambuf_iterator<char>(in), {});
}

/** The last line of a program's output, without a leading "simflex: ". **/
std::string findLastLine(const std::string& log) {
    const size_t end = log.find_last_not_of(" \r\n");
    if (end == std::string::npos) return "it printed nothing";
    const size_t start = log.find_last_of("\r\n", end);
    std::string line = log.substr(start == std::string::npos ? 0 : start + 1);
    line.resize(line.find_last_not_of(" \r\n") + 1);
    const std::string program = "simflex: ";
    return line.compare(0, program.size(), program) == 0 ? line.substr(program.size()) : line;
}

std::string findResults(const std::string& folder) {
    return folder + "/results.h5";
}

struct CaseText {
    InputChecksums inputs;
    std::string ending;
};

CaseText readCase(const std::string& folder) {
    CaseText one;
    std::istringstream in(readFile(folder + "/" + CaseFile));
    for (std::string line; std::getline(in, line);) {
        const size_t sum = line.find_first_not_of("0123456789abcdef");
        if (sum >= 16 && sum != std::string::npos && line[sum] == ' ')
            one.inputs[line.substr(sum + 1)] = line.substr(0, sum);
        else
            one.ending = in.eof() ? "" : line;  // ignore an incomplete last line
    }
    return one;
}

/** First change since the results of a case were made; empty if none, or no results. **/
std::string findChangeOfCase(const std::string& folder, const InputChecksums& now) {
    if (!fs::exists(findResults(folder))) return "";
    const InputChecksums then = readCase(folder).inputs;
    return then.empty() ? "another simflex has made them" : findChangedInput(then, now);
}

/** Status and error of a case, provided that its inputs are the same. **/
SweepOutcome readOutcome(const std::string& folder, const InputChecksums& inputs) {
    SweepOutcome outcome;
    const CaseText found = readCase(folder);
    if (found.inputs.empty() || !findChangedInput(found.inputs, inputs).empty()) return outcome;
    const std::string& ending = found.ending;
    if (ending == "complete" && fs::exists(findResults(folder))) {
        outcome.status = Status::Complete;
    } else if (ending.compare(0, 8, "failed: ") == 0) {
        outcome.status = Status::Failed;
        outcome.error = ending.substr(8);
    } else if (ending == "interrupted" || ending == "begun") {
        outcome.status = Status::Interrupted;
    }
    return outcome;
}

std::vector<std::string> listAnalyses(const SweepPlan& plan) {
    if (!plan.only.empty()) return plan.only;
    const ModelValue analyses = readModel(plan.model).get("analyses");
    std::vector<std::string> names;
    for (const std::string& name : analyses.getKeys())
        if (analyses.get(name).get("type").getText() != "sweep") names.push_back(name);
    return names;
}

/** Missing analyses of a run that exited successfully, since code within it may end its process;
empty if there are none. **/
std::string findMissing(const std::string& path, const std::vector<std::string>& analyses) {
    try {
        const Results results = readResults(path, ReadStates::No);
        for (const std::string& name : analyses) {
            const auto isDone = [&](const Results::Analysis& one) {
                return one.name == name && one.isComplete;
            };
            if (std::none_of(results.analyses.begin(), results.analyses.end(), isDone))
                return "analysis '" + name + "' is not complete";
        }
        return "";
    } catch (const std::exception& error) {
        return error.what();
    }
}

/** Opens and locks the log; −1 if another process holds it. **/
int claim(const std::string& folder) {
    const std::string path = folder + "/log.txt";
    const int file = open(path.c_str(), O_RDWR | O_CREAT | O_APPEND | O_NOFOLLOW | O_CLOEXEC, 0666);
    if (file < 0) throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno));
    if (flock(file, LOCK_EX | LOCK_NB) == 0) return file;
    close(file);
    return -1;
}

class Runner {
public:
    Runner(const SweepPlan& plan, const SweepOptions& options)
        : m_plan(plan),
          m_options(options),
          m_analyses(listAnalyses(plan)),
          m_outcomes(plan.cases.size()),
          m_isOver(plan.cases.size(), false) {
        const int numCores = countCores(), numCases = int(plan.cases.size());
        m_numJobs = options.numJobs > 0 ? options.numJobs
                                        : std::max(1, numCores / std::max(1, options.numThreads));
        m_numJobs = std::min(m_numJobs, numCases);
        m_numThreads =
            options.numThreads > 0 ? options.numThreads : std::max(1, numCores / m_numJobs);
        removeUnfinishedFiles(options.folder, "started");
        // The time by the clock of the folder's disk.
        m_started = fs::last_write_time(UnfinishedFile(options.folder + "/started").getPath());
        // Ranks start at different places, to avoid contention for the same case.
        const SweepShare& share = options.share;
        for (int k = 0; k < numCases; ++k) {
            const size_t place =
                size_t(k) + size_t(share.index) * size_t(numCases) / size_t(share.count);
            if (share.kind == SweepShare::Kind::Rank) {
                m_order.push_back(place % size_t(numCases));
            } else if (share.kind == SweepShare::Kind::Alone || k % share.count == share.index) {
                m_order.push_back(size_t(k));
            }
        }
    }

    /** After an exception, stops the running cases. **/
    ~Runner() {
        askToStop();
        for (Job& job : m_running) job.child.wait();
    }

    std::vector<SweepOutcome> run() {
        warnOfChanges();
        for (;;) {
            if (m_isStopped || !showProgress()) askToStop();
            while (!m_isStopped && int(m_running.size()) < m_numJobs && startNext()) {
            }
            const bool hasEnded = waitForSome();
            if (m_running.empty() && (m_isStopped || !hasWork())) break;
            if (!hasEnded) usleep(m_running.empty() ? LongPause : ShortPause);
        }
        return m_outcomes;
    }

private:
    struct Job {
        size_t index;
        ChildProcess child;
        int log;
    };

    std::string getFolder(size_t index) const {
        return m_options.folder + "/" + m_plan.cases[index].folder;
    }
    InputChecksums calcInputs(size_t index) const { return m_plan.calcInputs(m_plan.cases[index]); }
    void keep(size_t index, const std::string& ending) const {
        replaceFile(getFolder(index) + "/" + CaseFile, makeCaseText(calcInputs(index), ending));
    }

    /** Warns once about all outdated results. **/
    void warnOfChanges() const {
        if (m_options.share.kind == SweepShare::Kind::Rank && m_options.share.index > 0) return;
        size_t number = 0;
        std::string first;
        for (const size_t index : m_order) {
            const std::string change = findChangeOfCase(getFolder(index), calcInputs(index));
            if (change.empty()) continue;
            if (number++ == 0) first = m_plan.cases[index].folder + ": " + change;
        }
        if (number == 0) return;
        m_options.listener.tellWarning(
            "the results of " + std::to_string(number) + (number == 1 ? " case" : " cases") +
            " are out of date (" + first +
            ") and done anew; those that there are stay in a folder of the case until then");
    }

    /** True if cases are left for this process to run or wait for. Only the first rank waits for
    others. **/
    bool hasWork() const {
        if (m_options.share.kind == SweepShare::Kind::Rank && m_options.share.index > 0)
            return std::any_of(m_order.begin(), m_order.end(),
                               [&](size_t k) { return !m_isOver[k] && !m_isElsewhere.count(k); });
        return std::any_of(m_order.begin(), m_order.end(), [&](size_t k) { return !m_isOver[k]; });
    }

    bool isRunning(size_t index) const {
        return std::any_of(m_running.begin(), m_running.end(),
                           [&](const Job& job) { return job.index == index; });
    }

    /** True if a case ended before this sweep started, by the clock of the folder's disk. **/
    bool isOlderThanThis(size_t index) const {
        std::error_code error;
        const auto written = fs::last_write_time(getFolder(index) + "/" + CaseFile, error);
        return !error && written <= m_started;  // file times have a coarse resolution
    }

    /** Starts the next case; returns false if there is none. **/
    bool startNext() {
        m_isElsewhere.clear();
        for (const size_t index : m_order) {
            if (m_isOver[index] || isRunning(index)) continue;
            fs::create_directories(getFolder(index));
            const int log = claim(getFolder(index));
            if (log < 0) {
                m_isElsewhere.insert(index);
                continue;
            }
            const SweepOutcome before = readOutcome(getFolder(index), calcInputs(index));
            // Skip cases finished by another process of this sweep in the meantime.
            const bool isOld = isOlderThanThis(index);
            if (before.status == Status::Complete || (before.status == Status::Failed && !isOld)) {
                m_outcomes[index] = before;
                m_outcomes[index].wasDone = isOld;
                m_isOver[index] = true;
                close(log);
                continue;
            }
            if (!m_plan.cases[index].error.empty()) {
                refuse(index, log);
                continue;
            }
            start(index, log, before.status);
            return true;
        }
        return false;
    }

    /** Marks a case with an invalid model as failed. **/
    void refuse(size_t index, int log) {
        const std::string line = "simflex: " + m_plan.cases[index].error + "\n";
        const bool isWritten =
            ftruncate(log, 0) == 0 && write(log, line.data(), line.size()) == ssize_t(line.size());
        if (!isWritten) throw std::runtime_error("cannot write a log");
        keep(index, "failed: " + m_plan.cases[index].error);
        m_outcomes[index].status = Status::Failed;
        m_outcomes[index].error = m_plan.cases[index].error;
        m_isOver[index] = true;
        close(log);
    }

    void start(size_t index, int log, Status before) {
        const SweepCase& one = m_plan.cases[index];
        if (ftruncate(log, 0) != 0) throw std::runtime_error("cannot write a log");
        const std::string results = findResults(getFolder(index));
        if (!findChangeOfCase(getFolder(index), calcInputs(index)).empty())
            keepAside(results);
        else if (before != Status::Interrupted)  // results of a failed case may be damaged
            removeResults(results);
        keep(index, "begun");
        ChildSetup setup;
        setup.arguments = {
            m_options.program, "run",     m_plan.model.path, "-o",
            "results.h5",      "--quiet", "--threads",       std::to_string(m_numThreads)};
        if (!m_plan.hasPictures) setup.arguments.push_back("--no-pictures");
        for (const std::string& setting : m_plan.getSettings(one)) {
            setup.arguments.push_back("--set");
            setup.arguments.push_back(setting);
        }
        for (const std::string& analysis : m_plan.only) {
            setup.arguments.push_back("--only");
            setup.arguments.push_back(analysis);
        }
        if (before == Status::Interrupted) setup.arguments.push_back("--resume");
        setup.arguments.insert(setup.arguments.end(), m_options.arguments.begin(),
                               m_options.arguments.end());
        setup.environment["OMP_NUM_THREADS"] = std::to_string(m_numThreads);
        setup.output = setup.error = log;
        setup.folder = fs::absolute(getFolder(index)).string();
        setup.isOwnGroup = true;
        m_running.push_back({index, ChildProcess(setup), log});
    }

    /** Collects cases that have ended.
    @returns whether there were any **/
    bool waitForSome() {
        bool hasEnded = false;
        for (auto job = m_running.begin(); job != m_running.end();) {
            if (!job->child.hasEnded()) {
                ++job;
                continue;
            }
            finish(*job, job->child.getEnd());
            job = m_running.erase(job);
            hasEnded = true;
        }
        return hasEnded;
    }

    void finish(const Job& job, const ChildEnd& end) {
        SweepOutcome& outcome = m_outcomes[job.index];
        const std::string log = readFile(getFolder(job.index) + "/log.txt");
        const std::string missing =
            end.isSuccess() ? findMissing(findResults(getFolder(job.index)), m_analyses) : "";
        if (end.isSuccess() && missing.empty()) {
            outcome.status = Status::Complete;
            keep(job.index, "complete");
        } else if (end.exitCode == StoppedStatus || m_isStopped) {
            outcome.status = Status::Interrupted;
            keep(job.index, "interrupted");
            m_isStopped = true;  // Ctrl-C reached only the case: end the sweep, too
        } else {
            outcome.status = Status::Failed;
            outcome.error = end.signal        ? "it " + end.describe()
                            : end.isSuccess() ? "code within it (an FMU?) has ended it: " + missing
                                              : findLastLine(log);
            keep(job.index, "failed: " + outcome.error);
            m_options.listener.tellWarning(m_plan.cases[job.index].folder +
                                           " failed: " + outcome.error);
        }
        m_isOver[job.index] = true;
        close(job.log);
    }

    /** Asks all running cases to stop, once. **/
    void askToStop() {
        m_isStopped = true;
        if (m_isAsked) return;
        for (Job& job : m_running) job.child.sendSignal(SIGINT);
        m_isAsked = true;
    }

    /** @returns false to stop. **/
    bool showProgress() {
        int numOver = 0, numFailed = 0;
        for (const size_t k : m_order) {
            numOver += m_isOver[k];
            numFailed += m_outcomes[k].status == Status::Failed;
        }
        std::string text =
            std::to_string(numOver) + " of " + std::to_string(m_order.size()) + " cases done";
        if (numFailed > 0) text += ", " + std::to_string(numFailed) + " failed";
        const std::string share = m_options.share.describe();
        if (!share.empty()) text += " (" + share + ")";
        return m_options.listener.tellProgress(
            text, double(numOver) / double(std::max<size_t>(1, m_order.size())));
    }

    const SweepPlan& m_plan;
    const SweepOptions& m_options;
    const std::vector<std::string> m_analyses;
    std::vector<SweepOutcome> m_outcomes;
    std::vector<bool> m_isOver;
    std::vector<size_t> m_order;  ///< cases that this process may run
    std::set<size_t> m_isElsewhere;
    std::list<Job> m_running;
    fs::file_time_type m_started;
    int m_numJobs = 1, m_numThreads = 1;
    bool m_isStopped = false, m_isAsked = false;
};

}  // namespace

std::string makeCaseText(const InputChecksums& inputs, const std::string& ending) {
    std::string text;
    for (const auto& [what, sum] : inputs) text += sum + " " + what + "\n";
    return text + ending + "\n";
}

std::string nameOf(SweepOutcome::Status status) {
    static const char* const names[] = {"waiting", "complete", "failed", "interrupted"};
    return names[int(status)];
}

std::vector<SweepOutcome> runSweep(const SweepPlan& plan, const SweepOptions& options) {
    std::error_code error;
    fs::create_directories(options.folder, error);
    if (error)
        throw std::runtime_error("cannot make the folder '" + options.folder +
                                 "': " + error.message());
    return Runner(plan, options).run();
}

std::vector<SweepOutcome> readSweepOutcomes(const SweepPlan& plan, const std::string& folder) {
    std::vector<SweepOutcome> outcomes;
    for (const SweepCase& one : plan.cases)
        outcomes.push_back(readOutcome(folder + "/" + one.folder, plan.calcInputs(one)));
    return outcomes;
}

}  // namespace model
}  // namespace simflex
