#include "simflex/model/probes/TurnCounter.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/body/JointEquations.h"
#include "simflex/model/builders/InitialValues.h"

namespace simflex {
namespace model {

using SimTK::Pi;
using SimTK::State;
using SimTK::Vec2;

namespace {

constexpr size_t kNumbersPerAngle = 3;

}  // namespace

TurnCounter::TurnCounter(const Model& model) : _model(model) {
    for (const Model::JointEntry& entry : model.getJoints())
        for (int k = 0; k < entry.joint.getNumCoordinates(); ++k) {
            if (!entry.joint.getEquations().getCoordinate(k).isPeriodic()) continue;
            Angle angle;
            angle.joint = entry.joint.getIndex();
            angle.coordinate = k;
            angle.start = findStartValue(model.getFile(), entry.name, k);
            _angles.push_back(angle);
        }
}

void TurnCounter::reset() {
    _time = SimTK::NaN;
}

/** Value within half a turn, and rate. **/
Vec2 TurnCounter::calcAngle(const Angle& angle, const State& state) const {
    const Joint& joint = _model.getFlexibleBodies().getJoint(angle.joint);
    return {joint.calcCoordinates(state)[angle.coordinate],
            joint.calcCoordinateDots(state)[angle.coordinate]};
}

void TurnCounter::update(const State& state) {
    const double step = state.getTime() - _time;
    for (Angle& angle : _angles) {
        const Vec2 now = calcAngle(angle, state);
        if (std::isnan(step)) {
            angle.turned = 2 * Pi * std::round((angle.start - now[0]) / (2 * Pi));
        } else {
            const double expected = angle.value + angle.turned + 0.5 * step * (angle.rate + now[1]);
            const double turns = std::round((expected - now[0]) / (2 * Pi));
            if (std::isfinite(turns)) angle.turned = turns * 2 * Pi;
        }
        angle.value = now[0];
        angle.rate = now[1];
    }
    _time = state.getTime();
}

double TurnCounter::getTurned(JointIndex joint, int coordinate) const {
    for (const Angle& angle : _angles)
        if (angle.joint == joint && angle.coordinate == coordinate) return angle.turned;
    return 0;
}

std::vector<double> TurnCounter::save() const {
    std::vector<double> saved{_time};
    for (const Angle& angle : _angles)
        saved.insert(saved.end(), {angle.value, angle.rate, angle.turned});
    return saved;
}

void TurnCounter::restore(const std::vector<double>& saved) {
    if (saved.size() != 1 + kNumbersPerAngle * _angles.size())
        throw std::invalid_argument("TurnCounter::restore(): " + std::to_string(saved.size()) +
                                    " numbers for " + std::to_string(_angles.size()) + " angles");
    reset();
    _time = saved[0];
    const double* next = saved.data() + 1;
    for (Angle& angle : _angles) {
        angle.value = next[0];
        angle.rate = next[1];
        angle.turned = next[2];
        next += kNumbersPerAngle;
    }
}

}  // namespace model
}  // namespace simflex
