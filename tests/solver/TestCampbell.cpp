// A rigid rotor on two hinges with springs and dampers: forward and backward whirl in closed form.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "simflex/body/Joint.h"
#include "simflex/forces/Bushing.h"
#include "simflex/solver/CampbellDiagram.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using namespace SimTK;

struct Rotor {
    static constexpr Real I1 = 0.02, I3 = 0.03, stiffness = 200, damping = 0.05;

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    MobilizedBody::Pin spin;
    State state;

    Rotor() {
        const Body::Massless ring;
        const Rotation zToX(Pi / 2, YAxis), zToY(-Pi / 2, XAxis);
        MobilizedBody::Pin aboutX(matter.Ground(), Transform(zToX), ring, Transform(zToX));
        MobilizedBody::Pin aboutY(aboutX, Transform(zToY), ring, Transform(zToY));
        spin = MobilizedBody::Pin(aboutY, Transform(),
                                  Body::Rigid(MassProperties(1, Vec3(0), Inertia(I1, I1, I3))),
                                  Transform());
        for (const MobilizedBody& hinge : {MobilizedBody(aboutX), MobilizedBody(aboutY)}) {
            Force::MobilityLinearSpring(forces, hinge, MobilizerQIndex(0), stiffness, 0);
            Force::MobilityLinearDamper(forces, hinge, MobilizerUIndex(0), damping);
        }
        state = system.realizeTopology();
    }
};

TEST(Campbell, RotorWhirlsForwardAndBackwardAsInClosedForm) {
    Rotor rotor;
    const std::vector<Real> speeds{0, 25, 50, 100, 200, 400};
    const CampbellDiagram diagram = calcCampbellDiagram(speeds, 2, [&](Real speed, int) {
        rotor.spin.setOneU(rotor.state, 0, speed);
        return calcEigenmodes(calcLinearization(rotor.system, rotor.state));
    });
    ASSERT_EQ(diagram.branches.size(), 2u);
    for (size_t i = 0; i < speeds.size(); ++i) {
        // I₁z̈ + (d − i I₃Ω)ż + kz = 0 for z = θ_x + iθ_y.
        const Complex b(Rotor::damping, -Rotor::I3 * speeds[i]);
        const Complex root = std::sqrt(b * b - 4 * Rotor::I1 * Rotor::stiffness);
        std::vector<Complex> expected{(-b + root) / (2 * Rotor::I1), (-b - root) / (2 * Rotor::I1)};
        std::sort(expected.begin(), expected.end(),
                  [](Complex a, Complex c) { return std::abs(a) < std::abs(c); });
        std::vector<Real> found{diagram.branches[0].frequency[i], diagram.branches[1].frequency[i]};
        const bool isSwapped = found[0] > found[1];
        for (size_t k = 0; k < 2; ++k) {
            const size_t branch = isSwapped ? 1 - k : k;
            const Real size = std::abs(expected[k]);
            EXPECT_NEAR(diagram.branches[branch].frequency[i], size / (2 * Pi), 1e-8 * size);
            EXPECT_NEAR(diagram.branches[branch].dampingRatio[i], -expected[k].real() / size, 1e-8);
        }
        // With speed, one branch rises and one falls, and mode shapes remain circles.
        if (i < 2) continue;
        for (const CampbellDiagram::Branch& branch : diagram.branches) {
            EXPECT_GT(branch.modalAssurance[i], 0.999);
            EXPECT_EQ(branch.frequency[i] > branch.frequency[i - 1],
                      branch.frequency[1] > branch.frequency[0]);
        }
    }
}

TEST(Campbell, ASpeedThatFailsIsNamedAndLosesNoOther) {
    Rotor rotor;
    const auto calcModes = [&](Real speed, int count) {
        if (speed == 0 || speed == 50) throw std::runtime_error("does not turn so");
        rotor.spin.setOneU(rotor.state, 0, speed);
        return calcSlowestEigenmodes(rotor.system, rotor.state, count);
    };
    const CampbellDiagram diagram = calcCampbellDiagram({0, 25, 50, 75}, 2, calcModes);
    const CampbellDiagram others = calcCampbellDiagram({25, 75}, 2, calcModes);
    EXPECT_EQ(diagram.failures,
              (std::vector<std::string>{"does not turn so", "", "does not turn so", ""}));
    for (size_t k = 0; k < 2; ++k) {
        for (const size_t i : {0, 2}) EXPECT_TRUE(isNaN(diagram.branches[k].frequency[i]));
        for (const size_t i : {0, 1}) {
            EXPECT_EQ(diagram.branches[k].frequency[2 * i + 1], others.branches[k].frequency[i]);
            EXPECT_EQ(diagram.branches[k].modalAssurance[2 * i + 1],
                      others.branches[k].modalAssurance[i]);
        }
    }
    const std::string file =
        ::testing::TempDir() + "/campbell." + std::to_string(::getpid()) + ".csv";
    writeCampbellDiagram(file, diagram);
    std::ifstream in(file);
    std::string line;
    std::getline(in, line);
    std::getline(in, line);
    EXPECT_EQ(line, "0,,,,");
    std::filesystem::remove(file);
    // More modes than exist at any speed.
    try {
        calcCampbellDiagram({25, 75}, 20, calcModes);
        FAIL() << "no exception";
    } catch (const std::runtime_error& error) {
        EXPECT_EQ(std::string(error.what()),
                  "calcCampbellDiagram(): there are no modes at any of the 2 speeds; at the first, "
                  "20 modes are asked for, there are 2");
    }
}

TEST(Campbell, WhirlsOfWhatTurnsGoThroughZero) {
    // A puck on a table, held by isotropic springs that rotate with its axes: λ = i(ω ∓ Ω). The
    // steps are too long to track modes by frequencies or shapes alone.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const Real mass = 2, stiffness = 800, omega = std::sqrt(stiffness / mass);
    const MobilizedBody::Free body(
        matter.Ground(), Transform(),
        Body::Rigid(MassProperties(mass, Vec3(0), Inertia(0.02, 0.02, 0.03))), Transform());
    Bushing(flexible, Attachment(matter.Ground()), Attachment(body),
            Bushing::diagonal(Vec6(0, 0, 0, stiffness, stiffness, stiffness)), Mat66(0));
    Joint::Planar(flexible, Attachment(matter.Ground()), Attachment(body));
    State state = system.realizeTopology();
    const std::vector<Real> speeds{1, 12, 35, 90, 300};
    const CampbellDiagram diagram = calcCampbellDiagram(speeds, 2, [&](Real speed, int count) {
        body.setUToFitAngularVelocity(state, Vec3(0, 0, speed));
        return calcSlowestEigenmodes(system, state, count);
    });
    for (size_t i = 0; i < speeds.size(); ++i) {
        EXPECT_NEAR(2 * Pi * diagram.branches[0].frequency[i], std::abs(omega - speeds[i]), 1e-6);
        EXPECT_NEAR(2 * Pi * diagram.branches[1].frequency[i], omega + speeds[i], 1e-6);
    }
}

TEST(Campbell, CsvHoldsALineForEachSpeed) {
    Rotor rotor;
    const CampbellDiagram diagram = calcCampbellDiagram({0, 10, 20}, 2, [&](Real speed, int count) {
        rotor.spin.setOneU(rotor.state, 0, speed);
        return calcSlowestEigenmodes(rotor.system, rotor.state, count);
    });
    const testing::TestFolder folder;
    const std::string file = folder / "campbell.csv";
    writeCampbellDiagram(file, diagram);
    std::ifstream in(file);
    std::string header, line;
    std::getline(in, header);
    EXPECT_EQ(header, "speed,frequency 1 [Hz],damping ratio 1,frequency 2 [Hz],damping ratio 2");
    int count = 0;
    while (std::getline(in, line)) ++count;
    EXPECT_EQ(count, 3);
    EXPECT_THROW(writeCampbellDiagram(folder / "none/campbell.csv", diagram), std::runtime_error);
    EXPECT_THROW(calcCampbellDiagram({}, 2,
                                     [&](Real, int numModes) {
                                         return calcSlowestEigenmodes(rotor.system, rotor.state,
                                                                      numModes);
                                     }),
                 std::invalid_argument);
}

}  // namespace
}  // namespace simflex
