#pragma once
/** @file
Runs ccx on a clean deck and reads the matrices it stores. Internal to fe. **/

#include <filesystem>
#include <string>
#include <vector>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/Progress.h"
#include "simflex/base/TemporaryFolder.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** The ccx program to run: `program`, else $SIMFLEX_CCX, else "ccx". **/
std::string chooseCalculixProgram(const std::string& program);

/** "CalculiX 2.20" as the program says itself, or "CalculiX" if it does not say.
@throws std::runtime_error if it cannot be run. **/
std::string readCalculixVersion(const std::string& program);

/** `program JOB` in `folder` on one thread, so that the same deck gives the same bits. Ended if it
still runs when this goes. **/
class CalculixProcess {
public:
    /** @throws std::runtime_error if it cannot be started. **/
    void start(const std::string& program, const std::filesystem::path& folder,
               const std::string& job);
    /** True once it has ended. **/
    bool poll() { return m_process.hasEnded(); }
    /** @throws std::runtime_error with ccx's own *ERROR text, or the end of its output, if it
    failed; if the disk is full. @pre poll(). **/
    void checkResult() const;

private:
    std::string m_program;
    std::filesystem::path m_log;
    ChildProcess m_process;
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
