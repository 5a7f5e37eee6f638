#pragma once
/** @file
Numbers that the motion of a model gives, and functions of them: what forces and states of one's own
depend on.

    const Signal angle = Signal::turnedAngle(flexible, shoulder),
                   speed = Signal::coordinateRate(shoulder);
    const auto law = [](Real, const Real* x, Real* slopes) {
        if (slopes) slopes[0] = -400, slopes[1] = -30;
        return 400 * (0.5 - x[0]) - 30 * x[1];
    };
    CoordinateForce(flexible, shoulder, 0, Signal::function({angle, speed}, law));

A Signal is a handle: copies share what they are. Its derivatives go into the Newton matrix. **/

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/Joint.h"
#include "simflex/body/StateEquation.h"

namespace simflex {

class Signal {
public:
    using Real = SimTK::Real;

    /** 0. **/
    Signal() = default;
    bool isZero() const { return !m_implementation; }

    /** f(t, x₀, x₁ …).
    @param values  of the signals x_i, in their order
    @param slopes  null, or receives ∂f/∂x_i **/
    using Function = std::function<Real(Real time, const Real* values, Real* slopes)>;

    /** @name From frames **/
    /**@{**/
    /** Between two origins [m], and its rate [m/s]; positive where they part. **/
    static Signal distance(const Attachment& from, const Attachment& to);
    static Signal distanceRate(const Attachment& from, const Attachment& to);
    /** Of M's origin from F's along an axis of F [m], and its rate as seen from F [m/s]. **/
    static Signal displacement(const Attachment& F, const Attachment& M,
                               SimTK::CoordinateAxis axis);
    static Signal displacementRate(const Attachment& F, const Attachment& M,
                                   SimTK::CoordinateAxis axis);
    /** Of M as seen from F, about an axis of F [rad/s]. **/
    static Signal angularVelocity(const Attachment& F, const Attachment& M,
                                  SimTK::CoordinateAxis axis);
    /**@}**/

    /** @name Coordinates of joints [rad, m], and their rates **/
    /**@{**/
    /** Angles are in (−π, π]; see turnedAngle() for those that count turns.
    @throws std::out_of_range if the joint has no such coordinate. **/
    static Signal coordinate(const Joint& joint, int number = 0);
    static Signal coordinateRate(const Joint& joint, int number = 0);
    static Signal coordinate(const JointCoordinate& coordinate, const Attachment& F,
                             const Attachment& M);
    static Signal coordinateRate(const JointCoordinate& coordinate, const Attachment& F,
                                 const Attachment& M);
    /** An angle that goes on counting over any number of turns: a state of the subsystem follows
    it, which a run begins at that value of the angle which is nearest to what the State has. A
    joint has one for each of its angles, which Joint::calcCoordinates() then shows, too. A
    coordinate that is no angle stays what it is.
    @param start  what a State has that nobody has changed
    @param lead   the motion that leads the angle, if one does: it says which turn the angle is on.
    Both count where the turns are asked for first. **/
    static Signal turnedAngle(FlexibleBodySubsystem& subsystem, const Joint& joint, int number = 0,
                              Real start = 0, const Joint::MotionFunction& lead = {});
    static Signal turnedAngle(FlexibleBodySubsystem& subsystem, const JointCoordinate& coordinate,
                              const Attachment& F, const Attachment& M, const std::string& name,
                              Real start = 0);
    /**@}**/

    /** Value of a state equation, by its number. **/
    static Signal state(int index);
    static Signal constant(Real value);
    /** Of other signals, and of time. **/
    static Signal function(const std::vector<Signal>& arguments, Function function);

    /** The frames it is calculated from. **/
    const SimTK::Array_<Attachment>& getAttachments() const;

    /** In a State realized to Stage::Velocity. **/
    Real calcValue(const FlexibleBodySubsystem& subsystem, const SimTK::State& state) const;

    /** How a Signal changes with small displacements along the directions of the speeds u, and with
    the speeds themselves: n numbers each, in Simbody's numbering of u; zero for prescribed u. **/
    struct Slopes {
        SimTK::Vector byQ, byU;
    };
    /** Exact slopes at a State at rest, realized to Stage::Velocity, in O(n). Nothing for functions
    of other signals and for states, and for the distance of points that coincide, which has none.
    **/
    std::optional<Slopes> calcSlopes(const FlexibleBodySubsystem& subsystem,
                                     const SimTK::State& state) const;

    /** @name For elements, whose frames are many signals' **/
    /**@{**/
    using Frames = SimTK::Array_<FrameMotion>;
    /** Puts the frames among those of an element, each once.
    @returns where they are: `places` **/
    std::vector<int> addFramesTo(SimTK::Array_<Attachment>& attachments) const;
    Real calc(const ElementInputs& now, const Frames& frames, const std::vector<int>& places) const;
    struct Gradient {
        SimTK::SpatialVec* frames;  ///< one per frame of the element, in Ground
        Real* states = nullptr;     ///< one per state of the subsystem; null: not wanted
    };
    /** Adds `factor` times what a unit of every twist changes in it, at once and by γ times the
    twist in poses, and what a unit of every state does. **/
    void addInGradient(const ElementInputs& now, const Frames& frames,
                       const std::vector<int>& places, Real gamma, Real factor,
                       const Gradient& gradient) const;
    /** Numbers of the states that it depends on at once. **/
    void addStatesTo(std::set<int>& states) const;
    /**@}**/

    class Implementation;
    const Implementation* getImplementation() const { return m_implementation.get(); }

private:
    explicit Signal(std::shared_ptr<const Implementation> implementation)
        : m_implementation(std::move(implementation)) {}

    std::shared_ptr<const Implementation> m_implementation;
};

/** A joint's coordinate and the frames it is between. **/
struct JointCoordinateFrames {
    JointCoordinate coordinate;
    Attachment F, M;
};
/** @throws std::out_of_range if the joint has no such coordinate. **/
JointCoordinateFrames findCoordinate(const Joint& joint, int number);

/** ż = a Signal. **/
class SignalState : public StateEquation {
public:
    SignalState(const std::string& name, const Signal& rate, SimTK::Real initialValue = 0,
                SimTK::Real scale = 1)
        : SignalState(name, initialValue, scale) {
        setRate(rate);
    }
    /** Its rate is 0 until it is set, before the topology is realized: rates may depend on states
    that come later. **/
    SignalState(const std::string& name, SimTK::Real initialValue, SimTK::Real scale = 1)
        : StateEquation(name, initialValue, scale) {}
    void setRate(const Signal& rate) {
        m_rate = rate;
        m_places = rate.addFramesTo(m_attachments);
    }

    SimTK::Real calcRate(const ElementInputs& now,
                         const SimTK::Array_<FrameMotion>& frames) const override {
        return m_rate.calc(now, frames, m_places);
    }
    void addInStateSlopes(const ElementInputs& now, const SimTK::Array_<FrameMotion>& frames,
                          SimTK::Real* slopes) const override;
    /** One that only events change is no matter of equilibria. **/
    bool followsMotion() const override { return m_rate.isZero(); }
    const Signal& getRate() const { return m_rate; }

private:
    Signal m_rate;
    std::vector<int> m_places;
};

}  // namespace simflex
