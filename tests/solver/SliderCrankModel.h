#pragma once
/** @file
The slider-crank of the source paper for tests: flexible (the example's 1 mm hexahedral parts,
reduced) and rigid in plain Simbody, with the same masses, loads and initial state. **/

#include <functional>
#include <memory>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex::test {

constexpr SimTK::Real CrankLength = 0.06, RodLength = 0.18, SliderMass = 0.2;

/** Driving torque on the crank at its shaft, about z [N m]. **/
using Torque = std::function<SimTK::Real(SimTK::Real time)>;

/** Torque that rises smoothly (three continuous derivatives) from 0 to `value` within `ramp`
seconds, then stays constant. **/
Torque makeRampedTorque(SimTK::Real value, SimTK::Real ramp);

struct SliderCrankOptions {
    SimTK::Real stiffnessFactor = 1;
    SimTK::Real dampingRatio = 0;
    SimTK::Real startAngle = 0.5;  ///< of the crank [rad]
    Torque torque = makeRampedTorque(0.5, 0.02);
    /** If set, the crank's angle is prescribed and the torque ignored. **/
    Joint::AngleFunction angle;
};

struct FlexibleSliderCrank {
    explicit FlexibleSliderCrank(const SliderCrankOptions& options = {});

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody crank, rod;
    SimTK::MobilizedBody::Slider slider;
    Joint::Pin mainBearing, crankPin, gudgeonPin;
    SimTK::State state;  ///< positioned as if rigid, at rest

    SimTK::Real getSliderPosition(const SimTK::State& at) const { return slider.getOneQ(at, 0); }
};

struct RigidSliderCrank {
    explicit RigidSliderCrank(const SliderCrankOptions& options = {});

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    SimTK::MobilizedBody::Pin crank, rod;
    SimTK::MobilizedBody::Slider slider;
    SimTK::State state;

    /** Integrates to `time` by Runge–Kutta–Merson at accuracy 1e-10 (1e-8 leaves 4e-8 of the
    crank's length in the slider's position). The result is realized to Stage::Acceleration. **/
    SimTK::State integrate(SimTK::Real time) const;
};

/** Loads a reduced part from the build's parts folder. **/
std::shared_ptr<const ReducedBody> loadPart(const std::string& name,
                                            SimTK::Real stiffnessFactor = 1);

}  // namespace simflex::test
