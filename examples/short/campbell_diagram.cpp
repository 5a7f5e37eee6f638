// Campbell diagram: a disc that spins on the end of a clamped rod.
#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/CampbellDiagram.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);

    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Weld clamp(flexible, matter.Ground(), rod.interface("big_end"), "clamp");
    // The disc is an ordinary Simbody body on a Pin along the rod; the Pin's base is welded to it.
    MobilizedBody::Free hub(matter.Ground(),
                            Body::Rigid(MassProperties(0.05, Vec3(0), Inertia(5e-6))));
    Joint::Weld seat(flexible, rod.interface("small_end"), hub, "seat");
    const Rotation alongRod(Pi / 2, YAxis);
    const MassProperties disc(0.3, Vec3(0), 0.3 * UnitInertia::cylinderAlongX(0.06, 0.005));
    MobilizedBody::Pin rotor(hub, alongRod, Body::Rigid(disc), alongRod);

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    system.realize(state, Stage::Velocity);
    hub.setQToFitTransform(state, rod.interface("small_end").calcMotion(state).X);

    const CampbellDiagram diagram =
        calcCampbellDiagram({0, 500, 1000}, 4, [&](Real speed, int count) {
            rotor.setOneU(state, 0, speed);
            return calcSlowestEigenmodes(system, state, count);
        });
    for (const CampbellDiagram::Branch& branch : diagram.branches)
        std::printf("%8.2f Hz at rest, %8.2f Hz at 1000 rad/s\n", branch.frequency.front(),
                    branch.frequency.back());
}
