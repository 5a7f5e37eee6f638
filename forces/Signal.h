#pragma once
/** @file
Quantities of a model's motion, and functions of them, as inputs of forces and of user-defined
states.

    const Signal angle = Signal::turnedAngle(flexible, shoulder),
                   speed = Signal::coordinateRate(shoulder);
    const auto law = [](Real, const Real* x, Real* slopes) {
        if (slopes) slopes[0] = -400, slopes[1] = -30;
        return 400 * (0.5 - x[0]) - 30 * x[1];
    };
    CoordinateForce(flexible, shoulder, 0, Signal::function({angle, speed}, law));

A Signal is a handle: copies share their implementation. Its derivatives enter the Newton
matrix. **/

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

    /** The constant 0. **/
    Signal() = default;
    bool isZero() const { return !m_implementation; }

    /** f(t, x₀, x₁ …).
    @param values  x_i, in the order of the arguments
    @param slopes  null, or receives ∂f/∂x_i **/
    using Function = std::function<Real(Real time, const Real* values, Real* slopes)>;

    /** @name From frames **/
    /**@{**/
    /** Distance of two origins [m], and its rate [m/s], positive as they separate. **/
    static Signal distance(const Attachment& from, const Attachment& to);
    static Signal distanceRate(const Attachment& from, const Attachment& to);
    /** Displacement of M's origin from F's along an axis of F [m], and its rate as seen from F
    [m/s]. **/
    static Signal displacement(const Attachment& F, const Attachment& M,
                               SimTK::CoordinateAxis axis);
    static Signal displacementRate(const Attachment& F, const Attachment& M,
                                   SimTK::CoordinateAxis axis);
    /** Angular velocity of M relative to F, about an axis of F [rad/s]. **/
    static Signal angularVelocity(const Attachment& F, const Attachment& M,
                                  SimTK::CoordinateAxis axis);
    /**@}**/

    /** @name Coordinates of joints [rad, m], and their rates **/
    /**@{**/
    /** Angles are in (−π, π]; turnedAngle() counts turns.
    @throws std::out_of_range if the joint has no such coordinate. **/
    static Signal coordinate(const Joint& joint, int number = 0);
    static Signal coordinateRate(const Joint& joint, int number = 0);
    static Signal coordinate(const JointCoordinate& coordinate, const Attachment& F,
                             const Attachment& M);
    static Signal coordinateRate(const JointCoordinate& coordinate, const Attachment& F,
                                 const Attachment& M);
    /** An angle that counts turns by a state of the subsystem. A run begins at the value of the
    angle nearest to that state. A joint has one such state for each of its angles, and its
    Joint::calcCoordinates() counts turns, too. For coordinates that are not angles, the same as
    coordinate().
    @param start  value of that state in a default State [rad]; prescribed angles begin at 0
    @param lead   motion that prescribes the angle, if any, and with it the turn
    Both are ignored if the turns of this angle are counted already. **/
    static Signal turnedAngle(FlexibleBodySubsystem& subsystem, const Joint& joint, int number = 0,
                              Real start = 0, const Joint::MotionFunction& lead = {});
    static Signal turnedAngle(FlexibleBodySubsystem& subsystem, const JointCoordinate& coordinate,
                              const Attachment& F, const Attachment& M, const std::string& name,
                              Real start = 0);
    /**@}**/

    /** Value of the state with this index. **/
    static Signal state(int index);
    static Signal constant(Real value);
    /** A function of other signals and of time. **/
    static Signal function(const std::vector<Signal>& arguments, Function function);

    /** The frames on which it depends. **/
    const SimTK::Array_<Attachment>& getAttachments() const;

    /** @pre the State is realized to Stage::Velocity **/
    Real calcValue(const FlexibleBodySubsystem& subsystem, const SimTK::State& state) const;

    /** Derivatives of a Signal by small displacements along the directions of the speeds u, and by
    u: n numbers each, in Simbody's numbering of u; zero for prescribed u. **/
    struct Slopes {
        SimTK::Vector byQ, byU;
    };
    /** Exact slopes at a State at rest, realized to Stage::Velocity, in O(n). Empty for functions
    of other signals, for states, and for the distance of coincident points, which has no
    derivative. **/
    std::optional<Slopes> calcSlopes(const FlexibleBodySubsystem& subsystem,
                                     const SimTK::State& state) const;

    /** @name For elements whose signals share frames **/
    /**@{**/
    using Frames = SimTK::Array_<FrameMotion>;
    /** Adds the frames to those of an element, each once.
    @returns their indices there: `places` **/
    std::vector<int> addFramesTo(SimTK::Array_<Attachment>& attachments) const;
    Real calc(const ElementInputs& now, const Frames& frames, const std::vector<int>& places) const;
    struct Gradient {
        SimTK::SpatialVec* frames;  ///< one per frame of the element, in Ground
        Real* states = nullptr;     ///< one per state of the subsystem; null: not wanted
    };
    /** Adds `factor` times the derivatives by each frame's twist, which acts directly and displaces
    poses by γ times the twist, and by each state. **/
    void addInGradient(const ElementInputs& now, const Frames& frames,
                       const std::vector<int>& places, Real gamma, Real factor,
                       const Gradient& gradient) const;
    /** Adds the indices of the states on which it depends directly. **/
    void addStatesTo(std::set<int>& states) const;
    /**@}**/

    class Implementation;
    const Implementation* getImplementation() const { return m_implementation.get(); }

private:
    explicit Signal(std::shared_ptr<const Implementation> implementation)
        : m_implementation(std::move(implementation)) {}

    std::shared_ptr<const Implementation> m_implementation;
};

/** A joint's coordinate and its two frames. **/
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
    /** The rate is 0 until setRate(), to be called before the topology is realized. This allows
    rates that depend on states added later. **/
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
    /** True without a rate, as for states that only events change. **/
    bool followsMotion() const override { return m_rate.isZero(); }
    const Signal& getRate() const { return m_rate; }

private:
    Signal m_rate;
    std::vector<int> m_places;
};

}  // namespace simflex
