#pragma once
/** @file
Whole turns of an angle (private header): a State tells it within half a turn only. **/

#include <cmath>

#include "simflex/body/Joint.h"
#include "simflex/body/StateEquation.h"

namespace simflex {

/** The angle on the turn where `counted` is. **/
inline SimTK::Real followTurns(SimTK::Real counted, SimTK::Real angle) {
    return counted - std::remainder(counted - angle, 2 * SimTK::Pi);
}

/** Follows an angle over its turns; a run begins on the turn nearest to the State's value. **/
class TurnState : public StateEquation {
public:
    TurnState(const std::string& name, const JointCoordinate& coordinate, const Attachment& F,
              const Attachment& M, SimTK::Real start)
        // Half a turn off would be too far, and an error of a thousandth is none.
        : StateEquation(name, start, 1e3), m_coordinate(coordinate) {
        m_attachments.push_back(F);
        m_attachments.push_back(M);
    }

    SimTK::Real calcRate(const ElementInputs&,
                         const SimTK::Array_<FrameMotion>& frames) const override {
        return m_coordinate.calcMotion(frames[0], frames[1])[1];
    }

    bool followsMotion() const override { return true; }

    SimTK::Real calcStart(SimTK::Real value,
                          const SimTK::Array_<FrameMotion>& frames) const override {
        return followTurns(value, m_coordinate.calcValue(frames[0].X, frames[1].X));
    }

private:
    JointCoordinate m_coordinate;
};

}  // namespace simflex
