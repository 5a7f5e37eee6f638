#include "simflex/solver/ModalForm.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/FlushDenormals.h"
#include "simflex/base/NumberText.h"
#include "simflex/solver/equilibrium/SimbodyMatrix.h"

namespace simflex {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;
using SimTK::Complex;
using SimTK::Matrix;

namespace {

constexpr double PoleRoundOff = std::numeric_limits<double>::epsilon();
/** Relative distance below which poles are not separated. **/
constexpr double SamePole = 1e-6;
/** The same for real poles and those with |Im λ| below NearReal·|λ|: near critical damping, one
pole alone is meaningless. **/
constexpr double NearRealPole = 0.5, NearReal = 0.01;
/** Least relative part of a mode that is controllable or observable. **/
constexpr double ReachedPart = 1e-8;
/** Growth rate, relative to a pole, above which it is unstable. **/
constexpr double SlowGrowth = 1e-7;

/** Replaces A by S⁻¹A S, whose rows and columns have similar sums; returns the diagonal of S,
powers of two. **/
VectorXd balanceMatrix(MatrixXd& A) {
    constexpr int mostPasses = 100;
    constexpr double enough = 0.95;
    VectorXd scales = VectorXd::Ones(A.rows());
    bool isBalanced = false;
    for (int pass = 0; pass < mostPasses && !isBalanced; ++pass) {
        isBalanced = true;
        for (Eigen::Index i = 0; i < A.rows(); ++i) {
            const double own = std::abs(A(i, i)), row = A.row(i).cwiseAbs().sum() - own;
            double column = A.col(i).cwiseAbs().sum() - own;
            if (!(column > 0 && row > 0)) continue;
            const double before = column + row;
            double factor = 1;
            for (; column < row / 2; column *= 4) factor *= 2;
            for (; column >= row * 2; column /= 4) factor /= 2;
            if (!((column + row) / factor < enough * before)) continue;
            isBalanced = false;
            scales[i] *= factor;
            A.row(i) /= factor;
            A.col(i) *= factor;
        }
    }
    return scales;
}

/** A = U T Uᴴ. **/
struct OrderedSchur {
    MatrixXcd T, U;

    /** Swaps poles k and k + 1. **/
    void exchange(Eigen::Index k) {
        const Eigen::Index n = T.rows();
        const Complex first = T(k, k), second = T(k + 1, k + 1), f = T(k, k + 1),
                      g = second - first;
        const double size = std::hypot(std::abs(f), std::abs(g));
        if (std::abs(g) == 0) return;
        const double c = std::abs(f) / size;
        const Complex s =
            std::abs(f) == 0 ? std::conj(g) / std::abs(g) : f / std::abs(f) * std::conj(g) / size;
        for (Eigen::Index j = k + 2; j < n; ++j) {
            const Complex x = T(k, j), y = T(k + 1, j);
            T(k, j) = c * x + s * y;
            T(k + 1, j) = c * y - std::conj(s) * x;
        }
        const auto turnColumns = [&](MatrixXcd& matrix, Eigen::Index rows) {
            for (Eigen::Index i = 0; i < rows; ++i) {
                const Complex x = matrix(i, k), y = matrix(i, k + 1);
                matrix(i, k) = c * x + std::conj(s) * y;
                matrix(i, k + 1) = c * y - s * x;
            }
        };
        turnColumns(T, k);
        turnColumns(U, n);
        T(k, k) = second;
        T(k + 1, k + 1) = first;
    }
};

/** Poles that are not separated, from `begin` on along the diagonal. **/
struct PoleCluster {
    Eigen::Index begin = 0, size = 0;
    bool isReal = false;  ///< contains the conjugate of each of its poles
    Complex pole;         ///< their mean
};

/** Returns the indices of each cluster's poles: first for `clusters`, which are real or have a
positive imaginary part, then for their conjugates.
@throws std::runtime_error if poles come in no conjugate pairs **/
std::vector<std::vector<Eigen::Index>> gatherPoles(const VectorXcd& poles, double zero,
                                                   double noise,
                                                   std::vector<PoleCluster>& clusters) {
    const Eigen::Index n = poles.size();
    std::vector<Eigen::Index> root(static_cast<size_t>(n));
    std::iota(root.begin(), root.end(), 0);
    const auto findRoot = [&](Eigen::Index i) {
        while (root[size_t(i)] != i) i = root[size_t(i)];
        return i;
    };
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < i; ++j) {
            const double size = std::max(std::abs(poles[i]), std::abs(poles[j]));
            const double leastImag = std::max(NearReal * size, zero);
            const bool areReal =
                std::abs(poles[i].imag()) <= leastImag && std::abs(poles[j].imag()) <= leastImag;
            if (size > zero &&
                std::abs(poles[i] - poles[j]) > (areReal ? NearRealPole : SamePole) * size)
                continue;
            const Eigen::Index a = findRoot(i), b = findRoot(j);
            root[size_t(std::max(a, b))] = std::min(a, b);
        }
    std::vector<std::vector<Eigen::Index>> members, partners;
    clusters.clear();
    for (Eigen::Index i = 0; i < n; ++i) {
        if (findRoot(i) != i) continue;
        std::vector<Eigen::Index> own;
        Complex sum = 0;
        bool isAbove = false, isBelow = false;
        for (Eigen::Index j = i; j < n; ++j) {
            if (findRoot(j) != i) continue;
            own.push_back(j);
            sum += poles[j];
            const double least = std::max({SamePole * std::abs(poles[j]), noise, 0.0});
            const bool isZero = std::abs(poles[j]) <= zero;
            isAbove |= !isZero && poles[j].imag() > least;
            isBelow |= !isZero && poles[j].imag() < -least;
        }
        if (isBelow && !isAbove) {
            partners.push_back(own);
            continue;
        }
        clusters.push_back(
            {0, Eigen::Index(own.size()), isAbove == isBelow, sum / double(own.size())});
        members.push_back(own);
    }
    Eigen::Index place = 0, numPoles = 0;
    for (PoleCluster& cluster : clusters) {
        cluster.begin = place;
        place += cluster.size;
        numPoles += cluster.size * (cluster.isReal ? 1 : 2);
    }
    if (numPoles != n)
        throw std::runtime_error(
            "the poles of the linear model come in no conjugate pairs: leave "
            "its form as it is (form: full)");
    members.insert(members.end(), partners.begin(), partners.end());
    return members;
}

/** One mode, or several that are not separated: ẋ = A x + B p, with the contribution C x to y. **/
struct ModeBlock {
    MatrixXd A, B, C;
    Complex pole;
};

/** Orthonormal basis of a matrix's columns, without parts below `least` of its norm. **/
MatrixXd spanColumns(const MatrixXd& columns, double least) {
    MatrixXd basis(columns.rows(), 0), rest = columns;
    const double size = columns.norm();
    while (basis.cols() < columns.rows() && size > 0) {
        Eigen::Index largest = 0;
        const double norm = rest.colwise().norm().maxCoeff(&largest);
        if (!(norm > least * size)) break;
        VectorXd next = rest.col(largest) / norm;
        next -= basis * (basis.transpose() * next);
        basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
        basis.rightCols(1) = next.normalized();
        rest -= basis.rightCols(1) * (basis.rightCols(1).transpose() * rest);
    }
    return basis;
}

/** Basis of the smallest space that contains B and is invariant under A. **/
MatrixXd reachSpace(const MatrixXd& A, const MatrixXd& B) {
    const double size = A.norm();
    MatrixXd space = spanColumns(B, ReachedPart);
    while (space.cols() < A.rows() && size > 0) {
        MatrixXd more(A.rows(), 2 * space.cols());
        more << space, A * space / size;
        const MatrixXd next = spanColumns(more, ReachedPart);
        if (next.cols() == space.cols()) break;
        space = next;
    }
    return space;
}

/** Removes uncontrollable and unobservable parts.
@param reached, seen  B and C, of size 1 where an input or output is entirely in this mode **/
void keepReached(ModeBlock& mode, const MatrixXd& reached, const MatrixXd& seen) {
    const auto restrict = [](ModeBlock& whole, const MatrixXd& space) {
        whole.A = (space.transpose() * whole.A * space).eval();
        whole.B = (space.transpose() * whole.B).eval();
        whole.C = (whole.C * space).eval();
    };
    const Eigen::Index none = 0;
    if (!(reached.norm() > ReachedPart) || !(seen.norm() > ReachedPart)) {
        restrict(mode, MatrixXd(mode.A.rows(), none));
        return;
    }
    if (mode.A.rows() <= 2 && mode.pole.imag() > 0) return;  // a pair cannot be divided
    const MatrixXd space = reachSpace(mode.A, reached);
    restrict(mode, space);
    restrict(mode, reachSpace(mode.A.transpose(), (seen * space).transpose()));
}

/** Modes by ascending |λ|. **/
std::vector<ModeBlock> divideIntoModes(const MatrixXd& givenA, const MatrixXd& givenB,
                                       const MatrixXd& givenC, bool isMinimal) {
    MatrixXd A = givenA;
    const Eigen::Index n = A.rows();
    const VectorXd scales = balanceMatrix(A);
    const MatrixXd B = scales.cwiseInverse().asDiagonal() * givenB,
                   C = givenC * scales.asDiagonal();
    const Eigen::ComplexSchur<MatrixXd> found(A);
    if (found.info() != Eigen::Success)
        throw std::runtime_error("the poles of the linear model are not found");
    OrderedSchur schur{found.matrixT(), found.matrixU()};
    // Double zeros with one eigenvector appear as the square root of round-off.
    const double size = A.norm(), noise = 100 * PoleRoundOff * size,
                 zero = 10 * std::sqrt(PoleRoundOff * size);
    std::vector<PoleCluster> clusters;
    const auto members = gatherPoles(schur.T.diagonal(), zero, noise, clusters);
    std::vector<Eigen::Index> order(static_cast<size_t>(n));  // pole at each place
    std::iota(order.begin(), order.end(), 0);
    Eigen::Index place = 0;
    for (const auto& own : members)
        for (const Eigen::Index pole : own) {
            Eigen::Index at =
                Eigen::Index(std::find(order.begin(), order.end(), pole) - order.begin());
            for (; at > place; --at) {
                schur.exchange(at - 1);
                std::swap(order[size_t(at)], order[size_t(at - 1)]);
            }
            ++place;
        }

    // Columns of V span the invariant spaces: T Y = Y diag(T_JJ).
    const MatrixXcd& T = schur.T;
    MatrixXcd Y = MatrixXcd::Identity(n, n);
    Eigen::Index begin = 0;
    for (const auto& own : members) {
        const Eigen::Index end = begin + Eigen::Index(own.size());
        for (Eigen::Index j = begin; j < end && begin > 0; ++j) {
            VectorXcd right = -T.col(j).head(begin);
            for (Eigen::Index i = begin; i < j; ++i) right += T(i, j) * Y.col(i).head(begin);
            for (Eigen::Index i = begin - 1; i >= 0; --i) {
                const Complex y = right[i] / (T(i, i) - T(j, j));
                Y(i, j) = y;
                right.head(i) -= y * T.col(i).head(i);
            }
        }
        begin = end;
    }
    const MatrixXcd V = schur.U * Y,
                    W = Y.triangularView<Eigen::UnitUpper>().solve(schur.U.adjoint());
    const MatrixXcd reachedB = W * B, seenC = C * V;
    const VectorXd inputSizes = B.colwise().norm(), outputSizes = C.rowwise().norm();

    std::vector<ModeBlock> modes;
    for (const PoleCluster& cluster : clusters) {
        const Eigen::Index a = cluster.begin, m = cluster.size;
        const MatrixXcd own = T.block(a, a, m, m), ownB = reachedB.middleRows(a, m),
                        ownC = seenC.middleCols(a, m);
        ModeBlock mode;
        mode.pole = cluster.pole;
        if (cluster.isReal) {
            MatrixXd both(n, 2 * m);
            both << V.middleCols(a, m).real(), V.middleCols(a, m).imag();
            MatrixXd Q(n, 0);
            for (Eigen::Index k = 0; k < m; ++k) {  // as many as there are poles
                MatrixXd rest = both - Q * (Q.transpose() * both);
                rest -= Q * (Q.transpose() * rest);
                Eigen::Index largest = 0;
                rest.colwise().norm().maxCoeff(&largest);
                Q.conservativeResize(Eigen::NoChange, k + 1);
                Q.col(k) = rest.col(largest).normalized();
            }
            mode.A = Q.transpose() * (A * Q);
            mode.B = ((Q.transpose() * V.middleCols(a, m)) * ownB).real();
            mode.C = C * Q;
            mode.pole = mode.pole.real();
        } else {
            mode.A.resize(2 * m, 2 * m);
            mode.B.resize(2 * m, B.cols());
            mode.C.resize(C.rows(), 2 * m);
            for (Eigen::Index i = 0; i < m; ++i) {
                mode.B.row(2 * i) = 2 * ownB.row(i).real();
                mode.B.row(2 * i + 1) = -2 * ownB.row(i).imag();
                mode.C.col(2 * i) = ownC.col(i).real();
                mode.C.col(2 * i + 1) = ownC.col(i).imag();
                for (Eigen::Index j = 0; j < m; ++j)
                    mode.A.block<2, 2>(2 * i, 2 * j) << own(i, j).real(), own(i, j).imag(),
                        -own(i, j).imag(), own(i, j).real();
            }
        }
        if (isMinimal) {
            MatrixXd reached = mode.B, seen = mode.C;
            const double left = W.middleRows(a, m).norm(), right = V.middleCols(a, m).norm();
            for (Eigen::Index k = 0; k < B.cols(); ++k)
                reached.col(k) *= inputSizes[k] > 0 ? 1 / (inputSizes[k] * left) : 0;
            for (Eigen::Index k = 0; k < C.rows(); ++k)
                seen.row(k) *= outputSizes[k] > 0 ? 1 / (outputSizes[k] * right) : 0;
            keepReached(mode, reached, seen);
        }
        if (mode.A.rows() > 0) modes.push_back(std::move(mode));
    }
    std::stable_sort(modes.begin(), modes.end(), [](const ModeBlock& x, const ModeBlock& y) {
        return std::abs(x.pole) < std::abs(y.pole);
    });
    for (ModeBlock& mode : modes)
        if (std::abs(mode.pole) <= zero) mode.pole = 0;
    return modes;
}

}  // namespace

StateSpace calcModalForm(const StateSpace& space, const ModalForm& form) {
    if (form.kind == ModalForm::Kind::Full || space.A.nrow() == 0) return space;
    const StandardArithmetic standard;
    std::vector<ModeBlock> kept;
    MatrixXd D = toDense(space.D);
    int count = 0;
    double slowest = 0;
    for (ModeBlock& mode : divideIntoModes(toDense(space.A), toDense(space.B), toDense(space.C),
                                           form.kind == ModalForm::Kind::Minimal)) {
        const double size = std::abs(mode.pole);
        const bool isKept = size == 0 || mode.pole.real() > SlowGrowth * size ||
                            ((form.modes == 0 || count < form.modes) &&
                             (form.highest <= 0 || size <= form.highest));
        if (count == 0) slowest = size;
        count += int(mode.A.rows() + 1) / 2;
        if (isKept)
            kept.push_back(std::move(mode));
        else
            D -= mode.C * SquareSystem(mode.A).solveEach(mode.B);
    }
    Eigen::Index size = 0;
    for (const ModeBlock& mode : kept) size += mode.A.rows();
    if (size == 0 && count > 0)
        throw std::runtime_error("the slowest mode is faster than those that are kept, at " +
                                 writeGeneral(slowest / (2 * SimTK::Pi), 4) + " Hz");
    if (size == 0)
        throw std::runtime_error("no mode is reached by the inputs and seen by the outputs");
    MatrixXd A = MatrixXd::Zero(size, size), B(size, D.cols()), C(D.rows(), size);
    Eigen::Index place = 0;
    for (const ModeBlock& mode : kept) {
        const Eigen::Index own = mode.A.rows();
        A.block(place, place, own, own) = mode.A;
        B.middleRows(place, own) = mode.B;
        C.middleCols(place, own) = mode.C;
        place += own;
    }
    StateSpace result = space;
    result.A = toSimbody(A);
    result.B = toSimbody(B);
    result.C = toSimbody(C);
    result.D = toSimbody(D);
    return result;
}

}  // namespace simflex
