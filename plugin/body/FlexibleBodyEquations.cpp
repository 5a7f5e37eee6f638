#include "simflex/body/FlexibleBodyEquations.h"

#include <algorithm>

#include "simflex/base/Chunk.h"
#include "simflex/base/Dot.h"

namespace simflex {

using Eigen::Map;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

/** Entries that vanish by symmetry are zero only to the accuracy of the modes. **/
constexpr double NegligibleInvariant = 1e-12;

Matrix3d crossMatrix(const Vector3d& x) {
    Matrix3d matrix;
    matrix << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0;
    return matrix;
}

}  // namespace

FlexibleBodyModel::FlexibleBodyModel(std::shared_ptr<const ReducedBody> reducedPart)
    : part(std::move(reducedPart)),
      n(part->numModes),
      mass(part->mass),
      radius(part->calcRadius()),
      displacementSearch(std::make_shared<LazyDisplacementSearch>()) {
    inertia = symmetricMatrix(Map<const Eigen::Matrix<double, 6, 1>>(part->inertia.data()));
    I1Values.setZero(6 * n + ChunkSize);
    Map<MatrixXd>(I1Values.data(), n, 6) = Map<const MatrixXd>(part->I1.data(), 6, n).transpose();
    I2.resize(6 * n, n);
    N.resize(3 * n, n);
    for (int c = 0; c < 6; ++c)
        I2.middleRows(c * n, n) = Map<const MatrixXd>(part->I2[size_t(c)].data(), n, n);
    for (int a = 0; a < 3; ++a)
        N.middleRows(a * n, n) = Map<const MatrixXd>(part->N[size_t(a)].data(), n, n);
    I2Tiles = TiledMatrix(I2, NegligibleInvariant);
    NTiles = TiledMatrix(N, NegligibleInvariant);
    omegaSquared = Map<const VectorXd>(part->omegaSquared.data(), n);
    const std::vector<double> largest = part->calcLargestModeDisplacements();
    displacementPerMode = Map<const VectorXd>(largest.data(), n);
    for (const ReducedBody::Interface& interface : part->interfaces) {
        const auto& s = interface.position;
        std::vector<double> curvature;
        if (part->stiffening)
            for (const auto& K : part->stiffening->interfaces[interfaceShapes.size()])
                for (const double value : K) curvature.push_back(-value);
        interfaceShapes.push_back(FrameShapes::make(SimTK::Vec3(s[0], s[1], s[2]), interface.Phi,
                                                    interface.Psi, std::move(curvature)));
    }
    MatrixXd shapes(6 * int(part->interfaces.size()), n);
    for (int k = 0; k < int(part->interfaces.size()); ++k) {
        const ReducedBody::Interface& interface = part->interfaces[size_t(k)];
        shapes.middleRows(6 * k, 3) = Map<const MatrixXd>(interface.Phi.data(), 3, n);
        shapes.middleRows(6 * k + 3, 3) = Map<const MatrixXd>(interface.Psi.data(), 3, n);
    }
    shapeTiles = TiledMatrix(shapes);
}

std::shared_ptr<const FlexibleBodyModel> FlexibleBodyModel::makeStiffened() const {
    auto stiffened = std::make_shared<FlexibleBodyModel>(*this);
    stiffened->isStiffened = true;
    for (int c = 0; c < 6; ++c)
        stiffened->I2.middleRows(c * n, n) -=
            Map<const MatrixXd>(part->stiffening->turning[size_t(c)].data(), n, n);
    stiffened->I2Tiles = TiledMatrix(stiffened->I2, NegligibleInvariant);
    return stiffened;
}

std::shared_ptr<const FlexibleBodyModel> FlexibleBodyModel::makeRigid() const {
    auto rigid = std::make_shared<FlexibleBodyModel>();
    rigid->part = part;
    rigid->mass = mass;
    rigid->inertia = inertia;
    rigid->radius = radius;
    rigid->I1Values.setZero(ChunkSize);
    rigid->shapeTiles = TiledMatrix(MatrixXd(6 * int(interfaceShapes.size()), 0));
    for (const auto& shapes : interfaceShapes)
        rigid->interfaceShapes.push_back(FrameShapes::make(shapes->s, {}, {}));
    return rigid;
}

const std::shared_ptr<const FrameShapes>& FlexibleBodyModel::getInterfaceShapes(
    const std::string& name) const {
    return interfaceShapes[size_t(&part->getInterface(name) - part->interfaces.data())];
}

void FlexibleBodyData::resize(const FlexibleBodyModel& model) {
    numModes = model.n;
    I2Xi.setZero(model.I2Tiles.paddedRows() + ChunkSize);
    NXi.setZero(model.NTiles.paddedRows() + ChunkSize);
    NXiDot.setZero(model.NTiles.paddedRows() + ChunkSize);
    I.setZero();
    IDot.setZero();
    CXiDot.setZero();
}

void FlexibleBodyData::fit(const FlexibleBodyModel& model) {
    if (numModes == model.n) return;
    numModes = model.n;
    const auto fitOne = [](VectorXd& products, int rows) {
        if (products.size() < rows + ChunkSize)
            products.setZero(rows + ChunkSize);
        else
            products.segment(rows, ChunkSize).setZero();
    };
    fitOne(I2Xi, model.I2Tiles.paddedRows());
    fitOne(NXi, model.NTiles.paddedRows());
    fitOne(NXiDot, model.NTiles.paddedRows());
}

Matrix3d symmetricMatrix(const Eigen::Matrix<double, 6, 1>& c) {
    Matrix3d matrix;
    matrix << c[0], c[3], c[4], c[3], c[1], c[5], c[4], c[5], c[2];
    return matrix;
}

void calcProducts(const FlexibleBodyModel& model, int count, const double* const* xi,
                  const double* const* xiDot, FlexibleBodyData* const* data) {
    constexpr int Most = 8;
    for (int first = 0; first < count; first += Most) {
        const int size = std::min(Most, count - first);
        const double* factors[2 * Most];
        double *I2Xi[Most], *products[2 * Most];
        for (int k = 0; k < size; ++k) {
            factors[k] = xi[first + k];
            factors[size + k] = xiDot[first + k];
            I2Xi[k] = data[first + k]->I2Xi.data();
            products[k] = data[first + k]->NXi.data();
            products[size + k] = data[first + k]->NXiDot.data();
        }
        model.I2Tiles.multiply(size, factors, I2Xi);
        model.NTiles.multiply(2 * size, factors, products);
    }
}

void calcInertiaFromProducts(const FlexibleBodyModel& model, const double* xi, const double* xiDot,
                             FlexibleBodyData& data) {
    // I = I₀ + Σ_j ξ_j (I₁ⱼ + I₂ⱼᵢξᵢ), ∂I/∂ξ_j = B_j = I₁ⱼ + 2 I₂ⱼᵢξᵢ, İ = Σ_j ξ̇_j B_j.
    const int n = model.n;
    Eigen::Matrix<double, 6, 1> inertia, rate;
    for (int c = 0; c < 6; ++c) {
        const double *I1 = model.I1Values.data() + c * n, *I2Xi = data.I2Xi.data() + c * n;
        inertia[c] = dot(I1, xi, n) + dot(I2Xi, xi, n);
        rate[c] = dot(I1, xiDot, n) + 2 * dot(I2Xi, xiDot, n);
    }
    data.I = model.inertia + symmetricMatrix(inertia);
    data.IDot = symmetricMatrix(rate);
    // C_a = ξᵀN_a = −(N_a ξ)ᵀ.
    for (int a = 0; a < 3; ++a) data.CXiDot[a] = -dot(data.NXi.data() + a * n, xiDot, n);
}

void calcInertia(const FlexibleBodyModel& model, const Ref<const VectorXd>& xi,
                 const Ref<const VectorXd>& xiDot, FlexibleBodyData& data) {
    const double *xiData = xi.data(), *xiDotData = xiDot.data();
    FlexibleBodyData* only = &data;
    calcProducts(model, 1, &xiData, &xiDotData, &only);
    calcInertiaFromProducts(model, xiData, xiDotData, data);
}

Eigen::Matrix<double, Eigen::Dynamic, 6> calcInertiaGradient(const FlexibleBodyModel& model,
                                                             const FlexibleBodyData& data) {
    return model.getI1() +
           2 * Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>>(data.I2Xi.data(), model.n, 6);
}

void calcVelocityTerms(const FlexibleBodyModel& model, const FlexibleBodyData& data,
                       const Vector3d& omega, Vector3d& rotation, Ref<VectorXd> modes) {
    const int n = model.n;
    rotation = data.IDot * omega + omega.cross(data.I * omega + data.CXiDot);

    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> NXiDot(data.NXiDot.data(), n, 3);
    Eigen::Matrix<double, 6, 1> omegaProducts;  // ½ωᵀBω by components
    omegaProducts << 0.5 * omega[0] * omega[0], 0.5 * omega[1] * omega[1],
        0.5 * omega[2] * omega[2], omega[0] * omega[1], omega[0] * omega[2], omega[1] * omega[2];
    modes.noalias() = -2 * (NXiDot * omega);
    modes.noalias() -= calcInertiaGradient(model, data) * omegaProducts;
}

void addInInertiaTerms(const FlexibleBodyData& data, const Vector3d& omegaDot,
                       const Ref<const VectorXd>& xiDotDot, Vector3d& rotation,
                       Ref<VectorXd> modes) {
    rotation.noalias() += data.I * omegaDot + data.getCTransposed().transpose() * xiDotDot;
    modes.noalias() += data.getCTransposed() * omegaDot;
    modes += xiDotDot;
}

void calcNewtonMatrix(const FlexibleBodyModel& model, const FlexibleBodyData& data, double mass,
                      double stiffness, const Vector3d& omega, const Vector3d& omegaDot,
                      const Ref<const VectorXd>& xiDot, const Ref<const VectorXd>& xiDotDot,
                      const Ref<const VectorXd>& damping, Ref<MatrixXd> J) {
    const int n = model.n;
    J.setZero();
    const Vector3d h = data.I * omega + data.CXiDot;
    J.topLeftCorner<3, 3>() =
        data.I / mass + data.IDot + crossMatrix(omega) * data.I - crossMatrix(h);
    J.block<3, 3>(3, 3).diagonal().setConstant(model.mass / mass);

    // ω rows against ξ̇, column j: C/γ + B_jω + ω×C_j + γ[B_jω̇ + N_jξ̈ + Ḃ_jω + ω×(B_jω) +
    // ω×(N_jξ̇)].
    // The storage is reused between calls and only grows.
    thread_local VectorXd storage;
    if (storage.size() < 18 * n) storage.resize(18 * n);
    Map<Eigen::Matrix<double, Eigen::Dynamic, 6>> B(storage.data(), n, 6);
    Map<Eigen::Matrix<double, Eigen::Dynamic, 6>> I2XiDot(storage.data() + 6 * n, n, 6);
    Map<Eigen::Matrix<double, Eigen::Dynamic, 3>> CTransposed(storage.data() + 12 * n, n, 3);
    Map<Eigen::Matrix<double, Eigen::Dynamic, 3>> NXiDotDot(storage.data() + 15 * n, n, 3);
    B = model.getI1() +
        2 * Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>>(data.I2Xi.data(), n, 6);
    CTransposed = data.getCTransposed();
    const auto N = [&](int a) { return model.N.middleRows(a * n, n); };
    for (int c = 0; c < 6; ++c) I2XiDot.col(c).noalias() = model.I2.middleRows(c * n, n) * xiDot;
    const Map<const Eigen::Matrix<double, Eigen::Dynamic, 3>> NXiDot(data.NXiDot.data(), n, 3);
    for (int a = 0; a < 3; ++a) NXiDotDot.col(a).noalias() = N(a) * xiDotDot;
    for (int j = 0; j < n; ++j) {
        const Matrix3d Bj = symmetricMatrix(B.row(j).transpose());
        const Matrix3d BjDot = 2 * symmetricMatrix(I2XiDot.row(j).transpose());
        const Vector3d Bomega = Bj * omega, Nj = NXiDot.row(j).transpose();
        const Vector3d C = CTransposed.row(j).transpose();
        const Vector3d atRate = C / mass + Bomega + omega.cross(C);
        const Vector3d atPosition =
            Bj * omegaDot + NXiDotDot.row(j).transpose() + BjDot * omega + omega.cross(Bomega + Nj);
        J.block<3, 1>(0, 6 + j) = atRate + stiffness * atPosition;
        // ξ rows against ω: Cᵀ/γ − 2N_aξ̇ − B_jω.
        J.block<1, 3>(6 + j, 0) = (C / mass - 2 * Nj - Bomega).transpose();
    }

    // ξ rows against ξ̇: 1/γ + d + γΩ² − 2Σω_aN_a + γ(Σω̇_aN_aᵀ − ωωᵀ:I₂).
    auto modal = J.bottomRightCorner(n, n);
    for (int a = 0; a < 3; ++a)
        modal.noalias() -= (2 * omega[a] + stiffness * omegaDot[a]) * N(a);  // N_aᵀ = −N_a
    const double products[6] = {omega[0] * omega[0],     omega[1] * omega[1],
                                omega[2] * omega[2],     2 * omega[0] * omega[1],
                                2 * omega[0] * omega[2], 2 * omega[1] * omega[2]};
    for (int c = 0; c < 6; ++c)
        modal.noalias() -= stiffness * products[c] * model.I2.middleRows(c * n, n);
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
