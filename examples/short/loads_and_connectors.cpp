// Loads and connectors: a beam on a bushing and a spring, with a distributed load and a stop below.
#include "Simbody.h"
#include "simflex/forces/Bushing.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    const Attachment ground(matter.Ground());
    auto part = std::make_shared<const ReducedBody>(readReducedBody("rod.h5"));
    FlexibleBody rod(flexible, part);
    const Attachment end = rod.interface("small_end");

    Bushing(flexible, ground, rod.interface("big_end"),
            Bushing::diagonal(Vec6(50, 50, 50, 1e5, 1e5, 1e5)),
            Bushing::diagonal(Vec6(0.05, 0.05, 0.05, 50, 50, 50)));
    TwoPointSpringDamper(flexible, Attachment(matter.Ground(), Vec3(0.18, 0.1, 0)), end, 500, 2,
                         0.1);
    const Transform floor(Rotation(-Pi / 2, XAxis), Vec3(0, -0.002, 0));  // its z axis points up
    ContactStop(flexible, Attachment(matter.Ground(), floor), end, 1e5, 0.5);
    const LoadShape weight = LoadShape::nodeSetForce(*part, "SMALL_END", Vec3(0, -1, 0));
    DistributedLoad(flexible, rod, weight, [](Real t) { return t < 0.05 ? 0.0 : 20.0; });
    ModalDamping(flexible, rod, 0.02);

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    for (const Real time : {0.05, 0.5}) {
        integrator.stepTo(time);
        std::printf("t = %.2f s: end at y = %.3f mm\n", time,
                    1e3 * end.calcMotion(integrator.getState()).X.p()[1]);
    }
}
