// Natural modes of a rod that hangs from a pin, about its equilibrium.
#include "simflex/solver/Eigenmodes.h"
#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/StaticEquilibrium.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);  // after all other forces

    FlexibleBody rod(flexible, std::make_shared<const ReducedBody>(readReducedBody("rod.h5")));
    Joint::Pin pin(flexible, matter.Ground(), rod.interface("big_end"), "pin");
    ModalDamping(flexible, rod, 0.01);

    State state = system.realizeTopology();
    rod.setPoseByInterface(state, "big_end", Rotation(-Pi / 3, ZAxis));
    StaticEquilibrium equilibrium(system);
    equilibrium.solve(state);

    const Linearization linear = calcLinearization(system, equilibrium.getState());
    const std::vector<Eigenmode> modes = calcEigenmodes(linear);
    for (int k = 0; k < 5; ++k)
        std::printf("mode %d: %9.3f Hz, %5.2f %% of critical damping\n", k + 1, modes[k].frequency,
                    100 * modes[k].dampingRatio);
}
