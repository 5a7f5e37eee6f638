#include "BlockLanczos.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/ParallelFor.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr Index DenseSize = 400;      // a dense eigensolver is as fast for smaller sizes
constexpr double Nothing = 1e-14;     // relative to the largest eigenvalue; smaller ones are
                                      // round-off
constexpr double Coincide = 1e-8;     // relative distance below which eigenvalues may be multiple
constexpr double NearlyThere = 1e-3;  // residual relative to the eigenvalue below which it will
                                      // hardly change
constexpr double IllScaled = 1e-6;    // squared singular values of a block that needs another pass
constexpr int StepsOfFreshBlock = 8;
constexpr int MostRestarts = 300;
constexpr Index ChunkRows = 512;             // rows that fit into the cache
constexpr Index VectorWorthThreads = 20000;  // rows worth starting threads for
constexpr Index Sums = 64;                   // partial sums of consecutive chunks

/** The basis V and its operations, in chunks of rows. **/
class Basis {
public:
    Basis(Index size, Index capacity) : m_V(size, capacity) {}

    Index size() const { return m_V.rows(); }
    Index count() const { return m_count; }
    Index capacity() const { return m_V.cols(); }

    void grow(Index capacity) { m_V.conservativeResize(Eigen::NoChange, capacity); }

    void append(const MatrixXd& block) {
        m_V.middleCols(m_count, block.cols()) = block;
        m_count += block.cols();
    }

    /** W ← W − V VᵀW, twice. The first pass uses the columns from `from` on: W contains only
    round-off of the others. @returns the coefficients removed, count×k. **/
    MatrixXd orthogonalize(MatrixXd& W, Index from = 0) const {
        const auto V = m_V.leftCols(m_count), near = m_V.middleCols(from, m_count - from);
        const MatrixXd first =
            sum(near.cols(), W.cols(), [&](Index row, Index rows, MatrixXd& part) {
                part.noalias() += near.middleRows(row, rows).transpose() * W.middleRows(row, rows);
            });
        MatrixXd second = sum(m_count, W.cols(), [&](Index row, Index rows, MatrixXd& part) {
            W.middleRows(row, rows).noalias() -= near.middleRows(row, rows) * first;
            part.noalias() += V.middleRows(row, rows).transpose() * W.middleRows(row, rows);
        });
        forChunks([&](Index row, Index rows) {
            W.middleRows(row, rows).noalias() -= V.middleRows(row, rows) * second;
        });
        second.bottomRows(near.cols()) += first;
        return second;
    }

    /** Orthonormalises W, W = Q B, while keeping it orthogonal to V; directions shorter than
    `shortest` are dropped. @returns B. **/
    MatrixXd orthonormalize(MatrixXd& W, double shortest) const {
        MatrixXd B = MatrixXd::Identity(W.cols(), W.cols());
        for (int pass = 0; W.cols() > 0; ++pass) {
            const Index width = W.cols();
            MatrixXd gram = sum(width, width, [&](Index row, Index rows, MatrixXd& part) {
                part.noalias() += W.middleRows(row, rows).transpose() * W.middleRows(row, rows);
            });
            const VectorXd norms = gram.diagonal().cwiseSqrt();
            const VectorXd scale = norms.unaryExpr([](double x) { return x > 0 ? 1 / x : 0.0; });
            gram = scale.asDiagonal() * gram * scale.asDiagonal();
            const SymmetricEigen eigen = calcSymmetricEigen(gram);
            const VectorXd& lambda = eigen.values;  // ascending
            // The true length of a direction is at most its scaled length times the largest norm.
            const double longest = norms.maxCoeff(), least = pass == 0 ? shortest : 0.5;
            Index dropped = 0;
            while (dropped < width &&
                   (lambda[dropped] <= 1e-15 || std::sqrt(lambda[dropped]) * longest <= least))
                ++dropped;
            const Index kept = width - dropped;
            const MatrixXd U = eigen.vectors.rightCols(kept);
            const VectorXd root = lambda.tail(kept).cwiseSqrt();
            const MatrixXd toQ = scale.asDiagonal() * U * root.cwiseInverse().asDiagonal();
            B = root.asDiagonal() * U.transpose() * norms.asDiagonal() * B;
            forChunks([&](Index row, Index rows) {
                const MatrixXd part = W.middleRows(row, rows) * toQ;
                W.block(row, 0, rows, kept) = part;
            });
            W.conservativeResize(Eigen::NoChange, kept);
            const bool good = dropped == 0 && lambda[0] > IllScaled &&
                              norms.minCoeff() > std::sqrt(IllScaled) * longest;
            if (kept == 0 || (pass > 0 && good)) break;
            if (!good) orthogonalize(W);
            if (pass > 8) throw std::runtime_error("a block of Lanczos vectors lost its rank");
        }
        return B;
    }

    /** V S. **/
    MatrixXd combine(const MatrixXd& S) const {
        const auto V = m_V.leftCols(m_count);
        MatrixXd result(size(), S.cols());
        forChunks([&](Index row, Index rows) {
            result.middleRows(row, rows).noalias() = V.middleRows(row, rows) * S;
        });
        return result;
    }

    /** V ← V S. **/
    void replaceBy(const MatrixXd& S) {
        forChunks([&](Index row, Index rows) {
            const MatrixXd part = m_V.block(row, 0, rows, m_count) * S;
            m_V.block(row, 0, rows, S.cols()) = part;
        });
        m_count = S.cols();
    }

private:
    int chooseThreads() const { return size() >= VectorWorthThreads ? omp_get_max_threads() : 1; }

    template <class Work>
    void forChunks(const Work& work) const {
        const Index numChunks = (size() + ChunkRows - 1) / ChunkRows;
        parallelFor(numChunks, chooseThreads(), [&](Index chunk) {
            const Index row = chunk * ChunkRows;
            work(row, std::min(ChunkRows, size() - row));
        });
    }

    template <class Work>
    MatrixXd sum(Index numRows, Index numColumns, const Work& work) const {
        const Index numChunks = (size() + ChunkRows - 1) / ChunkRows,
                    numSums = std::min(Sums, numChunks);
        std::vector<MatrixXd> parts(static_cast<size_t>(numSums));
        parallelFor(numSums, chooseThreads(), [&](Index k) {
            MatrixXd part = MatrixXd::Zero(numRows, numColumns);
            const Index end = (k + 1) * numChunks / numSums;
            for (Index chunk = k * numChunks / numSums; chunk < end; ++chunk) {
                const Index row = chunk * ChunkRows;
                work(row, std::min(ChunkRows, size() - row), part);
            }
            parts[size_t(k)] = std::move(part);
        });
        for (size_t k = 1; k < parts.size(); ++k) parts[0] += parts[k];
        return parts[0];
    }

    MatrixXd m_V;  // memory of columns from m_count on is not touched
    Index m_count = 0;
};

/** Reproducible pseudo-random numbers in −½…½, the same on all platforms. **/
class RandomBlock {
public:
    MatrixXd make(Index size, Index width) {
        MatrixXd block(size, width);
        for (Index k = 0; k < block.size(); ++k)
            block.data()[k] = double(m_generator() >> 11) * 0x1p-53 - 0.5;
        return block;
    }

private:
    std::mt19937_64 m_generator{20250401};
};

/** Ritz values and vectors of T, descending, with their residuals. **/
struct Ritz {
    Ritz(const MatrixXd& T, const MatrixXd& B) {
        const SymmetricEigen eigen = calcSymmetricEigen(T);
        values = eigen.values.reverse();
        vectors = eigen.vectors.rowwise().reverse();
        residuals = (B * vectors.bottomRows(B.cols())).colwise().norm();
    }
    VectorXd values, residuals;
    MatrixXd vectors;
};

/** Assessment of the Ritz values. **/
struct Verdict {
    Index numFound = 0;       ///< number of leading values that are wanted and converged
    bool complete = false;    ///< all wanted eigenvalues are found
    bool suspicious = false;  ///< multiples of found eigenvalues may be missing
};

Verdict judge(const Ritz& ritz, const ModeRange& range, double accuracy, Index blockSize) {
    Verdict verdict;
    const Index n = ritz.values.size();
    const double nothing = Nothing * ritz.values[0];
    for (Index k = 0; k < n && !verdict.complete; ++k) {
        const double value = ritz.values[k], residual = ritz.residuals[k];
        if (value <= nothing && residual <= nothing) {
            verdict.complete = verdict.suspicious = true;  // possibly complete
        } else if (value + residual < range.smallest && residual <= NearlyThere * value && k > 0) {
            verdict.complete = true;  // early on, the largest may not have appeared yet
        } else if (value > nothing && residual <= accuracy * value) {
            if (value < range.smallest) {
                verdict.complete = true;
            } else {
                ++verdict.numFound;
                verdict.complete = verdict.numFound == range.count;
            }
        } else {
            break;
        }
    }
    for (Index k = blockSize - 1; k < verdict.numFound; ++k)
        if (ritz.values[k - blockSize + 1] - ritz.values[k] <= Coincide * ritz.values[k])
            verdict.suspicious = true;
    return verdict;
}

Eigenpairs solveDensely(const SymmetricOperator& C, const ModeRange& range,
                        const std::string& phase, const ProgressCallback& progress) {
    const Index size = C.size(), width = 32;
    MatrixXd full(size, size), Y;
    for (Index k = 0; k < size; k += width) {
        reportProgress(progress, phase, double(k) / double(size));
        const Index columns = std::min(width, size - k);
        MatrixXd X = MatrixXd::Zero(size, columns);
        X.middleRows(k, columns).setIdentity();
        C.apply(X, Y);
        full.middleCols(k, columns) = Y;
    }
    const SymmetricEigen eigen = calcSymmetricEigen(0.5 * (full + full.transpose()));
    const VectorXd values = eigen.values.reverse();
    const double least = std::max(range.smallest, Nothing * values[0]);
    Index count = 0;
    while (count < std::min<Index>(range.count, size) && values[count] > 0 &&
           values[count] >= least)
        ++count;
    return {values.head(count), eigen.vectors.rowwise().reverse().leftCols(count),
            int((size + width - 1) / width)};
}

}  // namespace

int estimateLanczosBasis(int count, int blockSize) {
    return 3 * count + 16 * blockSize;  // measured on compact and slender boxes
}

Eigenpairs calcLargestEigenpairs(const SymmetricOperator& C, const ModeRange& range,
                                 const std::string& phase, const ProgressCallback& progress,
                                 const LanczosOptions& options) {
    const Index size = C.size();
    const bool bounded = range.count < size;
    if (size <= DenseSize || (bounded && range.smallest == 0 && range.count > size / 3) ||
        (!bounded && range.smallest == 0))
        return solveDensely(C, range, phase, progress);

    const Index blockSize = std::min<Index>(options.blockSize, size);
    const Index guess = bounded ? estimateLanczosBasis(range.count, int(blockSize)) : 400;
    Index capacity = options.largestBasis > 0 ? options.largestBasis
                                              : 3 * guess + (range.smallest > 0 ? 1000 : 0);
    if (bounded) capacity = std::max<Index>(capacity, range.count + 8 * blockSize);
    capacity = std::min(capacity, size);

    Basis basis(size, capacity);
    RandomBlock random;
    MatrixXd T(0, 0), W = random.make(size, blockSize), Y;
    basis.orthonormalize(W, 0);
    Eigenpairs result;
    VectorXd found;                                                   // values before the last
                                                                      // fresh block
    double largest = 0;                                               // lower bound of ‖C‖
    Index numApplied = 0, nextJudgement = bounded ? range.count : 0;  // numbers of vectors
    Index previous = 0;  // first column of the previous block: C V has no component before it
    int sinceFresh = StepsOfFreshBlock, numRestarts = 0;
    for (;;) {
        // One step: append the block W to V and replace it by C W orthogonalised against V.
        const Index width = W.cols(), before = basis.count();
        basis.append(W);
        C.apply(W, Y);
        W.swap(Y);
        numApplied += width;
        ++result.numBlocks;
        ++sinceFresh;
        if (!W.allFinite())
            throw std::runtime_error(
                "Lanczos met a number that is not finite: the matrix is singular");
        const MatrixXd H = basis.orthogonalize(W, std::exchange(previous, before));
        const Index count = basis.count();
        T.conservativeResize(count, count);
        T.rightCols(width) = H;
        T.bottomLeftCorner(width, before) = H.topRows(before).transpose();
        T.bottomRightCorner(width, width) =
            0.5 * (H.bottomRows(width) + H.bottomRows(width).transpose());
        largest = std::max(largest, H.bottomRows(width).norm());
        const MatrixXd B = basis.orthonormalize(W, 1e-15 * largest);
        reportProgress(progress, phase, std::min(0.99, double(numApplied) / double(guess)));

        const bool full = count + W.cols() > capacity, exhausted = W.cols() == 0;
        if (count < nextJudgement && !full && !exhausted) continue;
        nextJudgement = count + count / 16;  // eigenvalues of a large T are expensive
        const Ritz ritz(T, B);
        Verdict verdict = judge(ritz, range, options.accuracy, blockSize);
        if (exhausted) verdict.suspicious = true;
        bool wantsFresh = exhausted;
        if ((verdict.complete && (sinceFresh >= StepsOfFreshBlock || exhausted)) || count == size) {
            const VectorXd values = ritz.values.head(verdict.numFound);
            const bool confirmed =
                values.size() == found.size() &&
                ((values - found).array().abs() <= Coincide * values.array()).all();
            if (!verdict.suspicious || confirmed || count == size) {
                result.values = values;
                result.vectors = basis.combine(ritz.vectors.leftCols(verdict.numFound));
                return result;
            }
            found = values;
            wantsFresh = true;
        }
        if (full || (wantsFresh && count + W.cols() + blockSize > capacity)) {
            if (++numRestarts > MostRestarts)
                throw std::runtime_error("Lanczos did not converge in " +
                                         std::to_string(MostRestarts) + " restarts");
            if (verdict.numFound > capacity / 2 && capacity < size) {
                capacity = std::min(2 * capacity, size);
                basis.grow(capacity);
            }
            const Index wanted = bounded ? std::max<Index>(range.count, verdict.numFound)
                                         : verdict.numFound,
                        room = capacity - 4 * blockSize;
            const Index kept =
                std::min({count, room, std::max(wanted + blockSize, (wanted + room) / 2)});
            basis.replaceBy(ritz.vectors.leftCols(kept));
            T = ritz.values.head(kept).asDiagonal();
            previous = 0;
            nextJudgement = 0;
        }
        if (wantsFresh) {
            sinceFresh = 0;
            const Index fresh = std::min(blockSize, size - basis.count() - W.cols());
            MatrixXd both(size, W.cols() + fresh);
            both << W, random.make(size, fresh);
            basis.orthogonalize(both);
            basis.orthonormalize(both, 0);
            W.swap(both);
        }
    }
}

}  // namespace simflex
