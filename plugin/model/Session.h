#pragma once
/** @file
A model that moves: started, stepped, looked at, changed, kept and drawn.

    Session session(loadModelText("crank.yaml", {"parameters.speed=50"}));
    session.runTo(0.5, 1e-3);                          // probes recorded each millisecond
    const double angle = session.get("joints.bearing.angle")[0];
    const SavedState before = session.save();
    session.set("joints.bearing.angle_rate", {12});    // joints stay closed
    session.step(100);
    session.restore(before);
    session.change("parameters.speed", "60");          // the model is built anew
    session.draw().writePng("crank.png");

What has a name is what the prompt of `simflex shell` knows by it: `time`, `joints.NAME.angle`,
`bodies.NAME.position.x`, `bodies.NAME.modes.3` and their speeds, and the probes. SI units, angles
in radians. A Session is for one thread. **/

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

/** Values of all probes, row by row; every second row goes when there are more than 100 000. **/
struct ProbeRecord {
    std::vector<double> time;
    std::vector<std::vector<double>> rows;  ///< probe after probe, column after column

    void add(double now, std::vector<double> values);
};

/** Something that a Session can tell, and perhaps set. Refers to the Session. **/
struct Quantity {
    std::string path, unit;
    std::function<std::vector<double>()> get;
    /** The State with new values, as many as get() gives; empty: cannot be set. **/
    std::function<SimTK::State(const std::vector<double>& values)> calcStateWith;
};

/** Where a Session was, to the last bit. **/
struct SavedState {
    std::string model;   ///< text and settings of what moved
    SimTK::State begun;  ///< where the integration began
    std::string integrator;
    std::vector<double> warnings;
    double energyBefore = 0;
};

class Session {
public:
    enum class Outcome { ReachedTime, Terminated, Stopped };
    /** Told the fraction that is done; false stops the motion. **/
    using Progress = std::function<bool(double fraction)>;

    /** Reads and builds the model, and goes to its start. The listener is told of the motion, too.
    @throws ModelError and what findStart() and ImplicitIntegrator::initialize() throw. **/
    explicit Session(const ModelText& text, const ModelOptions& options = {});
    ~Session();
    Session(Session&&) noexcept;
    Session& operator=(Session&&) noexcept;

    const ModelText& getText() const { return m_text; }
    /** As it is built now: change() makes another. **/
    const Model& getModel() const { return *m_model; }
    /** The file's title, or its name. **/
    std::string getTitle() const;
    const ImplicitIntegrator& getIntegrator() const { return *m_integrator; }
    /** Realized to Stage::Velocity. **/
    const SimTK::State& getState() const { return m_integrator->getState(); }
    double getTime() const { return m_integrator->getTime(); }
    /** Total energy [J], and that of the State from which work is counted: start, or last change.
     * **/
    double calcEnergy() const;
    double getEnergyBefore() const { return m_energyBefore; }

    /** @name Motion
    Throw what the integrator throws; the last good State stays. **/
    /**@{**/
    Outcome step(int numSteps = 1, const Progress& progress = {});
    /** @param interval  between rows of the record [s] **/
    Outcome runTo(double time, double interval, const Progress& progress = {});
    /** Back to the start; the record begins anew. **/
    void reset();
    struct Equilibrium {
        int numIterations = 0;
        std::vector<std::string> freeMotions;      ///< that nothing holds, in words
        std::vector<std::string> unstableMotions;  ///< in which it falls away, in words
        bool isByDampedMotion = false;             ///< see StaticEquilibrium
        std::string branch;                        ///< what there is to warn of, see the same
    };
    /** Goes to the static equilibrium near by, at rest; the time stays.
    @param goesOn  asked every now and then
    @throws Cancelled if that is false, and as StaticEquilibrium::solve(). **/
    Equilibrium settle(const std::function<bool()>& goesOn = {});
    /**@}**/

    /** About the State as it is, an equilibrium or a steady motion: A, B, C, D.
    @param inputs  numbers of the model by path, "loads.push.force.y"
    @param outputs  probes, "tip" or "tip.y"; none: all
    @param goesOn  asked every now and then
    @param form  of the states
    @throws Cancelled if that is false; std::runtime_error that says why it cannot be. **/
    LinearSystem linearize(const std::vector<std::string>& inputs,
                           const std::vector<std::string>& outputs = {},
                           const std::function<bool()>& goesOn = {},
                           const ModalForm& form = {}) const;

    /** @name Quantities by name **/
    /**@{**/
    /** All of them, without probes and elements: "joints.pin.angle", "bodies.rod.modes". **/
    std::vector<std::string> listQuantities() const;
    /** Nothing if no quantity is called so. @throws std::runtime_error if the path names a joint or
    body that there is not. **/
    std::optional<Quantity> findQuantity(const std::string& path) const;
    /** Of a quantity, a probe, or a number of the model ("parameters.speed").
    @throws std::runtime_error. **/
    std::vector<double> get(const std::string& path) const;
    /** Joints are assembled and speeds made consistent afterwards; a joint's coordinate and its
    rate get exactly the value. @throws std::runtime_error, and as setState(). **/
    void set(const std::string& path, const std::vector<double>& values);
    /** Inputs of the model by name, from now on: the value now, and its rate, with which it goes on
    from there, 0 unless told. What moves goes on with the steps it had; runTo() ends a step at its
    end where there are inputs. set("NAME", {value}) is the same of one, and set("NAME.rate",
    {rate}) leaves the value. @throws std::runtime_error if there is none of that name, or for what
    is not finite. **/
    struct Input {
        std::string name;
        double value, rate = 0;
    };
    void setInputs(const std::vector<Input>& inputs);

    /** Whether a model that is built anew begins at its start. **/
    enum class Restart {
        IfNeeded,  ///< unless what has changed moves nothing: pictures, probes, solver …
        Never      ///< for inputs, such as the size of a load; bodies and joints must be the same
    };
    /** Gives a key of the model another value (YAML) and builds it anew.
    @returns whether it is back at its start
    @throws as the constructor; the Session stays as it was. **/
    bool change(const std::string& key, const std::string& value,
                Restart restart = Restart::IfNeeded);
    /**@}**/

    /** @name Probes **/
    /**@{**/
    const std::vector<model::Probe>& getProbes() const { return m_probes.getProbes(); }
    std::vector<double> calcProbe(const model::Probe& probe) const;
    /** A formula of probes, states and t as they are now: "tip.x/length".
    @throws std::invalid_argument if it is none. **/
    double calcFormula(const std::string& formula) const;
    const ProbeRecord& getRecord() const { return m_record; }
    /**@}**/

    /** @name The State as a whole **/
    /**@{**/
    /** One like it to be changed. Copies of realized States will not do: Simbody copies what forces
    have cached together with its version numbers, which may be those of the copy once it has been
    changed as often. **/
    SimTK::State copyState() const { return makeFresh(getState()); }
    /** Takes a State over; joints are assembled and speeds made consistent.
    @throws std::invalid_argument for a State of another model, and as
    ImplicitIntegrator::initialize(); the State stays what it was then. **/
    void setState(const SimTK::State& state);
    /** What goes on from restore() has the bits of what went on from save(); the record ends there.
    @throws std::invalid_argument for another model, be it this one before a change() of what moves:
    setState() takes its State over. **/
    SavedState save() const;
    void restore(const SavedState& saved);
    /** What save() gave as bytes, and back: for another Session of the same model, in another
    process, too. @throws std::runtime_error if they are damaged or of another model. **/
    std::string pack(SavedState saved) const;
    SavedState unpack(const std::string& bytes) const;
    /** Writes time, coordinates, speeds and turns of angles to a file, which restoreState() brings
    back as they were: it goes on from there with small steps, as after setState(), and forgets
    what was recorded later.
    @throws std::runtime_error if the file cannot be written or read; std::invalid_argument that
    names file and line if it is damaged, of another model or version. **/
    void keepState(const std::string& path) const;
    void restoreState(const std::string& path);
    /**@}**/

    /** @name Pictures **/
    /**@{**/
    /** States that the motion went through, at most 64, evenly chosen. **/
    std::vector<SimTK::State> getPath() const;
    /** Draws as the model's `pictures` say, fitted to the motion so far. Refers to the model. **/
    std::unique_ptr<OffscreenVisualizer> makeVisualizer() const;
    Image draw() const { return makeVisualizer()->drawFrame(getState()); }
    /**@}**/

private:
    SimTK::State makeFresh(const SimTK::State& state) const;
    std::string describeWhatMoves() const;
    enum class Joints { ToBeClosed, Closed };
    void start(const SimTK::State& state, Joints joints = Joints::ToBeClosed);
    /** Where inputs may change. **/
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
