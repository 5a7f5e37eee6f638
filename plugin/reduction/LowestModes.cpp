#include "LowestModes.h"

#include <Spectra/SymEigsSolver.h>
#include <dlfcn.h>

#include <stdexcept>

namespace simflex {
namespace {

constexpr double kConverged = 1e-12;      // relative accuracy of μ that Lanczos is asked for
constexpr double kNoMode = 1e-14;         // μ over the largest μ below which M sees no motion
constexpr double kProductsPerMode = 3.5;  // about what Lanczos takes
constexpr int kMostRestarts = 500;
constexpr int kDenseSize = 400;  // below this a dense eigensolver is as quick

/** y ← L⁻¹ M L⁻ᵀ x, in the form Spectra asks for. **/
class InverseOperator {
public:
    using Scalar = double;

    /** @param expected  about how many products will be asked for, for the progress. **/
    InverseOperator(const SparseCholesky& factored, const FullRows& m, long expected,
                    const ProgressCallback& progress)
        : _factored(factored),
          _m(m),
          _expected(expected),
          _progress(progress),
          _u(3 * m.size(), 1) {}

    Eigen::Index rows() const { return _u.rows(); }
    Eigen::Index cols() const { return _u.rows(); }

    void perform_op(const double* x, double* y) const {
        if (++_numProducts % 10 == 0)
            reportProgress(_progress, "normal modes",
                           std::min(1.0, double(_numProducts) / double(_expected)));
        _factored.solveUpper(x, _u.data());
        _factored.solveLower(_m.multiplyPerAxis(_u).data(), y);
    }

private:
    const SparseCholesky& _factored;
    const FullRows& _m;
    const long _expected;
    const ProgressCallback& _progress;
    mutable Shapes _u;
    mutable long _numProducts = 0;
};

/** Keeps OpenBLAS, if that is the BLAS, to one thread while this lives: solves with one vector are
bound by memory, and its waiting threads made them 1.2 to 4 times slower. **/
class OneBlasThread {
public:
    OneBlasThread() : _set(find<void (*)(int)>("openblas_set_num_threads")) {
        const auto get = find<int (*)()>("openblas_get_num_threads");
        if (!_set || !get) return;
        _before = get();
        _set(1);
    }
    ~OneBlasThread() {
        if (_before > 0) _set(_before);
    }
    OneBlasThread(const OneBlasThread&) = delete;
    OneBlasThread& operator=(const OneBlasThread&) = delete;

private:
    template <class Function>
    static Function find(const char* name) {
        return reinterpret_cast<Function>(dlsym(RTLD_DEFAULT, name));
    }

    void (*_set)(int);
    int _before = 0;
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
    const OneBlasThread oneThread;
    const bool dense = size <= kDenseSize || numModes > size / 3;
    const InverseOperator C(factored, m, dense ? size : long(kProductsPerMode * numModes),
                            progress);
    Eigen::VectorXd mu;
    Eigen::MatrixXd y;
    if (dense) {
        Eigen::MatrixXd full(size, size);
        const Eigen::MatrixXd identity = Eigen::MatrixXd::Identity(size, size);
        for (int k = 0; k < size; ++k) C.perform_op(identity.col(k).data(), full.col(k).data());
        const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(0.5 *
                                                                    (full + full.transpose()));
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
