#pragma once
/** @file
Two soft links with five and six modes on ball joints under gravity. The second link starts to swing
out of the plane. The links are soft enough for explicit integrators. **/

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "support/PointMassPart.h"

namespace simflex::test {

/** Makes a part with natural frequencies from 6 to 25 Hz. **/
PointMassPart makeSoftPart(unsigned seed, int numModes);

struct DoublePendulum {
    DoublePendulum();

    /** Returns a State ready for Simbody's integrators. **/
    SimTK::State makeState();

    /** @name End positions of both links at 0.1, 0.2 and 0.3 s [m] **/
    /**@{**/
    /** With block elimination. @param order  largest BDF order **/
    SimTK::Vector runBdf(const SimTK::State& state, SimTK::Real accuracy, int order) const;
    /** With one of Simbody's integrators. **/
    template <class Integrator>
    SimTK::Vector runNatively(const SimTK::State& state, SimTK::Real accuracy) const;
    /**@}**/

    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter;
    SimTK::GeneralForceSubsystem forces;
    SimTK::Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody upper, lower;
    Joint::Ball root, knee;

private:
    template <class Step>
    SimTK::Vector sample(const Step& stepTo) const {
        SimTK::Vector places(18);
        for (int k = 1; k <= 3; ++k) {
            const SimTK::State& now = stepTo(0.1 * k);
            system.realize(now, SimTK::Stage::Velocity);
            const SimTK::Vec3 a = upper.interface("B").calcMotion(now).X.p(),
                              b = lower.interface("B").calcMotion(now).X.p();
            for (int i = 0; i < 3; ++i)
                places[6 * (k - 1) + i] = a[i], places[6 * k - 3 + i] = b[i];
        }
        return places;
    }
};

template <class Integrator>
SimTK::Vector DoublePendulum::runNatively(const SimTK::State& state, SimTK::Real accuracy) const {
    Integrator integrator(system);
    integrator.setAccuracy(accuracy);
    SimTK::TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    return sample([&](SimTK::Real t) -> const SimTK::State& {
        stepper.stepTo(t);
        return stepper.getState();
    });
}

}  // namespace simflex::test
