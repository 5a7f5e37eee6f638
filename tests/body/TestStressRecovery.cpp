/** @file
Stress and motion of nodes at a State, their extremes and histories over a run. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <vector>

#include "simflex/body/StressExtremes.h"
#include "simflex/body/StressHistory.h"
#include "simflex/body/StressRecovery.h"
#include "simflex/part/TableFile.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"
#include "support/TestFolder.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;
using Quantity = StressHistory::Quantity;

/** Returns the part with random stress and strain at the given mesh nodes. **/
std::shared_ptr<const ReducedBody> withStress(const ReducedBody& part, std::vector<int> nodes) {
    ReducedBody stressed = part;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(-1, 1);
    ReducedBody::ModalStress modal;
    modal.nodes = std::move(nodes);
    modal.stress.resize(6 * modal.nodes.size() * size_t(part.numModes));
    modal.strain.resize(modal.stress.size());
    for (float& value : modal.stress) value = 1e9f * unit(random);
    for (float& value : modal.strain) value = unit(random);
    stressed.modalStress = std::move(modal);
    return std::make_shared<const ReducedBody>(std::move(stressed));
}

std::vector<int> countTo(int count, int skipped = -1) {
    std::vector<int> nodes;
    for (int k = 0; k < count; ++k)
        if (k != skipped) nodes.push_back(k);
    return nodes;
}

SymMat33 makeTensor(Real xx, Real yy, Real zz, Real xy, Real xz, Real yz) {
    return SymMat33(xx, xy, yy, xz, yz, zz);
}

template <class Work>
std::string errorOf(const Work& work) {
    try {
        work();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "accepted";
}

class StressRecoveryTest : public ::testing::Test {
protected:
    static constexpr int Skipped = 5;  ///< mesh index of a node without stress

    StressRecoveryTest() {
        const auto bare = makePointMassPart().body;
        part = withStress(*bare, countTo(bare->mesh.numNodes(), Skipped));
        body.emplace(flexible, part, "boom");
        plain.emplace(flexible, bare, "plain");
    }

    /** Returns a State with nonzero speeds. **/
    State move(Real size = 0.01) const {
        State state = system.realizeTopology();
        Vector xi(part->numModes), xiDot(part->numModes);
        for (int i = 0; i < xi.size(); ++i) {
            xi[i] = size * std::sin(1 + i);
            xiDot[i] = 10 * size * std::cos(2 + i);
        }
        body->setModalCoordinates(state, xi);
        body->setModalSpeeds(state, xiDot);
        body->setFramePose(state, Transform(Rotation(0.7, UnitVec3(1, 2, -1)), Vec3(1, 2, 3)));
        body->setFrameVelocity(state, SpatialVec(Vec3(1, -2, 0.5), Vec3(0.1, 0.2, -0.3)));
        system.realize(state, Stage::Velocity);
        return state;
    }

    /** Returns S ξ by definition, for the k-th node with stress. **/
    SymMat33 expectedStress(const State& state, size_t k) const {
        const Vector xi = body->getModalCoordinates(state);
        Real s[6] = {};
        for (int i = 0; i < xi.size(); ++i)
            for (size_t c = 0; c < 6; ++c)
                s[c] +=
                    xi[i] *
                    Real(part->modalStress
                             ->stress[6 * part->modalStress->nodes.size() * size_t(i) + 6 * k + c]);
        return makeTensor(s[0], s[1], s[2], s[3], s[4], s[5]);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::shared_ptr<const ReducedBody> part;
    std::optional<FlexibleBody> body, plain;
    const testing::TestFolder folder;
};

TEST(StressMeasures, HaveTheValuesOfTextbookStates) {
    const SymMat33 tension = makeTensor(5, 0, 0, 0, 0, 0), shear = makeTensor(0, 0, 0, 0, 2, 0),
                   pressure = makeTensor(-7, -7, -7, 0, 0, 0);
    EXPECT_DOUBLE_EQ(calcVonMises(tension), 5);
    EXPECT_DOUBLE_EQ(calcVonMises(shear), 2 * std::sqrt(3.0));
    EXPECT_DOUBLE_EQ(calcVonMises(pressure), 0);
    EXPECT_DOUBLE_EQ(calcSignedVonMises(tension), 5);
    EXPECT_DOUBLE_EQ(calcSignedVonMises(-tension), -5);
    const Vec3 principal = calcPrincipalValues(makeTensor(3, 3, 1, 1, 0, 0));
    EXPECT_NEAR(principal[0], 4, 1e-14);
    EXPECT_NEAR(principal[1], 2, 1e-14);
    EXPECT_NEAR(principal[2], 1, 1e-14);
}

TEST(StressMeasures, ArePrincipalValuesOfTurnedTensors) {
    const Vec3 values(30, -4, -50);
    const Rotation R(0.9, UnitVec3(3, 1, 2));
    const SymMat33 turned = R.reexpressSymMat33(makeTensor(-4, 30, -50, 0, 0, 0));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(calcPrincipalValues(turned)[k], values[k], 1e-12);
    EXPECT_NEAR(calcVonMises(turned), std::sqrt(0.5 * (square(34.0) + square(46.0) + square(80.0))),
                1e-12);
    EXPECT_NEAR(calcSignedVonMises(turned), -calcVonMises(turned), 1e-12);
}

TEST_F(StressRecoveryTest, IsTheSumOverTheModesAtAllNodesOrAFew) {
    const State state = move();
    StressRecovery all(*body);
    ASSERT_EQ(all.getNumNodes(), part->mesh.numNodes() - 1);
    Array_<SymMat33> stress;
    all.calcStress(state, stress);
    for (int k = 0; k < all.getNumNodes(); ++k)
        EXPECT_LT((stress[unsigned(k)] - expectedStress(state, size_t(k))).norm(),
                  1e-12 * stress[unsigned(k)].norm());
    // A subset, in the requested order, is bit-identical.
    StressRecovery few(*body, {all.getNodeNumber(9), all.getNodeNumber(2)});
    Array_<SymMat33> ofFew;
    few.calcStress(state, ofFew);
    EXPECT_EQ(ofFew[0], stress[9]);
    EXPECT_EQ(ofFew[1], stress[2]);
    Vector vonMises;
    few.calcVonMises(state, vonMises);
    EXPECT_EQ(vonMises[0], calcVonMises(stress[9]));
    Array_<Vec3> principal;
    few.calcPrincipalStress(state, principal);
    EXPECT_EQ(principal[1], calcPrincipalValues(stress[2]));
}

TEST_F(StressRecoveryTest, InGroundTurnsWithTheBodyAndMeasuresDoNot) {
    const State state = move();
    StressRecovery all(*body);
    Array_<SymMat33> inBody, inGround, strain;
    all.calcStress(state, inBody);
    all.calcStress(state, inGround, StressRecovery::Axes::Ground);
    const Mat33 R = body->getFramePose(state).R().asMat33();
    for (unsigned k = 0; k < inBody.size(); ++k) {
        const Mat33 turned = R * Mat33(inBody[k]) * ~R;
        EXPECT_LT((turned - Mat33(inGround[k])).norm(), 1e-13 * inBody[k].norm());
        EXPECT_NEAR(calcVonMises(inGround[k]), calcVonMises(inBody[k]),
                    1e-13 * calcVonMises(inBody[k]));
    }
    all.calcStrain(state, strain);
    EXPECT_EQ(strain.size(), inBody.size());
}

TEST_F(StressRecoveryTest, RigidMotionGivesNone) {
    State state = move();
    body->setModalCoordinates(state, Vector(part->numModes, Real(0)));
    system.realize(state, Stage::Velocity);
    Vector vonMises;
    StressRecovery(*body).calcVonMises(state, vonMises);
    EXPECT_EQ(vonMises.normInf(), 0);
}

TEST_F(StressRecoveryTest, MotionOfNodesIsThatOfTheBodyAndItsTimeDerivative) {
    const State state = move();
    StressRecovery all = StressRecovery::atAllNodes(*body);
    Array_<Vec3> u, p, v;
    all.calcDisplacement(state, u);
    all.calcLocation(state, p);
    all.calcVelocity(state, v);
    ASSERT_EQ(int(u.size()), part->mesh.numNodes());
    const Real h = 1e-6;
    Array_<Vec3> at[2];
    for (const int side : {0, 1}) {
        State moved = state;
        moved.updQ() += (2 * side - 1) * h * state.getQDot();
        system.realize(moved, Stage::Position);
        all.calcLocation(moved, at[side]);
    }
    for (int k = 0; k < all.getNumNodes(); ++k) {
        const int number = all.getNodeNumber(k);
        EXPECT_LT((u[unsigned(k)] - body->calcNodeDisplacement(state, number)).norm(), 1e-15);
        EXPECT_LT((p[unsigned(k)] - body->calcNodeLocation(state, number)).norm(), 1e-14);
        EXPECT_LT((v[unsigned(k)] - (at[1][unsigned(k)] - at[0][unsigned(k)]) / (2 * h)).norm(),
                  1e-8);
    }
}

TEST_F(StressRecoveryTest, WhatHasNoStressSaysHowToGetIt) {
    const State state = move();
    Vector vonMises;
    EXPECT_THAT(errorOf([&] { StressRecovery(*plain).calcVonMises(state, vonMises); }),
                AllOf(HasSubstr("'plain'"), HasSubstr("--stress")));
    Array_<SymMat33> tensors;
    EXPECT_THAT(errorOf([&] { StressRecovery(*plain).calcStress(state, tensors); }),
                AllOf(HasSubstr("'plain'"), HasSubstr("--stress")));
    EXPECT_THAT(errorOf([&] { StressRecovery(*plain).calcStrain(state, tensors); }),
                AllOf(HasSubstr("'plain'"), HasSubstr("--stress")));
    const int number = part->mesh.nodeNumbers[Skipped];
    StressRecovery one(*body, {number});
    EXPECT_THAT(errorOf([&] { one.calcVonMises(state, vonMises); }),
                AllOf(HasSubstr("'boom'"), HasSubstr("node " + std::to_string(number)),
                      HasSubstr("--stress=all")));
    EXPECT_THAT(errorOf([&] { StressRecovery(*body, {4711}); }),
                AllOf(HasSubstr("'boom'"), HasSubstr("4711")));
    // Displacements need no stress.
    Array_<Vec3> u;
    one.calcDisplacement(state, u);
    EXPECT_LT((u[0] - body->calcNodeDisplacement(state, number)).norm(), 1e-15);
}

TEST_F(StressRecoveryTest, ManyNodesGiveTheBitsOfEachAlone) {
    const State state = move();
    StressRecovery all(*body);
    std::vector<int> numbers;
    while (numbers.size() < 20000)  // enough for several threads
        numbers.push_back(all.getNodeNumber(int(numbers.size()) % all.getNumNodes()));
    StressRecovery many(*body, numbers);
    Array_<SymMat33> stress, ofMany;
    Array_<Vec3> principal, principalOfMany;
    all.calcStress(state, stress);
    many.calcStress(state, ofMany);
    all.calcPrincipalStress(state, principal);
    many.calcPrincipalStress(state, principalOfMany);
    for (unsigned k = 0; k < ofMany.size(); ++k) {
        ASSERT_EQ(ofMany[k], stress[k % stress.size()]);
        ASSERT_EQ(principalOfMany[k], principal[k % stress.size()]);
    }
}

TEST_F(StressRecoveryTest, ExtremesAreThoseOfTheStatesSeen) {
    StressExtremes extremes(flexible, 0.1);
    EXPECT_TRUE(isNaN(extremes.getExtremes(*body).vonMises.value));
    Real largest = 0, least = Infinity, displacement = 0;
    int where = 0;
    Real when = -1;
    for (int step = 0; step < 5; ++step) {
        State state = move(0.01 * std::sin(1.0 + step));
        state.setTime(0.1 * step);
        extremes.handleEvent(state);
        for (int node = 0; node < part->mesh.numNodes(); ++node) {
            const int number = part->mesh.nodeNumbers[size_t(node)];
            displacement = std::max(displacement, body->calcNodeDisplacement(state, number).norm());
            if (node == Skipped) continue;
            const SymMat33 stress = expectedStress(state, size_t(node > Skipped ? node - 1 : node));
            least = std::min(least, calcPrincipalValues(stress)[2]);
            if (calcVonMises(stress) <= largest) continue;
            largest = calcVonMises(stress);
            where = number;
            when = state.getTime();
        }
    }
    const auto& found = extremes.getExtremes(*body);
    EXPECT_NEAR(found.vonMises.value, largest, 1e-12 * largest);
    EXPECT_EQ(found.vonMises.nodeNumber, where);
    EXPECT_EQ(found.vonMises.time, when);
    const auto s = part->mesh.position(part->mesh.indexOf(where));
    for (int a = 0; a < 3; ++a)
        EXPECT_DOUBLE_EQ(found.vonMises.position[a], s[size_t(a)] + part->centerOfMass[size_t(a)]);
    EXPECT_NEAR(found.leastPrincipal.value, least, 1e-12 * std::abs(least));
    EXPECT_NEAR(found.displacement.value, displacement, 1e-12 * displacement);
    EXPECT_TRUE(isNaN(extremes.getExtremes(*plain).vonMises.value));
    EXPECT_EQ(extremes.getExtremes(*plain).displacement.value, 0);
    std::ostringstream text;
    extremes.write(text);
    EXPECT_THAT(text.str(), HasSubstr("boom, largest von Mises stress [Pa]"));
    EXPECT_THROW(StressExtremes(flexible, 0), std::invalid_argument);
}

TEST_F(StressRecoveryTest, HistoriesHaveAColumnAChannelAndEvenTimes) {
    const int first = part->mesh.nodeNumbers[3], second = part->mesh.nodeNumbers[8];
    for (const char* ending : {".csv", ".h5"}) {
        const std::string path = folder / ("run" + std::string(ending));
        StressHistory history(path, 0.01);
        for (const Quantity quantity :
             {Quantity::Stress, Quantity::StressInGround, Quantity::Strain, Quantity::VonMises,
              Quantity::SignedVonMises, Quantity::PrincipalStress, Quantity::Displacement})
            history.addChannels(*body, quantity, {first, second});
        ASSERT_EQ(history.getChannels().size(), 2u * (6 + 6 + 6 + 1 + 1 + 3 + 3));
        Array_<SymMat33> stress;
        std::vector<Real> vonMises, sxy;
        for (int step = 0; step < 4; ++step) {
            State state = move(0.01 * (step - 1.5));
            state.setTime(0.01 * step);
            system.realize(state, Stage::Velocity);
            history.handleEvent(state);
            history.handleEvent(state);  // repeating it adds nothing
            StressRecovery(*body, {first, second}).calcStress(state, stress);
            vonMises.push_back(calcSignedVonMises(stress[1]));
            sxy.push_back(stress[0](1, 0));
        }
        EXPECT_THROW(history.addChannels(*body, Quantity::Stress, {first}), std::logic_error);
        history.flush();
        const Table table = readTable(path);
        EXPECT_EQ(table.times, (std::vector<double>{0, 0.01, 0.02, 0.03}));
        const std::string name = "boom." + std::to_string(second) + ".signed_von_mises";
        EXPECT_EQ(table.getColumn(name), vonMises);
        EXPECT_EQ(table.getColumn("boom." + std::to_string(first) + ".stress_xy"), sxy);
        // Time cannot go back.
        State early = move();
        system.realize(early, Stage::Velocity);
        EXPECT_THAT(errorOf([&] { history.handleEvent(early); }),
                    AllOf(HasSubstr("time went back"), HasSubstr(path)));
    }
}

TEST_F(StressRecoveryTest, ChannelsWithoutStressAreRefusedBeforeTheRun) {
    StressHistory history(folder / "run.csv", 0.01);
    const int number = part->mesh.nodeNumbers[Skipped];
    EXPECT_THAT(errorOf([&] { history.addChannels(*body, Quantity::VonMises, {number}); }),
                HasSubstr("--stress=all"));
    EXPECT_THAT(errorOf([&] { history.addChannels(*plain, Quantity::Strain, {number}); }),
                HasSubstr("'plain'"));
    history.addChannels(*plain, Quantity::Displacement, {number});
    EXPECT_EQ(history.getChannels().size(), 3u);
}

TEST_F(StressRecoveryTest, ARunIsRecordedAndItsExtremesAreThoseOfTheRecord) {
    const std::string path = folder / "run.h5";
    std::vector<int> numbers;
    for (const int node : part->modalStress->nodes)
        numbers.push_back(part->mesh.nodeNumbers[size_t(node)]);
    auto* history = new StressHistory(path, 0.0005);
    history->addChannels(*body, Quantity::VonMises, numbers);
    auto* extremes = new StressExtremes(flexible, 0.0005);
    system.addEventReporter(history);
    system.addEventReporter(extremes);

    // Released from a shape bent in its lowest mode, a body swings as cos Ωt.
    State state = system.realizeTopology();
    Vector xi(part->numModes, Real(0));
    xi[0] = 1e-4;
    body->setModalCoordinates(state, xi);
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.initialize(state);
    integrator.stepTo(0.02);
    history->flush();

    const Table table = readTable(path);
    ASSERT_EQ(table.times.size(), 41u);
    Real largest = 0, when = 0;
    int where = 0;
    for (size_t row = 0; row < table.times.size(); ++row) {
        EXPECT_NEAR(table.times[row], 0.0005 * double(row), 1e-12);
        for (size_t k = 0; k < numbers.size(); ++k) {
            const Real value = table.values[row * numbers.size() + k];
            if (value <= largest) continue;
            largest = value;
            where = numbers[k];
            when = table.times[row];
        }
    }
    const auto& found = extremes->getExtremes(*body).vonMises;
    EXPECT_EQ(found.value, largest);
    EXPECT_EQ(found.nodeNumber, where);
    EXPECT_EQ(found.time, when);
    const Real Omega = std::sqrt(part->omegaSquared[0]);
    const std::vector<double> column =
        table.getColumn("boom." + std::to_string(numbers[0]) + ".von_mises");
    for (size_t row = 0; row < column.size(); ++row)
        EXPECT_NEAR(column[row], column[0] * std::abs(std::cos(Omega * table.times[row])),
                    1e-2 * column[0]);
}

}  // namespace
}  // namespace simflex::test
