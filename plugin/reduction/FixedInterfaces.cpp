#include "FixedInterfaces.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <random>
#include <sstream>
#include <stdexcept>

#include "BlockLanczos.h"
#include "Coordinates.h"
#include "SparseCholesky.h"
#include "StiffnessSolver.h"
#include "simflex/base/Chunk.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/Hash.h"
#include "simflex/base/Memory.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/** Relative to the largest singular value: smaller load directions are dropped. **/
constexpr double Rank = 1e-10;

/** Relative to the diagonal: smaller stiffness is round-off. **/
constexpr double NoStiffness = 1e-12;
/** Share of its nodes' mass below which a motion is massless. **/
constexpr double NoMass = 1e-4;
/** Size of the subspace searched for idle motions, and its steps of inverse iteration. **/
constexpr Index NumSought = 24;
constexpr int NumSteps = 4;

/** Approximate speed of writing a factor and reading it back. **/
constexpr double BytesPerSecond = 4e8;

std::uint64_t calcKey(const SymmetricMatrix& A) {
    Hash hash;
    hash.add(A.columnStarts);
    hash.add(A.rows);
    hash.add(A.values);
    return hash.get();
}

/** Returns an orthonormal basis of the columns of X after scaling them to unit length. **/
MatrixXd orthonormalize(MatrixXd X) {
    const Eigen::VectorXd norms = X.colwise().norm();
    for (Index k = 0; k < X.cols(); ++k) X.col(k) /= norms[k];
    return calcThinQr(X).Q;
}

/** Returns the rows and columns of A whose index in the list is not negative, ascending. **/
SymmetricMatrix takeListed(const SymmetricMatrix& A, const std::vector<int>& listed,
                           const std::vector<int>& place) {
    SymmetricMatrix result;
    result.size = int(listed.size());
    result.columnStarts.reserve(listed.size() + 1);
    std::int64_t count = 0;
    for (const int column : listed)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            count += place[size_t(A.rows[k])] >= 0;
    result.rows.reserve(size_t(count));
    result.values.reserve(size_t(count));
    for (const int column : listed) {
        result.columnStarts.push_back(result.numEntries());
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k) {
            const int row = place[size_t(A.rows[k])];
            if (row < 0) continue;
            result.rows.push_back(row);
            result.values.push_back(A.values[k]);
        }
    }
    result.columnStarts.push_back(result.numEntries());
    return result;
}

/** Returns the 1-norm. **/
double calcNorm(const SymmetricMatrix& A) {
    std::vector<double> sums(size_t(A.size), 0.0);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k) {
            sums[size_t(column)] += std::abs(A.values[k]);
            if (A.rows[k] != column) sums[size_t(A.rows[k])] += std::abs(A.values[k]);
        }
    return *std::max_element(sums.begin(), sums.end());
}

/** Returns m ⊗ 1₃. **/
SymmetricMatrix tripleAxes(const SymmetricMatrix& m) {
    SymmetricMatrix M;
    M.size = 3 * m.size;
    M.columnStarts.reserve(size_t(M.size) + 1);
    M.rows.reserve(3 * m.rows.size());
    M.values.reserve(3 * m.values.size());
    for (int column = 0; column < m.size; ++column)
        for (int axis = 0; axis < 3; ++axis) {
            M.columnStarts.push_back(M.numEntries());
            for (auto k = m.columnStarts[column]; k < m.columnStarts[column + 1]; ++k) {
                M.rows.push_back(3 * m.rows[k] + axis);
                M.values.push_back(m.values[k]);
            }
        }
    M.columnStarts.push_back(M.numEntries());
    return M;
}

/** Index of each diagonal entry in the values of A, −1 if there is none. **/
std::vector<std::int64_t> findDiagonal(const SymmetricMatrix& A) {
    std::vector<std::int64_t> places;
    for (size_t column = 0; column < size_t(A.size); ++column) {
        const std::int64_t first = A.columnStarts[column];
        const bool isThere =
            first < A.columnStarts[column + 1] && A.rows[size_t(first)] == int(column);
        places.push_back(isThere ? first : -1);
    }
    return places;
}

/** Θᵀ M Θ, whose eigenvalues are 1/ω² of the normal modes. **/
class NormalModesOperator : public SymmetricOperator {
public:
    NormalModesOperator(const FixedInterfaces& held, const FullRows& m) : m_held(held), m_m(m) {}
    Index size() const override { return m_held.size(); }
    void apply(const Vectors& X, Vectors& Y) const override {
        Y = m_held.fromForces(m_m.multiplyPerAxis(m_held.toShapes(X)));
    }

private:
    const FixedInterfaces& m_held;
    const FullRows& m_m;
};

}  // namespace

struct FixedInterfaces::Data {
    Data(const std::string& partName, const FeModel& fe, const FeProducts& feProducts,
         const RigidMotion& rigidMotion, const InterfaceTies& interfaceTies)
        : part(partName),
          model(fe),
          products(feProducts),
          rigid(rigidMotion),
          ties(interfaceTies),
          coordinates(fe, feProducts.K, interfaceTies.tieOf()) {}

    const std::string part;
    const FeModel& model;
    const FeProducts& products;
    const RigidMotion& rigid;
    const InterfaceTies& ties;
    const Coordinates coordinates;
    SparseCholesky cholesky;
    std::shared_ptr<StiffnessSolver> solver;  ///< replaces cholesky if set

    double norm = 0;        ///< ‖K‖₁ of the free coordinates
    std::vector<int> free;  ///< coordinates that are neither tied nor supported: ascending, once
                            ///< factored in the order of L
    std::vector<int> tied;  ///< those that follow a rigid interface, ascending
    MatrixXd tiedMotion;    ///< motion of the tied coordinates per unit of each boundary coordinate

    /** Constraints D: of distributing ties, or the mean motion of a part without interfaces. **/
    struct Mean {
        size_t tie;
        MatrixXd D;  ///< 6×(3·nodes)
    };
    std::vector<Mean> means;
    Shapes MR;      ///< numDofs×6 of a part without interfaces, D = (M R)ᵀ; else empty
    MatrixXd N;     ///< self-equilibrated loads on the interfaces if the part is supported
    MatrixXd G;     ///< (DR)⁺ of a supported part
    MatrixXd C, Y;  ///< TᵀDᵀ of the free coordinates, times N if supported; K⁻¹C
    Eigen::LDLT<MatrixXd> CY;
    MatrixXd Q;  ///< orthonormal basis of L⁻¹C

    bool isSupported() const { return !ties.hasRigid(); }
    Index numMeans() const { return MR.size() > 0 ? 6 : 6 * Index(means.size()); }

    [[noreturn]] void refuse(const std::string& what) const {
        throw std::invalid_argument("part '" + part + "': " + what);
    }

    /** Returns D u. **/
    MatrixXd calcMean(const Shapes& u) const {
        if (MR.size() > 0) return MR.transpose() * u;
        MatrixXd mean(numMeans(), u.cols());
        for (size_t k = 0; k < means.size(); ++k) {
            const auto& nodes = ties.ties()[means[k].tie].nodes;
            MatrixXd local(3 * Index(nodes.size()), u.cols());
            for (size_t i = 0; i < nodes.size(); ++i)
                local.middleRows<3>(3 * Index(i)) = u.middleRows<3>(3 * nodes[i]);
            mean.middleRows(6 * Index(k), 6) = means[k].D * local;
        }
        return mean;
    }

    /** Returns Dᵀ λ. **/
    Shapes spread(const MatrixXd& lambda) const {
        if (MR.size() > 0) return MR * lambda;
        Shapes f = Shapes::Zero(model.K.size, lambda.cols());
        for (size_t k = 0; k < means.size(); ++k) {
            const MatrixXd local = means[k].D.transpose() * lambda.middleRows(6 * Index(k), 6);
            const auto& nodes = ties.ties()[means[k].tie].nodes;
            for (size_t i = 0; i < nodes.size(); ++i)
                f.middleRows<3>(3 * nodes[i]) = local.middleRows<3>(3 * Index(i));
        }
        return f;
    }

    MatrixXd solveCY(const MatrixXd& B) const { return CY.solve(B); }

    /** Returns K⁻¹ B of the free coordinates. **/
    Vectors solveFree(const Vectors& B) const {
        if (solver) return solver->solve(B);
        Vectors X = B;
        cholesky.solveLower(X);
        cholesky.solveUpper(X);
        return X;
    }

    /** Returns loads on the free coordinates; of a supported part, in equilibrium. **/
    Vectors takeForces(const Shapes& f) const {
        if (!isSupported()) return coordinates.contract(free, f);
        const MatrixXd resultant = rigid.R.transpose() * f;
        return coordinates.contract(free, f - spread(G.transpose() * resultant));
    }

    /** Returns shapes for the free coordinates; of a supported part, with its interfaces at
    rest. **/
    Shapes makeShapes(const Vectors& x) const {
        Shapes u = coordinates.expand(free, x);
        if (!isSupported()) return u;
        const MatrixXd motion = G * calcMean(u);
        u.noalias() -= rigid.R * motion;
        return u;
    }

    /** Returns the rows and columns of the free coordinates. **/
    SymmetricMatrix takeFree(const SymmetricMatrix& A) const {
        std::vector<int> place(size_t(coordinates.size()), -1);
        for (size_t k = 0; k < free.size(); ++k) place[size_t(free[k])] = int(k);
        return takeListed(A, free, place);
    }

    void findCoordinates();
    void factorFree(int numModes, const ReductionOptions& options,
                    const ProgressCallback& progress);
    void checkMemory(const SparseCholesky::Prediction& prediction, int numModes,
                     const ReductionOptions& options) const;
    void factorHeld(SymmetricMatrix K, const ProgressCallback& progress);
    std::vector<int> findIdleRows(const SymmetricMatrix& K, int singularRow);
    void prepareMeans();
};

/** Determines the tied coordinates and their motion, the supported coordinates and the free
ones. **/
void FixedInterfaces::Data::findCoordinates() {
    const Shapes rigidCoordinates = coordinates.solveRigid(rigid.R);
    std::vector<int> tieOf(size_t(coordinates.size()), -1);
    for (size_t k = 0; k < ties.ties().size(); ++k) {
        const auto& tie = ties.ties()[k];
        if (tie.type != TieType::Rigid) continue;
        for (const int node : tie.nodes)
            for (const int q : coordinates.coordinatesOf(node)) {
                int& owner = tieOf[size_t(q)];
                if (owner >= 0 && owner != int(k))
                    refuse("interfaces '" + ties.ties()[size_t(owner)].name + "' and '" + tie.name +
                           "' overlap: constraints hang node " +
                           std::to_string(model.mesh.nodeNumbers[size_t(node)]) +
                           " on nodes of both");
                owner = int(k);
            }
    }
    for (size_t k = 0; k < ties.ties().size(); ++k) {
        const auto& tie = ties.ties()[k];
        if (tie.type != TieType::Distributing) continue;
        means.push_back({k, ties.calcMean(model.mesh, tie)});
        for (const int node : tie.nodes)
            for (const int q : coordinates.coordinatesOf(node))
                if (tieOf[size_t(q)] >= 0)
                    refuse("interfaces '" + ties.ties()[size_t(tieOf[size_t(q)])].name + "' and '" +
                           tie.name + "' overlap: constraints hang node " +
                           std::to_string(model.mesh.nodeNumbers[size_t(node)]) +
                           " on a node of the first");
    }
    for (size_t q = 0; q < tieOf.size(); ++q)
        if (tieOf[q] >= 0) tied.push_back(int(q));
    // A unit of an interface coordinate is a rigid motion about its master.
    tiedMotion = MatrixXd::Zero(Index(tied.size()), ties.numBoundaryDofs());
    for (size_t i = 0; i < tied.size(); ++i) {
        const int k = tieOf[size_t(tied[i])];
        const Eigen::Map<const Eigen::Vector3d> master(ties.ties()[size_t(k)].master.data());
        Eigen::Matrix<double, 6, 6> aboutCenter = Eigen::Matrix<double, 6, 6>::Identity();
        aboutCenter.topRightCorner<3, 3>() = calcRigidMotion(rigid.center - master).rightCols<3>();
        tiedMotion.block(Index(i), 6 * k, 1, 6) = rigidCoordinates.row(tied[i]) * aboutCenter;
    }
    if (isSupported()) {
        // Support the six coordinates with the most independent rigid motions.
        MatrixXd motions = rigidCoordinates.transpose();
        for (Index j = 0; j < 6; ++j) motions.row(j).normalize();
        const std::vector<int> order = orderColumns(motions);
        for (size_t k = 0; k < 6; ++k) tieOf[size_t(order[k])] = 0;
    }
    for (size_t q = 0; q < tieOf.size(); ++q)
        if (tieOf[q] < 0) free.push_back(int(q));
}

void FixedInterfaces::Data::checkMemory(const SparseCholesky::Prediction& prediction, int numModes,
                                        const ReductionOptions& options) const {
    // After the factorization: the Lanczos basis and Ritz vectors, then the modes and products with
    // them.
    const double rows = double(model.K.size), modes = double(numModes);
    const double modesBytes =
        8 * rows * std::max(estimateLanczosBasis(numModes) + modes, 6 * modes);
    const double needed =
        double(prediction.factorBytes) + std::max(double(prediction.workingBytes), modesBytes);
    const double available =
        options.memoryLimit ? *options.memoryLimit : double(calcAvailableMemory());
    if (needed <= available) return;
    std::ostringstream text;
    text << "reducing it needs about " << formatMemory(needed) << " of memory ("
         << formatMemory(double(prediction.factorBytes)) << " for the factor of its " << free.size()
         << " free degrees of freedom, " << formatMemory(modesBytes) << " for " << numModes
         << " modes), but " << (options.memoryLimit ? "the limit is " : "the machine has ")
         << formatMemory(available) << (options.memoryLimit ? "" : " left")
         << "; take a coarser mesh, linear instead of quadratic elements, fewer modes or a larger "
            "machine, or set the memory limit (--memory) if you know better";
    refuse(text.str());
}

void FixedInterfaces::Data::factorFree(int numModes, const ReductionOptions& options,
                                       const ProgressCallback& progress) {
    try {
        const SymmetricMatrix K = coordinates.isIdentity()
                                      ? takeFree(products.K.matrix())
                                      : takeFree(coordinates.assembleStiffness());
        norm = calcNorm(K);
        if (options.solver) {
            solver = options.solver;
            reportProgress(progress, "factoring K", -1);
            solver->factor(K);
            return;
        }
        const std::uint64_t key = options.checkpoint ? calcKey(K) : 0;
        if (options.checkpoint &&
            options.checkpoint->load("factor", key, [&](Archive& in) { cholesky.load(in); }))
            return;
        const SparseCholesky::Prediction& prediction = cholesky.analyze(K);
        checkMemory(prediction, numModes, options);
        reportProgress(progress, "factoring K", 0);
        const auto start = std::chrono::steady_clock::now();
        factorHeld(K, progress);
        const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
        // Store the factor only if reading it is faster than recomputing it.
        if (options.checkpoint &&
            (options.checkpoint->worthSeconds() == 0 ||
             spent.count() >= double(prediction.factorBytes) / BytesPerSecond))
            options.checkpoint->save("factor", key, spent.count(),
                                     [&](Archive& out) { cholesky.save(out); });
    } catch (const SparseCholesky::SingularMatrix& singular) {
        refuse("the stiffness matrix is singular beyond the six rigid motions" +
               (singular.row >= 0 ? " at node " + std::to_string(coordinates.nodeNumberOf(
                                                      free[size_t(singular.row)]))
                                  : std::string()) +
               "; look for pieces that hang on a single node or edge, for elements without "
               "stiffness, and for few elements of reduced integration (C3D20R, S8R)" +
               describeSlenderness(rigid));
    }
}

/** Factors K, if necessary with one coordinate held per idle motion, which has neither stiffness
nor mass: the elements C3D20R, and thus S8R, have motions that vanish at all integration points.
Holding these loses nothing, since all other motions may contain any share of them. **/
void FixedInterfaces::Data::factorHeld(SymmetricMatrix K, const ProgressCallback& progress) {
    try {
        return cholesky.factor(K, progress);
    } catch (const SparseCholesky::SingularMatrix& singular) {
        const auto diagonal = findDiagonal(K);
        for (const int row : findIdleRows(K, singular.row))
            K.values[size_t(diagonal[size_t(row)])] *= 2;
    }
    cholesky.factor(K, progress);
}

/** Returns one row per idle motion. @throws SparseCholesky::SingularMatrix if K is singular for
another reason. **/
std::vector<int> FixedInterfaces::Data::findIdleRows(const SymmetricMatrix& K, int singularRow) {
    const Index size = K.size, count = std::min(size, NumSought);
    const auto diagonal = findDiagonal(K);
    Eigen::VectorXd D(size);
    SymmetricMatrix shifted = K;
    for (Index k = 0; k < size; ++k) {
        const std::int64_t at = diagonal[size_t(k)];
        if (at < 0 || !(K.values[size_t(at)] > 0)) throw SparseCholesky::SingularMatrix(int(k));
        D[k] = K.values[size_t(at)];
        shifted.values[size_t(at)] *= 1 + NoStiffness;
    }
    cholesky.factor(shifted);
    const Eigen::VectorXd scale = D.cwiseSqrt();
    MatrixXd X(size, count);
    for (Index j = 0; j < count; ++j)
        for (Index k = 0; k < size; ++k) X(k, j) = std::sin(double(1 + k * (2 * j + 1)));
    // Inverse iteration, with the columns of X orthonormal in D.
    for (int step = 0; step < NumSteps; ++step) {
        X = orthonormalize(scale.asDiagonal() * cholesky.solve(D.asDiagonal() * X));
        X = scale.cwiseInverse().asDiagonal() * X;
    }
    const SymmetricEigen stiffness =
        calcSymmetricEigen(symmetricGram(Shapes(X), LowerTriangle(K).multiply(X)));
    const Index numIdle = (stiffness.values.array() <= NoStiffness).count();
    if (numIdle == 0 || numIdle == count) throw SparseCholesky::SingularMatrix(singularRow);

    const MatrixXd motions = X * stiffness.vectors.leftCols(numIdle);
    const Shapes u = coordinates.expand(free, motions);
    Eigen::VectorXd masses = Eigen::VectorXd::Zero(u.rows());
    const auto nodes = findDiagonal(model.m);
    for (Index row = 0; row < u.rows(); ++row)
        if (const auto at = nodes[size_t(row / 3)]; at >= 0)
            masses[row] = model.m.values[size_t(at)];
    const MatrixXd together = symmetricGram(u, products.m.multiplyPerAxis(u)),
                   apart = u.transpose() * masses.asDiagonal() * u;
    if (!(together.trace() <= NoMass * apart.trace())) {
        Index row = 0, motion = 0;
        together.diagonal().maxCoeff(&motion);
        motions.col(motion).cwiseAbs().maxCoeff(&row);
        throw SparseCholesky::SingularMatrix(int(row));
    }
    // Choose the rows in which the motions are most independent.
    const std::vector<int> order = orderColumns((scale.asDiagonal() * motions).transpose());
    return {order.begin(), order.begin() + std::ptrdiff_t(numIdle)};
}

void FixedInterfaces::Data::prepareMeans() {
    if (ties.ties().empty()) MR = products.m.multiplyPerAxis(rigid.R);
    Q.resize(Index(free.size()), 0);
    const Index count = numMeans();
    if (count == 0) return;
    N = MatrixXd::Identity(count, count);
    if (isSupported()) {
        const MatrixXd DR = calcMean(rigid.R);
        ColumnSpace space = calcColumnSpace(DR, Rank * Rank);
        if (space.rank < 6)
            refuse(
                ties.ties().empty()
                    ? "its mass does not show all of its rigid motions: it may be a line, or one "
                      "row of C3D8R, which have their mass in their middles (use C3D8I), or "
                      "elements may lack mass"
                    : "its interfaces do not hold it: a rigid motion moves none of them");
        N = std::move(space.complement);
        G = std::move(space.pseudoInverse);
    }
    C = coordinates.contract(free, spread(N));
    if (C.cols() == 0) return;
    Y = solveFree(C);
    CY = Eigen::LDLT<MatrixXd>(C.transpose() * Y);
    if (solver) return;
    Vectors half = C;
    cholesky.solveLower(half);
    Q = orthonormalize(half);
}

FixedInterfaces::FixedInterfaces(const std::string& part, const FeModel& model,
                                 const FeProducts& products, const RigidMotion& rigid,
                                 const InterfaceTies& ties)
    : m_data(std::make_unique<Data>(part, model, products, rigid, ties)) {}

FixedInterfaces::~FixedInterfaces() = default;

void FixedInterfaces::factor(int numModes, const ReductionOptions& options,
                             const ProgressCallback& progress) {
    Data& d = *m_data;
    d.findCoordinates();
    if (!d.free.empty()) d.factorFree(numModes, options, progress);
    if (!d.free.empty() && !d.solver) {
        std::vector<int> order = d.cholesky.listOrder();
        for (int& row : order) row = d.free[size_t(row)];
        d.free.swap(order);
    }
    d.prepareMeans();
}

Index FixedInterfaces::size() const {
    return Index(m_data->free.size());
}

Shapes FixedInterfaces::toShapes(const Vectors& z) const {
    const Data& d = *m_data;
    if (d.free.empty()) return Shapes::Zero(d.model.K.size, z.cols());
    Vectors x = z;
    if (d.Q.cols() > 0) x.noalias() -= d.Q * (d.Q.transpose() * z).eval();
    d.cholesky.solveUpper(x);
    return d.makeShapes(x);
}

Vectors FixedInterfaces::fromForces(const Shapes& f) const {
    const Data& d = *m_data;
    if (d.free.empty()) return Vectors::Zero(0, f.cols());
    Vectors y = d.takeForces(f);
    d.cholesky.solveLower(y);
    if (d.Q.cols() > 0) y -= d.Q * (d.Q.transpose() * y).eval();
    return y;
}

Shapes FixedInterfaces::solve(const Shapes& f) const {
    const Data& d = *m_data;
    if (d.free.empty() || f.cols() == 0) return Shapes::Zero(d.model.K.size, f.cols());
    Vectors x = d.solveFree(d.takeForces(f));
    if (d.C.cols() > 0) x -= d.Y * d.solveCY(d.C.transpose() * x);
    return d.makeShapes(x);
}

Shapes FixedInterfaces::calcConstraintModes() const {
    const Data& d = *m_data;
    const Index numBoundary = d.ties.numBoundaryDofs(), numMeans = d.numMeans();
    MatrixXd prescribed = MatrixXd::Zero(numMeans, numBoundary);  // D u of each mode
    for (size_t k = 0; k < d.means.size(); ++k)
        prescribed.block(6 * Index(k), 6 * Index(d.means[k].tie), 6, 6).setIdentity();
    if (d.isSupported()) {
        // Self-equilibrated loads on the interfaces, then the remaining rigid motion.
        Shapes u = Shapes::Zero(d.model.K.size, numBoundary);
        if (d.C.cols() > 0)
            u = d.coordinates.expand(d.free, d.Y * d.solveCY(d.N.transpose() * prescribed));
        const MatrixXd missing = prescribed - d.calcMean(u), motion = d.G * missing;
        u.noalias() += d.rigid.R * motion;
        return u;
    }
    const Shapes u = d.coordinates.expand(d.tied, d.tiedMotion);
    if (d.free.empty()) return u;
    Vectors x = d.solveFree(-d.coordinates.contract(d.free, d.products.K.multiply(u)));
    if (d.C.cols() > 0) {
        const MatrixXd missing = prescribed - d.C.transpose() * x;
        x += d.Y * d.solveCY(missing);
    }
    return u + d.coordinates.expand(d.free, x);
}

FixedInterfaces::NormalModes FixedInterfaces::calcNormalModes(
    const ModeRange& range, const ProgressCallback& progress) const {
    const Data& d = *m_data;
    constexpr const char* Phase = "normal modes";
    if (d.free.empty() || range.count == 0)
        return {Eigen::VectorXd(0), Shapes::Zero(d.model.K.size, 0), 0};
    if (!d.solver) {
        const Eigenpairs pairs =
            calcLargestEigenpairs(NormalModesOperator(*this, d.products.m), range, Phase, progress);
        return {pairs.values.cwiseInverse(), toShapes(pairs.vectors), pairs.numBlocks};
    }
    // Mass of x including the rigid motion of makeShapes(), (1 − R Aᵀ)ᵀ M (1 − R Aᵀ).
    const SymmetricMatrix M = d.takeFree(d.coordinates.assemble(tripleAxes(d.model.m)));
    MatrixXd U(Index(d.free.size()), 0), S(0, 0);
    if (d.isSupported()) {
        const Shapes MR = d.products.m.multiplyPerAxis(d.rigid.R);
        U.resize(Eigen::NoChange, 12);
        U << d.coordinates.contract(d.free, MR),
            d.coordinates.contract(d.free, d.spread(d.G.transpose()));
        S.setZero(12, 12);
        S.topRightCorner(6, 6) = S.bottomLeftCorner(6, 6) = -MatrixXd::Identity(6, 6);
        S.bottomRightCorner(6, 6) = symmetricGram(d.rigid.R, MR);
    }
    const Eigenpairs pairs = d.solver->calcModes({M, U, S}, d.C, range, Phase, progress);
    return {pairs.values.cwiseInverse(), d.makeShapes(pairs.vectors), pairs.numBlocks};
}

long FixedInterfaces::numFactorEntries() const {
    if (m_data->free.empty()) return 0;
    return m_data->solver ? m_data->solver->numFactorEntries()
                          : m_data->cholesky.numFactorEntries();
}

double FixedInterfaces::estimateConditionNumber() const {
    const Data& d = *m_data;
    if (d.free.empty()) return 1;
    // ‖K⁻¹‖₁ is the largest column norm: taken over the eight columns that random signs show to be
    // the longest. Eight vectors cost as much as one.
    const Index n = Index(d.free.size()), width = std::min<Index>(ChunkSize, n);
    Vectors X(n, width);
    std::mt19937_64 random{20250401};
    for (Index k = 0; k < X.size(); ++k) X.data()[k] = random() >> 63 ? -1 : 1;
    const Eigen::VectorXd lengths = d.solveFree(X).rowwise().norm();
    std::vector<Index> rows(static_cast<size_t>(n));
    std::iota(rows.begin(), rows.end(), Index(0));
    std::partial_sort(rows.begin(), rows.begin() + width, rows.end(), [&](Index a, Index b) {
        return lengths[a] != lengths[b] ? lengths[a] > lengths[b] : a < b;
    });
    X.setZero();
    for (Index j = 0; j < width; ++j) X(rows[size_t(j)], j) = 1;
    return d.solveFree(X).cwiseAbs().colwise().sum().maxCoeff() * d.norm;
}

}  // namespace simflex
