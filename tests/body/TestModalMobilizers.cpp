/** @file
Modal coordinates as Simbody's own mobilities: exact identity mass, no bias, no leak. **/

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/ModalMobilizer.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** One flexible body beside a rigid one, at a random state. **/
class ModalMobilizerTest : public ::testing::TestWithParam<int> {
protected:
    ModalMobilizerTest() : numModes(GetParam()) {
        matter.setShowDefaultGeometry(false);
        PointMassPartOptions options;
        options.numModes = numModes;
        part = makePointMassPart(options).body;
        gravity = std::make_unique<Force::Gravity>(general, matter, Vec3(0.3, -9.8, 2));
        body = std::make_unique<FlexibleBody>(flexible, part);
        pendulum = MobilizedBody::Pin(matter.Ground(),
                                      Body::Rigid(MassProperties(3, Vec3(0), Inertia(1))));
        state = system.realizeTopology();
        std::mt19937 random(numModes);
        std::uniform_real_distribution<double> unit(-1, 1);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = unit(random);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 100 * unit(random);
        system.realize(state, Stage::Velocity);
        for (int k = 0; k < body->getNumModalMobilizers(); ++k)
            for (int i = 0; i < body->getModalMobilizer(k).getNumU(state); ++i) {
                modalU.push_back(int(body->getModalMobilizer(k).getFirstUIndex(state)) + i);
                modalQ.push_back(int(body->getModalMobilizer(k).getFirstQIndex(state)) + i);
            }
    }

    int numModes;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem general{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::shared_ptr<const ReducedBody> part;
    std::unique_ptr<Force::Gravity> gravity;
    std::unique_ptr<FlexibleBody> body;
    MobilizedBody::Pin pendulum;
    State state;
    std::vector<int> modalU, modalQ;
};

INSTANTIATE_TEST_SUITE_P(Modes, ModalMobilizerTest, ::testing::Values(1, 5, 6, 7, 13, 24));

TEST_P(ModalMobilizerTest, EveryModeHasOneMobility) {
    EXPECT_EQ(int(modalU.size()), numModes);
    EXPECT_EQ(body->getNumModalMobilizers(), (numModes + 5) / 6);
    EXPECT_EQ(state.getNU(), 6 + numModes + 1);
    EXPECT_EQ(state.getNQ(), 7 + numModes + 1);
}

TEST_P(ModalMobilizerTest, SimbodysMassMatrixHasAnExactIdentityBlock) {
    Matrix M;
    matter.calcM(state, M);
    for (int i : modalU)
        for (int j = 0; j < M.ncol(); ++j) {
            EXPECT_EQ(M(i, j), i == j ? 1.0 : 0.0) << i << " " << j;
            EXPECT_EQ(M(j, i), i == j ? 1.0 : 0.0) << j << " " << i;
        }
    Matrix MInv;
    matter.calcMInv(state, MInv);
    for (int i : modalU)
        for (int j = 0; j < M.ncol(); ++j)
            EXPECT_EQ(MInv(i, j), i == j ? 1.0 : 0.0) << i << " " << j;
}

TEST_P(ModalMobilizerTest, ThereIsNoBiasForceAtAnySpeed) {
    Vector residual;
    matter.calcResidualForceIgnoringConstraints(state, Vector(), Vector_<SpatialVec>(), Vector(),
                                                residual);
    for (int i : modalU) EXPECT_EQ(residual[i], 0.0);
    for (int k = 0; k < body->getNumModalMobilizers(); ++k) {
        const MobilizedBodyIndex carrier = body->getModalMobilizer(k).getMobilizedBodyIndex();
        const SpatialVec centrifugal = matter.getTotalCentrifugalForces(state, carrier);
        EXPECT_EQ(centrifugal[0].norm() + centrifugal[1].norm(), 0.0);
    }
}

TEST_P(ModalMobilizerTest, UniformGravityDoesNotLeakIntoModes) {
    system.realize(state, Stage::Dynamics);
    Vector_<SpatialVec> weights(matter.getNumBodies(), SpatialVec(Vec3(0), Vec3(0)));
    for (MobilizedBodyIndex b(1); b < matter.getNumBodies(); ++b)
        weights[b][1] = matter.getMobilizedBody(b).getBodyMass(state) * Vec3(0.3, -9.8, 2);
    Vector generalized;
    matter.multiplyBySystemJacobianTranspose(state, weights, generalized);
    for (int i : modalU) EXPECT_LT(std::abs(generalized[i]), 1e-10);

    // Through realize(Acceleration): at rest and undeformed no mode is excited.
    for (int i : modalQ) state.updQ()[i] = 0;
    state.updU() = 0;
    system.realize(state, Stage::Acceleration);
    for (int i : modalU) EXPECT_LT(std::abs(state.getUDot()[i]), 1e-10);
    const SpatialVec A = body->getFrame().getBodyAcceleration(state);
    EXPECT_LT((A[1] - Vec3(0.3, -9.8, 2)).norm(), 1e-13);
    EXPECT_LT(A[0].norm(), 1e-13);
}

TEST_P(ModalMobilizerTest, SystemMassIsUnchanged) {
    EXPECT_NEAR(matter.calcSystemMass(state), part->mass + 3, 1e-15);
}

TEST_P(ModalMobilizerTest, QDotIsUExactly) {
    for (int i = 0; i < numModes; ++i) {
        EXPECT_EQ(state.getQDot()[modalQ[i]], state.getU()[modalU[i]]);
        EXPECT_EQ(body->getModalCoordinates(state)[i], state.getQ()[modalQ[i]]);
        EXPECT_EQ(body->getModalSpeeds(state)[i], state.getU()[modalU[i]]);
    }
}

TEST_P(ModalMobilizerTest, LockHoldsTheModes) {
    Vector xi(numModes);
    for (int i = 0; i < numModes; ++i) xi[i] = 0.01 * (i + 1);
    body->setModalCoordinates(state, xi);
    state.updU() = 1;
    for (int k = 0; k < body->getNumModalMobilizers(); ++k) body->getModalMobilizer(k).lock(state);
    RungeKuttaMersonIntegrator integrator(system);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.05);
    EXPECT_EQ((body->getModalCoordinates(stepper.getState()) - xi).norm(), 0.0);
    EXPECT_EQ(body->getModalSpeeds(stepper.getState()).norm(), 0.0);
}

TEST(ModalMobilizer, CarriesOneToSixModes) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    EXPECT_THROW(ModalMobilizer(matter, 0), std::invalid_argument);
    EXPECT_THROW(ModalMobilizer(matter, 7), std::invalid_argument);
    EXPECT_NO_THROW(ModalMobilizer(matter, 6));
}

}  // namespace
}  // namespace simflex::test
