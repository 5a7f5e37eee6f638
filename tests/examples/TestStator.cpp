// The stator of the source paper, with the example's reduced parts: natural frequencies, weight,
// energy, and a run-up through a critical speed, against linear theory implemented here without
// Simbody.

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "simflex/part/ReducedBodyFile.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "support/StatorModel.h"

namespace simflex {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using examples::LinearModel;
using examples::StatorModel;
using examples::StatorOptions;

using Parts = std::vector<std::shared_ptr<const ReducedBody>>;

const Parts& getParts() {
    static const Parts parts = [] {
        Parts result;
        for (const std::string name : StatorModel::getPartNames())
            result.push_back(std::make_shared<const ReducedBody>(
                readReducedBody(std::string(SIMFLEX_BINARY_DIR) + "/parts/" + name + ".h5")));
        return result;
    }();
    return parts;
}

/** M v̈ + D v̇ + K v = f with G v = 0, all parts in engine axes; v = (translation, rotation, ξ)
part by part.
**/
struct LinearStator {
    MatrixXd M, K, D, G;
    MatrixXd Z;  ///< null space of G

    explicit LinearStator(double dampingRatio);
    int firstOf(int part) const { return m_first[part]; }
    /** Returns the 6×n map to translation and rotation of an interface's master point. **/
    MatrixXd calcMotionMap(int part, const std::string& interface) const;

private:
    std::vector<int> m_first;
};

Eigen::Matrix3d crossMatrix(const Eigen::Vector3d& a) {
    Eigen::Matrix3d result;
    result << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return result;
}

LinearStator::LinearStator(double dampingRatio) {
    int n = 0;
    for (const auto& part : getParts()) {
        m_first.push_back(n);
        n += 6 + part->numModes;
    }
    M = MatrixXd::Identity(n, n);
    K = D = MatrixXd::Zero(n, n);
    for (int p = 0; p < StatorModel::NumParts; ++p) {
        const ReducedBody& part = *getParts()[p];
        const int first = m_first[p];
        M.block<3, 3>(first, first) *= part.mass;
        const auto& I = part.inertia;
        M.block<3, 3>(first + 3, first + 3) << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
        for (int i = 0; i < part.numModes; ++i) {
            K(first + 6 + i, first + 6 + i) = part.omegaSquared[i];
            D(first + 6 + i, first + 6 + i) = 2 * dampingRatio * std::sqrt(part.omegaSquared[i]);
        }
    }
    G = MatrixXd::Zero(4 * 6 + 3 * 3, n);
    for (int flange = 0; flange < 4; ++flange)
        G.middleRows(6 * flange, 6) =
            calcMotionMap(flange, "rear") - calcMotionMap(flange + 1, "front");
    G.middleRows(24, 3) = calcMotionMap(0, "left").topRows(3);
    G.middleRows(27, 3) = calcMotionMap(0, "right").topRows(3);
    G.middleRows(30, 3) = calcMotionMap(4, "mount").topRows(3);
    const MatrixXd Q = Eigen::HouseholderQR<MatrixXd>(G.transpose()).householderQ();
    Z = Q.rightCols(n - G.rows());
}

MatrixXd LinearStator::calcMotionMap(int p, const std::string& interface) const {
    const ReducedBody& part = *getParts()[p];
    const ReducedBody::Interface& seat = part.getInterface(interface);
    const int first = m_first[p];
    MatrixXd map = MatrixXd::Zero(6, M.rows());
    map.block<6, 6>(0, first).setIdentity();
    map.block<3, 3>(0, first + 3) = -crossMatrix(Eigen::Vector3d(seat.position.data()));
    map.block(0, first + 6, 3, part.numModes) =
        Eigen::Map<const MatrixXd>(seat.Phi.data(), 3, part.numModes);
    map.block(3, first + 6, 3, part.numModes) =
        Eigen::Map<const MatrixXd>(seat.Psi.data(), 3, part.numModes);
    return map;
}

TEST(Stator, PartsHaveTheModesOfThePaper) {
    const int craigBampton[] = {50, 32, 26, 32, 26};
    // The turbine is axisymmetric: its last mode is one of a pair.
    const int numTwins[] = {0, 0, 0, 1, 0};
    for (int p = 0; p < StatorModel::NumParts; ++p)
        EXPECT_EQ(getParts()[p]->numModes, craigBampton[p] - 6 + numTwins[p])
            << getParts()[p]->name;
}

TEST(Stator, NaturalFrequenciesFromSimbodysMatricesAreThoseOfTheJoinedParts) {
    const LinearStator stator(0);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(
        stator.Z.transpose() * stator.K * stator.Z, stator.Z.transpose() * stator.M * stator.Z,
        Eigen::EigenvaluesOnly);
    StatorModel model({}, getParts());
    const LinearModel linear = model.makeLinearModel();
    ASSERT_EQ(linear.getNumModes(), eigen.eigenvalues().size());
    for (int k = 0; k < linear.getNumModes(); ++k) {
        const double expected = std::sqrt(eigen.eigenvalues()[k]) / (2 * M_PI);
        EXPECT_NEAR(linear.getFrequency(k), expected, 1e-7 * expected) << "mode " << k;
    }
}

// CalculiX 2.20 on all five meshes at once (250 227 DOF), *FREQUENCY: mating flange faces, bearing
// bores and hinge bores are each a *RIGID BODY; the hinges' reference nodes are held. A reduced
// model is stiffer, so its frequencies are higher.
TEST(Stator, NaturalFrequenciesAreThoseOfTheWholeFiniteElementModel) {
    const double calculix[] = {92.85962, 116.4121, 182.5380, 224.3783,
                               279.2850, 358.1647, 405.7570, 431.1485};
    StatorModel model({}, getParts());
    const LinearModel linear = model.makeLinearModel();
    for (int k = 0; k < 8; ++k) {
        // 14 normal modes per part cost at most 0.33 %.
        EXPECT_GT(linear.getFrequency(k), calculix[k] * (1 - 1e-5)) << "mode " << k;
        EXPECT_LT(linear.getFrequency(k), calculix[k] * 1.004) << "mode " << k;
    }
}

TEST(Stator, ModesAboutItsStaticEquilibriumAreThoseOfTheJoinedParts) {
    StatorOptions undamped;
    undamped.damping = 0;
    StatorModel model(undamped, getParts());
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.makeUndeformedState());
    const LinearModel linear = model.makeLinearModel();
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, equilibrium.getState()));
    ASSERT_EQ(int(modes.size()), linear.getNumModes());
    for (size_t k = 0; k < modes.size(); ++k) {
        const double expected = linear.getFrequency(int(k));
        // The weight stiffens and softens by (g/sag)/ω²: a millionth.
        EXPECT_NEAR(modes[k].frequency, expected, 1e-5 * expected) << "mode " << k;
    }
    double weight = 0;
    for (const auto& part : getParts()) weight += part->mass * model.getOptions().gravity;
    SimTK::Vec3 sum(0);
    for (const Joint& hinge :
         {Joint(model.leftHinge), Joint(model.rightHinge), Joint(model.rearHinge)})
        sum += hinge.calcForceOnM(equilibrium.getState(), equilibrium.getMultipliers(hinge))[1];
    EXPECT_LT((sum - SimTK::Vec3(0, weight, 0)).norm(), 1e-9 * weight);
}

TEST(Stator, EveryModeIsDampedByTheParts) {
    StatorModel model({}, getParts());
    const LinearModel linear = model.makeLinearModel();
    const std::vector<Eigenmode> modes =
        calcEigenmodes(calcLinearization(model.system, model.makeUndeformedState()));
    // Coupling through D shifts frequencies by at most ζ²; ratios above those of the lowest modes
    // differ more.
    const double ratio = model.getOptions().damping;
    for (size_t k = 0; k < 8; ++k) {
        const double expected = linear.getFrequency(int(k));
        EXPECT_NEAR(modes[k].frequency, expected, ratio * ratio * expected) << "mode " << k;
        EXPECT_NEAR(modes[k].dampingRatio, linear.getDampingRatio(int(k)), ratio * ratio)
            << "mode " << k;
    }
    for (const Eigenmode& mode : modes) EXPECT_LT(mode.eigenvalue.real(), 0);
}

TEST(Stator, RestsOnItsHingesAndTheyCarryItsWeight) {
    StatorModel model({}, getParts());
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.makeInitialState());
    double mass = 0;
    for (const auto& part : getParts()) mass += part->mass;
    const double weight = mass * model.getOptions().gravity;

    SimTK::Vec3 sum(0);
    for (const Joint& hinge :
         {Joint(model.leftHinge), Joint(model.rightHinge), Joint(model.rearHinge)}) {
        const SimTK::Vec3 force =
            hinge.calcForceOnM(integrator.getState(), integrator.getMultipliers(hinge))[1];
        EXPECT_GT(force[1], 0) << hinge.getName();
        sum += force;
    }
    // The linear static equilibrium leaves second-order accelerations: 1e-3 m/s² of 9.81.
    EXPECT_NEAR(sum[1], weight, 1e-4 * weight);
    EXPECT_NEAR(sum[0], 0, 1e-4 * weight);
    EXPECT_NEAR(sum[2], 0, 1e-4 * weight);

    // It stays there: without unbalance nothing moves by more than a thousandth of the sag.
    StatorOptions still;
    still.frontUnbalance = still.rearUnbalance = 0;
    StatorModel resting(still, getParts());
    BdfIntegrator rest(resting.system);
    rest.setAccuracy(1e-9);
    rest.initialize(resting.makeInitialState());
    const SimTK::Vec3 before =
        resting.calcBearingDisplacement(rest.getState(), StatorModel::RearBearing);
    rest.stepTo(0.05);
    const SimTK::Vec3 after =
        resting.calcBearingDisplacement(rest.getState(), StatorModel::RearBearing);
    EXPECT_LT(before[1], 0);
    EXPECT_LT((after - before).norm(), 1e-3 * std::abs(before[1]));
}

/** Run-up to 160 Hz within 0.2 s: through the critical speed at 116 Hz. **/
StatorOptions makeShortRunUp() {
    StatorOptions options;
    options.speed = 160;
    options.runUp = 0.2;
    return options;
}

TEST(Stator, EnergyMinusWorkVanishesWithAccuracy) {
    std::vector<double> errors;
    for (const double accuracy : {1e-7, 1e-8, 1e-9}) {
        StatorModel model(makeShortRunUp(), getParts());
        BdfIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(model.makeInitialState());
        model.system.realize(integrator.getState(), SimTK::Stage::Dynamics);
        const double start = model.flexible.calcEnergy(integrator.getState());
        integrator.stepTo(0.2);
        model.system.realize(integrator.getState(), SimTK::Stage::Dynamics);
        errors.push_back(std::abs(model.flexible.calcEnergy(integrator.getState()) - start -
                                  integrator.getWork()) /
                         std::abs(integrator.getWork()));
    }
    EXPECT_LT(errors[1], errors[0] / 2.5);
    EXPECT_LT(errors[2], errors[1] / 2.5);
    EXPECT_LT(errors[2], 3e-3);
}

TEST(Stator, RunUpThroughACriticalSpeedFollowsLinearTheory) {
    const StatorOptions options = makeShortRunUp();
    StatorModel model(options, getParts());
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-10);
    integrator.initialize(model.makeInitialState());
    const SimTK::Vec3 sag[] = {
        model.calcBearingDisplacement(integrator.getState(), StatorModel::FrontBearing),
        model.calcBearingDisplacement(integrator.getState(), StatorModel::RearBearing)};

    // The same by the midpoint rule in the null space of the joints, with 3000 steps per rotor turn
    // of 1/160 s.
    const LinearStator stator(options.damping);
    const MatrixXd M = stator.Z.transpose() * stator.M * stator.Z,
                   K = stator.Z.transpose() * stator.K * stator.Z,
                   D = stator.Z.transpose() * stator.D * stator.Z;
    const MatrixXd seats[] = {stator.calcMotionMap(1, "bearing").topRows(3) * stator.Z,
                              stator.calcMotionMap(3, "bearing").topRows(3) * stator.Z};
    const double h = 1e-5;
    const Eigen::LDLT<MatrixXd> matrix(M + h / 2 * D + h * h / 4 * K);
    VectorXd q = VectorXd::Zero(M.rows()), v = q;
    double largestDifference = 0, largest = 0;
    for (int step = 0; step < 20000; ++step) {
        const double middle = (step + 0.5) * h;
        VectorXd f = VectorXd::Zero(q.size());
        for (auto bearing : {StatorModel::FrontBearing, StatorModel::RearBearing}) {
            const SimTK::Vec3 force = model.calcUnbalanceForce(bearing, middle);
            f += seats[bearing].transpose() * Eigen::Vector3d(force[0], force[1], force[2]);
        }
        const VectorXd change = matrix.solve(h * (f - D * v - K * (q + h / 2 * v)));
        q += h * (v + change / 2);
        v += change;
        if (step % 100 != 99) continue;
        integrator.stepTo((step + 1) * h);
        for (auto bearing : {StatorModel::FrontBearing, StatorModel::RearBearing}) {
            const Eigen::Vector3d expected = seats[bearing] * q;
            const SimTK::Vec3 found =
                model.calcBearingDisplacement(integrator.getState(), bearing) - sag[bearing];
            largest = std::max(largest, expected.norm());
            largestDifference =
                std::max(largestDifference,
                         (expected - Eigen::Vector3d(found[0], found[1], found[2])).norm());
        }
    }
    EXPECT_GT(largest, 5e-5);  // resonance has occurred
    EXPECT_LT(largestDifference, 5e-3 * largest);
}

}  // namespace
}  // namespace simflex
