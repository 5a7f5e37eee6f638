#pragma once
/** @file
Whole turns of angles in the course of a motion: a State tells an angle of a joint within half a
turn only. **/

#include <string>
#include <vector>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

class TurnCounter {
public:
    /** Counts the angles of all joints, and of the model's torsion springs. **/
    explicit TurnCounter(const Model& model);

    /** Begins anew: the next State has made the turns that the file's `initial.joints` have, or
    none. **/
    void reset();
    /** Goes on to a later State: each angle by whole turns next to where the mean of its rates
    before and now leads. Right if a rate changes by less than a turn per interval between two
    calls. @pre Stage::Velocity. **/
    void update(const SimTK::State& state);

    /** What is to be added to a joint's coordinate [rad]; 0 for one that is no angle. **/
    double getTurned(JointIndex joint, int coordinate) const;

    /** Names of the torsion springs that have been turned by more than half a turn from where they
    are free: their moment has changed sign there (TorsionSpring). In the file's order. **/
    const std::vector<std::string>& getOverturnedSprings() const { return _overturned; }

    /** @name All that is known, as numbers **/
    /**@{**/
    std::vector<double> save() const;
    /** @throws std::invalid_argument if they are not of this model. **/
    void restore(const std::vector<double>& saved);
    /**@}**/

private:
    struct Angle {
        JointIndex joint;  ///< or none, but a spring
        int coordinate = 0;
        std::string spring;
        std::vector<Attachment> frames;  ///< of a spring: F, M
        double center = 0;               ///< of a spring: where it is free
        double start = 0;                ///< of a joint: what the file begins with
        double value = 0, rate = 0, turned = 0;
    };
    SimTK::Vec2 calcAngle(const Angle& angle, const SimTK::State& state) const;

    const Model& _model;
    std::vector<Angle> _angles;
    std::vector<std::string> _overturned;
    double _time = SimTK::NaN;  ///< NaN: at no State yet
};

}  // namespace model
}  // namespace simflex
