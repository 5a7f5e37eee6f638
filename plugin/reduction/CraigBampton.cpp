#include "CraigBampton.h"

#include <stdexcept>

#include "LowestModes.h"
#include "MeanAxis.h"
#include "SparseCholesky.h"

namespace simflex {
namespace {

[[noreturn]] void refuse(const ReductionOptions& options, const std::string& what) {
    throw std::invalid_argument("part '" + options.name + "': " + what);
}

/** Finds the limit of memory before CHOLMOD does, and names a node of a singular pivot. **/
void factor(SparseCholesky& cholesky, const SymmetricMatrix& A, const FeModel& model,
            const std::vector<int>& nodes, const ReductionOptions& options) {
    try {
        cholesky.factor(A);
    } catch (const SparseCholesky::SingularMatrix& singular) {
        refuse(
            options,
            "the stiffness matrix is singular beyond the six rigid motions" +
                (singular.row >= 0
                     ? " at node " + std::to_string(model.mesh.nodeNumbers[nodes[singular.row / 3]])
                     : std::string()) +
                "; look for pieces that hang on a single node or edge, and for elements without "
                "stiffness");
    }
}

/** ω² of a bent shape of the part: the order of magnitude of its lowest elastic mode [rad²/s²]. **/
double estimateLowestEigenvalue(const FeModel& model, const FeProducts& products) {
    const RigidMotion rigid = calcRigidMotions(model, products);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(rigid.inertia);
    const Eigen::Matrix3d axes = principal.eigenvectors();  // column 0: the long axis
    Shapes bent(model.K.size, 2);
    for (int node = 0; node < model.mesh.numNodes(); ++node) {
        const Eigen::Vector3d s =
            Eigen::Map<const Eigen::Vector3d>(&model.mesh.positions[3 * node]) - rigid.center;
        const Eigen::Vector3d local = axes.transpose() * s;
        for (int k = 0; k < 2; ++k)
            bent.block<3, 1>(3 * node, k) =
                axes.col(1 + k) * 0.5 * local[0] * local[0] - axes.col(0) * local[0] * local[1 + k];
    }
    removeRigidMotion(rigid, products, bent);
    const Shapes Kb = products.K.multiply(bent), Mb = products.m.multiplyPerAxis(bent);
    double lowest = 0;
    for (int k = 0; k < 2; ++k) {
        const double value = bent.col(k).dot(Kb.col(k)) / bent.col(k).dot(Mb.col(k));
        if (k == 0 || value < lowest) lowest = value;
    }
    return lowest;
}

}  // namespace

double lapTime(std::chrono::steady_clock::time_point& start) {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - start).count();
    start = now;
    return seconds;
}

ModeBasis calcCraigBamptonBasis(const FeModel& model, const FeProducts& products,
                                const InterfaceTies& ties, const ReductionOptions& options,
                                const ProgressCallback& progress, ReductionTimings& timings) {
    auto lap = std::chrono::steady_clock::now();
    const int numBoundary = ties.numBoundaryDofs(), numNormal = options.numModes - numBoundary;
    const auto& free = ties.freeNodes();
    if (numNormal < 0 || options.numModes < 7)
        refuse(options, std::to_string(options.numModes) +
                            " modes are too few: " + std::to_string(ties.ties().size()) +
                            " interfaces need " + std::to_string(numBoundary) +
                            " constraint modes, and six rigid modes are "
                            "taken out; ask for at least " +
                            std::to_string(std::max(7, numBoundary)));
    if (numNormal > 3 * int(free.size()))
        refuse(options, std::to_string(options.numModes) + " modes are too many: the mesh has " +
                            std::to_string(3 * free.size()) +
                            " free degrees of freedom; ask for at most " +
                            std::to_string(numBoundary + 3 * free.size()) + ", or refine the mesh");

    ModeBasis basis;
    basis.Psi = Shapes::Zero(model.K.size, options.numModes);
    basis.boundary = Shapes::Zero(numBoundary, options.numModes);
    basis.boundary.leftCols(numBoundary).setIdentity();
    basis.Psi.leftCols(numBoundary) = ties.calcTiedMotion(model.mesh);
    if (free.empty()) return basis;

    reportProgress(progress, "factoring K", -1);
    const auto factored = std::make_shared<SparseCholesky>();
    SparseCholesky& cholesky = *factored;
    factor(cholesky, ties.takeFree(model.K, 3), model, free, options);
    basis.fixedInterfaces = factored;
    timings.factor = lapTime(lap);
    timings.numFactorEntries = cholesky.numFactorEntries();

    reportProgress(progress, "constraint modes", -1);
    const Shapes KT = products.K.multiply(basis.Psi.leftCols(numBoundary));
    Eigen::MatrixXd Kib(3 * free.size(), numBoundary);
    for (size_t k = 0; k < free.size(); ++k)
        Kib.middleRows<3>(3 * k) = KT.middleRows<3>(3 * free[k]);
    const Eigen::MatrixXd constraint = cholesky.solve(Kib);
    for (size_t k = 0; k < free.size(); ++k)
        basis.Psi.block(3 * free[k], 0, 3, numBoundary) = -constraint.middleRows<3>(3 * k);
    timings.constraintModes = lapTime(lap);

    if (numNormal == 0) return basis;
    reportProgress(progress, "normal modes", -1);
    Eigen::MatrixXd normal;
    try {
        normal =
            calcLowestModes(cholesky, FullRows(ties.takeFree(model.m, 1)), numNormal, progress);
    } catch (const std::invalid_argument& error) {
        refuse(options, error.what());
    }
    for (size_t k = 0; k < free.size(); ++k)
        basis.Psi.block(3 * free[k], numBoundary, 3, numNormal) = normal.middleRows<3>(3 * k);
    timings.normalModes = lapTime(lap);
    return basis;
}

ModeBasis calcFreeBasis(const FeModel& model, const FeProducts& products,
                        const ReductionOptions& options, const ProgressCallback& progress,
                        ReductionTimings& timings) {
    auto lap = std::chrono::steady_clock::now();
    if (options.numModes < 7)
        refuse(options, std::to_string(options.numModes) +
                            " modes are too few: the six rigid modes "
                            "are among them; ask for at least 7");
    // K is singular: shift it by about the lowest elastic eigenvalue.
    const double shift = estimateLowestEigenvalue(model, products);
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    const size_t numEntries = model.K.values.size() + 3 * model.m.values.size();
    rows.reserve(numEntries);
    columns.reserve(numEntries);
    values.reserve(numEntries);
    for (int column = 0; column < model.K.size; ++column)
        for (auto k = model.K.columnStarts[column]; k < model.K.columnStarts[column + 1]; ++k) {
            rows.push_back(model.K.rows[k]);
            columns.push_back(column);
            values.push_back(model.K.values[k]);
        }
    for (int column = 0; column < model.m.size; ++column)
        for (auto k = model.m.columnStarts[column]; k < model.m.columnStarts[column + 1]; ++k)
            for (int a = 0; a < 3; ++a) {
                rows.push_back(3 * model.m.rows[k] + a);
                columns.push_back(3 * column + a);
                values.push_back(shift * model.m.values[k]);
            }
    std::vector<int> allNodes(model.mesh.numNodes());
    for (size_t node = 0; node < allNodes.size(); ++node) allNodes[node] = int(node);

    reportProgress(progress, "factoring K", -1);
    SparseCholesky cholesky;
    factor(cholesky, SymmetricMatrix::fromEntries(model.K.size, rows, columns, values), model,
           allNodes, options);
    timings.factor = lapTime(lap);
    timings.numFactorEntries = cholesky.numFactorEntries();

    reportProgress(progress, "normal modes", -1);
    ModeBasis basis;
    try {
        basis.Psi = calcLowestModes(cholesky, products.m, options.numModes, progress);
    } catch (const std::invalid_argument& error) {
        refuse(options, error.what());
    }
    basis.boundary.resize(0, options.numModes);
    timings.normalModes = lapTime(lap);
    return basis;
}

}  // namespace simflex
