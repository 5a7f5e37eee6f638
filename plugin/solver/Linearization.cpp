#include "simflex/solver/Linearization.h"

#include "simflex/solver/ImplicitStep.h"
#include "simflex/solver/SimbodyNumbering.h"

namespace simflex {

using namespace SimTK;
using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Matrix3d crossMatrix(const Vector3d& a) {
    Matrix3d cross;
    cross << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return cross;
}

Matrix toMatrix(const MatrixXd& from) {
    Matrix to(int(from.rows()), int(from.cols()));
    for (int j = 0; j < to.ncol(); ++j)
        for (int i = 0; i < to.nrow(); ++i) to(i, j) = from(i, j);
    return to;
}

/** δ̇ = δu − A δ and δu̇ = d(δu)/dt + B δu in axes that turn with the bodies, Simbody's numbering.
 * **/
struct MovingAxes {
    MatrixXd A, B, ADot;
};

MovingAxes calcMovingAxes(MultibodyEquations& equations, const CoordinateScales& scales,
                          const SolutionPoint& point, const MatrixXd& T, const State& state) {
    MovingAxes axes;
    axes.A = T * calcRateMatrix(equations, scales, point) * T.transpose();
    axes.B = axes.ADot = MatrixXd::Zero(T.rows(), T.cols());
    const SimbodyMatterSubsystem& matter = equations.getMatter();
    const VectorXd u = T * Map<const VectorXd>(point.u.data(), equations.numU());
    const VectorXd uDot = T * Map<const VectorXd>(point.uDot.data(), equations.numU());
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (!MobilizedBody::Free::isInstanceOf(mobod) ||
            mobod.getParentMobilizedBody().getMobilizedBodyIndex() != GroundIndex)
            continue;
        // ω and v in the axes of F, here and now; a flexible frame's F is Ground.
        const int first = mobod.getFirstUIndex(state);
        const Matrix3d omega = crossMatrix(u.segment<3>(first));
        const Matrix3d omegaDot = crossMatrix(uDot.segment<3>(first));
        int q0, nq, u0;
        const bool isRigid = equations.findRigidSlots(i, q0, nq, u0);
        axes.A.block<6, 6>(first, first).setZero();
        axes.A.block<3, 3>(first + 3, first + 3) = omega;
        axes.B.block<3, 3>(first + 3, first + 3) = omega;
        axes.ADot.block<3, 3>(first + 3, first + 3) = omegaDot;
        if (isRigid) {
            axes.B.block<3, 3>(first, first) = omega;
        } else {
            // ω_B is in turning axes already, and δω_B = δ̇ + ω×δ.
            axes.A.block<3, 3>(first, first) = omega;
            axes.ADot.block<3, 3>(first, first) = omegaDot;
        }
    }
    return axes;
}

}  // namespace

Linearization calcLinearization(const MultibodySystem& system, const State& state,
                                const std::function<void()>& observer) {
    requireTopology(system, state, "calcLinearization()");
    Linearization result;
    result.state = state;
    system.realize(result.state, Stage::Velocity);
    MultibodyEquations equations(system, result.state, MultibodyEquations::Setting::Linearize);
    for (int row = 0; row < equations.numMultipliers(); ++row)
        if (equations.getRowLevel(row) != MotionLevel::Position)
            throw std::invalid_argument(
                "calcLinearization(): " + equations.describeConstraint(row) +
                " holds speeds or accelerations; only constraints of "
                "positions can be linearised: disable it");

    SolutionPoint point;
    point.resize(equations.numQ(), equations.numU(), equations.numMultipliers(), equations.numZ());
    point.t = result.state.getTime();
    equations.getFromState(result.state, point.q.data(), point.u.data());
    for (size_t i = 0; i < point.z.size(); ++i) point.z[i] = result.state.getZ()[int(i)];
    equations.setZ(point.z.data());
    equations.prescribe(point.t, 0, nullptr, point.q.data(), point.u.data());
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    step.calcAccelerations(point.t, point.q, point.u, point.uDot, point.lambda);

    const CoordinateScales scales(equations);
    MatrixXd M, G;
    equations.realize(point.t, point.q.data(), point.u.data());
    equations.calcResidual(point.q.data(), point.u.data(), point.uDot.data(), point.lambda.data(),
                           VectorXd(equations.numU()).data());
    calcMassAndJacobian(equations, M, G);
    const MatrixXd K =
        differentiateByQ(equations, scales, point.t, point.q, point.u,
                         [&](const std::vector<double>& q, VectorXd& r) {
                             if (observer) observer();
                             equations.realize(point.t, q.data(), point.u.data());
                             equations.calcResidual(q.data(), point.u.data(), point.uDot.data(),
                                                    point.lambda.data(), r.data());
                         });
    const MatrixXd D = calcDampingMatrix(equations, scales, point);

    // M(δ̈ + (A + B)δ̇ + (Ȧ + BA)δ) + D(δ̇ + Aδ) + Kδ + Gᵀδλ = 0.
    const MatrixXd T = calcSimbodyNumbering(equations, point.q.data());
    const MovingAxes axes = calcMovingAxes(equations, scales, point, T, result.state);
    const MatrixXd mass = T * M * T.transpose(), damping = T * D * T.transpose();
    MatrixXd fullDamping = damping + mass * (axes.A + axes.B);
    MatrixXd fullStiffness =
        T * K * T.transpose() + mass * axes.ADot + (damping + mass * axes.B) * axes.A;
    MatrixXd jacobian = G * T.transpose();

    const int n = equations.numU();
    result.isHeld.resize(unsigned(n), 0);
    result.isModal.resize(unsigned(n), 0);
    std::vector<char> isModal(size_t(n), 0);
    for (int b = 0; b < equations.numFlexibleBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        std::fill_n(isModal.begin() + block.firstU + 6, block.numU - 6, char(1));
    }
    result.metres.resize(n);
    result.uDot.resize(n);
    const VectorXd uDot = T * Map<const VectorXd>(point.uDot.data(), n);
    for (int i = 0; i < n; ++i) {
        Eigen::Index own;
        T.row(i).cwiseAbs().maxCoeff(&own);  // one of its own mobilizer, held as a whole
        result.metres[i] = scales.metres[size_t(own)];
        result.uDot[i] = uDot[i];
        result.isModal[unsigned(i)] = isModal[size_t(own)];
        if (!equations.isPrescribed(int(own))) continue;
        result.isHeld[unsigned(i)] = 1;
        for (MatrixXd* matrix : {&fullDamping, &fullStiffness}) {
            matrix->row(i).setZero();
            matrix->col(i).setZero();
        }
    }
    result.M = toMatrix(mass);
    result.D = toMatrix(fullDamping);
    result.K = toMatrix(fullStiffness);
    result.G = toMatrix(jacobian);
    result.multipliers.resize(equations.numMultipliers());
    for (int k = 0; k < equations.numMultipliers(); ++k)
        result.multipliers[k] = point.lambda[size_t(k)];
    return result;
}

}  // namespace simflex
