// Static equilibrium: a clamped rod bends under a force at its end.
#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/StaticEquilibrium.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);

    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Weld clamp(flexible, matter.Ground(), rod.interface("big_end"), "clamp");
    const Attachment end = rod.interface("small_end");
    AttachmentForce(flexible, end, SpatialVec(Vec3(0), Vec3(0, -10, 0)));

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Transform());
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);

    const State& atRest = equilibrium.getState();
    const Real deflection = -end.calcMotion(atRest).X.p()[1];
    const SpatialVec reaction = clamp.calcReaction(atRest, equilibrium.getMultipliers(clamp),
                                                   Joint::Side::M, Joint::Side::M);
    std::printf("deflection %.4g mm, moment in the clamp %.4g N m\n", 1e3 * deflection,
                reaction[0][2]);
}
