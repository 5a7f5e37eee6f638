// Stress: the largest von Mises stress of a crank bent by a moment, and its node.
#include <iostream>

#include "Simbody.h"
#include "simflex/body/Joint.h"
#include "simflex/body/StressExtremes.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/RadauIntegrator.h"
using namespace SimTK;
using namespace simflex;

int main() {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);

    // Reduced with `simflex reduce --stress`.
    FlexibleBody crank(flexible,
                       std::make_shared<const ReducedBody>(readReducedBody("crank_stress.h5")));
    Joint::Weld clamp(flexible, matter.Ground(), crank.interface("shaft"), "clamp");
    ModalDamping(flexible, crank, 0.05);
    AttachmentForce(flexible, crank.interface("pin"), [](Real t) {
        return SpatialVec(Vec3(0, 0, 5 * std::min(t / 1e-3, 1.0)), Vec3(0));
    });
    auto* extremes = new StressExtremes(flexible, 1e-4);
    system.addEventReporter(extremes);  // the system owns it

    State state = system.realizeTopology();
    crank.setPoseByInterface(state, "shaft", Transform());
    RadauIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.005);
    extremes->write(std::cout);

    const StressExtremes::Extreme& worst = extremes->getExtremes(crank).vonMises;
    Vector now;
    StressRecovery(crank, {worst.nodeNumber}).calcVonMises(integrator.getState(), now);
    std::printf("at the end node %d has %.3g MPa\n", worst.nodeNumber, 1e-6 * now[0]);
}
