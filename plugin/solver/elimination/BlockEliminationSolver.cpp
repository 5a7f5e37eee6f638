#include "simflex/solver/BlockEliminationSolver.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <stdexcept>
#include <string>

#include "simflex/base/ParallelFor.h"
#include "simflex/base/SecondsSince.h"
#include "simflex/solver/elimination/BlockFactors.h"
#include "simflex/solver/elimination/FrontSolver.h"

namespace simflex {
namespace {

using Eigen::Map;
using Eigen::MatrixXd;
using Clock = std::chrono::steady_clock;

/** Whether a block has so many columns that its speeds stay unknowns of step 3. **/
bool isLate(const NewtonBlock& block) {
    return block.numColumns() > 4 * block.size + 64;
}

}  // namespace

template <class Scalar>
class BlockElimination<Scalar>::Implementation {
    using Block = typename System::Block;
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

public:
    explicit Implementation(const System& system) : m_numMultipliers(system.numMultipliers()) {
        system.checkSizes();
        m_parts.reserve(system.parts.size());
        for (const typename System::Part& part : system.parts) m_parts.emplace_back(part);
        m_blocks.reserve(system.blocks.size());
        for (const Block& block : system.blocks) {
            m_blocks.emplace_back(block, m_parts);
            m_firstColumn.push_back(int(m_Gz.size()));
            m_firstSpeed.push_back(int(m_deltaU.size()));
            m_deltaU.resize(m_deltaU.size() + size_t(block.size));
            m_Gz.resize(m_Gz.size() + block.rows.size());
            m_rows.insert(m_rows.end(), block.rows.begin(), block.rows.end());
        }
        m_firstColumn.push_back(int(m_Gz.size()));
        m_columnLambda.resize(m_Gz.size());
        analyse(system, true);
    }

    void factor(const System& system) {
        m_isFactored = false;
        const auto start = Clock::now();
        factorBlocks(system);
        const auto schurStart = Clock::now();
        m_timing.factor += std::chrono::duration<double>(schurStart - start).count();
        factorSchurComplement(system);
        if (!m_lateBlocks.empty() && !m_fronts->getRedundantUnknowns().empty()) {
            // A pivot beside a late block may vanish that the block would fill: retry without.
            analyse(system, false);
            factorBlocks(system);
            factorSchurComplement(system);
        }
        m_timing.schur += secondsSince(schurStart);
        m_isFactored = true;
    }

    /** @param hasResidual  false: r counts as zero **/
    void solve(const System& system, bool hasResidual) {
        requireFactors();
        const auto start = Clock::now();
        const int count = int(m_blocks.size());
        parallelFor(hasResidual ? count : 0, m_threads, [&](int b) {
            prefetch(b + 1);
            eliminate(system, b);
        });
        const auto schurStart = Clock::now();
        solveForMultipliers(system, hasResidual);
        const auto substitutionStart = Clock::now();
        parallelFor(count, m_threads, [&](int b) {
            prefetch(b + 1);
            substitute(system, b, hasResidual);
        });
        m_timing.backSubstitution += std::chrono::duration<double>(schurStart - start).count() +
                                     secondsSince(substitutionStart);
    }

    void eliminate(const System& system, int b) {
        if (m_isLate[size_t(b)]) return;
        m_blocks[size_t(b)].eliminate(system.r.data() + m_firstSpeed[size_t(b)],
                                      m_Gz.data() + m_firstColumn[size_t(b)]);
    }

    void solveForMultipliers(const System& system, bool hasResidual) {
        requireFactors();
        const auto start = Clock::now();
        const int count = int(m_blocks.size());
        std::copy(system.c.begin(), system.c.end(), m_x.begin());
        for (int b = 0; b < count && hasResidual; ++b) {
            if (m_isLate[size_t(b)]) continue;
            for (int k = m_firstColumn[size_t(b)]; k < m_firstColumn[size_t(b) + 1]; ++k)
                m_x[size_t(m_rows[size_t(k)])] -= m_Gz[size_t(k)];
        }
        for (const LateBlock& late : m_lateBlocks) {
            const int size = system.blocks[size_t(late.block)].size;
            Scalar* rows = m_x.data() + late.firstUnknown;
            if (hasResidual)
                std::copy_n(system.r.data() + m_firstSpeed[size_t(late.block)], size, rows);
            else
                std::fill_n(rows, size, Scalar(0));
        }
        if (!m_x.empty()) m_fronts->solve(m_x.data(), m_threads);
        for (const LateBlock& late : m_lateBlocks)
            std::copy_n(m_x.data() + late.firstUnknown, system.blocks[size_t(late.block)].size,
                        m_deltaU.data() + m_firstSpeed[size_t(late.block)]);
        m_timing.schur += secondsSince(start);
    }

    void substitute(const System& system, int b, bool hasResidual) {
        if (m_isLate[size_t(b)]) return;
        const int first = m_firstSpeed[size_t(b)];
        const int begin = m_firstColumn[size_t(b)], end = m_firstColumn[size_t(b) + 1];
        Scalar* lambda = m_columnLambda.data();
        for (int k = begin; k < end; ++k) lambda[k] = m_x[size_t(m_rows[size_t(k)])];
        m_blocks[size_t(b)].substitute(hasResidual ? system.r.data() + first : nullptr,
                                       lambda + begin, m_deltaU.data() + first);
    }

    /** Prefetches the next block, if there is one. **/
    void prefetch(int b) const {
        if (size_t(b) < m_blocks.size()) m_blocks[size_t(b)].prefetch();
    }

    const std::vector<Scalar>& getDeltaU() const { return m_deltaU; }

    const Scalar* getDeltaLambda() const { return m_x.data(); }
    const FrontSolver<Scalar>& getFronts() const { return *m_fronts; }

    void setNumThreads(int most) {
        constexpr double WorkPerThread = 1e5;  // multiplications in one factor()
        m_threads = chooseNumThreads(most, m_work, WorkPerThread);
    }
    const Timing& getTiming() const { return m_timing; }
    bool isFactored() const { return m_isFactored; }
    bool hasLateBlocks() const { return !m_lateBlocks.empty(); }
    void dissolveLateBlocks(const System& system) {
        m_isFactored = false;
        analyse(system, false);
    }

private:
    void requireFactors() const {
        if (!m_isFactored)
            throw std::logic_error("BlockEliminationSolver::solve() before factor()");
    }

    /** A block whose speeds are unknowns of step 3: rows −J Δu − Gᵀ Δλ = r. **/
    struct LateBlock {
        int block;
        int firstUnknown;
        int selfClique;  ///< −J
        struct Coupling {
            int clique;  ///< [0, −Gᵀ; −G, 0] for some columns of Gᵀ
            int firstColumn, numColumns;
        };
        std::vector<Coupling> couplings;
        Matrix minusJ;
        MatrixXd Gt;
    };

    /** Lays out the unknowns and cliques of step 3. **/
    void analyse(const System& system, bool keepLateBlocks) {
        m_work = 0;
        CliquePattern pattern;
        pattern.numUnknowns = m_numMultipliers;
        m_lateBlocks.clear();
        m_isLate.assign(m_blocks.size(), 0);
        m_isRegular.assign(m_blocks.size(), 1);
        m_lateMatrices.clear();
        std::vector<std::vector<int>> blocksOfRow(static_cast<size_t>(m_numMultipliers));
        for (size_t b = 0; b < m_blocks.size(); ++b) {
            const Block& block = system.blocks[b];
            m_work += double(block.size) * block.size + 20.0 * block.size * block.numColumns();
            m_isLate[b] = keepLateBlocks && isLate(block);
            pattern.cliques.push_back(m_isLate[b] ? std::vector<int>() : block.rows);
            for (int row : block.rows) blocksOfRow[size_t(row)].push_back(int(b));
        }
        for (size_t b = 0; b < m_blocks.size(); ++b) {
            if (!m_isLate[b]) continue;
            const Block& block = system.blocks[b];
            LateBlock late;
            late.block = int(b);
            late.firstUnknown = pattern.numUnknowns;
            pattern.numUnknowns += block.size;
            std::vector<int> speeds;
            for (int i = 0; i < block.size; ++i) speeds.push_back(late.firstUnknown + i);
            pattern.lastUnknowns.insert(pattern.lastUnknowns.end(), speeds.begin(), speeds.end());
            late.selfClique = int(pattern.cliques.size());
            pattern.cliques.push_back(speeds);
            // Columns of one joint together: those that act on the same blocks.
            for (int first = 0; first < block.numColumns();) {
                const auto blocksOf = [&](int column) -> const std::vector<int>& {
                    return blocksOfRow[size_t(block.rows[size_t(column)])];
                };
                int columns = 1;
                while (first + columns < block.numColumns() &&
                       blocksOf(first + columns) == blocksOf(first))
                    ++columns;
                late.couplings.push_back({int(pattern.cliques.size()), first, columns});
                std::vector<int> clique = speeds;
                clique.insert(clique.end(), block.rows.begin() + first,
                              block.rows.begin() + first + columns);
                pattern.cliques.push_back(clique);
                first += columns;
            }
            late.minusJ.setZero(block.size, block.size);
            late.Gt.setZero(block.size, block.numColumns());
            m_lateBlocks.push_back(std::move(late));
        }
        m_firstComplianceClique = int(pattern.cliques.size());
        visitCompliances(system, [&](int row, bool isPair) {
            pattern.cliques.push_back(isPair ? std::vector<int>{row, row + 1}
                                             : std::vector<int>{row});
        });
        m_pairs.resize(system.pairs.size());
        m_firstCouplingClique = int(pattern.cliques.size());
        for (const auto& coupling : system.couplings) pattern.cliques.push_back(coupling.rows);
        // Rows that act on late blocks only have no diagonal until these are eliminated.
        for (int row = 0; row < m_numMultipliers && !m_lateBlocks.empty(); ++row)
            if (std::all_of(blocksOfRow[size_t(row)].begin(), blocksOfRow[size_t(row)].end(),
                            [&](int b) { return m_isLate[size_t(b)]; }))
                pattern.lastUnknowns.push_back(row);
        m_cliqueValues.assign(pattern.cliques.size(), nullptr);
        m_lateMatrices.resize(pattern.cliques.size());
        m_x.assign(size_t(pattern.numUnknowns), 0);
        m_fronts = std::make_unique<FrontSolver<Scalar>>(pattern);
        m_work += m_fronts->getTree().work();
    }

    void factorBlocks(const System& system) {
        m_isPartUsed.assign(m_parts.size(), 0);
        for (const Block& block : system.blocks)
            if (block.form == NewtonBlock::Form::Arrow) m_isPartUsed[size_t(block.part)] = 1;
        for (size_t p = 0; p < m_parts.size(); ++p)
            if (m_isPartUsed[p] && !m_parts[p].factor(system.parts[p]))
                throw std::runtime_error("BlockEliminationSolver: the diagonal of part " +
                                         std::to_string(p) + " is singular or not finite");
        const int count = int(m_blocks.size());
        parallelFor(count, m_threads, [&](int b) {
            m_isRegular[size_t(b)] =
                m_isLate[size_t(b)] || m_blocks[size_t(b)].factor(system, system.blocks[size_t(b)]);
        });
        const int culprit =
            int(std::find(m_isRegular.begin(), m_isRegular.end(), 0) - m_isRegular.begin());
        if (culprit < count)
            throw SingularBlock(culprit, "BlockEliminationSolver: the matrix of block " +
                                             std::to_string(culprit) +
                                             " is singular or not finite");
    }

    /** Visits nonzero rows, both at once for a pair. **/
    template <class Visit>
    static void visitCompliances(const System& system, const Visit& visit) {
        auto pair = system.pairs.begin();
        for (int row = 0; row < int(system.compliance.size()); ++row) {
            const bool isPair = pair != system.pairs.end() && *pair == row;
            if (isPair || system.compliance[size_t(row)] != 0.0) visit(row, isPair);
            if (!isPair) continue;
            ++pair;
            ++row;
        }
    }

    void factorSchurComplement(const System& system) {
        bool isSymmetric = system.pairs.empty() && system.couplings.empty();
        for (size_t b = 0; b < m_blocks.size(); ++b) {
            m_cliqueValues[b] = m_isLate[b] ? nullptr : m_blocks[b].getSchur();
            isSymmetric = isSymmetric && system.blocks[b].form != NewtonBlock::Form::General &&
                          system.blocks[b].form != NewtonBlock::Form::Tree;
        }
        for (LateBlock& late : m_lateBlocks) fillLateBlock(system, late);
        size_t clique = size_t(m_firstComplianceClique);
        size_t pair = 0;
        visitCompliances(system, [&](int row, bool isPair) {
            const Scalar& compliance = system.compliance[size_t(row)];
            if (!isPair) {
                m_cliqueValues.at(clique++) = &compliance;
                return;
            }
            auto& values = m_pairs[pair++];
            values = {compliance, compliance, System::PairFactor * compliance, compliance};
            m_cliqueValues.at(clique++) = values.data();
        });
        for (size_t k = 0; k < system.couplings.size(); ++k)
            m_cliqueValues.at(size_t(m_firstCouplingClique) + k) =
                system.couplings[k].values.data();
        if (m_x.empty()) return;
        m_fronts->setSymmetric(isSymmetric);
        m_fronts->factor(m_cliqueValues, m_threads);
    }

    void fillLateBlock(const System& system, LateBlock& late) {
        const Block& block = system.blocks[size_t(late.block)];
        const int n = block.size;
        if (block.form == NewtonBlock::Form::Arrow) {
            const typename System::Part& part = system.parts[size_t(block.part)];
            late.minusJ.template topLeftCorner<6, 6>() =
                -Map<const Matrix>(block.head.data(), 6, 6);
            late.minusJ.bottomLeftCorner(n - 6, 3) =
                -Map<const Matrix>(block.coupling.data(), n - 6, 3);
            late.minusJ.topRightCorner(3, n - 6) =
                late.minusJ.bottomLeftCorner(n - 6, 3).transpose();
            late.minusJ.diagonal().tail(n - 6) = -Map<const Vector>(part.diagonal.data(), n - 6);
        } else if (block.form == NewtonBlock::Form::Tree) {
            std::vector<Scalar> workspace;
            block.tree.expand(n, late.minusJ.data(), workspace);
            late.minusJ *= Scalar(-1);
        } else {
            late.minusJ = -Map<const Matrix>(block.matrix.data(), n, n);
        }
        system.expandGt(block, late.Gt.data());
        m_cliqueValues[size_t(late.selfClique)] = late.minusJ.data();
        for (const auto& coupling : late.couplings) {
            Matrix& values = m_lateMatrices[size_t(coupling.clique)];
            const int k = coupling.numColumns;
            values.setZero(n + k, n + k);
            values.topRightCorner(n, k) =
                -late.Gt.middleCols(coupling.firstColumn, k).template cast<Scalar>();
            values.bottomLeftCorner(k, n) = values.topRightCorner(n, k).transpose();
            m_cliqueValues[size_t(coupling.clique)] = values.data();
        }
    }

    int m_numMultipliers;
    std::vector<PartFactors<Scalar>> m_parts;
    std::vector<BlockFactors<Scalar>> m_blocks;
    std::vector<char> m_isLate, m_isRegular, m_isPartUsed;
    std::vector<LateBlock> m_lateBlocks;
    std::vector<Matrix> m_lateMatrices;  ///< by clique
    std::vector<const Scalar*> m_cliqueValues;
    int m_firstComplianceClique = 0, m_firstCouplingClique = 0;
    std::vector<std::array<Scalar, 4>> m_pairs;  ///< D of each, column-major
    std::unique_ptr<FrontSolver<Scalar>> m_fronts;

    std::vector<int> m_firstColumn, m_firstSpeed;  ///< by block; all columns' end last
    std::vector<int> m_rows;                       ///< all blocks' columns, one after another
    std::vector<Scalar> m_deltaU;
    std::vector<Scalar> m_Gz, m_columnLambda;  ///< by column
    std::vector<Scalar> m_x;                   ///< Δλ, then late blocks' Δu
    double m_work = 0;                         ///< of one factor() with arrows
    int m_threads = 1;
    bool m_isFactored = false;
    Timing m_timing;
};

template <class Scalar>
BlockElimination<Scalar>::BlockElimination(const System& system)
    : m_impl(std::make_unique<Implementation>(system)) {}
template <class Scalar>
BlockElimination<Scalar>::~BlockElimination() = default;
template <class Scalar>
BlockElimination<Scalar>::BlockElimination(BlockElimination&&) noexcept = default;
template <class Scalar>
BlockElimination<Scalar>& BlockElimination<Scalar>::operator=(BlockElimination&&) noexcept =
    default;

template <class Scalar>
void BlockElimination<Scalar>::setNumThreads(int threads) {
    if (threads < 1)
        throw std::invalid_argument("BlockEliminationSolver::setNumThreads: at least 1");
    m_impl->setNumThreads(threads);
}
template <class Scalar>
void BlockElimination<Scalar>::factor(const System& system) {
    m_impl->factor(system);
}
template <class Scalar>
void BlockElimination<Scalar>::solve(const System& system) {
    m_impl->solve(system, true);
}
template <class Scalar>
void BlockElimination<Scalar>::eliminate(const System& system, int block) {
    m_impl->eliminate(system, block);
}
template <class Scalar>
void BlockElimination<Scalar>::solveForMultipliers(const System& system) {
    m_impl->solveForMultipliers(system, true);
}
template <class Scalar>
void BlockElimination<Scalar>::substitute(const System& system, int block) {
    m_impl->prefetch(block + 1);
    m_impl->substitute(system, block, true);
}
template <class Scalar>
void BlockElimination<Scalar>::solveForConstraints(const System& system) {
    m_impl->solve(system, false);
}
template <class Scalar>
const std::vector<Scalar>& BlockElimination<Scalar>::getDeltaU() const {
    return m_impl->getDeltaU();
}
template <class Scalar>
const Scalar* BlockElimination<Scalar>::getDeltaLambda() const {
    return m_impl->getDeltaLambda();
}
template <class Scalar>
bool BlockElimination<Scalar>::isFactored() const {
    return m_impl->isFactored();
}
template <class Scalar>
bool BlockElimination<Scalar>::hasLateBlocks() const {
    return m_impl->hasLateBlocks();
}
template <class Scalar>
void BlockElimination<Scalar>::dissolveLateBlocks(const System& system) {
    m_impl->dissolveLateBlocks(system);
}
template <class Scalar>
int BlockElimination<Scalar>::getNumRedundant() const {
    return int(getRedundantRows().size());
}
template <class Scalar>
const std::vector<int>& BlockElimination<Scalar>::getRedundantRows() const {
    return m_impl->getFronts().getRedundantUnknowns();
}
template <class Scalar>
std::vector<int> BlockElimination<Scalar>::findInvolvedRows(int k) const {
    return m_impl->getFronts().findInvolvedUnknowns(k);
}
template <class Scalar>
auto BlockElimination<Scalar>::getTiming() const -> const Timing& {
    return m_impl->getTiming();
}

template class BlockElimination<double>;
template class BlockElimination<std::complex<double>>;

}  // namespace simflex
