#include "validation/RotatingCantilever.h"

#include <cmath>

#include "simflex/body/Joint.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex::test {

using namespace SimTK;

BeamOptions getRotatingCantileverOptions() {
    BeamOptions options;
    options.height = 0.01;
    options.width = 0.0105;
    return options;
}

const std::shared_ptr<const ReducedBody>& getRotatingCantileverPart() {
    static const auto part = makeBeam(getRotatingCantileverOptions());
    return part;
}

double calcFrequencyUnit(double depth) {
    const BeamOptions o = getRotatingCantileverOptions();
    return std::sqrt(o.E * depth * depth / (12 * o.density)) / (o.length * o.length);
}

RotatingModes calcRotatingModes(double speed) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody beam(flexible, getRotatingCantileverPart());
    const Attachment root = beam.interface("root"), tip = beam.interface("tip");
    Joint::Pin bearing(flexible, matter.Ground(), root, "bearing");
    Joint::PrescribedRotation drive(
        flexible, matter.Ground(), root, [speed](Real t) { return Vec3(speed * t, speed, 0); },
        "drive");
    State state = system.realizeTopology();
    beam.setPoseByInterface(state, "root", Transform());
    StaticEquilibrium equilibrium(system);
    equilibrium.solveSteadyMotion(state);
    if (!equilibrium.getFreeMotions().empty())
        throw std::runtime_error("of the driven beam " + equilibrium.getFreeMotions()[0]);
    const Linearization linear = calcLinearization(system, equilibrium.getState());
    RotatingModes modes;
    modes.all = calcEigenmodes(linear);
    const Vec3 steady = tip.calcMotion(equilibrium.getState()).X.p();
    for (const Eigenmode& mode : modes.all) {
        const State moved = calcModeStates(system, linear, mode, 1e-4, 1)[0];
        system.realize(moved, Stage::Velocity);
        const Vec3 shift = tip.calcMotion(moved).X.p() - steady;
        (std::abs(shift[2]) > std::abs(shift[1]) ? modes.flap : modes.lag)
            .push_back(mode.eigenvalue.imag());
    }
    return modes;
}

}  // namespace simflex::test
