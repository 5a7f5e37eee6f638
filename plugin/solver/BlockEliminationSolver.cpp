#include "simflex/solver/BlockEliminationSolver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <stdexcept>
#include <string>

namespace simflex {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Clock = std::chrono::steady_clock;
using Block = NewtonSystem::Block;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using MatrixX3d = Eigen::Matrix<double, Eigen::Dynamic, 3>;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

/** Factors of one arrow matrix [H, E; Eᵀ, diag(d)]: T = E diag(d)⁻¹ and LU of H − T Eᵀ. **/
struct ArrowFactors {
    VectorXd inverseDiagonal;
    MatrixX3d T;
    Eigen::PartialPivLU<Matrix6d> head;

    void factor(const NewtonSystem::Part& part, const Block& block) {
        const int tail = block.size - 6;
        const Map<const MatrixX3d> coupling(block.coupling.data(), tail, 3);
        inverseDiagonal = Map<const VectorXd>(part.diagonal.data(), tail).cwiseInverse();
        T.noalias() = inverseDiagonal.asDiagonal() * coupling;
        Matrix6d reduced = Map<const Matrix6d>(block.head.data());
        reduced.topLeftCorner<3, 3>() -= coupling.transpose() * T;
        head.compute(reduced);
    }

    /** X ← A⁻¹ X for n×m X. **/
    template <class Matrix>
    void solveInPlace(Matrix&& X) const {
        const auto tail = X.rows() - 6;
        for (Eigen::Index k = 0; k < X.cols(); ++k) {
            auto column = X.col(k);
            Eigen::Matrix<double, 6, 1> top = column.template head<6>();
            top.template head<3>() -= T.transpose() * column.tail(tail);
            const Eigen::Matrix<double, 6, 1> solved = head.solve(top);
            column.template head<6>() = solved;
            column.tail(tail).array() *= inverseDiagonal.array();
            column.tail(tail) -= T * solved.template head<3>();
        }
    }
};

/** What factor() and solve() write for one block. **/
struct BlockData {
    bool isArrow = false;
    ArrowFactors arrow;
    Eigen::PartialPivLU<MatrixXd> dense;
    MatrixXd Gt;      ///< n×m
    MatrixXd W;       ///< n×m
    MatrixXd S;       ///< m×m contribution G_b W_b
    VectorXd z;       ///< n
    VectorXd Gz;      ///< m
    VectorXd lambda;  ///< m multipliers gathered
    VectorXd deltaU;  ///< n

    template <class Matrix>
    void solveInPlace(Matrix&& X) const {
        if (isArrow)
            arrow.solveInPlace(X);
        else
            X = dense.solve(X);
    }
};

}  // namespace

class BlockEliminationSolver::Implementation {
public:
    explicit Implementation(const NewtonSystem& system)
        : m_blocks(system.blocks.size()),
          m_rows(system.blocks.size()),
          m_numMultipliers(system.numMultipliers()) {
        system.checkSizes();
        for (size_t b = 0; b < m_blocks.size(); ++b) {
            const Block& block = system.blocks[b];
            const auto n = block.size, m = int(block.rows.size());
            m_rows[b] = block.rows;
            m_blocks[b].Gt.setZero(n, m);
            m_blocks[b].W.setZero(n, m);
            m_blocks[b].S.setZero(m, m);
            m_blocks[b].z.setZero(n);
            m_blocks[b].Gz.setZero(m);
            m_blocks[b].lambda.setZero(m);
            m_blocks[b].deltaU.setZero(n);
        }
        m_S.setZero(m_numMultipliers, m_numMultipliers);
        m_scale.setOnes(m_numMultipliers);
        m_lambda.setZero(m_numMultipliers);
    }

    void factor(const NewtonSystem& system) {
        m_isFactored = false;
        const auto start = Clock::now();
        const int count = int(m_blocks.size());
        bool isSingular = false;
        int culprit = 0;
#pragma omp parallel for schedule(static) num_threads(m_threads) if (m_threads > 1)
        for (int b = 0; b < count; ++b) {
            if (factorBlock(system, system.blocks[b], m_blocks[b])) continue;
#pragma omp critical
            {
                culprit = isSingular ? std::min(culprit, b) : b;
                isSingular = true;
            }
        }
        m_timing.factor += secondsSince(start);
        if (isSingular)
            throw std::runtime_error("BlockEliminationSolver: the matrix of block " +
                                     std::to_string(culprit) + " is singular or not finite");
        const auto schurStart = Clock::now();
        factorSchurComplement();
        m_timing.schur += secondsSince(schurStart);
        m_isFactored = true;
    }

    void solve(const NewtonSystem& system) {
        if (!m_isFactored)
            throw std::logic_error("BlockEliminationSolver::solve() before factor()");
        auto start = Clock::now();
        const int count = int(m_blocks.size());
#pragma omp parallel for schedule(static) num_threads(m_threads) if (m_threads > 1)
        for (int b = 0; b < count; ++b) {
            const Block& block = system.blocks[b];
            BlockData& data = m_blocks[b];
            data.z = Map<const VectorXd>(block.r.data(), block.size);
            // G_b z_b = W̃ᵀ r needs J symmetric; the plain product serves every form.
            data.solveInPlace(data.z);
            data.Gz.noalias() = data.Gt.transpose() * data.z;
        }
        m_timing.backSubstitution += secondsSince(start);

        start = Clock::now();
        m_lambda = Map<const VectorXd>(system.c.data(), m_numMultipliers);
        for (int b = 0; b < count; ++b)
            for (size_t i = 0; i < m_rows[b].size(); ++i)
                m_lambda[m_rows[b][i]] -= m_blocks[b].Gz[i];
        solveSchurComplement();
        m_timing.schur += secondsSince(start);

        start = Clock::now();
#pragma omp parallel for schedule(static) num_threads(m_threads) if (m_threads > 1)
        for (int b = 0; b < count; ++b) {
            BlockData& data = m_blocks[b];
            for (size_t i = 0; i < m_rows[b].size(); ++i) data.lambda[i] = m_lambda[m_rows[b][i]];
            data.deltaU = -data.z;
            data.deltaU.noalias() -= data.W * data.lambda;
        }
        m_timing.backSubstitution += secondsSince(start);
    }

    std::vector<BlockData> m_blocks;
    std::vector<std::vector<int>> m_rows;
    int m_numMultipliers;
    int m_threads = 1;
    int m_numRedundant = 0;
    bool m_isFactored = false;
    VectorXd m_lambda;
    Timing m_timing;

private:
    /** @returns false if the block's matrix is singular or not finite. **/
    static bool factorBlock(const NewtonSystem& system, const Block& block, BlockData& data) {
        const int n = block.size, m = int(block.rows.size());
        if (n == 0) return true;
        data.isArrow = block.form == Block::Form::Arrow;
        double smallestPivot = 0;
        if (data.isArrow) {
            data.arrow.factor(system.parts[size_t(block.part)], block);
            smallestPivot = data.arrow.head.matrixLU().diagonal().cwiseAbs().minCoeff();
            if (!data.arrow.T.allFinite()) return false;
        } else {
            data.dense.compute(Map<const MatrixXd>(block.matrix.data(), n, n));
            smallestPivot = data.dense.matrixLU().diagonal().cwiseAbs().minCoeff();
        }
        if (!(smallestPivot > 0)) return false;
        if (m == 0) return true;
        system.expandGt(block, data.Gt.data());
        data.W = data.Gt;
        data.solveInPlace(data.W);
        data.S.noalias() = data.Gt.transpose() * data.W;
        return data.S.allFinite();
    }

    void factorSchurComplement() {
        m_numRedundant = 0;
        if (m_numMultipliers == 0) return;
        m_S.setZero();
        for (size_t b = 0; b < m_blocks.size(); ++b) {
            const std::vector<int>& rows = m_rows[b];
            for (size_t j = 0; j < rows.size(); ++j)
                for (size_t i = 0; i < rows.size(); ++i)
                    m_S(rows[i], rows[j]) += m_blocks[b].S(i, j);
        }
        // Rows of metres and radians on light and heavy bodies: scale S to a unit diagonal.
        for (int i = 0; i < m_numMultipliers; ++i) {
            const double diagonal = std::abs(m_S(i, i));
            m_scale[i] = diagonal > 0 ? 1 / std::sqrt(diagonal) : 1;
        }
        m_S = m_scale.asDiagonal() * m_S * m_scale.asDiagonal();
        m_lu.compute(m_S);
        // The estimate of rcond() is no guide when a pivot vanishes: look at the pivots first.
        const auto pivots = m_lu.matrixLU().diagonal().cwiseAbs();
        const bool isRegular = pivots.minCoeff() > RankThreshold * pivots.maxCoeff();
        if (isRegular && m_lu.rcond() > SmallestReciprocalCondition) return;
        m_orthogonal.setThreshold(RankThreshold);
        m_orthogonal.compute(m_S);
        m_numRedundant = m_numMultipliers - int(m_orthogonal.rank());
    }

    void solveSchurComplement() {
        if (m_numMultipliers == 0) return;
        m_lambda.array() *= m_scale.array();
        if (m_numRedundant == 0)
            m_lambda = m_lu.solve(m_lambda);
        else
            m_lambda = m_orthogonal.solve(m_lambda);
        m_lambda.array() *= m_scale.array();
    }

    static constexpr double SmallestReciprocalCondition = 1e-13;
    static constexpr double RankThreshold = 1e-11;

    MatrixXd m_S;
    VectorXd m_scale;
    Eigen::PartialPivLU<MatrixXd> m_lu;
    Eigen::CompleteOrthogonalDecomposition<MatrixXd> m_orthogonal;
};

BlockEliminationSolver::BlockEliminationSolver(const NewtonSystem& system)
    : m_impl(std::make_unique<Implementation>(system)) {}
BlockEliminationSolver::~BlockEliminationSolver() = default;
BlockEliminationSolver::BlockEliminationSolver(BlockEliminationSolver&&) noexcept = default;
BlockEliminationSolver& BlockEliminationSolver::operator=(BlockEliminationSolver&&) noexcept =
    default;

void BlockEliminationSolver::setNumThreads(int threads) {
    if (threads < 1)
        throw std::invalid_argument("BlockEliminationSolver::setNumThreads: at least 1");
    m_impl->m_threads = threads;
}
void BlockEliminationSolver::factor(const NewtonSystem& system) {
    m_impl->factor(system);
}
void BlockEliminationSolver::solve(const NewtonSystem& system) {
    m_impl->solve(system);
}
const double* BlockEliminationSolver::getDeltaU(int block) const {
    return m_impl->m_blocks.at(block).deltaU.data();
}
const double* BlockEliminationSolver::getDeltaLambda() const {
    return m_impl->m_lambda.data();
}
int BlockEliminationSolver::getNumRedundant() const {
    return m_impl->m_numRedundant;
}
const BlockEliminationSolver::Timing& BlockEliminationSolver::getTiming() const {
    return m_impl->m_timing;
}

}  // namespace simflex
