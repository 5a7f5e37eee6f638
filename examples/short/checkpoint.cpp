// Checkpoint: a stopped run continues with bit-identical results.
#include <fstream>

#include "Simbody.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/RadauIntegrator.h"
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
    State start = system.realizeTopology();
    rod.setPoseByInterface(start, "big_end", Transform());

    RadauIntegrator integrator(system);
    integrator.initialize(start);
    integrator.stepTo(0.1);
    std::ofstream out("run.checkpoint", std::ios::binary);
    integrator.writeCheckpoint(out);
    out.close();
    integrator.stepTo(0.2);

    RadauIntegrator later(system);  // as in another process
    std::ifstream in("run.checkpoint", std::ios::binary);
    later.readCheckpoint(in, start);
    later.stepTo(0.2);
    const Vector difference = later.getState().getY() - integrator.getState().getY();
    std::printf("difference after going on: %g\n", difference.normInf());
    return difference.normInf() == 0 ? 0 : 1;
}
