#pragma once
/** @file
The model at the prompt: where it is in its motion, and what its probes have seen so far. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "simflex/model/analyses/MotionWarnings.h"
#include "simflex/model/analyses/Session.h"
#include "simflex/model/file/ModelReader.h"
#include "simflex/model/probes/Probe.h"
#include "simflex/model/probes/TurnCounter.h"

namespace simflex {
namespace cli {

using namespace model;

/** Values of all probes, row by row; every second row goes when there are more than 100 000. **/
struct ProbeRecord {
    std::vector<double> time;
    std::vector<std::vector<double>> rows;

    void add(double now, std::vector<double> values);
};

class ShellModel {
public:
    enum class Outcome { ReachedTime, Terminated, Interrupted };

    /** Reads and builds the model, and goes to its start; the listener is told of the motion, too.
    @throws ModelError and what findStart()
    and ImplicitIntegrator::initialize() throw. **/
    ShellModel(const ModelText& text, const ModelOptions& options);

    const ModelText& getText() const { return _text; }
    const Model& getModel() const { return *_model; }
    /** The file's title, or its name. **/
    std::string getTitle() const;
    const std::vector<Probe>& getProbes() const { return _probes.getProbes(); }
    const ProbeRecord& getRecord() const { return _record; }
    const ImplicitIntegrator& getIntegrator() const { return *_integrator; }

    /** Realized to Stage::Velocity. **/
    const SimTK::State& getState() const { return _integrator->getState(); }
    double getTime() const { return _integrator->getTime(); }
    /** One like it to be changed. Copies of realized States will not do: Simbody copies what forces
    have cached together with its version numbers, which may be those of the copy once it has been
    changed as often. **/
    SimTK::State copyState() const { return makeFresh(getState()); }
    /** What probes want to know; refers to this model. **/
    Moment makeMoment() const;

    /** Total energy, and that of the state from which work is counted: start, or last change. **/
    double calcEnergy() const;
    double getEnergyBefore() const { return _energyBefore; }

    /** Back to the start; the record begins anew. **/
    void reset();
    /** Takes a State over; joints are assembled and speeds made consistent. @throws as
    ImplicitIntegrator::initialize() does; the State stays what it was then. **/
    void setState(const SimTK::State& state);

    /** Goes where another model of the same bodies and joints has come to, and takes over what was
    recorded if the probes are the same. **/
    void continueFrom(const ShellModel& other);

    /** Writes time, coordinates and speeds to a file, which restoreState() reads: it goes on from
    there as after setState(), and forgets what was recorded later.
    @throws std::runtime_error naming the file: of another model, damaged, of a newer version. **/
    void keepState(const std::string& path) const;
    void restoreState(const std::string& path);

    /** @name Motion
    Throw what the integrator throws; the last good State stays. **/
    /**@{**/
    /** @param progress  told the fraction that is done; false stops the motion
    @param interval  between rows of the record [s] **/
    Outcome step(int numSteps, const std::function<bool(double)>& progress);
    Outcome runTo(double time, double interval, const std::function<bool(double)>& progress);
    /**@}**/

    /** States that the motion went through, at most 64, evenly chosen; for pictures. **/
    std::vector<SimTK::State> getPath() const;

private:
    SimTK::State makeFresh(const SimTK::State& state) const;
    void start(const SimTK::State& state);
    void recordRow();

    ModelText _text;
    std::shared_ptr<const Model> _model;
    Probes _probes;
    SimTK::State _start;
    TurnCounter _turns;
    std::function<void(const std::string&)> _warn;
    std::unique_ptr<MotionWarnings> _warnings;
    std::unique_ptr<ImplicitIntegrator> _integrator;
    ProbeRecord _record;
    double _energyBefore = 0;
    std::vector<SimTK::State> _path;
    int _pathStride = 1, _pathCount = 0;
    SimTK::Vector _uDot, _multipliers;
};

}  // namespace cli
}  // namespace simflex
