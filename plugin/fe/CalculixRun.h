#pragma once
/** @file
Runs ccx on a clean deck and reads the matrices it stores. Internal to fe. **/

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"
#include "simflex/fe/Progress.h"

namespace simflex {

/** A folder of its own under $TMPDIR (else /tmp), removed with everything in it at the end. **/
class TemporaryFolder {
public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return _path; }

private:
    std::filesystem::path _path;
};

/** The ccx program to run: `program`, else $SIMFLEX_CCX, else "ccx". **/
std::string chooseCalculixProgram(const std::string& program);

/** "CalculiX 2.20" as the program says itself, or "CalculiX" if it does not say.
@throws std::runtime_error if it cannot be run. **/
std::string readCalculixVersion(const std::string& program);

/** `program JOB` in `folder` on one thread, so that the same deck gives the same bits. Ended if it
still runs when this goes. **/
class CalculixProcess {
public:
    CalculixProcess() = default;
    ~CalculixProcess();
    CalculixProcess(const CalculixProcess&) = delete;
    CalculixProcess& operator=(const CalculixProcess&) = delete;

    /** @throws std::runtime_error if it cannot be started. **/
    void start(const std::string& program, const std::filesystem::path& folder,
               const std::string& job);
    /** True once it has ended. **/
    bool poll();
    /** @throws std::runtime_error with ccx's own *ERROR text, or the end of its output, if it
    failed. @pre poll(). **/
    void checkResult() const;

private:
    std::string _program;
    std::filesystem::path _log;
    pid_t _pid = -1;
    int _status = 0;
};

/** Runs `program JOB` in `folder` as a CalculixProcess, to its end.
@throws std::runtime_error with ccx's own *ERROR text if it failed. @throws Cancelled. **/
void runCalculix(const std::string& program, const std::filesystem::path& folder,
                 const std::string& job, const ProgressCallback& progress);

/** Reads JOB.sti, JOB.mas and JOB.dof into model.K and model.m; model.mesh must be set.
@param expected  of each node: true if its degrees of freedom must be there
@throws std::runtime_error for a missing or broken file.
@throws std::invalid_argument if a degree of freedom is missing or M is not m ⊗ 1₃. **/
void readCalculixMatrices(const std::filesystem::path& folder, const std::string& job,
                          const std::vector<char>& expected, FeModel& model,
                          const ProgressCallback& progress);

}  // namespace simflex
