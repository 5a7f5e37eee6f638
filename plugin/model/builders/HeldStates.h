#pragma once
/** @file
States that hold their values until something happens: samples of a signal, taken every period, and
relays between two thresholds. What they wait for is in the State: runs go on from checkpoints as if
they had not stopped. **/

#include <functional>
#include <vector>

#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

/** Makes a change at one time, and then what it sets off: events and relays that did not hold
before it and do now; what makes the change may be set off again, whatever held. @throws
std::runtime_error if that has no end. **/
void changeWithTriggers(const ModelSystem& system, SimTK::State& state, bool& shouldTerminate,
                        const std::function<void()>& change,
                        const SimTK::TriggeredEventHandler* own = nullptr);

class HeldState : public SignalState {
public:
    using SignalState::SignalState;
    bool isHeld() const override { return true; }
};

/** value = input at t = k·period; k is a state, too. **/
struct Sampling {
    int value, number;  ///< of states
    double period;
    Signal input;
};
/** Number of the last sample at `time` or before. **/
double countSamples(double time, double period);

/** All samples of one time are of what was before it. **/
void addSamplings(const std::vector<Sampling>& samplings, ModelSystem& system);

/** value = 1 from where the input exceeds `upper` until it falls below `lower`, else 0. **/
struct Relay {
    int value;
    double lower, upper;
    Signal input;
};
void addRelay(const Relay& relay, ModelSystem& system);

}  // namespace model
}  // namespace simflex
