#include "SparseCholesky.h"

#include <cholmod.h>

#include <stdexcept>
#include <vector>

namespace simflex {
namespace {

/** A reciprocal condition below this means that pivots are nothing but round-off. **/
constexpr double kSingular = 1e-15;

cholmod_dense viewOf(double* values, size_t rows, size_t columns) {
    cholmod_dense view{};
    view.nrow = rows;
    view.ncol = columns;
    view.nzmax = rows * columns;
    view.d = rows;
    view.x = values;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    return view;
}

}  // namespace

struct SparseCholesky::Data {
    Data() {
        cholmod_l_start(&common);
        common.supernodal = CHOLMOD_SUPERNODAL;
        common.print = 0;
        common.error_handler = nullptr;
    }

    ~Data() {
        cholmod_l_free_dense(&result, &common);
        cholmod_l_free_dense(&work, &common);
        cholmod_l_free_dense(&work2, &common);
        cholmod_l_free_factor(&factor, &common);
        cholmod_l_finish(&common);
    }

    /** A triangular solve into `result`. **/
    Eigen::Map<const Eigen::MatrixXd> solve(int system, Eigen::MatrixXd& values) {
        cholmod_dense b = viewOf(values.data(), size_t(values.rows()), size_t(values.cols()));
        if (!cholmod_l_solve2(system, factor, &b, nullptr, &result, nullptr, &work, &work2,
                              &common))
            throw std::runtime_error("CHOLMOD could not solve (status " +
                                     std::to_string(common.status) + ")");
        return {static_cast<const double*>(result->x), values.rows(), values.cols()};
    }

    cholmod_common common;
    cholmod_factor* factor = nullptr;
    cholmod_dense *result = nullptr, *work = nullptr, *work2 = nullptr;
    Eigen::MatrixXd permuted;
};

SparseCholesky::SparseCholesky() : _data(std::make_unique<Data>()) {}
SparseCholesky::~SparseCholesky() = default;

void SparseCholesky::factor(const SymmetricMatrix& A) {
    std::vector<SuiteSparse_long> rows(A.rows.begin(), A.rows.end());
    std::vector<SuiteSparse_long> starts(A.columnStarts.begin(), A.columnStarts.end());
    cholmod_sparse view{};
    view.nrow = view.ncol = size_t(A.size);
    view.nzmax = A.values.size();
    view.p = starts.data();
    view.i = rows.data();
    view.x = const_cast<double*>(A.values.data());
    view.stype = -1;
    view.itype = CHOLMOD_LONG;
    view.xtype = CHOLMOD_REAL;
    view.dtype = CHOLMOD_DOUBLE;
    view.sorted = 1;
    view.packed = 1;

    Data& d = *_data;
    cholmod_l_free_factor(&d.factor, &d.common);
    d.factor = cholmod_l_analyze(&view, &d.common);
    if (!d.factor)
        throw std::runtime_error("CHOLMOD could not analyse a matrix of " + std::to_string(A.size) +
                                 " rows: out of memory?");
    cholmod_l_factorize(&view, d.factor, &d.common);
    const auto* order = static_cast<const SuiteSparse_long*>(d.factor->Perm);
    if (d.common.status == CHOLMOD_NOT_POSDEF)
        throw SingularMatrix(int(order[std::min(d.factor->minor, d.factor->n - 1)]));
    if (d.common.status < CHOLMOD_OK)
        throw std::runtime_error("CHOLMOD could not factor a matrix of " + std::to_string(A.size) +
                                 " rows: out of memory?");
    if (cholmod_l_rcond(d.factor, &d.common) < kSingular) throw SingularMatrix(-1);
}

Eigen::MatrixXd SparseCholesky::solve(const Eigen::MatrixXd& B) const {
    Data& d = *_data;
    Eigen::MatrixXd copy = B;
    cholmod_dense b = viewOf(copy.data(), size_t(B.rows()), size_t(B.cols()));
    cholmod_dense* x = cholmod_l_solve(CHOLMOD_A, d.factor, &b, &d.common);
    if (!x) throw std::runtime_error("CHOLMOD could not solve: out of memory?");
    copy = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(x->x), B.rows(), B.cols());
    cholmod_l_free_dense(&x, &d.common);
    return copy;
}

void SparseCholesky::solveLower(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const {
    if (X.cols() == 0) {  // CHOLMOD refuses that
        Y.resize(X.rows(), 0);
        return;
    }
    Data& d = *_data;
    const auto* order = static_cast<const SuiteSparse_long*>(d.factor->Perm);
    d.permuted.resize(X.rows(), X.cols());
    for (Eigen::Index j = 0; j < X.cols(); ++j)
        for (Eigen::Index k = 0; k < X.rows(); ++k) d.permuted(k, j) = X(order[k], j);
    Y = d.solve(CHOLMOD_L, d.permuted);
}

void SparseCholesky::solveUpper(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const {
    if (X.cols() == 0) {  // CHOLMOD refuses that
        Y.resize(X.rows(), 0);
        return;
    }
    Data& d = *_data;
    const auto* order = static_cast<const SuiteSparse_long*>(d.factor->Perm);
    d.permuted = X;
    const auto result = d.solve(CHOLMOD_Lt, d.permuted);
    Y.resize(X.rows(), X.cols());
    for (Eigen::Index j = 0; j < X.cols(); ++j)
        for (Eigen::Index k = 0; k < X.rows(); ++k) Y(order[k], j) = result(k, j);
}

double SparseCholesky::estimateReciprocalCondition() const {
    return cholmod_l_rcond(_data->factor, &_data->common);
}

int SparseCholesky::size() const {
    return int(_data->factor->n);
}

long SparseCholesky::numFactorEntries() const {
    return long(_data->factor->is_super ? _data->factor->xsize : _data->factor->nzmax);
}

}  // namespace simflex
