/** @file
Warnings about large deformations, and strain energy by modes. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/part/PartColumns.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class LinearRangeTest : public ::testing::Test {
protected:
    /** Returns a State in which one mode displaces some node by this share of the part's size. **/
    State bend(int mode, Real share) const {
        State state = system.realizeTopology();
        Vector xi(part->numModes, Real(0));
        xi[mode] =
            share * 2 * part->calcRadius() / part->calcLargestModeDisplacements()[size_t(mode)];
        body.setModalCoordinates(state, xi);
        state.setTime(0.25);
        system.realize(state, Stage::Velocity);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    FlexibleBody body{flexible, part, "boom"};
    std::vector<std::string> messages;
    LinearRangeReporter reporter{flexible, 0.01,
                                 [this](const std::string& text) { messages.push_back(text); }};
};

TEST_F(LinearRangeTest, SilentBelowTenPercentAndNamesBodyNodeAndTimeAbove) {
    const auto displacementMessages = [&] {
        std::vector<std::string> found;
        for (const std::string& text : messages)
            if (text.find("displaced") != std::string::npos) found.push_back(text);
        return found;
    };
    reporter.handleEvent(bend(2, 0.099));
    EXPECT_TRUE(displacementMessages().empty());
    const State state = bend(2, 0.12);
    reporter.handleEvent(state);
    reporter.handleEvent(state);  // reported once
    ASSERT_EQ(displacementMessages().size(), 1u);
    // The named node moves most.
    int worst = 0;
    Real largest = 0;
    for (const int number : part->mesh.nodeNumbers) {
        const Real moved = body.calcNodeDisplacement(state, number).norm();
        if (moved > largest) worst = number;
        largest = std::max(largest, moved);
    }
    EXPECT_THAT(displacementMessages()[0],
                AllOf(HasSubstr("'boom' at t = 0.25 s"),
                      HasSubstr("node " + std::to_string(worst) + " is"), HasSubstr("12 %")));
}

TEST_F(LinearRangeTest, LargeRotationsOfInterfacesAreNamed) {
    for (const Real angle : {0.19, 0.21}) {
        State state = system.realizeTopology();
        const ReducedBody::Interface& interface = part->interfaces[1];
        Real norm = 0;
        for (int a = 0; a < 3; ++a) norm += square(interface.Psi[size_t(a)]);
        Vector xi(part->numModes, Real(0));
        xi[0] = angle / std::sqrt(norm);
        body.setModalCoordinates(state, xi);
        system.realize(state, Stage::Velocity);
        messages.clear();
        LinearRangeReporter(flexible, 1, [this](const std::string& text) {
            messages.push_back(text);
        }).handleEvent(state);
        bool isNamed = false;
        for (const std::string& text : messages)
            isNamed = isNamed || text.find("interface '" + interface.name +
                                           "' is rotated by 0.21 rad") != std::string::npos;
        // The other interface may rotate further and be named instead: it passes the limit first.
        Real other = 0;
        for (int a = 0; a < 3; ++a) other += square(part->interfaces[0].Psi[size_t(a)] * xi[0]);
        if (std::sqrt(other) <= LinearRangeReporter::LargestRotation) {
            EXPECT_EQ(isNamed, angle > 0.2);
        }
    }
}

TEST_F(LinearRangeTest, AxialLoadWithoutStiffeningIsNamed) {
    // The part compressed between its interfaces.
    Vector xi(part->numModes, Real(0));
    const ReducedBody::Interface &A = part->interfaces[0], &B = part->interfaces[1];
    const Vec3 d = Vec3(B.position[0] - A.position[0], B.position[1] - A.position[1],
                        B.position[2] - A.position[2])
                       .normalize();
    for (int i = 0; i < xi.size(); ++i)
        for (int a = 0; a < 3; ++a)
            xi[i] += d[a] * (A.Phi[size_t(3 * i + a)] - B.Phi[size_t(3 * i + a)]) /
                     part->omegaSquared[size_t(i)];
    const PartColumns::Load unit = PartColumns(*part).findLargest(&xi[0]).compression;
    ASSERT_GT(unit.share, 0);
    const auto countMessages = [&](Real share) {
        State state = system.realizeTopology();
        body.setModalCoordinates(state, share / unit.share * xi);
        system.realize(state, Stage::Velocity);
        reporter.handleEvent(state);
        reporter.handleEvent(state);
        int count = 0;
        for (const std::string& text : messages)
            if (text.find("between interfaces 'A' and 'B' by") != std::string::npos) ++count;
        return count;
    };
    EXPECT_EQ(countMessages(0.099), 0);
    EXPECT_EQ(countMessages(-0.199), 0);  // pulled
    EXPECT_EQ(countMessages(0.101), 1);   // once
    messages.clear();
    reporter.setWarned({});
    EXPECT_EQ(countMessages(-0.201), 1);
}

TEST_F(LinearRangeTest, StrainEnergiesOfModesAddUpToTheBodys) {
    State state = system.realizeTopology();
    Vector xi(part->numModes);
    for (int i = 0; i < xi.size(); ++i) xi[i] = 0.01 * (i - 4);
    body.setModalCoordinates(state, xi);
    system.realize(state, Stage::Velocity);
    const Vector energies = body.calcModalStrainEnergies(state);
    EXPECT_DOUBLE_EQ(energies[7], 0.5 * part->omegaSquared[7] * square(xi[7]));
    EXPECT_NEAR(energies.sum(), body.calcStrainEnergy(state), 1e-13 * energies.sum());
}

TEST_F(LinearRangeTest, IntervalMustBePositive) {
    EXPECT_THROW(LinearRangeReporter(flexible, 0), std::invalid_argument);
}

}  // namespace
}  // namespace simflex::test
