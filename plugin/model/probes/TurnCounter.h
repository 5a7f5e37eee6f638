#pragma once
/** @file
Whole turns of angles in the course of a motion: a State tells an angle of a joint within half a
turn only. **/

#include <vector>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

class TurnCounter {
public:
    /** Counts the angles of all joints. **/
    explicit TurnCounter(const Model& model);

    /** Begins anew: the next State has made the turns that the file's `initial.joints` have, or
    none. **/
    void reset();
    /** Goes on to a later State: each angle by whole turns next to where the mean of its rates
    before and now leads. Right if a rate changes by less than a turn per interval between two
    calls. @pre Stage::Velocity. **/
    void update(const SimTK::State& state);

    /** Goes on to a State that no motion has led to: each angle by whole turns next to what it was. **/
    void follow(const SimTK::State& state);
    /** The coordinate of that State has gone on to this value, as near as whole turns bring it. **/
    void setTurned(JointIndex joint, int coordinate, double value);

    /** What is to be added to a joint's coordinate [rad]; 0 for one that is no angle. **/
    double getTurned(JointIndex joint, int coordinate) const;

    /** @name All that is known, as numbers **/
    /**@{**/
    std::vector<double> save() const;
    /** @throws std::invalid_argument if they are not of this model. **/
    void restore(const std::vector<double>& saved);
    /**@}**/

private:
    struct Angle {
        JointIndex joint;
        int coordinate = 0;
        double start = 0;  ///< what the file begins with
        double value = 0, rate = 0, turned = 0;
    };
    SimTK::Vec2 calcAngle(const Angle& angle, const SimTK::State& state) const;

    const Model& m_model;
    std::vector<Angle> m_angles;
    double m_time = SimTK::NaN;  ///< NaN: at no State yet
};

}  // namespace model
}  // namespace simflex
