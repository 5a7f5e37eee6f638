#pragma once
/** @file
States that hold their values until something happens: samples of a signal, taken every period, and
relays between two thresholds. What they wait for is in the State: runs go on from checkpoints as if
they had not stopped. **/

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

/** Given from outside, with its rate, another state: it changes linearly between two settings.
Errors of it are none. **/
class InputState : public SignalState {
public:
    InputState(const std::string& name, SimTK::Real start) : SignalState(name, start, 1e30) {}
    bool followsMotion() const override { return true; }
};

/** value = input at t = k·period; k is a state, too. **/
struct Sampling {
    int value, number;  ///< of states
    double period;
    Signal input;
};
/** Number of the last sample at `time` or before. **/
double countSamples(double time, double period);

/** All samples of one time are of what was before it, those of system.controllers among them. **/
void addSamplings(const std::vector<Sampling>& samplings, ModelSystem& system);

/** value = 1 from where the input exceeds `upper` until it falls below `lower`, else 0. **/
struct Relay {
    std::string name;
    int value;
    double lower, upper;
    Signal input;
};
void addRelay(const Relay& relay, ModelSystem& system);

}  // namespace model
}  // namespace simflex
