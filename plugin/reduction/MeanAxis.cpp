#include "MeanAxis.h"

#include <limits>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

/** Factor by which a shape's relative energy may exceed that of the rigid motions and still be
round-off. **/
constexpr double RigidNoise = 30;
/** Largest relative frequency error due to round-off in K. **/
constexpr double FrequencyDigits = 1e-3;
/** Number of slowest shapes examined. **/
constexpr Eigen::Index MostHinges = 8;
/** 1 − θ of a massless shape. **/
constexpr double Massless = 1e-14;

/** Relative difference below which entries count as equal when the sign of a mode is chosen. **/
constexpr double SameSize = 1e-6;

/** Returns the round-off of energies relative to the magnitude of their terms: the largest found
for the rigid motions. **/
double calcRigidNoise(const FeProducts& products, const RigidMotion& rigid) {
    const Eigen::VectorXd sizes = products.K.sumSizes(rigid.R);
    const Shapes KR = products.K.multiply(rigid.R);
    double noise = 0;
    for (int j = 0; j < 6; ++j)
        noise = std::max(noise, std::abs(rigid.R.col(j).dot(KR.col(j))) / sizes[j]);
    return noise;
}

/** V with VᵀMV = 1, VᵀKV = Ω² for a positive definite K. **/
struct Modes {
    Eigen::MatrixXd vectors;
    Eigen::VectorXd omegaSquared;
};

/** Solves K v = θ (K + σM) v with σ in the middle of all ω²: the slowest modes of a slender part
are then as accurate as the stiffest. **/
Modes solvePencil(const std::string& part, const Eigen::MatrixXd& K, const Eigen::MatrixXd& M) {
    const Eigen::VectorXd ratio = K.diagonal().cwiseQuotient(M.diagonal());
    const double sigma = std::sqrt(ratio.minCoeff()) * std::sqrt(ratio.maxCoeff());
    const Eigen::MatrixXd both = K + sigma * M;
    const Eigen::VectorXd scale = both.diagonal().cwiseSqrt().cwiseInverse();
    const SymmetricEigen pencil =
        calcSymmetricEigen(scale.asDiagonal() * K * scale.asDiagonal(),
                           scale.asDiagonal() * both * scale.asDiagonal());
    const Eigen::VectorXd shares = Eigen::VectorXd::Ones(K.rows()) - pencil.values;
    if (!pencil.hasConverged || !pencil.values.allFinite() || !(shares.minCoeff() > Massless))
        throw std::invalid_argument(
            "part '" + part +
            "': the reduced mass matrix is singular: a mode moves no "
            "mass, or two modes are the same; ask for fewer modes, refine the mesh, or, of "
            "elements "
            "with one integration point (C3D8R, S4R), take full ones (C3D8I, S4)");
    return {scale.asDiagonal() * pencil.vectors *
                (sigma * shares.cwiseInverse()).cwiseSqrt().asDiagonal(),
            sigma * pencil.values.cwiseQuotient(shares)};
}

[[noreturn]] void refuseFree(const std::string& part, const RigidMotion& rigid,
                             Eigen::Index count) {
    throw LoosePieces(
        "part '" + part +
        "': the stiffness matrix is singular beyond the six rigid motions: it has " +
        std::to_string(6 + count) +
        " rigid modes; it must have 6. Pieces of the part move against each other without "
        "stiffness: look for hinges, where elements share only a node or an edge" +
        describeSlenderness(rigid));
}

/** Returns the magnitude of the terms of the energies of the first shapes. **/
Eigen::VectorXd calcSizes(const FeProducts& products, const Shapes& Phi) {
    return products.K.sumSizes(Phi.leftCols(std::min(MostHinges, Phi.cols())));
}

/** Counts shapes whose energy does not exceed round-off.
@param noise  see calcRigidNoise() **/
Eigen::Index countFree(const Eigen::VectorXd& sizes, const Eigen::VectorXd& energies,
                       double noise) {
    Eigen::Index count = 0;
    for (Eigen::Index k = 0; k < sizes.size(); ++k)
        count += !(energies[k] > RigidNoise * noise * sizes[k]);
    return count;
}

/** Counts the same among all combinations of shapes, scaled to equal energy, since a massless one
has no frequency. **/
Eigen::Index countFreeTogether(const FeProducts& products, const Shapes& Phi,
                               const Eigen::MatrixXd& K, double noise) {
    const Eigen::VectorXd scale = K.diagonal().cwiseSqrt().cwiseInverse();
    const SymmetricEigen pivots = calcSymmetricEigen(scale.asDiagonal() * K * scale.asDiagonal());
    const Eigen::MatrixXd softest =
        scale.asDiagonal() * pivots.vectors.leftCols(std::min(MostHinges, Phi.cols()));
    return countFree(calcSizes(products, Phi * softest), pivots.values, noise);
}

/** Checks round-off in the energies of the slowest shapes, which are sums of far larger terms. **/
void checkDigits(const std::string& part, const RigidMotion& rigid, const Eigen::VectorXd& sizes,
                 const Eigen::VectorXd& omegaSquared) {
    constexpr double UnitRoundOff = std::numeric_limits<double>::epsilon() / 2;
    // The relative error of ω is half that of ω².
    const double lost =
        0.5 * UnitRoundOff * sizes.cwiseQuotient(omegaSquared.head(sizes.size())).maxCoeff();
    if (lost <= FrequencyDigits) return;
    throw std::invalid_argument("part '" + part +
                                "': round-off in the stiffness matrix may change "
                                "its lowest frequencies by " +
                                writeGeneral(100 * lost, 2) + " %" + describeSlenderness(rigid));
}

void fixSigns(MeanAxisModes& modes) {
    for (Eigen::Index i = 0; i < modes.Phi.cols(); ++i) {
        const double largest = modes.Phi.col(i).cwiseAbs().maxCoeff();
        Eigen::Index row = 0;
        while (std::abs(modes.Phi(row, i)) < (1 - SameSize) * largest) ++row;
        if (modes.Phi(row, i) > 0) continue;
        modes.Phi.col(i) *= -1;
        modes.boundary.col(i) *= -1;
    }
}

}  // namespace

MeanAxisModes calcMeanAxisModes(const std::string& part, const FeProducts& products,
                                const RigidMotion& rigid, const Eigen::Matrix3Xd& masters,
                                const ModeBasis& basis) {
    // The rigid motions replace the first six columns: constraint modes of an interface, which
    // combine to them, or the rigid motions themselves.
    const Eigen::Index n = basis.Psi.cols() - 6;
    Shapes Phi = basis.Psi.rightCols(n);
    Shapes boundary = basis.boundary.rightCols(n);
    const Eigen::MatrixXd taken = removeRigidMotion(rigid, products, Phi);
    for (Eigen::Index k = 0; k < masters.cols(); ++k) {
        Eigen::Matrix<double, 6, 6> atMaster = Eigen::Matrix<double, 6, 6>::Identity();
        atMaster.topRows<3>() = calcRigidMotion(masters.col(k) - rigid.center);
        boundary.middleRows(6 * k, 6) -= atMaster * taken;
    }
    const auto calcK = [&] { return symmetricGram(Phi, products.K.multiply(Phi)); };
    const auto calcM = [&] { return symmetricGram(Phi, products.m.multiplyPerAxis(Phi)); };
    const Eigen::MatrixXd K = calcK();
    const double noise = calcRigidNoise(products, rigid);
    if (const Eigen::Index count = countFreeTogether(products, Phi, K, noise))
        refuseFree(part, rigid, count);
    const Modes first = solvePencil(part, K, calcM());
    Phi = (Phi * first.vectors).eval();
    const Eigen::VectorXd sizes = calcSizes(products, Phi);
    if (const Eigen::Index count = countFree(sizes, first.omegaSquared, noise))
        refuseFree(part, rigid, count);
    checkDigits(part, rigid, sizes, first.omegaSquared);
    boundary = (boundary * first.vectors).eval();
    const Modes second = solvePencil(part, calcK(), calcM());
    MeanAxisModes modes;
    modes.Phi = Phi * second.vectors;
    modes.boundary = boundary * second.vectors;
    modes.omegaSquared = second.omegaSquared;
    fixSigns(modes);
    return modes;
}

}  // namespace simflex
