#include "SparseCholesky.h"

#include <cholmod.h>
#include <omp.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "SupernodalFactorization.h"
#include "SupernodalSolve.h"
#include "simflex/base/Archive.h"
#include "simflex/part/OwnRandom.h"

namespace simflex {
namespace {

/** A smaller reciprocal condition means that pivots are round-off. **/
constexpr double Singular = 1e-15;

/** Assumed speed of one processor, for progress reports. **/
constexpr double FlopsPerSecond = 1e10;
constexpr Eigen::Index RowsWorthThreads = 30000;  // rows worth copying with threads
constexpr auto FactorPollInterval = std::chrono::milliseconds(50);

}  // namespace

struct SparseCholesky::Data {
    Data() {
        cholmod_l_start(&common);
        common.supernodal = CHOLMOD_SUPERNODAL;
        common.print = 0;
        common.error_handler = nullptr;
    }

    ~Data() {
        cholmod_l_free_factor(&factor, &common);
        cholmod_l_finish(&common);
    }

    /** Solves eight columns of X at a time, in place. Row k of L belongs to row order[k] of X, by
    default k. **/
    template <class Solve>
    void solve(Vectors& X, const SuiteSparse_long* order, const Solve& solveBlock) {
        if (!solver) prepareSolves();  // after a factor was loaded and found intact
        static_assert(alignof(Chunk) <= EIGEN_MAX_ALIGN_BYTES, "Vectors are aligned as Chunks");
        if (!order && X.cols() == ChunkSize) return solveBlock(reinterpret_cast<Chunk*>(X.data()));
        const Eigen::Index size = X.rows();
        block.resize(size_t(size));
        for (Eigen::Index first = 0; first < X.cols(); first += ChunkSize) {
            const int width = int(std::min<Eigen::Index>(ChunkSize, X.cols() - first));
            const auto at = [&](Eigen::Index k) {
                return &X.coeffRef(order ? order[k] : k, first);
            };
#pragma omp parallel for schedule(static) if (size >= RowsWorthThreads)
            for (Eigen::Index k = 0; k < size; ++k) block[size_t(k)] = loadChunk(at(k), width);
            solveBlock(block.data());
#pragma omp parallel for schedule(static) if (size >= RowsWorthThreads)
            for (Eigen::Index k = 0; k < size; ++k) storeChunk(block[size_t(k)], at(k), width);
        }
    }

    const SuiteSparse_long* order() const {
        return static_cast<const SuiteSparse_long*>(factor->Perm);
    }

    SupernodalFactor pattern() const {
        const cholmod_factor& L = *factor;
        const auto indices = [](const void* p) { return static_cast<const std::int64_t*>(p); };
        return {std::int64_t(L.n),
                std::int64_t(L.nsuper),
                indices(L.super),
                indices(L.pi),
                indices(L.px),
                indices(L.s),
                static_cast<const double*>(L.x)};
    }

    void prepareSolves() {
        solver = std::make_unique<SupernodalSolve>(pattern());
    }

    [[noreturn]] void fail(const char* what, int size) const {
        throw std::runtime_error(std::string("CHOLMOD could not ") + what + " a matrix of " +
                                 std::to_string(size) + " rows (status " +
                                 std::to_string(common.status) + "): out of memory?");
    }

    cholmod_common common;
    cholmod_factor* factor = nullptr;
    Prediction prediction;
    std::unique_ptr<SupernodalSolve> solver;
    std::vector<Chunk> block;
};

SparseCholesky::SparseCholesky() : m_data(std::make_unique<Data>()) {}
SparseCholesky::~SparseCholesky() = default;

namespace {

/** The lower triangle in CHOLMOD's format with long indices. **/
class LongView {
public:
    explicit LongView(const SymmetricMatrix& A)
        : m_rows(A.rows.begin(), A.rows.end()),
          m_starts(A.columnStarts.begin(), A.columnStarts.end()) {
        view.nrow = view.ncol = size_t(A.size);
        view.nzmax = A.values.size();
        view.p = m_starts.data();
        view.i = m_rows.data();
        view.x = const_cast<double*>(A.values.data());
        view.stype = -1;
        view.itype = CHOLMOD_LONG;
        view.xtype = CHOLMOD_REAL;
        view.dtype = CHOLMOD_DOUBLE;
        view.sorted = 1;
        view.packed = 1;
    }
    cholmod_sparse view{};

private:
    std::vector<SuiteSparse_long> m_rows, m_starts;
};

/** Reports progress while a thread works, based on the expected time. **/
void reportWhile(const ProgressCallback& progress, double expectedSeconds,
                 const std::function<void()>& work) {
    if (!progress) return work();
    std::promise<void> promise;
    std::future<void> done = promise.get_future();
    std::thread worker;
    try {
        worker = std::thread([&] {
            try {
                work();
                promise.set_value();
            } catch (...) {
                promise.set_exception(std::current_exception());
            }
        });
    } catch (const std::system_error&) {
        return work();  // no more threads available
    }
    const auto start = std::chrono::steady_clock::now();
    bool wanted = true;
    while (done.wait_for(FactorPollInterval) != std::future_status::ready) {
        const double spent =
            std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
        // Slow down towards the end in case the work takes longer.
        const double share = spent / expectedSeconds;
        try {
            wanted = wanted && progress("factoring K", 1 - std::exp(-1.5 * share));
        } catch (...) {
            worker.join();
            throw;
        }
    }
    worker.join();
    done.get();
    if (!wanted) throw Cancelled();
}

}  // namespace

const SparseCholesky::Prediction& SparseCholesky::analyze(const SymmetricMatrix& A) {
    Data& d = *m_data;
    d.solver.reset();
    cholmod_l_free_factor(&d.factor, &d.common);
    LongView view(A);
    {
        const OwnRandom random;
        d.factor = cholmod_l_analyze(&view.view, &d.common);
    }
    if (!d.factor) d.fail("analyse", A.size);
    const cholmod_factor& L = *d.factor;
    Prediction& p = d.prediction;
    p.numEntries = std::int64_t(L.xsize);
    p.flops = d.common.fl;
    p.factorBytes = std::int64_t(8 * L.xsize + (8 + 4) * L.ssize + 8 * 8 * L.n);
    // The permuted A, and the rows that supernodes have in others.
    p.workingBytes = 12 * A.numEntries() + 12 * std::int64_t(L.ssize);
    p.order = L.ordering == CHOLMOD_METIS ? "METIS" : "AMD";
    return p;
}

void SparseCholesky::factor(const SymmetricMatrix& A, const ProgressCallback& progress) {
    Data& d = *m_data;
    if (!d.factor || d.factor->x || d.factor->n != size_t(A.size)) analyze(A);
    cholmod_factor& L = *d.factor;
    L.x = cholmod_l_malloc(L.xsize, 8, &d.common);
    if (!L.x) d.fail("factor", A.size);
    L.xtype = CHOLMOD_REAL;
    const int threads = omp_get_max_threads();
    std::int64_t failed = -1;
    reportWhile(progress, 0.2 + d.prediction.flops / (FlopsPerSecond * threads), [&] {
        failed = factorSupernodes(A, d.order(), d.pattern(), static_cast<double*>(L.x), threads);
    });
    if (failed >= 0) throw SingularMatrix(int(d.order()[failed]));
    if (estimateReciprocalCondition() < Singular) throw SingularMatrix(-1);
    d.prepareSolves();
}

namespace {

/** Visits all arrays of a factor, which already have their sizes. **/
void visitArrays(Archive& archive, const cholmod_factor& L) {
    archive.visitBytes(L.Perm, 8 * L.n);
    for (void* starts : {L.super, L.pi, L.px}) archive.visitBytes(starts, 8 * (L.nsuper + 1));
    archive.visitBytes(L.s, 8 * L.ssize);
    archive.visitBytes(L.x, 8 * L.xsize);
}

}  // namespace

void SparseCholesky::save(Archive& out) const {
    const cholmod_factor& L = *m_data->factor;
    std::uint64_t sizes[] = {L.n, L.nsuper, L.ssize, L.xsize, L.maxcsize, L.maxesize};
    out.visitBytes(sizes, sizeof sizes);
    visitArrays(out, L);
}

void SparseCholesky::load(Archive& in) {
    Data& d = *m_data;
    d.solver.reset();
    cholmod_l_free_factor(&d.factor, &d.common);
    std::uint64_t sizes[6];
    in.visitBytes(sizes, sizeof sizes);
    for (const std::uint64_t size : sizes) in.requireLeft(size, 1);
    in.requireLeft(sizes[3], 8);
    d.factor = cholmod_l_allocate_factor(size_t(sizes[0]), &d.common);
    if (!d.factor) d.fail("hold", int(sizes[0]));
    cholmod_factor& L = *d.factor;
    L.nsuper = size_t(sizes[1]);
    L.ssize = size_t(sizes[2]);
    L.xsize = size_t(sizes[3]);
    L.maxcsize = size_t(sizes[4]);
    L.maxesize = size_t(sizes[5]);
    L.is_ll = L.is_super = L.is_monotonic = 1;
    L.xtype = CHOLMOD_REAL;
    const auto take = [&](size_t count) {
        void* bytes = cholmod_l_malloc(count, 8, &d.common);
        if (!bytes) d.fail("hold", int(L.n));
        return bytes;
    };
    L.super = take(L.nsuper + 1);
    L.pi = take(L.nsuper + 1);
    L.px = take(L.nsuper + 1);
    L.s = take(L.ssize);
    L.x = take(L.xsize);
    visitArrays(in, L);
}

Vectors SparseCholesky::solve(const Vectors& B) const {
    Data& d = *m_data;
    Vectors X = B;
    d.solve(X, d.order(), [&](Chunk* x) {
        d.solver->solveLower(x);
        d.solver->solveUpper(x);
    });
    return X;
}

void SparseCholesky::solveLower(Vectors& X) const {
    m_data->solve(X, nullptr, [&](Chunk* x) { m_data->solver->solveLower(x); });
}

void SparseCholesky::solveUpper(Vectors& X) const {
    m_data->solve(X, nullptr, [&](Chunk* x) { m_data->solver->solveUpper(x); });
}

std::vector<int> SparseCholesky::listOrder() const {
    return {m_data->order(), m_data->order() + size()};
}

double SparseCholesky::estimateReciprocalCondition() const {
    return cholmod_l_rcond(m_data->factor, &m_data->common);
}

int SparseCholesky::size() const {
    return int(m_data->factor->n);
}

long SparseCholesky::numFactorEntries() const {
    return long(m_data->factor->is_super ? m_data->factor->xsize : m_data->factor->nzmax);
}

}  // namespace simflex
