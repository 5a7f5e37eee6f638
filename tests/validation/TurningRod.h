#pragma once
/** @file
A rod rotating steadily about its end, free on a pin (after Code_Aster's test SSLV104): it stretches
by tan(kL)/k − L with k² = ρω²/E. **/

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"

namespace simflex::test {

struct TurningRod {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody rod;
    Joint::Pin pin;
    StaticEquilibrium equilibrium{system};

    static simflex::testing::Brick getBrick() {
        simflex::testing::Brick brick;
        brick.size = {0.5, 0.02, 0.02};
        brick.elements = {40, 1, 1};
        brick.E = 2e11;
        brick.nu = 0;
        brick.rho = 7800;
        return brick;
    }

    static const std::shared_ptr<const ReducedBody>& getPart() {
        static const auto part = reduceBrick(getBrick(), 60);
        return part;
    }

    TurningRod()
        : rod(flexible, getPart(), "rod"),
          pin(flexible, matter.Ground(), rod.interface("left"), "pin") {}

    /** Finds the steady motion. @param speed  [rad/s] **/
    void turn(SimTK::Real speed) {
        SimTK::State state = system.realizeTopology();
        rod.setPoseByInterface(state, "left", SimTK::Transform(SimTK::Rotation(0.3, SimTK::ZAxis)));
        setSteadyRotation(system, state, SimTK::Vec3(0, 0, speed));
        equilibrium.solveSteadyMotion(state);
    }

    /** Returns the stretch in the steady motion [m]. **/
    SimTK::Real calcStretch() const {
        const SimTK::Vec3 tip = rod.interface("right").calcMotion(equilibrium.getState()).X.p();
        return tip.norm() - getBrick().size[0];
    }

    static SimTK::Real calcExactStretch(SimTK::Real speed) {
        const auto brick = getBrick();
        const SimTK::Real L = brick.size[0], k = speed * std::sqrt(brick.rho / brick.E);
        return std::tan(k * L) / k - L;
    }
};

}  // namespace simflex::test
