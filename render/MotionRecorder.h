#pragma once
/** @file
Records a motion for drawing: time and continuous variables only, a few kilobytes per State.

@code
    simflex::MotionRecorder motion(system);
    // ... now and then in a simulation
    motion.record(state);
    // ... afterwards: camera, range and factor of the whole motion, and its frames
    viz.fitToMotion(motion);
    viz.reportAll(motion);
@endcode

Discrete variables are assumed to be those of the first State recorded. **/

#include <vector>

#include "Simbody.h"

namespace simflex {

class MotionRecorder {
public:
    explicit MotionRecorder(const SimTK::System& recordedSystem) : system(&recordedSystem) {}

    /** Records t, q, u, z, the locks of joints, and the realized stage of a State.
    @throws std::invalid_argument if the number of variables differs from that of the first
    State. **/
    void record(const SimTK::State& state);
    void clear();

    int getNumStates() const { return int(records.size()); }
    double getTime(int i) const { return records.at(std::size_t(i)).time; }

    /** Returns a recorded State, realized to the same stage. The next call changes it.
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
