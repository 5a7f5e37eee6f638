#include "simflex/body/FlexibleBodyEquations.h"

namespace simflex {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Matrix3d crossMatrix(const Vector3d& x) {
    Matrix3d matrix;
    matrix << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0;
    return matrix;
}

/** Writes A·x and A·y while reading A once, four columns at a time: the product is bound by memory,
 * not arithmetic. **/
void multiplyTwo(const MatrixXd& A, const Ref<const VectorXd>& x, const Ref<const VectorXd>& y,
                 VectorXd& Ax, VectorXd& Ay) {
    const Eigen::Index rows = A.rows(), columns = A.cols();
    Ax.setZero();
    Ay.setZero();
    double *ax = Ax.data(), *ay = Ay.data();
    Eigen::Index j = 0;
    for (; j + 4 <= columns; j += 4) {
        const double *a0 = A.data() + j * rows, *a1 = a0 + rows, *a2 = a1 + rows, *a3 = a2 + rows;
        const double x0 = x[j], x1 = x[j + 1], x2 = x[j + 2], x3 = x[j + 3];
        const double y0 = y[j], y1 = y[j + 1], y2 = y[j + 2], y3 = y[j + 3];
#pragma GCC ivdep
        for (Eigen::Index i = 0; i < rows; ++i) {
            ax[i] += a0[i] * x0 + a1[i] * x1 + a2[i] * x2 + a3[i] * x3;
            ay[i] += a0[i] * y0 + a1[i] * y1 + a2[i] * y2 + a3[i] * y3;
        }
    }
    for (; j < columns; ++j) {
        Ax += A.col(j) * x[j];
        Ay += A.col(j) * y[j];
    }
}

}  // namespace

FlexibleBodyModel::FlexibleBodyModel(std::shared_ptr<const ReducedBody> reducedPart)
    : part(std::move(reducedPart)),
      n(part->numModes),
      mass(part->mass),
      radius(part->calcRadius()) {
    inertia = symmetricMatrix(Map<const Eigen::Matrix<double, 6, 1>>(part->inertia.data()));
    I1 = Map<const MatrixXd>(part->I1.data(), 6, n).transpose();
    stacked.resize(9 * n, n);
    for (int c = 0; c < 9; ++c) {
        const auto& component = c < 6 ? part->I2[c] : part->N[c - 6];
        stacked.middleRows(c * n, n) = Map<const MatrixXd>(component.data(), n, n);
    }
    omegaSquared = Map<const VectorXd>(part->omegaSquared.data(), n);
    const std::vector<double> largest = part->calcLargestModeDisplacements();
    displacementPerMode = Map<const VectorXd>(largest.data(), n);
    for (const ReducedBody::Interface& interface : part->interfaces) {
        const auto& s = interface.position;
        interfaceShapes.push_back(std::make_shared<const FrameShapes>(
            FrameShapes{SimTK::Vec3(s[0], s[1], s[2]), interface.Phi, interface.Psi}));
    }
}

const std::shared_ptr<const FrameShapes>& FlexibleBodyModel::getInterfaceShapes(
    const std::string& name) const {
    return interfaceShapes[size_t(&part->getInterface(name) - part->interfaces.data())];
}

void FlexibleBodyData::resize(int n) {
    atXi.setZero(9 * n);
    atXiDot.setZero(9 * n);
    B.setZero(n, 6);
    C.setZero(3, n);
    I.setZero();
    IDot.setZero();
    CXiDot.setZero();
}

Matrix3d symmetricMatrix(const Eigen::Matrix<double, 6, 1>& c) {
    Matrix3d matrix;
    matrix << c[0], c[3], c[4], c[3], c[1], c[5], c[4], c[5], c[2];
    return matrix;
}

void calcInertia(const FlexibleBodyModel& model, const Ref<const VectorXd>& xi,
                 const Ref<const VectorXd>& xiDot, FlexibleBodyData& data) {
    const int n = model.n;
    multiplyTwo(model.stacked, xi, xiDot, data.atXi, data.atXiDot);

    // I = I₀ + Σ_j ξ_j (I₁ⱼ + I₂ⱼᵢξᵢ), İ = Σ_j ξ̇_j ∂I/∂ξ_j.
    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>> I2Xi(data.atXi.data(), n, 6);
    data.B = model.I1 + 2 * I2Xi;
    data.I = model.inertia + symmetricMatrix(model.I1.transpose() * xi + I2Xi.transpose() * xi);
    data.IDot = symmetricMatrix(data.B.transpose() * xiDot);

    // C_a = ξᵀN_a = −(N_a ξ)ᵀ.
    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> NXi(data.atXi.data() + 6 * n, n, 3);
    data.C = -NXi.transpose();
    data.CXiDot = data.C * xiDot;
}

void calcVelocityTerms(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                       const Vector3d& omega, Vector3d& rotation, Ref<VectorXd> modes) {
    const int n = model.n;
    rotation = data.IDot * omega + omega.cross(data.I * omega + data.CXiDot);

    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> NXiDot(data.atXiDot.data() + 6 * n, n,
                                                                     3);
    Eigen::Matrix<double, 6, 1> omegaProducts;  // ½ωᵀBω by components
    omegaProducts << 0.5 * omega[0] * omega[0], 0.5 * omega[1] * omega[1],
        0.5 * omega[2] * omega[2], omega[0] * omega[1], omega[0] * omega[2], omega[1] * omega[2];
    modes.noalias() = -2 * (NXiDot * omega);
    modes.noalias() -= data.B * omegaProducts;
}

void addInInertiaTerms(const FlexibleBodyData& data, const Vector3d& omegaDot,
                       const Ref<const VectorXd>& xiDotDot, Vector3d& rotation,
                       Ref<VectorXd> modes) {
    rotation.noalias() += data.I * omegaDot + data.C * xiDotDot;
    modes.noalias() += data.C.transpose() * omegaDot;
    modes += xiDotDot;
}

void calcNewtonMatrix(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                      const NewtonFactors& factors, const Vector3d& omega, const Vector3d& omegaDot,
                      const Ref<const VectorXd>& xiDotDot, const Ref<const VectorXd>& damping,
                      Ref<MatrixXd> J) {
    const int n = model.n;
    const double mass = factors.mass, stiffness = factors.stiffness;
    J.setZero();
    const Vector3d h = data.I * omega + data.CXiDot;
    J.topLeftCorner<3, 3>() =
        data.I / mass + data.IDot + crossMatrix(omega) * data.I - crossMatrix(h);
    J.block<3, 3>(3, 3).diagonal().setConstant(model.mass / mass);

    // ω rows against ξ̇, column j: C/γ + B_jω + ω×C_j + γ[B_jω̇ + N_jξ̈ + Ḃ_jω + ω×(B_jω) + ω×(N_jξ̇)].
    const auto N = [&](int a) { return model.stacked.middleRows((6 + a) * n, n); };
    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>> I2XiDot(data.atXiDot.data(), n, 6);
    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> NXiDot(data.atXiDot.data() + 6 * n, n,
                                                                     3);
    Eigen::Matrix<double, Eigen::Dynamic, 3> NXiDotDot(n, 3);
    for (int a = 0; a < 3; ++a) NXiDotDot.col(a).noalias() = N(a) * xiDotDot;
    for (int j = 0; j < n; ++j) {
        const Matrix3d Bj = symmetricMatrix(data.B.row(j).transpose());
        const Matrix3d BjDot = 2 * symmetricMatrix(I2XiDot.row(j).transpose());
        const Vector3d Bomega = Bj * omega, Nj = NXiDot.row(j).transpose();
        const Vector3d atRate = data.C.col(j) / mass + Bomega + omega.cross(data.C.col(j));
        const Vector3d atPosition =
            Bj * omegaDot + NXiDotDot.row(j).transpose() + BjDot * omega + omega.cross(Bomega + Nj);
        J.block<3, 1>(0, 6 + j) = atRate + stiffness * atPosition;
        // ξ rows against ω: Cᵀ/γ − 2N_aξ̇ − B_jω.
        J.block<1, 3>(6 + j, 0) = (data.C.col(j) / mass - 2 * Nj - Bomega).transpose();
    }

    // ξ rows against ξ̇: 1/γ + d + γΩ² − 2Σω_aN_a + γ(Σω̇_aN_aᵀ − ωωᵀ:I₂).
    auto modal = J.bottomRightCorner(n, n);
    for (int a = 0; a < 3; ++a)
        modal.noalias() -= (2 * omega[a] + stiffness * omegaDot[a]) * N(a);  // N_aᵀ = −N_a
    const double products[6] = {omega[0] * omega[0],     omega[1] * omega[1],
                                omega[2] * omega[2],     2 * omega[0] * omega[1],
                                2 * omega[0] * omega[2], 2 * omega[1] * omega[2]};
    for (int c = 0; c < 6; ++c)
        modal.noalias() -= stiffness * products[c] * model.stacked.middleRows(c * n, n);
    modal.diagonal() += damping + stiffness * model.omegaSquared;
    modal.diagonal().array() += 1 / mass;
}

double calcKineticEnergy(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                         const Vector3d& omega, const Vector3d& v,
                         const Ref<const VectorXd>& xiDot) {
    return 0.5 * model.mass * v.squaredNorm() + 0.5 * omega.dot(data.I * omega) +
           omega.dot(data.CXiDot) + 0.5 * xiDot.squaredNorm();
}

}  // namespace simflex
