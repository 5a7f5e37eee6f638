// Natural modes about the steady rotation of a stiffened cantilever, from StaticEquilibrium and
// calcEigenmodes(), against the table of Wright, Smith, Thresher and Wang (see
// TestRotatingCantilever).

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/Beam.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(RotatingModes, FlapAndLagFrequenciesAreThoseOfTheTable) {
    struct Row {
        Real eta, lambda[2];
    };
    test::BeamOptions options;
    options.width = 0.0105;  // flap and lag never coincide at rest
    const auto part = test::makeBeam(options);
    for (const Row& row :
         {Row{0, {3.5160, 22.0345}}, Row{2, {4.1373, 22.6149}}, Row{8, {9.2568, 29.9954}}}) {
        for (const bool isFlap : {true, false}) {
            const Real depth = isFlap ? options.width : options.height;
            const Real scale = std::sqrt(options.E * depth * depth / (12 * options.density)) /
                               square(options.length);
            const Real speed = row.eta * scale;
            MultibodySystem system;
            SimbodyMatterSubsystem matter(system);
            FlexibleBodySubsystem flexible(system, matter);
            const FlexibleBody beam(flexible, part);
            const Attachment root = beam.interface("root");
            Joint::Pin bearing(flexible, matter.Ground(), root, "bearing");
            Joint::PrescribedRotation drive(
                flexible, matter.Ground(), root,
                [speed](Real t) { return Vec3(speed * t, speed, 0); }, "drive");
            State state = system.realizeTopology();
            beam.setPoseByInterface(state, "root", Transform());
            setSteadyRotation(system, state, Vec3(0, 0, speed));
            StaticEquilibrium equilibrium(system);
            equilibrium.solveSteadyMotion(state);
            EXPECT_TRUE(equilibrium.getFreeMotions().empty());
            const std::vector<Eigenmode> modes =
                calcEigenmodes(calcLinearization(system, equilibrium.getState()));
            for (const Real lambda : row.lambda) {
                // In the plane of rotation the centrifugal force turns with the beam.
                const Real expected =
                    scale * (isFlap ? lambda : std::sqrt(square(lambda) - square(row.eta)));
                Real nearest = 0;
                for (const Eigenmode& mode : modes) {
                    const Real omega = mode.eigenvalue.imag();
                    if (std::abs(omega - expected) < std::abs(nearest - expected)) nearest = omega;
                    EXPECT_NEAR(mode.dampingRatio, 0, 1e-7);
                }
                EXPECT_NEAR(nearest, expected, 5e-3 * expected)
                    << (isFlap ? "flap" : "lag") << " at " << row.eta;
            }
        }
    }
}

}  // namespace
}  // namespace simflex
