#pragma once
/** @file
A motion as it is needed to draw it: time and continuous variables only, a few kilobytes a State.

@code
    simflex::MotionRecorder motion(system);
    // ... now and then in a simulation
    motion.record(state);
    // ... afterwards: camera, range and factor of the whole motion, and its frames
    viz.fitToMotion(motion);
    viz.reportAll(motion);
@endcode
Discrete variables are taken to be those of the first State recorded. **/

#include <vector>

#include "Simbody.h"

namespace simflex {

class MotionRecorder {
public:
    explicit MotionRecorder(const SimTK::System& recordedSystem) : system(&recordedSystem) {}

    /** Keeps t, q, u, z, what joints hold, and how far the State has been realized.
    @throws std::invalid_argument when their number differs from that of the first State. **/
    void record(const SimTK::State& state);
    void clear();

    int getNumStates() const { return int(records.size()); }
    double getTime(int i) const { return records.at(std::size_t(i)).time; }

    /** The State as it was recorded, realized as far. It changes with the next call.
    @throws std::out_of_range. **/
    const SimTK::State& getState(int i) const;

private:
    struct Record {
        double time;
        SimTK::Stage stage;
        std::vector<double> variables;  // q, u, z
        SimTK::Vector holding;          // FlexibleBodySubsystem::getHolding(), if there is one
    };

    const SimTK::System* system;
    std::vector<Record> records;
    mutable SimTK::State state;
};

}  // namespace simflex
