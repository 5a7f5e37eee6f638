#include "FixedInterfaces.h"

#include <algorithm>
#include <sstream>
#include <stdexcept>

#include "BlockLanczos.h"
#include "Coordinates.h"
#include "Memory.h"
#include "SparseCholesky.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/** Part of the largest singular value below which a direction of loads counts as none. **/
constexpr double kRank = 1e-10;

/** An orthonormal basis of the columns of X, which are scaled to unit length first. **/
MatrixXd orthonormalize(MatrixXd X) {
    const Eigen::VectorXd norms = X.colwise().norm();
    for (Index k = 0; k < X.cols(); ++k) X.col(k) /= norms[k];
    const Eigen::HouseholderQR<MatrixXd> qr(X);
    return qr.householderQ() * MatrixXd::Identity(X.rows(), X.cols());
}

/** Rows and columns of A whose place in the list is not negative, ascending. **/
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

}  // namespace

struct FixedInterfaces::Data {
    Data(const std::string& partName, const FeModel& fe, const FeProducts& feProducts,
         const RigidMotion& rigidMotion, const InterfaceTies& interfaceTies)
        : part(partName),
          model(fe),
          products(feProducts),
          rigid(rigidMotion),
          ties(interfaceTies),
          coordinates(fe) {}

    const std::string part;
    const FeModel& model;
    const FeProducts& products;
    const RigidMotion& rigid;
    const InterfaceTies& ties;
    const Coordinates coordinates;
    SparseCholesky cholesky;

    std::vector<int> free;  ///< coordinates that are neither tied nor supported, ascending
    std::vector<int> tied;  ///< those that follow a rigid interface, ascending
    MatrixXd tiedMotion;    ///< of the tied coordinates for a unit of each boundary coordinate

    /** The constraints D: of distributing ties, or the mean of a part without interfaces. **/
    struct Mean {
        size_t tie;
        MatrixXd D;  ///< 6×(3·nodes)
    };
    std::vector<Mean> means;
    Shapes MR;          ///< numDofs×6 of a part without interfaces, D = (M R)ᵀ; else empty
    MatrixXd X;         ///< L⁻¹TᵀDᵀ
    MatrixXd Q;         ///< may have no columns
    MatrixXd N, G, DR;  ///< of a part without rigid ties; else empty

    bool isSupported() const { return !ties.hasRigid(); }
    Index numMeans() const { return MR.size() > 0 ? 6 : 6 * Index(means.size()); }

    [[noreturn]] void refuse(const std::string& what) const {
        throw std::invalid_argument("part '" + part + "': " + what);
    }

    /** D u. **/
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

    /** Dᵀ λ. **/
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

    void findCoordinates();
    void factorFree(int numModes, const ReductionOptions& options,
                    const ProgressCallback& progress);
    void checkMemory(const SparseCholesky::Prediction& prediction, int numModes,
                     const ReductionOptions& options) const;
    void prepareMeans();
};

/** Tied coordinates with their motion, supported ones, and the rest. **/
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
    // A unit of an interface's coordinates is a rigid motion about its master.
    tiedMotion = MatrixXd::Zero(Index(tied.size()), ties.numBoundaryDofs());
    for (size_t i = 0; i < tied.size(); ++i) {
        const int k = tieOf[size_t(tied[i])];
        const Eigen::Map<const Eigen::Vector3d> master(ties.ties()[size_t(k)].master.data());
        Eigen::Matrix<double, 6, 6> aboutCenter = Eigen::Matrix<double, 6, 6>::Identity();
        aboutCenter.topRightCorner<3, 3>() = calcRigidMotion(rigid.center - master).rightCols<3>();
        tiedMotion.block(Index(i), 6 * k, 1, 6) = rigidCoordinates.row(tied[i]) * aboutCenter;
    }
    if (isSupported()) {
        // The six coordinates whose rigid motions are the farthest from dependent.
        MatrixXd motions = rigidCoordinates.transpose();
        for (Index j = 0; j < 6; ++j) motions.row(j).normalize();
        const Eigen::ColPivHouseholderQR<MatrixXd> pivoted(motions);
        for (Index k = 0; k < 6; ++k) tieOf[size_t(pivoted.colsPermutation().indices()[k])] = 0;
    }
    for (size_t q = 0; q < tieOf.size(); ++q)
        if (tieOf[q] < 0) free.push_back(int(q));
}

void FixedInterfaces::Data::checkMemory(const SparseCholesky::Prediction& prediction, int numModes,
                                        const ReductionOptions& options) const {
    // After factoring: the Lanczos basis and Ritz vectors, then the modes and products with them.
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
    std::vector<int> place(size_t(coordinates.size()), -1);
    for (size_t k = 0; k < free.size(); ++k) place[size_t(free[k])] = int(k);
    try {
        const SymmetricMatrix K = model.constraints.empty()
                                      ? takeListed(model.K, free, place)
                                      : takeListed(coordinates.assemble(model.K), free, place);
        reportProgress(progress, "ordering K", -1);
        checkMemory(cholesky.analyze(K), numModes, options);
        reportProgress(progress, "factoring K", 0);
        cholesky.factor(K, progress);
    } catch (const SparseCholesky::SingularMatrix& singular) {
        refuse("the stiffness matrix is singular beyond the six rigid motions" +
               (singular.row >= 0 ? " at node " + std::to_string(coordinates.nodeNumberOf(
                                                      free[size_t(singular.row)]))
                                  : std::string()) +
               "; look for pieces that hang on a single node or edge, and for elements without "
               "stiffness");
    }
}

void FixedInterfaces::Data::prepareMeans() {
    if (ties.ties().empty()) MR = products.m.multiplyPerAxis(rigid.R);
    Q.resize(Index(free.size()), 0);
    const Index count = numMeans();
    if (count == 0) return;
    cholesky.solveLower(coordinates.contract(free, spread(MatrixXd::Identity(count, count))), X);
    if (!isSupported()) {
        Q = orthonormalize(X);
        return;
    }
    DR = calcMean(rigid.R);
    const Eigen::JacobiSVD<MatrixXd> svd(DR, Eigen::ComputeFullU | Eigen::ComputeThinV);
    if (svd.singularValues()[5] <= kRank * kRank * svd.singularValues()[0])
        refuse("its interfaces do not hold it: a rigid motion moves none of them");
    N = svd.matrixU().rightCols(count - 6);
    G = svd.matrixV() * svd.singularValues().cwiseInverse().asDiagonal() *
        svd.matrixU().leftCols(6).transpose();
    if (count > 6) Q = orthonormalize(X * N);
}

FixedInterfaces::FixedInterfaces(const std::string& part, const FeModel& model,
                                 const FeProducts& products, const RigidMotion& rigid,
                                 const InterfaceTies& ties)
    : _data(std::make_unique<Data>(part, model, products, rigid, ties)) {}

FixedInterfaces::~FixedInterfaces() = default;

void FixedInterfaces::factor(int numModes, const ReductionOptions& options,
                             const ProgressCallback& progress) {
    _data->findCoordinates();
    if (!_data->free.empty()) _data->factorFree(numModes, options, progress);
    _data->prepareMeans();
}

Index FixedInterfaces::size() const {
    return Index(_data->free.size());
}

Shapes FixedInterfaces::toShapes(const MatrixXd& z) const {
    const Data& d = *_data;
    if (d.free.empty()) return Shapes::Zero(d.model.K.size, z.cols());
    MatrixXd x = z;
    if (d.Q.cols() > 0) x.noalias() -= d.Q * (d.Q.transpose() * z);
    d.cholesky.solveUpper(x, x);
    Shapes u = d.coordinates.expand(d.free, x);
    if (d.isSupported()) u.noalias() -= d.rigid.R * (d.G * d.calcMean(u));
    return u;
}

MatrixXd FixedInterfaces::fromForces(const Shapes& f) const {
    const Data& d = *_data;
    if (d.free.empty()) return MatrixXd::Zero(0, f.cols());
    MatrixXd y;
    if (d.isSupported()) {
        const Shapes balanced = f - d.spread(d.G.transpose() * (d.rigid.R.transpose() * f));
        y = d.coordinates.contract(d.free, balanced);
    } else {
        y = d.coordinates.contract(d.free, f);
    }
    d.cholesky.solveLower(y, y);
    if (d.Q.cols() > 0) y -= d.Q * (d.Q.transpose() * y).eval();
    return y;
}

Shapes FixedInterfaces::calcConstraintModes() const {
    const Data& d = *_data;
    const Index numBoundary = d.ties.numBoundaryDofs(), numMeans = d.numMeans();
    MatrixXd prescribed = MatrixXd::Zero(numMeans, numBoundary);  // D u of each mode
    for (size_t k = 0; k < d.means.size(); ++k)
        prescribed.block(6 * Index(k), 6 * Index(d.means[k].tie), 6, 6).setIdentity();
    if (d.isSupported()) {
        // Loads in equilibrium on the interfaces, then the rigid motion that is left.
        const MatrixXd XN = d.X * d.N;
        MatrixXd inside = MatrixXd::Zero(d.X.rows(), numBoundary);
        if (d.N.cols() > 0)
            inside = XN * (XN.transpose() * XN).ldlt().solve(d.N.transpose() * prescribed);
        d.cholesky.solveUpper(inside, inside);
        const Shapes u = d.coordinates.expand(d.free, inside);
        return u + d.rigid.R * (d.G * (prescribed - d.calcMean(u)));
    }
    Shapes u = d.coordinates.expand(d.tied, d.tiedMotion);
    if (d.free.empty()) return u;
    MatrixXd y = -d.coordinates.contract(d.free, d.products.K.multiply(u));
    d.cholesky.solveLower(y, y);
    if (numMeans > 0)
        y += d.X * (d.X.transpose() * d.X).ldlt().solve(prescribed - d.X.transpose() * y);
    d.cholesky.solveUpper(y, y);
    return u + d.coordinates.expand(d.free, y);
}

long FixedInterfaces::numFactorEntries() const {
    return _data->free.empty() ? 0 : _data->cholesky.numFactorEntries();
}

double FixedInterfaces::estimateConditionNumber() const {
    return _data->free.empty() ? 1 : 1 / _data->cholesky.estimateReciprocalCondition();
}

}  // namespace simflex
