#include "MeanAxis.h"

#include <sstream>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {
namespace {

/** An eigenvalue of the pencil counts as zero below the largest of these: the energy that K itself
gives a rigid motion (ccx writes 14 digits) and the round-off of the largest eigenvalue. **/
constexpr double RigidNoise = 1e3, RoundOff = 1e-13;

/** Two entries within this of each other are equally large, for the sign of a mode. **/
constexpr double SameSize = 1e-6;

/** ω² of the rigid motions with the K at hand, the largest: round-off of K. **/
double calcRigidNoise(const FeProducts& products, const RigidMotion& rigid) {
    const Shapes KR = products.K.multiply(rigid.R), MR = products.m.multiplyPerAxis(rigid.R);
    double noise = 0;
    for (int j = 0; j < 6; ++j)
        noise = std::max(noise,
                         std::abs(rigid.R.col(j).dot(KR.col(j)) / rigid.R.col(j).dot(MR.col(j))));
    return noise;
}

/** Eigenvectors with vᵀBv = 1 of A v = λ B v, ascending. B may be badly scaled. **/
SymmetricEigen solvePencil(Eigen::MatrixXd A, Eigen::MatrixXd B, Eigen::VectorXd& scale) {
    scale = B.diagonal().cwiseSqrt().cwiseInverse();
    A = scale.asDiagonal() * A * scale.asDiagonal();
    B = scale.asDiagonal() * B * scale.asDiagonal();
    return calcSymmetricEigen(A, B);
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
    // The pencil of the whole basis has the six rigid motions as its zeros.
    const Shapes KPsi = products.K.multiply(basis.Psi),
                 MPsi = products.m.multiplyPerAxis(basis.Psi);
    Eigen::VectorXd scale;
    const auto pencil =
        solvePencil(symmetricGram(basis.Psi, KPsi), symmetricGram(basis.Psi, MPsi), scale);
    const Eigen::VectorXd& lambda = pencil.values;
    if (!pencil.hasConverged || !lambda.allFinite())
        throw std::invalid_argument(
            "part '" + part +
            "': the reduced mass matrix is singular: a mode moves no "
            "mass, or two modes are the same; ask for fewer modes or refine the mesh");
    const double threshold = std::max(RigidNoise * calcRigidNoise(products, rigid),
                                      RoundOff * lambda[lambda.size() - 1]);
    const long numZeros = (lambda.array() < threshold).count();
    if (numZeros != 6) {
        std::ostringstream text;
        text << "part '" << part << "': the stiffness matrix has " << numZeros
             << " rigid modes, must have 6 (eigenvalues below " << threshold
             << " rad²/s² count as rigid). "
             << (numZeros > 6
                     ? "Pieces of the part move against each other without stiffness: look for "
                       "hinges, where elements share only a node or an edge."
                     : "The part is held by something: take supports out of the deck.");
        throw std::invalid_argument(text.str());
    }
    const Eigen::Index n = lambda.size() - 6;
    const Eigen::MatrixXd elastic = scale.asDiagonal() * pencil.vectors.rightCols(n);

    Shapes Phi = basis.Psi * elastic;
    Shapes boundary = basis.boundary * elastic;
    const Eigen::MatrixXd taken = removeRigidMotion(rigid, products, Phi);
    for (Eigen::Index k = 0; k < masters.cols(); ++k) {
        Eigen::Matrix<double, 6, 6> atMaster = Eigen::Matrix<double, 6, 6>::Identity();
        atMaster.topRows<3>() = calcRigidMotion(masters.col(k) - rigid.center);
        boundary.middleRows(6 * k, 6) -= atMaster * taken;
    }

    const auto second = solvePencil(symmetricGram(Phi, products.K.multiply(Phi)),
                                    symmetricGram(Phi, products.m.multiplyPerAxis(Phi)), scale);
    const Eigen::MatrixXd turn = scale.asDiagonal() * second.vectors;
    MeanAxisModes modes;
    modes.Phi = Phi * turn;
    modes.boundary = boundary * turn;
    modes.omegaSquared = second.values;
    fixSigns(modes);
    return modes;
}

}  // namespace simflex
