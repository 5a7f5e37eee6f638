#include "support/DoublePendulum.h"

#include "simflex/solver/BdfIntegrator.h"

namespace simflex::test {

using namespace SimTK;

PointMassPart makeSoftPart(unsigned seed, int numModes) {
    PointMassPartOptions options;
    options.seed = seed;
    options.numModes = numModes;
    options.lowestFrequency = 6;
    options.highestFrequency = 25;
    return makePointMassPart(options);
}

DoublePendulum::DoublePendulum()
    : matter(system),
      forces(system),
      gravity(forces, matter, -YAxis, 9.81),
      flexible(system, matter),
      upper(flexible, makeSoftPart(3, 5).body, "upper"),
      lower(flexible, makeSoftPart(4, 6).body, "lower"),
      root(flexible, matter.Ground(), upper.interface("A"), "root"),
      knee(flexible, upper.interface("B"), lower.interface("A"), "knee") {}

State DoublePendulum::makeState() {
    State state = system.realizeTopology();
    upper.setPoseByInterface(state, "A", Transform());
    system.realize(state, Stage::Velocity);
    lower.setPoseByInterface(state, "A", upper.interface("B").calcMotion(state).X);
    lower.setFrameVelocity(state, SpatialVec(Vec3(0, 1, 0.5), Vec3(0)));
    flexible.initializeNative(state);
    return state;
}

Vector DoublePendulum::runBdf(const State& state, Real accuracy, int order) const {
    BdfIntegrator integrator(system);
    integrator.setAccuracy(accuracy);
    integrator.setMaximumOrder(order);
    integrator.initialize(state);
    return sample([&](Real t) -> const State& {
        integrator.stepTo(t);
        return integrator.getState();
    });
}

}  // namespace simflex::test
