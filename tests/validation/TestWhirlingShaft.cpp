// A slender shaft of welded pieces, clamped in bearings that allow spin. In co-rotating axes each
// bending frequency ω_n at rest becomes |ω_n − Ω| and ω_n + Ω, even far beyond the critical speeds,
// where the shaft still runs straight.

#include <gtest/gtest.h>

#include <algorithm>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/Beam.h"

namespace simflex::test {
namespace {

using namespace SimTK;

constexpr int NumPieces = 16, NumShapes = 3;

struct Shaft {
    BeamOptions options;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> pieces;
    State state;

    Shaft(const BeamOptions& beam, std::shared_ptr<const ReducedBody> part, Real speed)
        : options(beam) {
        // Bearings rotate about the z axes of their frames.
        const Rotation zToX(Pi / 2, YAxis);
        for (int k = 0; k < NumPieces; ++k) {
            pieces.emplace_back(flexible, part, "piece" + std::to_string(k));
            if (k > 0)
                Joint::Weld(flexible, pieces[size_t(k) - 1].interface("tip"),
                            pieces.back().interface("root"));
        }
        const Attachment ground(matter.Ground(), Transform(zToX)),
            seat = pieces[0].interface("root", Transform(zToX));
        Joint::Pin(flexible, ground, seat, "bearing");
        Joint::PrescribedRotation(
            flexible, ground, seat, [speed](Real t) { return Vec3(speed * t, speed, 0); }, "drive");
        Joint::Cylinder(flexible,
                        Attachment(matter.Ground(), Transform(zToX, Vec3(calcLength(), 0, 0))),
                        pieces.back().interface("tip", Transform(zToX)), "far bearing");
        state = system.realizeTopology();
        for (int k = 0; k < NumPieces; ++k)
            pieces[size_t(k)].setPoseByInterface(state, "root",
                                                 Transform(Vec3(k * options.length, 0, 0)));
        system.realize(state, Stage::Position);
        setSteadyRotation(system, state, Vec3(speed, 0, 0));
    }

    Real calcLength() const { return NumPieces * options.length; }

    /** Returns the frequencies of the `count` slowest modes about the steady motion [rad/s]. **/
    std::vector<Real> calcFrequencies(int count) {
        StaticEquilibrium equilibrium(system);
        equilibrium.solveSteadyMotion(state);
        std::vector<Real> frequencies;
        for (const Eigenmode& mode :
             calcSlowestEigenmodes(system, equilibrium.getState(), count, EigenMethod::Blocks))
            if (!mode.isRigidMotion()) frequencies.push_back(2 * Pi * mode.frequency);
        return frequencies;
    }
};

TEST(WhirlingShaft, FrequenciesInTurningAxesAreThoseAtRestLessAndMoreTheSpeed) {
    BeamOptions beam;
    beam.length = 0.1;
    beam.numElements = 4;
    beam.numModes = 24;
    const auto part = makeBeam(beam);
    std::vector<Real> atRest = Shaft(beam, part, 0).calcFrequencies(2 * (NumShapes + 2));
    // Clamped at both ends: βL = 4.7300, 7.8532, 10.9956; each in two planes.
    const Real unit =
        std::sqrt(beam.E / beam.density / 12) * beam.height / square(NumPieces * beam.length);
    const Real betas[] = {4.7300, 7.8532, 10.9956};
    for (int n = 0; n < NumShapes; ++n)
        for (const int plane : {0, 1})
            EXPECT_NEAR(atRest[size_t(2 * n + plane)], square(betas[n]) * unit,
                        2e-3 * square(betas[n]) * unit);

    for (const Real ratio : {0.5, 1.6, 4.0}) {
        SCOPED_TRACE(ratio);
        const Real speed = ratio * atRest[0];
        const std::vector<Real> found = Shaft(beam, part, speed).calcFrequencies(16);
        for (int n = 0; n < NumShapes; ++n)
            for (const Real expected :
                 {std::abs(atRest[size_t(2 * n)] - speed), atRest[size_t(2 * n)] + speed}) {
                const Real nearest =
                    *std::min_element(found.begin(), found.end(), [expected](Real a, Real b) {
                        return std::abs(a - expected) < std::abs(b - expected);
                    });
                // Rotatory inertia is of order (βh/L)²/12.
                EXPECT_NEAR(nearest, expected, 1e-3 * atRest[size_t(2 * n)]) << "shape " << n;
            }
    }
}

}  // namespace
}  // namespace simflex::test
