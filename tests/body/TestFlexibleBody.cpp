/** @file
A flexible body in a Simbody system: energy, momentum and locations against sums over its point
masses; node attachments against known deformations. **/

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "support/PointMassMotion.h"

namespace simflex::test {
namespace {

using SimTK::Mat33;
using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Stage;
using SimTK::State;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

Vector toVector(const Eigen::VectorXd& v) {
    return Vector(int(v.size()), v.data());
}

/** Sets a motion's pose and speeds in the State. **/
void setMotion(const FlexibleBody& body, const PointMassMotion& motion, State& state) {
    Mat33 R;
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) R(i, j) = motion.R_GB(i, j);
    const Rotation R_GB(R);
    body.setFramePose(state, Transform(R_GB, toSimTK(motion.p_GB)));
    body.setFrameVelocity(state, SpatialVec(R_GB * toSimTK(motion.omega_B), toSimTK(motion.v_G)));
    body.setModalCoordinates(state, toVector(motion.xi));
    body.setModalSpeeds(state, toVector(motion.xiDot));
}

class FlexibleBodyTest : public ::testing::Test {
protected:
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
};

TEST_F(FlexibleBodyTest, EnergyAndMomentumAreThoseOfItsMasses) {
    const PointMassPart part = makePointMassPart();
    const FlexibleBody body(flexible, part.body);
    const SimTK::MobilizedBody::Free rigid(
        matter.Ground(),
        SimTK::Body::Rigid(SimTK::MassProperties(3, Vec3(0), SimTK::Inertia(1, 2, 2.5))));
    State state = system.realizeTopology();
    const PointMassMotion motion = PointMassMotion::makeRandom(part.body->numModes, 8);
    setMotion(body, motion, state);
    rigid.setUToFitVelocity(state, SpatialVec(Vec3(1, 2, 3), Vec3(4, 5, 6)));
    system.realize(state, Stage::Dynamics);

    const double T = test::calcKineticEnergy(part, motion);
    EXPECT_NEAR(body.calcKineticEnergy(state), T, 1e-13 * T);
    const double rigidT = 0.5 * (1 + 2 * 4 + 2.5 * 9) + 1.5 * 77;
    EXPECT_NEAR(flexible.calcKineticEnergy(state), T + rigidT, 1e-13 * (T + rigidT));
    double V = 0;
    for (int i = 0; i < motion.numModes(); ++i)
        V += 0.5 * part.body->omegaSquared[i] * std::pow(motion.xi[i], 2);
    EXPECT_NEAR(body.calcStrainEnergy(state), V, 1e-13 * V);
    EXPECT_NEAR(flexible.calcEnergy(state), T + rigidT + V, 1e-13 * V);

    const SpatialVec momentum = body.calcMomentum(state);
    EXPECT_LT((momentum[1] - toSimTK(calcLinearMomentum(part, motion))).norm(), 1e-13);
    EXPECT_LT((momentum[0] - toSimTK(calcAngularMomentum(part, motion))).norm(), 1e-13);
}

TEST_F(FlexibleBodyTest, NodesAreWhereTheMassesAre) {
    const PointMassPart part = makePointMassPart();
    const FlexibleBody body(flexible, part.body);
    State state = system.realizeTopology();
    const PointMassMotion motion = PointMassMotion::makeRandom(part.body->numModes, 9);
    setMotion(body, motion, state);
    system.realize(state, Stage::Velocity);
    const Eigen::Matrix3Xd x = calcMassLocations(part, motion),
                           v = calcMassVelocities(part, motion);
    double largest = 0;
    for (int k = 0; k < part.body->mesh.numNodes(); ++k) {
        const int number = part.body->mesh.nodeNumbers[k];
        EXPECT_LT((body.calcNodeLocation(state, number) - toSimTK(x.col(k))).norm(), 1e-14);
        largest = std::max(largest, body.calcNodeDisplacement(state, number).norm());
        const FrameMotion frame = body.node(number).calcMotion(state);
        EXPECT_LT((frame.X.p() - toSimTK(x.col(k))).norm(), 1e-14);
        EXPECT_LT((frame.V[1] - toSimTK(v.col(k))).norm(), 1e-13);
    }
    EXPECT_EQ(body.calcLargestDisplacement(state), largest);
}

/** Expects the largest displacement of all nodes at many ξ: with all modes, few, or one. **/
void expectLargestOfAll(const FlexibleBody& body, const SimTK::MultibodySystem& system) {
    const ReducedBody& part = body.getPart();
    SimTK::Random::Gaussian random;
    for (int trial = 0; trial < 120; ++trial) {
        Vector xi(part.numModes, Real(0));
        for (int i = 0; i < part.numModes; ++i)
            if (trial % 3 == 0 || i == trial % part.numModes || (trial % 3 == 1 && i % 4 == 1))
                xi[i] = random.getValue() * (trial % 2 ? 1e-3 : 1 / (1.0 + i * i));
        State state = system.getDefaultState();
        body.setModalCoordinates(state, xi);
        Real largest = 0;
        for (const int number : part.mesh.nodeNumbers)
            largest = std::max(largest, body.calcNodeDisplacement(state, number).norm());
        EXPECT_EQ(body.calcLargestDisplacement(state), largest) << trial;
    }
}

TEST_F(FlexibleBodyTest, LargestDisplacementIsThatOfAllNodesWhateverTheModesAndTheMesh) {
    // With thousands of nodes, all are evaluated until pruning pays.
    PointMassPartOptions options;
    options.cells = {40, 8, 6};
    const auto smooth = makePointMassPart(options).body;
    // Modes that differ in size at every node, and modes that are equal at all nodes.
    auto rough = std::make_shared<ReducedBody>(*smooth),
         even = std::make_shared<ReducedBody>(*smooth);
    SimTK::Random::Uniform random(-1, 1);
    for (double& value : rough->Phi) value = random.getValue();
    for (size_t k = 0; k < even->Phi.size(); ++k) even->Phi[k] = 1 + double(k % 3);
    // Nodes in a plane, on a line, at one point.
    auto plane = std::make_shared<ReducedBody>(*smooth),
         line = std::make_shared<ReducedBody>(*smooth),
         point = std::make_shared<ReducedBody>(*smooth);
    for (size_t k = 0; k < smooth->mesh.positions.size(); ++k) {
        if (k % 3 == 2) plane->mesh.positions[k] = 0.3;
        if (k % 3 > 0) line->mesh.positions[k] = -0.1;
        point->mesh.positions[k] = 0.2;
    }
    std::vector<FlexibleBody> bodies;
    for (const auto& part :
         {std::shared_ptr<const ReducedBody>(smooth), std::shared_ptr<const ReducedBody>(rough),
          std::shared_ptr<const ReducedBody>(even), std::shared_ptr<const ReducedBody>(plane),
          std::shared_ptr<const ReducedBody>(line), std::shared_ptr<const ReducedBody>(point)})
        bodies.emplace_back(flexible, part);
    system.realizeTopology();
    for (const FlexibleBody& body : bodies) {
        SCOPED_TRACE(int(body.getIndex()));
        expectLargestOfAll(body, system);
    }
}

TEST_F(FlexibleBodyTest, LargestDisplacementOfWhatIsNotANumberIsNone) {
    const FlexibleBody body(flexible, makePointMassPart().body);
    State state = system.realizeTopology();
    EXPECT_EQ(body.calcLargestDisplacement(state), 0);
    Vector xi(body.getNumModes(), Real(0));
    xi[3] = SimTK::NaN;
    body.setModalCoordinates(state, xi);
    EXPECT_TRUE(SimTK::isNaN(body.calcLargestDisplacement(state)));
}

TEST_F(FlexibleBodyTest, PoseByInterfacePutsTheInterfaceThere) {
    const FlexibleBody body(flexible, makePointMassPart().body);
    State state = system.realizeTopology();
    const Transform X_GI(Rotation(0.7, SimTK::UnitVec3(1, 2, 3)), Vec3(1, 2, 3));
    body.setPoseByInterface(state, "B", X_GI);
    system.realize(state, Stage::Velocity);
    const Transform found = body.interface("B").calcMotion(state).X;
    EXPECT_LT((found.p() - X_GI.p()).norm(), 1e-15);
    EXPECT_LT((Mat33(found.R()) - Mat33(X_GI.R())).norm(), 1e-15);
}

TEST_F(FlexibleBodyTest, BodiesOfOnePartShareItsMatrices) {
    const auto part = makePointMassPart().body;
    const FlexibleBody first(flexible, part), second(flexible, part, "other");
    EXPECT_EQ(flexible.getNumBodies(), 2);
    EXPECT_EQ(first.getName(), part->name);
    EXPECT_EQ(flexible.getBody(second.getIndex()).getName(), "other");
    const auto& guts = flexible.getGuts();
    EXPECT_EQ(guts.body(first.getIndex()).model, guts.body(second.getIndex()).model);
    EXPECT_EQ(second.getPartHandle(), part);
}

TEST_F(FlexibleBodyTest, PartWithoutModesIsARigidBody) {
    PointMassPartOptions options;
    options.numModes = 0;
    const PointMassPart part = makePointMassPart(options);
    const FlexibleBody body(flexible, part.body);
    State state = system.realizeTopology();
    EXPECT_EQ(state.getNU(), 6);
    const PointMassMotion motion = PointMassMotion::makeRandom(0, 4);
    setMotion(body, motion, state);
    system.realize(state, Stage::Dynamics);
    EXPECT_NEAR(body.calcKineticEnergy(state), test::calcKineticEnergy(part, motion), 1e-13);
    EXPECT_EQ(body.calcLargestDisplacement(state), 0);
    EXPECT_LT((body.node(3).calcMotion(state).X.p() - body.calcNodeLocation(state, 3)).norm(),
              1e-15);
}

/** Returns a part whose three "modes" are a rotation about (0.3, −0.2, 0.5), a pure strain, and a
general affine field. **/
std::shared_ptr<const ReducedBody> makeAffinePart() {
    PointMassPartOptions options;
    options.numModes = 3;
    options.cells = {2, 2, 2};
    auto part = std::make_shared<ReducedBody>(*makePointMassPart(options).body);
    const Vec3 axis(0.3, -0.2, 0.5);
    const Mat33 strain(0.1, 0.4, -0.3, 0.4, 0.2, 0.6, -0.3, 0.6, -0.5);
    const Mat33 affine(0.1, 0.7, -0.2, 0.3, -0.4, 0.8, 0.5, -0.6, 0.9);
    const int rows = 3 * part->mesh.numNodes();
    for (int node = 0; node < part->mesh.numNodes(); ++node) {
        const auto at = part->mesh.position(node);
        const Vec3 s(at[0], at[1], at[2]);
        const Vec3 fields[] = {axis % s, strain * s, affine * s + Vec3(1, 2, 3)};
        for (int i = 0; i < 3; ++i)
            for (int a = 0; a < 3; ++a) part->Phi[size_t(i) * rows + 3 * node + a] = fields[i][a];
    }
    return part;
}

TEST_F(FlexibleBodyTest, NodeAttachmentTurnsAsItsSurroundingsDo) {
    const FlexibleBody body(flexible, makeAffinePart());
    State state = system.realizeTopology();
    const auto rotationAt = [&](int node, const Vec3& xi) {
        body.setModalCoordinates(state, Vector(xi));
        system.realize(state, Stage::Velocity);
        return Mat33(body.node(node).calcMotion(state).X.R());
    };
    const Vec3 axis(0.3, -0.2, 0.5);
    // Half the axial vector of the affine field: (A₃₂ − A₂₃, A₁₃ − A₃₁, A₂₁ − A₁₂)/2.
    const Vec3 axial = 0.5 * Vec3(-0.6 - 0.8, -0.2 - 0.5, 0.3 - 0.7);
    for (const int node : {1, 5, 14, 27}) {
        EXPECT_LT((rotationAt(node, Vec3(1.3, 0, 0)) - Mat33(calcExponential(1.3 * axis))).norm(),
                  1e-13);
        EXPECT_LT((rotationAt(node, Vec3(0, 2, 0)) - Mat33(1)).norm(), 1e-13);
        EXPECT_LT((rotationAt(node, Vec3(0, 0, 0.9)) - Mat33(calcExponential(0.9 * axial))).norm(),
                  1e-13);
    }
}

TEST_F(FlexibleBodyTest, NodeAttachmentOnTetrahedraTurnsAsTheyDo) {
    auto part = std::make_shared<ReducedBody>(*makeAffinePart());
    // Splits each hexahedron into five tetrahedra.
    const std::vector<int> hexahedra = part->mesh.elements.front().nodes;
    ElementBlock block{ElementType::Tet4, {}};
    const int corners[5][4] = {
        {0, 1, 2, 5}, {0, 2, 3, 7}, {0, 5, 7, 4}, {2, 7, 5, 6}, {0, 2, 7, 5}};
    for (size_t element = 0; element < hexahedra.size(); element += 8)
        for (const auto& tetrahedron : corners)
            for (int corner : tetrahedron) block.nodes.push_back(hexahedra[element + corner]);
    part->mesh.elements = {block};
    const FlexibleBody body(flexible, part);
    State state = system.realizeTopology();
    body.setModalCoordinates(state, Vector(Vec3(0.7, 0.4, 0)));
    system.realize(state, Stage::Velocity);
    for (const int node : {1, 2, 14, 27}) {
        const Mat33 R(body.node(node).calcMotion(state).X.R());
        EXPECT_LT((R - Mat33(calcExponential(0.7 * Vec3(0.3, -0.2, 0.5)))).norm(), 1e-13);
    }
}

}  // namespace
}  // namespace simflex::test
