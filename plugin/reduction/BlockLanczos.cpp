#include "BlockLanczos.h"

#include <algorithm>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <type_traits>
#include <utility>
#include <vector>

#include "simflex/base/Chunk.h"
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
constexpr Index ChunkRows = 256;             // rows that fit into the cache
constexpr Index VectorWorthThreads = 20000;  // rows worth starting threads for
constexpr Index Sums = 64;                   // partial sums of consecutive chunks

/** Consecutive rows. **/
struct Rows {
    Index begin, end;
};

/** Adds VᵀW to S for some columns of V and at most eight of W. All are row-major. **/
template <int Columns>
void addTransposed(const double* V, Index strideV, const double* W, Index strideW, Index numRows,
                   double* S, Index strideS, int width) {
    Chunk sums[Columns];
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) sums[c] = loadChunk(S + c * strideS, width);
    for (Index row = 0; row < numRows; ++row, V += strideV, W += strideW) {
        const Chunk w = loadChunk(W, width);
#pragma GCC unroll 8
        for (int c = 0; c < Columns; ++c) sums[c] += V[c] * w;
    }
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) storeChunk(sums[c], S + c * strideS, width);
}

/** Adds V S to W for some columns of V and at most eight of W. **/
template <int Columns>
void addProduct(const double* V, Index strideV, double* W, Index strideW, Index numRows,
                const double* S, Index strideS, int width) {
    Chunk factors[Columns];
#pragma GCC unroll 8
    for (int c = 0; c < Columns; ++c) factors[c] = loadChunk(S + c * strideS, width);
    for (Index row = 0; row < numRows; ++row, V += strideV, W += strideW) {
        Chunk w = loadChunk(W, width);
#pragma GCC unroll 8
        for (int c = 0; c < Columns; ++c) w += V[c] * factors[c];
        storeChunk(w, W, width);
    }
}

/** Calls one of the above, with the products of eight columns of V or of one, until all are done. S
begins at row `first`. **/
template <class Eight, class One, class Left, class Right>
void forPanels(const Eight& eight, const One& one, const Vectors& V, Left& W, Rows rows, Right& S,
               Index first) {
    for (Index column = 0; column < V.cols();) {
        const bool isPanel = column + ChunkSize <= V.cols();
        for (Index j = 0; j < W.cols(); j += ChunkSize)
            (isPanel ? eight : one)(&V.coeffRef(rows.begin, column), V.cols(),
                                    &W.coeffRef(rows.begin, j), W.cols(), rows.end - rows.begin,
                                    &S.coeffRef(first + column, j), S.cols(),
                                    int(std::min<Index>(ChunkSize, W.cols() - j)));
        column += isPanel ? ChunkSize : 1;
    }
}

/** Adds VᵀW, summed over some rows, to the rows of S from `first` on. **/
void addTransposed(const Vectors& V, const Vectors& W, Rows rows, Vectors& S, Index first = 0) {
    forPanels(addTransposed<ChunkSize>, addTransposed<1>, V, W, rows, S, first);
}

/** Adds V S to some rows of W; S has the rows of another matrix from `first` on. **/
void addProduct(const Vectors& V, const Vectors& S, Rows rows, Vectors& W, Index first = 0) {
    forPanels(addProduct<ChunkSize>, addProduct<1>, V, W, rows, S, first);
}

/** The basis V, block by block, and its operations, in chunks of rows. **/
class Basis {
public:
    explicit Basis(Index size) : m_size(size) {}

    Index count() const { return m_count; }

    void append(Vectors block) {
        m_count += block.cols();
        m_blocks.push_back(std::move(block));
    }

    /** W ← W − V VᵀW, twice. The first pass uses the columns from `from` on: W contains only
    round-off of the others. @returns the coefficients removed, count×k. **/
    MatrixXd orthogonalize(Vectors& W, Index from = 0) const {
        const Vectors first = sum(m_count, W.cols(), [&](Rows rows, Vectors& part) {
            addTransposedBasis(from, W, rows, part);
        });
        const Vectors minusFirst = -first;
        const Vectors second = sum(m_count, W.cols(), [&](Rows rows, Vectors& part) {
            addBasisProduct(from, minusFirst, rows, W);
            addTransposedBasis(0, W, rows, part);
        });
        const Vectors minusSecond = -second;
        forChunks([&](Rows rows) { addBasisProduct(0, minusSecond, rows, W); });
        return first + second;
    }

    /** Orthonormalises W, W = Q B, while keeping it orthogonal to V; directions shorter than
    `shortest` are dropped. @returns B. **/
    MatrixXd orthonormalize(Vectors& W, double shortest) const {
        MatrixXd B = MatrixXd::Identity(W.cols(), W.cols());
        for (int pass = 0; W.cols() > 0; ++pass) {
            const Index width = W.cols();
            MatrixXd gram = sum(width, width,
                                [&](Rows rows, Vectors& part) { addTransposed(W, W, rows, part); });
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
            W = calcProduct(kept, [&, factors = Vectors(toQ)](Rows rows, Vectors& result) {
                addProduct(W, factors, rows, result);
            });
            const bool good = dropped == 0 && lambda[0] > IllScaled &&
                              norms.minCoeff() > std::sqrt(IllScaled) * longest;
            if (kept == 0 || (pass > 0 && good)) break;
            if (!good) orthogonalize(W);
            if (pass > 8) throw std::runtime_error("a block of Lanczos vectors lost its rank");
        }
        return B;
    }

    /** V S. **/
    Vectors combine(const MatrixXd& S) const {
        return calcProduct(S.cols(), [&, factors = Vectors(S)](Rows rows, Vectors& result) {
            addBasisProduct(0, factors, rows, result);
        });
    }

    /** V ← V S, in place. **/
    void replaceBy(const MatrixXd& S) {
        forChunks([&](Rows rows) {
            const Index count = rows.end - rows.begin;
            Vectors part = Vectors::Zero(count, S.cols());
            forBlocks(0, [&](const Vectors& V, Index at) {
                part.noalias() += V.middleRows(rows.begin, count) * S.middleRows(at, V.cols());
            });
            Index at = 0;
            for (Vectors& V : m_blocks) {
                const Index width = std::min(V.cols(), S.cols() - at);
                if (width <= 0) break;
                V.block(rows.begin, 0, count, width) = part.middleCols(at, width);
                at += V.cols();
            }
        });
        m_count = 0;
        std::vector<Vectors> blocks;
        blocks.swap(m_blocks);
        for (Vectors& V : blocks) {
            const Index width = std::min(V.cols(), S.cols() - m_count);
            if (width == 0) break;
            if (width < V.cols()) V = V.leftCols(width).eval();
            append(std::move(V));
        }
    }

private:
    int chooseThreads() const { return m_size >= VectorWorthThreads ? omp_get_max_threads() : 1; }

    Index numChunks() const { return (m_size + ChunkRows - 1) / ChunkRows; }
    Rows rowsOf(Index chunk) const {
        return {chunk * ChunkRows, std::min((chunk + 1) * ChunkRows, m_size)};
    }

    template <class Work>
    void forChunks(const Work& work) const {
        parallelFor(numChunks(), chooseThreads(), [&](Index chunk) { work(rowsOf(chunk)); });
    }

    /** Returns what `add` adds to the rows of a matrix. **/
    template <class Add>
    Vectors calcProduct(Index numColumns, const Add& add) const {
        Vectors result(m_size, numColumns);
        forChunks([&](Rows rows) {
            result.middleRows(rows.begin, rows.end - rows.begin).setZero();
            add(rows, result);
        });
        return result;
    }

    /** Calls work(block, its first column) for the blocks from column `from` on. **/
    template <class Work>
    void forBlocks(Index from, const Work& work) const {
        Index column = 0;
        for (const Vectors& V : m_blocks) {
            if (column >= from) work(V, column);
            column += V.cols();
        }
    }

    /** Adds VᵀW of some rows to S, with the columns of V from `from` on. **/
    void addTransposedBasis(Index from, const Vectors& W, Rows rows, Vectors& S) const {
        forBlocks(from, [&](const Vectors& V, Index at) { addTransposed(V, W, rows, S, at); });
    }

    /** Adds V S to some rows of W, with the columns of V from `from` on. **/
    void addBasisProduct(Index from, const Vectors& S, Rows rows, Vectors& W) const {
        forBlocks(from, [&](const Vectors& V, Index at) { addProduct(V, S, rows, W, at); });
    }

    /** Adds up a matrix over all rows, in a fixed order. **/
    template <class Work>
    Vectors sum(Index numRows, Index numColumns, const Work& work) const {
        const Index numSums = std::min(Sums, numChunks());
        std::vector<Vectors> parts(static_cast<size_t>(numSums));
        parallelFor(numSums, chooseThreads(), [&](Index k) {
            Vectors part = Vectors::Zero(numRows, numColumns);
            const Index end = (k + 1) * numChunks() / numSums;
            for (Index chunk = k * numChunks() / numSums; chunk < end; ++chunk)
                work(rowsOf(chunk), part);
            parts[size_t(k)] = std::move(part);
        });
        for (size_t k = 1; k < parts.size(); ++k) parts[0] += parts[k];
        return parts[0];
    }

    const Index m_size;
    std::vector<Vectors> m_blocks;
    Index m_count = 0;
};

/** Reproducible pseudo-random numbers in −½…½, the same on all platforms. **/
class RandomBlock {
public:
    Vectors make(Index size, Index width) {
        Vectors block(size, width);
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
    MatrixXd full(size, size);
    Vectors Y;
    for (Index k = 0; k < size; k += width) {
        reportProgress(progress, phase, double(k) / double(size));
        const Index columns = std::min(width, size - k);
        Vectors X = Vectors::Zero(size, columns);
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

    Basis basis(size);
    RandomBlock random;
    MatrixXd T(0, 0);
    Vectors W = random.make(size, blockSize);
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
        Vectors CW;
        C.apply(W, CW);
        basis.append(std::move(W));
        W.swap(CW);
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
            if (verdict.numFound > capacity / 2 && capacity < size)
                capacity = std::min(2 * capacity, size);
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
            Vectors both(size, W.cols() + fresh);
            both << W, random.make(size, fresh);
            basis.orthogonalize(both);
            basis.orthonormalize(both, 0);
            W.swap(both);
        }
    }
}

}  // namespace simflex
