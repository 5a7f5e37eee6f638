#pragma once
/** @file
Whole turns of an angle (private header). Frames determine an angle only modulo a turn, so a state z
of the subsystem counts its turns:

    θ = θ_frames + 2πk, the one nearest to z + f(t),    ż = θ̇ − ḟ,

where f is the motion that prescribes the angle, if any, and 0 otherwise. For a prescribed angle z
is constant, and f determines the turn for any step size. z is set to θ − f at the end of each step,
so errors do not accumulate. **/

#include <cmath>

#include "simflex/body/JointCoordinate.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/StateEquation.h"

namespace simflex {

class TurnState : public StateEquation {
public:
    using Motion = JointEquations::MotionFunction;

    /** Returns the angle on the turn nearest to `counted`. **/
    static SimTK::Real followTurns(SimTK::Real counted, SimTK::Real angle) {
        const SimTK::Real turns = std::round((counted - angle) / (2 * SimTK::Pi));
        return turns == 0 ? angle : angle + turns * (2 * SimTK::Pi);
    }

    /** @param start  initial count; 0 is used for prescribed angles
    @param lead   f; empty: none **/
    TurnState(const std::string& name, const JointCoordinate& coordinate, const Attachment& F,
              const Attachment& M, SimTK::Real start, Motion lead = {})
        // The motion itself is under error control, and with it the angles.
        : StateEquation(name, lead ? 0 : start, NoError),
          m_coordinate(coordinate),
          m_lead(std::move(lead)) {
        m_attachments.push_back(F);
        m_attachments.push_back(M);
    }

    const JointCoordinate& getCoordinate() const { return m_coordinate; }

    /** Returns θ. **/
    SimTK::Real calcAngle(SimTK::Real time, SimTK::Real z, const SimTK::Transform& F,
                          const SimTK::Transform& M) const {
        return followTurns(z + calcLead(time)[0], m_coordinate.calcValue(F, M));
    }
    /** Returns z for an angle θ. **/
    SimTK::Real calcCount(SimTK::Real time, SimTK::Real angle) const {
        return angle - calcLead(time)[0];
    }

    SimTK::Real calcRate(const ElementInputs& now,
                         const SimTK::Array_<FrameMotion>& frames) const override {
        const SimTK::Real rate =
            m_coordinate.calcMotion(frames[0], frames[1])[1] - calcLead(now.time)[1];
        // The angle is undefined if the axes are parallel.
        return std::isfinite(rate) ? rate : 0;
    }

    bool followsMotion() const override { return true; }
    bool countsTurns() const override { return true; }

    SimTK::Real calcStart(const ElementInputs& now, SimTK::Real value,
                          const SimTK::Array_<FrameMotion>& frames) const override {
        return calcCount(now.time, calcAngle(now.time, value, frames[0].X, frames[1].X));
    }

private:
    static constexpr SimTK::Real NoError = 1e30;

    SimTK::Vec3 calcLead(SimTK::Real time) const { return m_lead ? m_lead(time) : SimTK::Vec3(0); }

    JointCoordinate m_coordinate;
    Motion m_lead;
};

}  // namespace simflex
