#pragma once
/** @file
Runs all analyses of a model in sequence, into one result file.

    ModelRun run(loadModelText("crank.yaml"), ModelOptions::Bodies::AsGiven, options);
    run.perform();
    const Results results = readResults(run.getResultPath());  **/

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/fmi/FmuCost.h"
#include "simflex/model/RunOptions.h"
#include "simflex/model/analyses/Beginning.h"
#include "simflex/model/analyses/Provenance.h"
#include "simflex/model/analyses/RunCheckpoint.h"
#include "simflex/model/file/ModelReader.h"
#include "simflex/model/probes/Probe.h"
#include "simflex/model/results/ResultWriter.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex {
namespace model {

class ModelRun {
public:
    /** Reads and builds the model, and finds the analyses to run.
    @throws ModelError. **/
    ModelRun(const ModelText& text, ModelOptions::Bodies bodies, const RunOptions& options);
    ~ModelRun();

    /** Result of assembling the model. **/
    struct Assembly {
        SimTK::State state;              ///< realized to Stage::Velocity
        std::vector<std::string> moved;  ///< bodies and their distances from their places, in words
        std::vector<std::string> redundant;  ///< redundant equations, in words
        std::vector<std::string> warnings;
        double largestError = 0;  ///< largest error of a joint
    };
    /** Runs no analysis. **/
    Assembly assemble();

    void setListener(const Listener& listener) { m_options.listener = listener; }

    /** Starts the result file, or continues it.
    @throws Cancelled if the listener stops the run, after everything was saved; std::runtime_error
    if something fails. **/
    void perform();

    /** Writes CSV tables beside the results if requested. **/
    void writeTables() const;

    /** @throws std::runtime_error naming everything that could only be done in part, if there is
    any. **/
    void refuseFailures() const;

    /** True if a body is flexible and not held rigid. **/
    bool canBend() const;

    const std::string& getResultPath() const { return m_resultPath; }
    const ModelText& getText() const { return m_text; }
    const Model& getModel() const { return *m_model; }
    const Probes& getProbes() const { return m_probes; }
    /** True if perform() has opened its file. The file then has all completed results, even after
    an exception. **/
    bool hasResults() const { return m_hasResults; }
    bool isWanted(const std::string& analysis) const;
    /** Findings apart from results: "slider along x: nothing holds it". **/
    std::vector<std::string> getRemarks(const std::string& analysis) const;

private:
    friend class TransientRun;

    /** Reports a warning on an analysis and saves it with the results. **/
    void warn(const std::string& analysis, const std::string& message);
    void warnOfKinks(const std::string& analysis, const std::vector<std::string>& leftOut);
    void warnOfUnevenDamping(const std::string& analysis, const SimTK::State& about);
    /** Gives the warnings of the equilibrium at which an analysis starts. **/
    void warnOfStart(const std::string& analysis, const EquilibriumNotes& notes);
    /** Reports that an analysis is skipped as meaningless for a rigid model. **/
    void leaveOut(const std::string& analysis, const std::string& reason);
    bool isRigidTwin() const { return m_modelOptions.bodies == ModelOptions::Bodies::Rigid; }
    /** Warns of bodies and connectors outside their valid range: see RangeWarnings. **/
    void checkRanges(const std::string& analysis, const std::vector<SimTK::State>& states);

    /** An equilibrium at which later analyses may start. **/
    struct Equilibrium {
        SimTK::State state;
        SimTK::Vector multipliers;
        int numIterations = 0;
        EquilibriumNotes notes;
        std::vector<StaticEquilibrium::PathPoint> path;
    };

    /** Reports progress; called between analyses and within long ones.
    @throws Cancelled if the listener asks to stop. **/
    void stopIfAsked() const;
    void beginWork(const std::string& name);
    void performAll();
    void checkWishes(const ModelValue& file) const;
    /** Checks, before any analysis starts, that all inputs and outputs exist.
    @throws ModelError. **/
    void checkPorts() const;
    void readEarlier();
    /** Drops earlier results if they are out of date, and adds analyses that the wanted ones start
    from. **/
    void takeUpEarlier();
    void openResults();
    /** First difference from the model of an earlier run; empty if none. **/
    std::string findChange(const ResultHeader& earlier) const;
    /** Default folder of pictures: MODEL.frames in the current folder. **/
    std::string getUsualFolder() const;
    std::string getCheckpointPath() const { return makeCheckpointPath(m_resultPath); }
    bool isComplete(const std::string& analysis) const;

    const SimTK::State& getStart();
    /** @throws std::runtime_error if an analysis starts at a State from a result file, which lacks
    the memories of controllers. **/
    void refuseForgottenControllers(const ModelValue& analysis) const;
    const Equilibrium& obtainEquilibrium(const ModelValue& analysis);
    void describePath(const std::string& name,
                      const std::vector<StaticEquilibrium::PathPoint>& path);
    /** The last State of a transient analysis. **/
    SimTK::State findEnd(const std::string& name) const;
    /** The State named by a key such as `from`: start (or placed), static, or an analysis above
    this one. **/
    SimTK::State findNamedState(const ModelValue& name, const std::string& forAnalysis);

    bool keepsStates() const;
    bool drawsEquilibrium(const ModelValue& analysis) const;
    /** True if the analysis starts at static equilibrium. **/
    bool beginsAtRest(const ModelValue& analysis) const;

    void runTransient(const ModelValue& analysis);
    void runStatic(const ModelValue& analysis);
    void runEigen(const ModelValue& analysis);
    void runCampbell(const ModelValue& analysis);
    void runLinear(const ModelValue& analysis);
    void runFrequencyResponse(const ModelValue& analysis);

    std::vector<ResultColumn> makeColumns() const;
    /** Cost of FMUs since the last call. **/
    FmuCost takeFmuCost();

    ModelText m_text;
    ModelOptions m_modelOptions;
    RunOptions m_options;
    std::vector<std::string> m_modelWarnings;  ///< given before the result file existed
    std::shared_ptr<const Model> m_model;
    Probes m_probes;
    std::string m_resultPath;
    bool m_hasResults = false;
    std::string m_work;  ///< the current work, with its completed fraction below
    double m_fraction = 0;
    std::unique_ptr<ResultWriter> m_writer;
    std::optional<Results> m_earlier;          ///< of the run that is continued
    std::vector<Results::Analysis> m_kept;     ///< earlier results to keep
                                               ///< analyses are wanted
    InputChecksums m_inputs, m_earlierInputs;  ///< of this run, and of the earlier results
    std::string m_change;                      ///< why the earlier results are out of date
    std::vector<std::string> m_outdated;       ///< the outdated analyses
    std::optional<SimTK::State> m_start;
    EquilibriumNotes m_startNotes;
    std::map<std::string, Equilibrium> m_equilibria;
    std::map<std::string, SimTK::State> m_ends;  ///< last States of transient analyses
    FmuCost m_fmuCost;                           ///< already accounted for
    std::vector<std::string> m_failures;         ///< partial failures of analyses
    std::map<std::string, std::vector<std::string>> m_remarks;  ///< by analysis, for the summary
};

}  // namespace model
}  // namespace simflex
