#pragma once
/** @file
A moving model: started, stepped, inspected, changed, saved and drawn.

    Session session(loadModelText("crank.yaml", {"parameters.speed=50"}));
    session.runTo(0.5, 1e-3);                          // probes recorded each millisecond
    const double angle = session.get("joints.bearing.angle")[0];
    const SavedState before = session.save();
    session.set("joints.bearing.angle_rate", {12});    // joints stay closed
    session.step(100);
    session.restore(before);
    session.change("parameters.speed", "60");          // the model is built again
    session.draw().writePng("crank.png");

Names are those of the prompt of `simflex shell`: `time`, `joints.NAME.angle`,
`bodies.NAME.position.x`, `bodies.NAME.modes.3`, their speeds, and the probes. SI units, angles in
radians. A Session is for one thread. **/

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "simflex/model/LinearSystem.h"
#include "simflex/model/Model.h"
#include "simflex/model/probes/Probe.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/solver/ImplicitIntegrator.h"

namespace simflex {
namespace model {
class MotionWarnings;
}  // namespace model

/** Values of all probes, row by row; above 100 000 rows every second one is dropped. **/
struct ProbeRecord {
    std::vector<double> time;
    std::vector<std::vector<double>> rows;  ///< probe after probe, column after column

    void add(double now, std::vector<double> values);
};

/** A value that a Session can return, and perhaps set. Refers to the Session. **/
struct Quantity {
    std::string path, unit;
    std::function<std::vector<double>()> get;
    /** Returns the State with new values, as many as get() returns; empty if it cannot be set. **/
    std::function<SimTK::State(const std::vector<double>& values)> calcStateWith;
};

/** Complete state of a Session, exact to the last bit. **/
struct SavedState {
    std::string model;   ///< text and settings of the moving model
    SimTK::State begun;  ///< State at the start of the integration
    std::string integrator;
    std::vector<double> warnings;
    double energyBefore = 0;
};

class Session {
public:
    enum class Outcome { ReachedTime, Terminated, Stopped };
    /** Called with the completed fraction; returning false stops the motion. **/
    using Progress = std::function<bool(double fraction)>;

    /** Reads and builds the model, and goes to its start. The listener also reports on the motion.
    @throws ModelError, and as findStart() and ImplicitIntegrator::initialize(). **/
    explicit Session(const ModelText& text, const ModelOptions& options = {});
    ~Session();
    Session(Session&&) noexcept;
    Session& operator=(Session&&) noexcept;

    const ModelText& getText() const { return m_text; }
    /** The current model; change() replaces it. **/
    const Model& getModel() const { return *m_model; }
    /** The file's title or name. **/
    std::string getTitle() const;
    const ImplicitIntegrator& getIntegrator() const { return *m_integrator; }
    /** Realized to Stage::Velocity. **/
    const SimTK::State& getState() const { return m_integrator->getState(); }
    double getTime() const { return m_integrator->getTime(); }
    /** Total energy [J], and its value at the State from which work is counted: the start or the
    last change. **/
    double calcEnergy() const;
    double getEnergyBefore() const { return m_energyBefore; }

    /** @name Motion
    These throw as the integrator does; the last good State remains. **/
    /**@{**/
    Outcome step(int numSteps = 1, const Progress& progress = {});
    /** @param interval  between rows of the record [s]
    @throws std::invalid_argument unless `time` is later than now and the interval positive. **/
    Outcome runTo(double time, double interval, const Progress& progress = {});
    /** Returns to the start and clears the record. **/
    void reset();
    struct Equilibrium {
        int numIterations = 0;
        std::vector<std::string> freeMotions;      ///< unconstrained motions, in words
        std::vector<std::string> unstableMotions;  ///< directions of instability, in words
        bool isByDampedMotion = false;             ///< see StaticEquilibrium
        std::string branch;                        ///< a warning or empty, see StaticEquilibrium
    };
    /** Goes to the nearby static equilibrium, at rest; the time does not change.
    @param goesOn  called every now and then
    @throws Cancelled if goesOn returns false, and as StaticEquilibrium::solve(). **/
    Equilibrium settle(const std::function<bool()>& goesOn = {});
    /**@}**/

    /** Linearises about the current State, an equilibrium or a steady motion.
    @param inputs  numbers of the model by path, "loads.push.force.y"
    @param outputs  probes, "tip" or "tip.y"; none: all
    @param goesOn  called every now and then
    @param form  of the states
    @throws Cancelled if goesOn returns false; std::runtime_error with the reason if it cannot be
    done. **/
    LinearSystem linearize(const std::vector<std::string>& inputs,
                           const std::vector<std::string>& outputs = {},
                           const std::function<bool()>& goesOn = {},
                           const ModalForm& form = {}) const;

    /** @name Quantities by name **/
    /**@{**/
    /** All names without probes and elements: "joints.pin.angle", "bodies.rod.modes". **/
    std::vector<std::string> listQuantities() const;
    /** Finds a quantity; empty if the name is unknown.
    @throws std::runtime_error if the path names a joint or body that does not exist. **/
    std::optional<Quantity> findQuantity(const std::string& path) const;
    /** Values of a quantity, a probe, or a number of the model ("parameters.speed").
    @throws std::runtime_error. **/
    std::vector<double> get(const std::string& path) const;
    /** Sets a quantity, then assembles joints and makes speeds consistent; a joint's coordinate or
    rate gets exactly the value.
    @throws std::runtime_error, and as setState(). **/
    void set(const std::string& path, const std::vector<double>& values);
    /** Inputs of the model by name: the current value and the rate at which it changes from now on,
    0 by default. The integration continues with its step size; with inputs, runTo() ends a step at
    its end time. set("NAME", {value}) does the same for one input, and set("NAME.rate", {rate})
    keeps the value.
    @throws std::runtime_error if there is no such input, or a number is not finite. **/
    struct Input {
        std::string name;
        double value, rate = 0;
    };
    void setInputs(const std::vector<Input>& inputs);

    /** Whether a model that is built again returns to its start. **/
    enum class Restart {
        IfNeeded,  ///< unless the change does not affect the motion: pictures, probes, solver …
        Never      ///< for inputs, such as the size of a load; bodies and joints must stay the same
    };
    /** Gives a key of the model another value (YAML) and builds the model again.
    @returns true if it is back at its start
    @throws as the constructor; the Session is then unchanged. **/
    bool change(const std::string& key, const std::string& value,
                Restart restart = Restart::IfNeeded);
    /**@}**/

    /** @name Probes **/
    /**@{**/
    const std::vector<model::Probe>& getProbes() const { return m_probes.getProbes(); }
    std::vector<double> calcProbe(const model::Probe& probe) const;
    /** Current value of a formula of probes, states and t: "tip.x/length".
    @throws std::invalid_argument if it is invalid. **/
    double calcFormula(const std::string& formula) const;
    const ProbeRecord& getRecord() const { return m_record; }
    /**@}**/

    /** @name The State as a whole **/
    /**@{**/
    /** A copy of the State that may be changed. Do not copy realized States: Simbody copies the
    cache entries of forces with their version numbers, which may match those of the copy after as
    many changes. **/
    SimTK::State copyState() const { return makeFresh(getState()); }
    /** Sets the State; joints are assembled and speeds made consistent.
    @throws std::invalid_argument for a State of another model, and as
    ImplicitIntegrator::initialize(); the State is then unchanged. **/
    void setState(const SimTK::State& state);
    /** After restore() the motion repeats that after save() bit by bit; the record ends at the
    saved time.
    @throws std::invalid_argument for another model, including this one before a change() that
    affects the motion; use setState() to take over that State. **/
    SavedState save() const;
    void restore(const SavedState& saved);
    /** Converts a SavedState to bytes and back, for another Session of the same model, also in
    another process.
    @throws std::runtime_error if the bytes are damaged or of another model. **/
    std::string pack(SavedState saved) const;
    SavedState unpack(const std::string& bytes) const;
    /** Writes time, coordinates, speeds and turns of angles to a file. restoreState() restores them
    exactly, restarts the integration with small steps, as setState() does, and drops later records.
    @throws std::runtime_error if the file cannot be written or read; std::invalid_argument naming
    file and line if it is damaged, or of another model or version. **/
    void keepState(const std::string& path) const;
    void restoreState(const std::string& path);
    /**@}**/

    /** @name Pictures **/
    /**@{**/
    /** States along the motion so far, evenly chosen, at most 64 and the current one. **/
    std::vector<SimTK::State> getPath() const;
    /** Makes a visualizer as the model's `pictures` say, fitted to the motion so far. Refers to the
    model. **/
    std::unique_ptr<OffscreenVisualizer> makeVisualizer() const;
    Image draw() const { return makeVisualizer()->drawFrame(getState()); }
    /**@}**/

private:
    SimTK::State makeFresh(const SimTK::State& state) const;
    std::string describeWhatMoves() const;
    enum class Joints { ToBeClosed, Closed };
    void start(const SimTK::State& state, Joints joints = Joints::ToBeClosed);
    /** Ends steps at this time if the model has inputs, since they may change there. **/
    void endStepsAt(double time);
    void goOnFrom(const Session& other);
    void forgetFrom(double time);
    void recordRow();

    ModelText m_text;
    ModelOptions m_options;
    std::shared_ptr<const Model> m_model;
    model::Probes m_probes;
    SimTK::State m_start, m_begun;
    std::unique_ptr<model::MotionWarnings> m_warnings;
    std::unique_ptr<ImplicitIntegrator> m_integrator;
    ProbeRecord m_record;
    double m_energyBefore = 0;
    std::vector<SimTK::State> m_path;
    int m_pathStride = 1, m_pathCount = 0;
    SimTK::Vector m_uDot, m_multipliers;
};

}  // namespace simflex
