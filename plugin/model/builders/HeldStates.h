#pragma once
/** @file
States that hold their values between events: samples of a signal at a fixed period, and relays
between two thresholds. Their progress is stored in the State, so runs continue from checkpoints as
if never stopped. **/

#include <string>
#include <vector>

#include "simflex/model/builders/Controllers.h"
#include "simflex/model/builders/ModelSystem.h"

namespace simflex {
namespace model {

class HeldState : public SignalState {
public:
    using SignalState::SignalState;
    bool isHeld() const override { return true; }
};

/** An input from outside, whose rate is another state: it changes linearly between two settings.
Exempt from error control. **/
class InputState : public SignalState {
public:
    InputState(const std::string& name, SimTK::Real start) : SignalState(name, start, 1e30) {}
    bool followsMotion() const override { return true; }
};

/** value = input at t = k·period; k is a state as well. **/
struct Sampling {
    int value, number;  ///< of states
    double period;
    Signal input;
};
/** Number of the last sample at `time` or before. **/
double countSamples(double time, double period);

/** All samples at one time, with those of system.controllers, use the values before it. **/
void addSamplings(const std::vector<Sampling>& samplings, ModelSystem& system);

/** value = 1 from when the input exceeds `upper` until it falls below `lower`, else 0. **/
struct Relay {
    std::string name;
    int value;
    double lower, upper;
    Signal input;
};
void addRelay(const Relay& relay, ModelSystem& system);

}  // namespace model
}  // namespace simflex
