#pragma once
/** @file
All analyses of a model, one after the other, into one result file.

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
    /** Reads and builds the model, and finds out which analyses there are to do.
    @throws ModelError. **/
    ModelRun(const ModelText& text, ModelOptions::Bodies bodies, const RunOptions& options);
    ~ModelRun();

    /** How the model is assembled. **/
    struct Assembly {
        SimTK::State state;                  ///< realized to Stage::Velocity
        std::vector<std::string> moved;      ///< bodies, and how far from their places, in words
        std::vector<std::string> redundant;  ///< equations, in words
        std::vector<std::string> warnings;
        double largestError = 0;  ///< of a joint
    };
    /** Runs nothing. **/
    Assembly assemble();

    /** Who is told from now on. **/
    void setListener(const Listener& listener) { m_options.listener = listener; }

    /** Begins the result file, or goes on with it.
    @throws Cancelled when the listener asked for it, after everything was kept; std::runtime_error
    if something fails. **/
    void perform();

    /** Tables of the results beside them, if they are wanted. **/
    void writeTables() const;

    /** What could be done in part only, in words. @throws std::runtime_error if there is any. **/
    void refuseFailures() const;

    /** Whether a body is flexible and not held rigid. **/
    bool canBend() const;

    const std::string& getResultPath() const { return m_resultPath; }
    const ModelText& getText() const { return m_text; }
    const Model& getModel() const { return *m_model; }
    const Probes& getProbes() const { return m_probes; }
    /** Whether perform() has opened its file, which then has what was done even if it has thrown.
     * **/
    bool hasResults() const { return m_hasResults; }
    /** Whether an analysis is among those that are to be done. **/
    bool isWanted(const std::string& analysis) const;
    /** What was found besides results: "slider along x: nothing holds it". **/
    std::vector<std::string> getRemarks(const std::string& analysis) const;

private:
    friend class TransientRun;

    /** Says, and keeps with the analysis' results, what changes their meaning.
     * **/
    void warn(const std::string& analysis, const std::string& message);
    void warnOfKinks(const std::string& analysis, const std::vector<std::string>& leftOut);
    void warnOfUnevenDamping(const std::string& analysis, const SimTK::State& about);
    /** Of an equilibrium that an analysis begins at, what no analysis says that finds it. **/
    void warnOfStart(const std::string& analysis, const EquilibriumNotes& notes);
    /** Tells that an analysis of a rigid model has no meaning. **/
    void leaveOut(const std::string& analysis, const std::string& reason);
    bool isRigidTwin() const { return m_modelOptions.bodies == ModelOptions::Bodies::Rigid; }
    /** Warns of bodies and connectors out of their range: see RangeWarnings. **/
    void checkRanges(const std::string& analysis, const std::vector<SimTK::State>& states);

    /** An equilibrium that later analyses may begin at. **/
    struct Equilibrium {
        SimTK::State state;
        SimTK::Vector multipliers;
        int numIterations = 0;
        EquilibriumNotes notes;
        std::vector<StaticEquilibrium::PathPoint> path;
    };

    /** Tells where the work is. @throws Cancelled if it is to stop; between analyses and where they
    take long. **/
    void stopIfAsked() const;
    void beginWork(const std::string& name);
    void performAll();
    void checkWishes(const ModelValue& file) const;
    /** Before any analysis begins: inputs and outputs that there are not.
     * @throws ModelError. **/
    void checkPorts() const;
    void readEarlier();
    /** Drops what was read if it is out of date, and adds to what is wanted what that begins from.
     * **/
    void takeUpEarlier();
    void openResults();
    /** What is not as in an earlier run; empty if it was the same. **/
    std::string findChange(const ResultHeader& earlier) const;
    /** For pictures, where the model names no folder: MODEL.frames in the current one. **/
    std::string getUsualFolder() const;
    std::string getCheckpointPath() const { return makeCheckpointPath(m_resultPath); }
    bool isComplete(const std::string& analysis) const;

    const SimTK::State& getStart();
    /** Result files do not have what controllers remember.
    @throws std::runtime_error if an analysis begins at a State from there. **/
    void refuseForgottenControllers(const ModelValue& analysis) const;
    const Equilibrium& obtainEquilibrium(const ModelValue& analysis);
    void describePath(const std::string& name,
                      const std::vector<StaticEquilibrium::PathPoint>& path);
    /** Last State of a transient analysis. **/
    SimTK::State findEnd(const std::string& name) const;
    /** The State that a key such as `from` names: start (or placed), static, or an analysis above
    the one that asks. **/
    SimTK::State findNamedState(const ModelValue& name, const std::string& forAnalysis);

    /** Whether results keep States. **/
    bool keepsStates() const;
    bool drawsEquilibrium(const ModelValue& analysis) const;
    /** Whether it goes on from static equilibrium. **/
    bool beginsAtRest(const ModelValue& analysis) const;

    void runTransient(const ModelValue& analysis);
    void runStatic(const ModelValue& analysis);
    void runEigen(const ModelValue& analysis);
    void runCampbell(const ModelValue& analysis);
    void runLinear(const ModelValue& analysis);
    void runFrequencyResponse(const ModelValue& analysis);

    std::vector<ResultColumn> makeColumns() const;
    /** What FMUs have cost since the last call. **/
    FmuCost takeFmuCost();

    ModelText m_text;
    ModelOptions m_modelOptions;
    RunOptions m_options;
    std::vector<std::string> m_modelWarnings;  ///< told before there was a result file
    std::shared_ptr<const Model> m_model;
    Probes m_probes;
    std::string m_resultPath;
    bool m_hasResults = false;
    std::string m_work;  ///< what is being done, and how much of it
    double m_fraction = 0;
    std::unique_ptr<ResultWriter> m_writer;
    std::optional<Results> m_earlier;          ///< of the run that is gone on with
    std::vector<Results::Analysis> m_kept;     ///< earlier results that stay: others are wanted
    InputChecksums m_inputs, m_earlierInputs;  ///< of this run, and of those results
    std::string m_change;                      ///< since those results, which are out of date
    std::vector<std::string> m_outdated;       ///< their analyses
    std::optional<SimTK::State> m_start;
    EquilibriumNotes m_startNotes;
    std::map<std::string, Equilibrium> m_equilibria;
    std::map<std::string, SimTK::State> m_ends;                 ///< of transient analyses
    FmuCost m_fmuCost;                                          ///< that was taken
    std::vector<std::string> m_failures;                        ///< of parts of analyses
    std::map<std::string, std::vector<std::string>> m_remarks;  ///< by analysis, for the summary
};

}  // namespace model
}  // namespace simflex
