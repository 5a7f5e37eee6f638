#include "LowestModes.h"

#include <Spectra/SymEigsSolver.h>

#include <stdexcept>

namespace simflex {
namespace {

constexpr double kConverged = 1e-12;  // relative accuracy of μ that Lanczos is asked for
constexpr double kNoMode = 1e-14;     // μ over the largest μ below which M sees no motion
constexpr int kMostRestarts = 500;
constexpr int kDenseSize = 400;  // below this a dense eigensolver is as quick

/** y ← L⁻¹ M L⁻ᵀ x, in the form Spectra asks for. **/
class InverseOperator {
public:
    using Scalar = double;

    InverseOperator(const SparseCholesky& factored, const FullRows& m,
                    const ProgressCallback& progress)
        : _factored(factored), _m(m), _progress(progress), _u(3 * m.size(), 1) {}

    Eigen::Index rows() const { return _u.rows(); }
    Eigen::Index cols() const { return _u.rows(); }

    void perform_op(const double* x, double* y) const {
        if (++_numProducts % 10 == 0) reportProgress(_progress, "normal modes", -1);
        _factored.solveUpper(x, _u.data());
        _factored.solveLower(_m.multiplyPerAxis(_u).data(), y);
    }

private:
    const SparseCholesky& _factored;
    const FullRows& _m;
    const ProgressCallback& _progress;
    mutable Shapes _u;
    mutable long _numProducts = 0;
};

[[noreturn]] void refuseModes(int numModes, long available) {
    throw std::invalid_argument(
        std::to_string(numModes) + " normal modes are asked for, but the mesh " + "has only " +
        std::to_string(available) + ": ask for fewer modes or refine the mesh");
}

}  // namespace

Eigen::MatrixXd calcLowestModes(const SparseCholesky& factored, const FullRows& m, int numModes,
                                const ProgressCallback& progress) {
    const int size = 3 * m.size();
    if (numModes > size) refuseModes(numModes, size);
    const InverseOperator C(factored, m, progress);
    Eigen::VectorXd mu;
    Eigen::MatrixXd y;
    if (size <= kDenseSize || numModes > size / 3) {
        Eigen::MatrixXd dense(size, size);
        const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
        for (int k = 0; k < size; ++k) C.perform_op(identity.col(k).data(), dense.col(k).data());
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 *
                                                                    (dense + dense.transpose()));
        mu = solver.eigenvalues().reverse().head(numModes);
        y = solver.eigenvectors().rowwise().reverse().leftCols(numModes);
    } else {
        const int subspace = std::min(size, std::max(2 * numModes + 1, numModes + 20));
        Spectra::SymEigsSolver<InverseOperator> solver(const_cast<InverseOperator&>(C), numModes,
                                                       subspace);
        solver.init();
        solver.compute(Spectra::SortRule::LargestAlge, kMostRestarts, kConverged,
                       Spectra::SortRule::LargestAlge);
        if (solver.info() != Spectra::CompInfo::Successful)
            throw std::runtime_error("the normal modes did not converge in " +
                                     std::to_string(kMostRestarts) + " restarts of Lanczos");
        mu = solver.eigenvalues();
        y = solver.eigenvectors();
    }
    const long available = (mu.array() > kNoMode * mu[0]).count();
    if (available < numModes) refuseModes(numModes, available);
    Eigen::MatrixXd modes(size, numModes);
    for (int k = 0; k < numModes; ++k) factored.solveUpper(y.col(k).data(), modes.col(k).data());
    return modes;
}

}  // namespace simflex
