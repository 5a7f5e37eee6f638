#include "simflex/solver/BlockFactors.h"

#include <algorithm>
#include <cmath>

#include "simflex/body/Dot.h"

namespace simflex {

using Eigen::Map;
using Eigen::Matrix;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Matrix6d = Matrix<double, 6, 6>;
using Vector6d = Matrix<double, 6, 1>;
using MatrixX6d = Matrix<double, Eigen::Dynamic, 6>;

//--------------------------------------------------------------------------------------------------
// parts

PartFactors::PartFactors(const NewtonSystem::Part& part)
    : inverseDiagonal(VectorXd::Zero(part.numModes)),
      m_numFrames(part.numFrames),
      m_shapes(Map<const MatrixXd>(part.shapes->data(), part.numModes, 6 * part.numFrames)),
      m_flexibility(part.numModes, 6 * part.numFrames),
      m_pairIndex(size_t(part.numFrames) * size_t(part.numFrames), -1) {
    m_flexibilityTiles.assignTransposed(m_flexibility);  // for its size
}

void PartFactors::requestPair(int frame, int other) {
    for (const auto& [a, b] : {std::make_pair(frame, other), std::make_pair(other, frame)}) {
        int& index = m_pairIndex[size_t(a * m_numFrames + b)];
        if (index >= 0) continue;
        index = int(m_pairs.size());
        m_pairs.emplace_back(a, b);
    }
    m_compliances.setZero(36, Eigen::Index(m_pairs.size()));
}

bool PartFactors::factor(const NewtonSystem::Part& part) {
    inverseDiagonal = Map<const VectorXd>(part.diagonal.data(), numModes()).cwiseInverse();
    for (int k = 0; k < 6 * m_numFrames; ++k)
        m_flexibility.col(k) = inverseDiagonal.cwiseProduct(m_shapes.col(k));
    m_flexibilityTiles.assignTransposed(m_flexibility);
    for (size_t k = 0; k < m_pairs.size(); ++k) {
        const auto [frame, other] = m_pairs[k];
        if (frame > other) continue;
        Map<Matrix6d> compliance(m_compliances.col(Eigen::Index(k)).data());
        for (int j = 0; j < 6; ++j)
            for (int i = 0; i < 6; ++i)
                compliance(i, j) =
                    m_shapes.col(6 * frame + i).dot(m_flexibility.col(6 * other + j));
        const int mirrored = m_pairIndex[size_t(other * m_numFrames + frame)];
        if (frame != other)
            Map<Matrix6d>(m_compliances.col(mirrored).data()) = compliance.transpose();
    }
    return inverseDiagonal.allFinite();
}

//--------------------------------------------------------------------------------------------------
// blocks

namespace {

/** L⁻¹ for A = LLᵀ, of A's lower triangle. @returns false if A is not positive definite. **/
bool invertCholeskyFactor(const Matrix6d& A, Matrix6d& inverse) {
    Matrix6d L;
    for (int j = 0; j < 6; ++j) {
        double pivot = A(j, j);
        for (int k = 0; k < j; ++k) pivot -= L(j, k) * L(j, k);
        if (!(pivot > 0) || !std::isfinite(pivot)) return false;
        L(j, j) = std::sqrt(pivot);
        for (int i = j + 1; i < 6; ++i) {
            double sum = A(i, j);
            for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
            L(i, j) = sum / L(j, j);
        }
    }
    inverse.setZero();
    for (int j = 0; j < 6; ++j) {
        inverse(j, j) = 1 / L(j, j);
        for (int i = j + 1; i < 6; ++i) {
            double sum = 0;
            for (int k = j; k < i; ++k) sum -= L(i, k) * inverse(k, j);
            inverse(i, j) = sum / L(i, i);
        }
    }
    return inverse.allFinite();
}

}  // namespace

BlockFactors::BlockFactors(const NewtonSystem::Block& block, std::vector<PartFactors>& parts) {
    const int n = block.size, m = block.numColumns();
    m_schur.setZero(m, m);
    m_Gz.setZero(m);
    m_lambda.setZero(m);
    m_deltaU.setZero(n);
    m_z.setZero(n);
    if (block.part < 0) {
        m_W.setZero(n, m);
        return;
    }
    PartFactors& part = parts[size_t(block.part)];
    m_part = &part;
    m_z.setZero(n - 6);
    m_dE.setZero(n - 6, 3);
    m_K.setZero(6, m);
    m_Y.setZero(6, m);
    m_LY.setZero(6, m);
    for (const NewtonSystem::Side& side : block.sides) {
        m_frames.push_back(side.frame);
        for (const NewtonSystem::Side& other : block.sides)
            part.requestPair(side.frame, other.frame);
    }
    std::sort(m_frames.begin(), m_frames.end());
    m_frames.erase(std::unique(m_frames.begin(), m_frames.end()), m_frames.end());
    m_frameForce.setZero(6, Eigen::Index(m_frames.size()));
    m_products.setZero(part.getNumProductRows(), 3);
}

bool BlockFactors::factor(const NewtonSystem& system, const NewtonSystem::Block& block) {
    m_form = block.form;
    if (block.size == 0) return true;
    return m_form == Form::Arrow ? factorArrow(block) : factorMatrix(system, block);
}

bool BlockFactors::factorArrow(const NewtonSystem::Block& block) {
    const int tail = block.size - 6, m = block.numColumns();
    const double* E = block.coupling.data();
    Matrix6d head = Map<const Matrix6d>(block.head.data());
    for (int a = 0; a < 3; ++a)
        m_dE.col(a) = m_part->inverseDiagonal.cwiseProduct(Map<const VectorXd>(E + a * tail, tail));
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b <= a; ++b) head(a, b) -= dot(E + a * tail, m_dE.col(b).data(), tail);
    if (!invertCholeskyFactor(head, m_inverseL)) return false;
    if (m == 0) return true;

    m_K = Map<const Matrix6Xd>(block.coefficients.data(), 6, m);
    m_Y = Map<const Matrix6Xd>(block.Gt.data(), 6, m);
    const double* const columns[3] = {E, E + tail, E + 2 * tail};
    double* const products[3] = {m_products.col(0).data(), m_products.col(1).data(),
                                 m_products.col(2).data()};
    m_part->multiplyByFlexibility(3, columns, products);
    int first = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        const Matrix<double, 6, 3> Q = m_products.block<6, 3>(6 * side.frame, 0);
        for (int k = first; k < first + side.numColumns; ++k)
            for (int a = 0; a < 3; ++a) m_Y(a, k) -= Q.col(a).dot(m_K.col(k));
        first += side.numColumns;
    }
    for (int k = 0; k < m; ++k) m_LY.col(k).noalias() = m_inverseL * m_Y.col(k);

    MatrixXd& S = m_schur;
    int column = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        for (int k = column; k < column + side.numColumns; ++k) {
            const Vector6d y = m_LY.col(k), x = m_K.col(k);
            int row = 0;
            for (const NewtonSystem::Side& other : block.sides) {
                if (row > k) break;
                const Vector6d force = m_part->getCompliance(other.frame, side.frame) * x;
                for (int i = row; i < row + other.numColumns; ++i)
                    S(i, k) = m_K.col(i).dot(force) + m_LY.col(i).dot(y);
                row += other.numColumns;
            }
        }
        column += side.numColumns;
    }
    for (int k = 0; k < m; ++k)
        for (int i = k + 1; i < m; ++i) S(i, k) = S(k, i);
    return S.allFinite();
}

bool BlockFactors::factorMatrix(const NewtonSystem& system, const NewtonSystem::Block& block) {
    const int n = block.size, m = block.numColumns();
    const Map<const MatrixXd> J(block.matrix.data(), n, n);
    m_Gt.resize(n, m);
    m_W.resize(n, m);
    system.expandGt(block, m_Gt.data());
    MatrixXd& S = m_schur;
    if (m_form == Form::Symmetric) {
        m_symmetric.compute(J);
        if (m_symmetric.info() != Eigen::Success ||
            !std::isfinite(m_symmetric.matrixLLT().diagonal().sum()))
            return false;
        if (m == 0) return true;
        m_W = m_Gt;
        m_symmetric.matrixL().solveInPlace(m_W);
        S.noalias() = m_W.transpose() * m_W;
    } else {
        m_general.compute(J);
        if (!(m_general.matrixLU().diagonal().cwiseAbs().minCoeff() > 0)) return false;
        if (m == 0) return true;
        m_W = m_general.solve(m_Gt);
        S.noalias() = m_Gt.transpose() * m_W;
    }
    return S.allFinite();
}

void BlockFactors::eliminate(const NewtonSystem::Block& block, double* Gz) {
    const int n = block.size, m = block.numColumns();
    if (m_form != Form::Arrow) {
        m_z = Map<const VectorXd>(block.r.data(), n);
        if (m_form == Form::Symmetric) {
            m_symmetric.matrixL().solveInPlace(m_z);
            m_Gz.noalias() = m_W.transpose() * m_z;
        } else {
            m_deltaU = m_z;
            m_z = m_general.solve(m_deltaU);
            m_Gz.noalias() = m_Gt.transpose() * m_z;
        }
        std::copy_n(m_Gz.data(), m, Gz);
        return;
    }
    m_top = Map<const Vector6d>(block.r.data());
    m_z = Map<const VectorXd>(block.r.data() + 6, n - 6);
    for (int a = 0; a < 3; ++a) m_top[a] -= m_dE.col(a).dot(m_z);
    if (m == 0) return;
    const double* z = m_z.data();
    double* products = m_products.data();
    m_part->multiplyByFlexibility(1, &z, &products);
    for (size_t f = 0; f < m_frames.size(); ++f)
        m_frameForce.col(Eigen::Index(f)) = m_products.block<6, 1>(6 * m_frames[f], 0);
    const Vector6d solved = m_inverseL * m_top;
    int k = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        const Eigen::Index f = findFrame(side.frame);
        for (int end = k + side.numColumns; k < end; ++k)
            Gz[k] = m_LY.col(k).dot(solved) + m_K.col(k).dot(m_frameForce.col(f));
    }
}

void BlockFactors::eliminateZero() {
    m_z.setZero();
    m_top.setZero();
}

void BlockFactors::substitute(const NewtonSystem::Block& block, const double* lambda) {
    const int n = block.size, m = block.numColumns();
    m_lambda = Map<const VectorXd>(lambda, m);
    if (m_form != Form::Arrow) {
        m_deltaU = -m_z;
        m_deltaU.noalias() -= m_W * m_lambda;
        if (m_form == Form::Symmetric) m_symmetric.matrixU().solveInPlace(m_deltaU);
        return;
    }
    Vector6d top = m_top;
    for (int k = 0; k < m; ++k) top += m_Y.col(k) * m_lambda[k];
    const Vector6d half = m_inverseL * top;
    const Vector6d solved = m_inverseL.transpose() * half;
    m_deltaU.head<6>() = -solved;
    m_z = m_part->inverseDiagonal.cwiseProduct(m_z);
    for (int a = 0; a < 3; ++a) m_z -= m_dE.col(a) * solved[a];
    m_frameForce.setZero();
    int k = 0;
    for (const NewtonSystem::Side& side : block.sides) {
        const Eigen::Index f = findFrame(side.frame);
        for (int end = k + side.numColumns; k < end; ++k)
            m_frameForce.col(f) += m_K.col(k) * m_lambda[k];
    }
    for (size_t f = 0; f < m_frames.size(); ++f) {
        const auto flexibility = m_part->getFlexibility(m_frames[f]);
        for (int a = 0; a < 6; ++a) m_z += flexibility.col(a) * m_frameForce(a, Eigen::Index(f));
    }
    m_deltaU.tail(n - 6) = -m_z;
}

Eigen::Index BlockFactors::findFrame(int frame) const {
    return std::lower_bound(m_frames.begin(), m_frames.end(), frame) - m_frames.begin();
}

}  // namespace simflex
