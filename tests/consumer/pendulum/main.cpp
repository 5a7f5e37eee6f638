#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;

int main(int, char** argv) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    simflex::FlexibleBodySubsystem flexible(system, matter);
    simflex::FlexibleBody bar(
        flexible, std::make_shared<const simflex::ReducedBody>(simflex::readReducedBody(argv[1])));
    simflex::Joint::Pin pin(flexible, matter.Ground(), bar.interface("big_end"));
    State state = system.realizeTopology();
    bar.setPoseByInterface(state, "big_end", Transform());
    simflex::RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.1);
    std::printf("fell by %.3f rad\n", -pin.calcCoordinates(integrator.getState())[0]);
}
