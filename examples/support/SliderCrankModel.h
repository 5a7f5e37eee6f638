#pragma once
/** @file
The crank-slider of C. Yang et al., Appl. Sci. 2025, 15(8), 4541: flexible crank and connecting rod,
rigid slider.

    Ground ──pin── crank ──pin── rod ──pin── slider ──MobilizedBody::Slider── Ground

It lies in the x-y plane: main bearing at the origin with its axis along z, slider along x, gravity
along −y. All parts share that plane, as in the paper; pictures show rod and slider before it, so
that crank and rod pass each other. The paper gives no dimensions: those of the parts are in
examples/parts, the rest is in SliderCrankOptions. **/

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"

namespace simflex::examples {

struct SliderCrankOptions {
    enum class Drive { Speed, Torque };

    Drive drive = Drive::Speed;
    double speed = 150;            ///< of the crank after the run-up [rad/s]
    double torque = 1;             ///< on the crank at the main bearing after the run-up [N m]
    double runUp = 0.05;           ///< duration [s]
    double sliderMass = 0.2;       ///< [kg]
    double flywheelMass = 0.8;     ///< of Drive::Torque, turns with the shaft [kg]
    double flywheelRadius = 0.05;  ///< a disc [m]
    double gravity = 9.81;         ///< [m/s²]
    double damping = 0.01;         ///< of each mode, as a part of critical

    /** Crank angle, rate and acceleration of Drive::Speed; acceleration is continuous. **/
    SimTK::Vec3 calcAngle(double time) const;
    /** Torque of Drive::Torque, ramped by half a cosine [N m]. **/
    double calcTorque(double time) const;
    /** About the shaft [kg m²]; zero with Drive::Speed. **/
    double calcFlywheelInertia() const;
};

class SliderCrankModel {
public:
    /** @param crankPart  interfaces "shaft" and "pin"
    @param rodPart  interfaces "big_end" and "small_end" **/
    SliderCrankModel(const SliderCrankOptions& options,
                     std::shared_ptr<const ReducedBody> crankPart,
                     std::shared_ptr<const ReducedBody> rodPart);

    /** The undeformed mechanism at rest, crank and rod stretched along x. **/
    SimTK::State makeInitialState();

    /** @name Probes; the State is realized to Stage::Velocity **/
    /**@{**/
    /** Angle of the shaft, nearest to `guess` [rad]. **/
    double calcCrankAngle(const SimTK::State& state, double guess) const;
    double calcSliderPosition(const SimTK::State& state) const { return slider.getOneQ(state, 0); }
    /** How far the middle of the rod has moved across the line between its pins, in the plane of
     * motion [m]. **/
    double calcRodDeflection(const SimTK::State& state) const;
    /** How far the crank pin has moved across the crank as the shaft holds it, in the plane of
     * motion [m]. **/
    double calcCrankDeflection(const SimTK::State& state) const;
    /**@}**/

    /** @name Pictures **/
    /**@{**/
    /** A State with the rod beside the crank, in whose plane it moves. **/
    SimTK::State calcPictureState(const SimTK::State& state) const;
    /** The crank pin, on the crank's interface "pin". **/
    SimTK::DecorativeCylinder makeCrankPin() const;
    /**@}**/

    double getCrankLength() const { return m_crankLength; }
    double getRodLength() const { return m_rodLength; }

private:
    void addDrive();
    void addDecorations();

    SliderCrankOptions m_options;
    double m_crankLength, m_rodLength, m_offset;  // offset: along z, of rod and slider in pictures

public:
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible;  // after the other forces
    FlexibleBody crank, rod;
    SimTK::MobilizedBody::Slider slider;
    Joint::Pin mainBearing, crankPin, gudgeonPin;

private:
    int m_rodMiddle;                  // node nearest to the middle of the rod
    SimTK::Vec3 m_rodMiddlePosition;  // in B, undeformed
};

}  // namespace simflex::examples
