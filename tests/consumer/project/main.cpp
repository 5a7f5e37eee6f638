#include "Simbody.h"

using namespace SimTK;

#include <cstdio>

#include "all_headers.h"  // every public header of simflex

#ifdef NDEBUG
#error "the package must undefine NDEBUG: Simbody's State cache depends on it"
#endif
#ifdef EIGEN_WORLD_VERSION
#error "a public header includes Eigen"
#endif

// A part with four nodes and one mode, made by hand.
simflex::ReducedBody makePart() {
    simflex::ReducedBody part;
    part.name = "tetrahedron";
    part.mass = 2;
    part.inertia = {0.02, 0.03, 0.04, 0, 0, 0};
    part.numModes = 1;
    part.omegaSquared = {1e4};
    part.I1.assign(6, 0);
    for (auto& component : part.I2) component = {0};
    part.I2[0] = {2};  // xx + yy + zz of a mass-normalised mode
    for (auto& component : part.N) component = {0};
    part.mesh.nodeNumbers = {1, 2, 3, 4};
    part.mesh.positions = {-0.1, -0.1, -0.1, 0.3, -0.1, -0.1, -0.1, 0.3, -0.1, -0.1, -0.1, 0.3};
    part.mesh.elements = {{simflex::ElementType::Tet4, {0, 1, 2, 3}}};
    part.Phi.assign(12, 0);
    part.Phi[3] = 0.1;
    simflex::ReducedBody::Interface tip;
    tip.name = "tip";
    tip.position = {-0.1, -0.1, -0.1};
    tip.Phi = {0.05, 0, 0};
    tip.Psi = {0, 0, 0};
    tip.nodes = {0};
    part.interfaces = {tip};
    return part;
}

int main(int, char** argv) {
    // Parts and their file.
    simflex::writeReducedBody(argv[1], makePart());
    const auto part =
        std::make_shared<const simflex::ReducedBody>(simflex::readReducedBody(argv[1]));

    // Simulation: a pendulum.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    simflex::FlexibleBodySubsystem flexible(system, matter);
    simflex::FlexibleBody body(flexible, part);
    simflex::Joint::Ball ball(flexible, matter.Ground(), body.interface("tip"));
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "tip", Transform());
    simflex::BdfIntegrator integrator(system);
    integrator.initialize(state);
    integrator.stepTo(0.01);
    const Real fall = 0.1 - body.getFramePose(integrator.getState()).p()[1];
    if (!(fall > 1e-4 && fall < 1e-3)) return std::printf("fell %g m\n", fall), 1;

    // Reduction: it links, and reports errors.
    try {
        simflex::readCalculixDeck("there is no such deck.inp");
        return std::printf("a missing deck was read\n"), 1;
    } catch (const std::exception&) {
    }

    // Pictures.
    simflex::OffscreenVisualizer visualizer(system, 64, 36);
    visualizer.addFlexibleBody(body);
    return visualizer.drawFrame(integrator.getState()).getWidth() == 64 ? 0 : 1;
}
