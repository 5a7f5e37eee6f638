/** @file
Loads spread over a part: consistent nodal forces in closed form, resultants, power and work. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/NativeReference.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

//-------------------------------------------------------------------------------------------------
// one element: a mode for each node's displacement along one axis reads its nodal force

ReducedBody makeOneElement(ElementType type, const std::vector<std::array<double, 3>>& nodes) {
    ReducedBody part;
    part.name = "element";
    ElementBlock block;
    block.type = type;
    for (size_t k = 0; k < nodes.size(); ++k) {
        part.mesh.nodeNumbers.push_back(int(k) + 1);
        block.nodes.push_back(int(k));
        part.mesh.positions.insert(part.mesh.positions.end(), nodes[k].begin(), nodes[k].end());
    }
    part.mesh.elements.push_back(block);
    part.numModes = int(3 * nodes.size());
    part.Phi.assign(size_t(part.numModes) * 3 * nodes.size(), 0);
    for (size_t i = 0; i < size_t(part.numModes); ++i) part.Phi[i * size_t(part.numModes) + i] = 1;
    std::vector<int> all(nodes.size());
    std::iota(all.begin(), all.end(), 0);
    part.mesh.nodeSets["ALL"] = all;
    return part;
}

/** Mesh indices of the nodes with this z. **/
std::vector<int> findNodesAt(const ReducedBody& part, double z) {
    std::vector<int> nodes;
    for (int k = 0; k < part.mesh.numNodes(); ++k)
        if (part.mesh.position(k)[2] == z) nodes.push_back(k);
    return nodes;
}

using Nodes = std::vector<std::array<double, 3>>;

/** The first `corners` nodes, then mid-points of the pairs. **/
Nodes addMiddles(Nodes corners, const std::vector<std::pair<int, int>>& edges) {
    for (const auto& [a, b] : edges) {
        std::array<double, 3> middle;
        for (size_t i = 0; i < 3; ++i)
            middle[i] = 0.5 * (corners[size_t(a)][i] + corners[size_t(b)][i]);
        corners.push_back(middle);
    }
    return corners;
}

const Nodes boxCorners{{0, 0, 0}, {2, 0, 0}, {2, 3, 0}, {0, 3, 0},
                       {0, 0, 1}, {2, 0, 1}, {2, 3, 1}, {0, 3, 1}};
const Nodes box20 = addMiddles(boxCorners, {{0, 1},
                                            {1, 2},
                                            {2, 3},
                                            {3, 0},
                                            {4, 5},
                                            {5, 6},
                                            {6, 7},
                                            {7, 4},
                                            {0, 4},
                                            {1, 5},
                                            {2, 6},
                                            {3, 7}});
const Nodes tetCorners{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 1}};
const Nodes tet10 = addMiddles(tetCorners, {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}});
const Nodes wedgeCorners{{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 1}, {2, 0, 1}, {0, 3, 1}};
const Nodes wedge15 = addMiddles(
    wedgeCorners, {{0, 1}, {1, 2}, {2, 0}, {3, 4}, {4, 5}, {5, 3}, {0, 3}, {1, 4}, {2, 5}});

struct FaceCase {
    const char* name;
    ElementType type;
    Nodes nodes;
    double area;            ///< of the face z = 0
    double corner, middle;  ///< shares of the force that its nodes take
};
void PrintTo(const FaceCase& face, std::ostream* stream) {
    *stream << face.name;
}

class FaceTest : public ::testing::TestWithParam<FaceCase> {};
INSTANTIATE_TEST_SUITE_P(
    Elements, FaceTest,
    ::testing::Values(FaceCase{"Hex8", ElementType::Hex8, boxCorners, 6, 0.25, 0},
                      FaceCase{"Hex20", ElementType::Hex20, box20, 6, -1. / 12, 1. / 3},
                      FaceCase{"Tet4", ElementType::Tet4, tetCorners, 3, 1. / 3, 0},
                      FaceCase{"Tet10", ElementType::Tet10, tet10, 3, 0, 1. / 3},
                      FaceCase{"Wedge6", ElementType::Wedge6, wedgeCorners, 3, 1. / 3, 0},
                      FaceCase{"Wedge15", ElementType::Wedge15, wedge15, 3, 0, 1. / 3}),
    [](const auto& test) { return std::string(test.param.name); });

TEST_P(FaceTest, UniformLoadGivesTheTextbooksNodalForces) {
    const FaceCase& test = GetParam();
    ReducedBody part = makeOneElement(test.type, test.nodes);
    const std::vector<int> face = findNodesAt(part, 0);
    part.mesh.nodeSets["BOTTOM"] = face;
    const bool isTriangle = test.area == 3;
    const size_t corners = isTriangle ? 3 : 4;
    const LoadShape pressure = LoadShape::pressure(part, "BOTTOM");
    const LoadShape traction = LoadShape::traction(part, "BOTTOM", Vec3(1, 2, -3));
    for (int k = 0; k < part.mesh.numNodes(); ++k) {
        const auto found = std::find(face.begin(), face.end(), k);
        const bool isIn = found != face.end();
        const double share = !isIn                                    ? 0
                             : size_t(found - face.begin()) < corners ? test.corner
                                                                      : test.middle;
        const Vec3 onNode(traction.modal[3 * k], traction.modal[3 * k + 1],
                          traction.modal[3 * k + 2]);
        EXPECT_LT((onNode - share * test.area * Vec3(1, 2, -3)).norm(), 1e-13) << k;
        // Pressure on the bottom pushes upwards.
        EXPECT_NEAR(pressure.modal[3 * k + 2], share * test.area, 1e-13) << k;
        EXPECT_NEAR(std::hypot(pressure.modal[3 * k], pressure.modal[3 * k + 1]), 0, 1e-13) << k;
    }
    EXPECT_LT((traction.force - test.area * Vec3(1, 2, -3)).norm(), 1e-12);
    EXPECT_LT((pressure.force - Vec3(0, 0, test.area)).norm(), 1e-12);
}

TEST_P(FaceTest, PressureAllAroundHasNoResultant) {
    const FaceCase& test = GetParam();
    ReducedBody part = makeOneElement(test.type, test.nodes);
    // Curve the element: moved nodes keep the surface closed.
    for (size_t i = 0; i < part.mesh.positions.size(); ++i)
        part.mesh.positions[i] += 0.05 * std::sin(3.0 * double(i));
    const LoadShape shape = LoadShape::pressure(part, "ALL");
    EXPECT_LT(shape.force.norm(), 1e-13);
    EXPECT_LT(shape.torque.norm(), 1e-12);
    EXPECT_GT(shape.modal.normInf(), 0.1);
}

//-------------------------------------------------------------------------------------------------
// on a body

class DistributedLoadTest : public ::testing::Test {
protected:
    DistributedLoadTest() {
        for (int k = 0; k < part->mesh.numNodes(); ++k) {
            nodes.push_back(k);
            forces.emplace_back(std::sin(1.0 + k), std::cos(2.0 * k), std::sin(3.0 - k));
        }
    }

    State makeState() {
        State state = system.realizeTopology();
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.4 * std::sin(2.3 * i + 1);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = std::cos(1.7 * i);
        body.setModalCoordinates(state, 0.05 * body.getModalCoordinates(state));
        system.realize(state, Stage::Position);
        matter.normalizeQuaternions(state);
        state.setTime(0.3);
        system.realize(state, Stage::Velocity);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    FlexibleBody body{flexible, part, "plate"};
    std::vector<int> nodes;
    std::vector<Vec3> forces;
};

TEST_F(DistributedLoadTest, PowerIsThatOfTheNodalForcesOnTheMovingNodes) {
    const Real others = calcPowerOfForces(flexible, makeState());
    DistributedLoad(flexible, body, LoadShape::fromNodalForces(*part, nodes, forces),
                    [](Real t) { return 10 * t; });
    const State state = makeState();
    const Real power = calcPowerOfForces(flexible, state) - others;

    const Rotation R_GB = body.getFrame().getBodyRotation(state);
    const Real h = 1e-4;
    Real expected = 0;
    State ahead = state, behind = state;
    ahead.updQ() += h * state.getQDot();
    behind.updQ() -= h * state.getQDot();
    system.realize(ahead, Stage::Velocity);
    system.realize(behind, Stage::Velocity);
    for (size_t k = 0; k < nodes.size(); ++k) {
        const int number = part->mesh.nodeNumbers[k];
        const Vec3 v =
            (body.calcNodeLocation(ahead, number) - body.calcNodeLocation(behind, number)) /
            (2 * h);
        expected += 10 * 0.3 * (~(R_GB * forces[k]) * v);
    }
    EXPECT_NEAR(power, expected, 1e-6 * std::abs(expected));
}

TEST_F(DistributedLoadTest, ImplicitAndNativeAccelerationsAgree) {
    DistributedLoad(flexible, body, LoadShape::fromNodalForces(*part, nodes, forces), 50);
    LoadShape modal = LoadShape::fromModalForces(Vector(part->numModes, 3.0));
    DistributedLoad(flexible, body, modal, [](Real t) { return 100 + t; });
    State state = makeState();
    BdfIntegrator integrator(system);
    integrator.initialize(state);
    const Vector own = integrator.getUDot();
    system.realize(state, Stage::Acceleration);
    EXPECT_LT((own - state.getUDot()).normInf(), 1e-10 * own.normInf());
}

TEST_F(DistributedLoadTest, EnergyFollowsTheWorkOfTheLoads) {
    DistributedLoad(flexible, body, LoadShape::fromNodalForces(*part, nodes, forces),
                    [](Real t) { return 40 * std::sin(30 * t); });
    const State state = makeState();
    Real drifts[2];
    for (int k = 0; k < 2; ++k) {
        State start = state;
        start.setTime(0);
        BdfIntegrator integrator(system);
        integrator.setAccuracy(k ? 1e-8 : 1e-6);
        integrator.initialize(start);
        system.realize(integrator.getState(), Stage::Dynamics);
        const Real before = flexible.calcEnergy(integrator.getState());
        integrator.stepTo(0.05);
        system.realize(integrator.getState(), Stage::Dynamics);
        EXPECT_GT(std::abs(integrator.getWork()), 0.1);
        drifts[k] =
            std::abs(flexible.calcEnergy(integrator.getState()) - before - integrator.getWork());
    }
    EXPECT_LT(drifts[1], drifts[0] / 5);
}

TEST_F(DistributedLoadTest, ErrorsNameWhatIsWrong) {
    const auto messageOf = [](const auto& action) -> std::string {
        try {
            action();
        } catch (const std::exception& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(messageOf([&] { LoadShape::pressure(*part, "TOP"); }),
                HasSubstr("has no node set 'TOP'; it has: "));
    EXPECT_THAT(messageOf([&] { LoadShape::fromNodalForces(*part, {9999}, {Vec3(1)}); }),
                HasSubstr("node index 9999"));
    EXPECT_THAT(messageOf([&] {
                    DistributedLoad(flexible, body, LoadShape::fromModalForces(Vector(3, 1.0)));
                }),
                HasSubstr("'plate': the load shape is of 3 modes, the body has 11"));
    Vector modal(11, 1.0);
    modal[10] = NaN;
    EXPECT_THAT(
        messageOf([&] { DistributedLoad(flexible, body, LoadShape::fromModalForces(modal)); }),
        AllOf(HasSubstr("DistributedLoad on 'plate'"), HasSubstr("a modal force is not a number")));
    EXPECT_THAT(
        messageOf([&] {
            DistributedLoad(flexible, body, LoadShape::fromModalForces(Vector(11, 1.0)), Infinity);
        }),
        AllOf(HasSubstr("DistributedLoad on 'plate'"), HasSubstr("the scale is not a number")));
    EXPECT_THAT(messageOf([&] {
                    DistributedLoad(flexible, body, LoadShape::fromModalForces(modal), 1, "wind");
                }),
                StartsWith("'wind': a modal force"));
    ReducedBody lonely = makeOneElement(ElementType::Hex8, boxCorners);
    lonely.mesh.nodeSets["EDGE"] = {0, 1};
    EXPECT_THAT(messageOf([&] { LoadShape::pressure(lonely, "EDGE"); }),
                HasSubstr("holds no whole element face"));
}

}  // namespace
}  // namespace simflex::test
