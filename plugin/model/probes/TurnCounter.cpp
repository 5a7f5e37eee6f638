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

constexpr size_t NumbersPerAngle = 3;

}  // namespace

TurnCounter::TurnCounter(const Model& model) : m_model(model) {
    for (const Model::JointEntry& entry : model.getJoints())
        for (int k = 0; k < entry.joint.getNumCoordinates(); ++k) {
            if (!entry.joint.getEquations().getCoordinate(k).isPeriodic()) continue;
            Angle angle;
            angle.joint = entry.joint.getIndex();
            angle.coordinate = k;
            angle.start = findStartValue(model.getFile(), entry.name, k);
            m_angles.push_back(angle);
        }
}

void TurnCounter::reset() {
    m_time = SimTK::NaN;
}

/** Value within half a turn, and rate. **/
Vec2 TurnCounter::calcAngle(const Angle& angle, const State& state) const {
    const Joint& joint = m_model.getFlexibleBodies().getJoint(angle.joint);
    return {joint.calcCoordinates(state)[angle.coordinate],
            joint.calcCoordinateDots(state)[angle.coordinate]};
}

void TurnCounter::update(const State& state) {
    const double step = state.getTime() - m_time;
    for (Angle& angle : m_angles) {
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
    m_time = state.getTime();
}

void TurnCounter::follow(const State& state) {
    if (std::isnan(m_time)) return update(state);
    m_time = state.getTime();
    for (Angle& angle : m_angles) angle.rate = 0;
    update(state);
}

void TurnCounter::setTurned(JointIndex joint, int coordinate, double value) {
    for (Angle& angle : m_angles)
        if (angle.joint == joint && angle.coordinate == coordinate)
            angle.turned = 2 * Pi * std::round((value - angle.value) / (2 * Pi));
}

double TurnCounter::getTurned(JointIndex joint, int coordinate) const {
    for (const Angle& angle : m_angles)
        if (angle.joint == joint && angle.coordinate == coordinate) return angle.turned;
    return 0;
}

std::vector<double> TurnCounter::save() const {
    std::vector<double> saved{m_time};
    for (const Angle& angle : m_angles)
        saved.insert(saved.end(), {angle.value, angle.rate, angle.turned});
    return saved;
}

void TurnCounter::restore(const std::vector<double>& saved) {
    if (saved.size() != 1 + NumbersPerAngle * m_angles.size())
        throw std::invalid_argument("TurnCounter::restore(): " + std::to_string(saved.size()) +
                                    " numbers for " + std::to_string(m_angles.size()) + " angles");
    reset();
    m_time = saved[0];
    const double* next = saved.data() + 1;
    for (Angle& angle : m_angles) {
        angle.value = next[0];
        angle.rate = next[1];
        angle.turned = next[2];
        next += NumbersPerAngle;
    }
}

}  // namespace model
}  // namespace simflex
