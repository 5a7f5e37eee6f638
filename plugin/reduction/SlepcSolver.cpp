#include "SlepcSolver.h"

#include <mpi.h>
#include <slepceps.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <utility>
#include <vector>

#include "OneBlasThread.h"

namespace simflex {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double Accuracy = 1e-12;  // residual of the eigenpairs
constexpr int LargestSolve = 16;    // right-hand sides at a time

/** Requests of rank 0 to the others. **/
enum class Request : int { Factor, Solve, Modes, Free, End };

bool isRunning = false;

void check(PetscErrorCode code, const char* what) {
    if (code == 0) return;
    const char* text = nullptr;
    PetscErrorMessage(code, &text, nullptr);
    throw std::runtime_error(std::string("PETSc could not ") + what + ": " + (text ? text : "?"));
}

int rankOf() {
    int rank = 0;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    return rank;
}

/** An error that all ranks detect alike. **/
struct SharedFailure : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/** Runs collective work on one BLAS thread per rank.
@throws SharedFailure; other exceptions only if there are no other ranks, which would wait
forever **/
template <class Work>
void doTogether(const Work& work) {
    const OneBlasThread oneThread;
    const auto endAll = [](const char* error) {
        std::fprintf(stderr, "simflex: process %d of %d has failed, so all of them end: %s\n",
                     rankOf() + 1, countProcesses(), error);
        MPI_Abort(PETSC_COMM_WORLD, EXIT_FAILURE);
    };
    try {
        work();
    } catch (const SharedFailure&) {
        throw;
    } catch (const std::bad_alloc&) {
        if (countProcesses() == 1) throw;
        endAll("there is not enough memory");
    } catch (const std::exception& error) {
        if (countProcesses() == 1) throw;
        endAll(error.what());
    }
}

/** Wraps a function called by C code, which exceptions must not cross. **/
template <class Work>
PetscErrorCode callSafely(const Work& work) {
    try {
        return work();
    } catch (const std::bad_alloc&) {
        return PETSC_ERR_MEM;
    } catch (const std::exception&) {
        return PETSC_ERR_LIB;
    }
}

/** Broadcasts a value from rank 0. **/
template <class Number>
Number broadcast(Number value) {
    MPI_Bcast(&value, sizeof value, MPI_BYTE, 0, PETSC_COMM_WORLD);
    return value;
}

/** Rows [first, end) of `size` owned by a process. **/
struct Rows {
    explicit Rows(Index size) : Rows(size, rankOf()) {}
    Rows(Index size, int rank) {
        const Index count = countProcesses();
        first = size * rank / count;
        end = size * (rank + 1) / count;
    }
    Index count() const { return end - first; }
    Index first, end;
};

/** Sends in pieces, since MPI counts in int. **/
template <class Number>
void sendAll(const Number* values, std::int64_t count, int to) {
    constexpr std::int64_t Most = 1 << 27;
    for (std::int64_t at = 0; at < count; at += Most)
        MPI_Send(values + at, int(std::min(Most, count - at) * std::int64_t(sizeof(Number))),
                 MPI_BYTE, to, 0, PETSC_COMM_WORLD);
}

template <class Number>
void receiveAll(Number* values, std::int64_t count) {
    constexpr std::int64_t Most = 1 << 27;
    for (std::int64_t at = 0; at < count; at += Most)
        MPI_Recv(values + at, int(std::min(Most, count - at) * std::int64_t(sizeof(Number))),
                 MPI_BYTE, 0, 0, PETSC_COMM_WORLD, MPI_STATUS_IGNORE);
}

/** Distributes a matrix by rows of its upper triangle; `A` is given on rank 0. **/
Mat distribute(const SymmetricMatrix* A) {
    const Index size = broadcast<std::int64_t>(A ? A->size : 0);
    const Rows mine(size);
    std::vector<std::int64_t> starts(size_t(mine.count()) + 1);
    std::vector<std::int32_t> columns;
    std::vector<double> values;
    // Columns of the lower triangle are rows of the upper one.
    if (A) {
        for (int rank = 1; rank < countProcesses(); ++rank) {
            const Rows theirs(size, rank);
            const std::int64_t first = A->columnStarts[size_t(theirs.first)],
                               end = A->columnStarts[size_t(theirs.end)];
            sendAll(A->columnStarts.data() + theirs.first, theirs.count() + 1, rank);
            sendAll(A->rows.data() + first, end - first, rank);
            sendAll(A->values.data() + first, end - first, rank);
        }
        std::copy_n(A->columnStarts.begin(), starts.size(), starts.begin());
        columns.assign(A->rows.begin(), A->rows.begin() + starts.back());
        values.assign(A->values.begin(), A->values.begin() + starts.back());
    } else {
        receiveAll(starts.data(), std::int64_t(starts.size()));
        columns.resize(size_t(starts.back() - starts.front()));
        values.resize(columns.size());
        receiveAll(columns.data(), std::int64_t(columns.size()));
        receiveAll(values.data(), std::int64_t(values.size()));
    }
    std::vector<PetscInt> i, j(columns.begin(), columns.end());
    for (const std::int64_t start : starts) i.push_back(PetscInt(start - starts.front()));
    Mat matrix = nullptr;
    check(MatCreate(PETSC_COMM_WORLD, &matrix), "make a matrix");
    check(MatSetSizes(matrix, PetscInt(mine.count()), PetscInt(mine.count()), PetscInt(size),
                      PetscInt(size)),
          "size a matrix");
    check(MatSetType(matrix, MATSBAIJ), "make a symmetric matrix");
    check(MatSeqSBAIJSetPreallocationCSR(matrix, 1, i.data(), j.data(), values.data()),
          "fill a matrix");
    check(MatMPISBAIJSetPreallocationCSR(matrix, 1, i.data(), j.data(), values.data()),
          "fill a matrix");
    check(MatSetOption(matrix, MAT_SYMMETRIC, PETSC_TRUE), "mark a matrix symmetric");
    return matrix;
}

/** Distributes the rows of a dense matrix from rank 0. **/
MatrixXd scatterRows(const MatrixXd* whole) {
    const Index rows = broadcast<std::int64_t>(whole ? whole->rows() : 0),
                columns = broadcast<std::int64_t>(whole ? whole->cols() : 0);
    const Rows mine(rows);
    if (!whole) {
        MatrixXd local(mine.count(), columns);
        receiveAll(local.data(), local.size());
        return local;
    }
    for (int rank = 1; rank < countProcesses(); ++rank) {
        const Rows theirs(rows, rank);
        const MatrixXd part = whole->middleRows(theirs.first, theirs.count());
        sendAll(part.data(), part.size(), rank);
    }
    return whole->middleRows(mine.first, mine.count());
}

/** Gathers all rows of a distributed dense matrix on rank 0. **/
void gatherRows(const MatrixXd& local, MatrixXd* whole) {
    if (!whole) {
        sendAll(local.data(), local.size(), 0);
        return;
    }
    const Rows mine(whole->rows());
    whole->middleRows(mine.first, mine.count()) = local;
    for (int rank = 1; rank < countProcesses(); ++rank) {
        const Rows theirs(whole->rows(), rank);
        MatrixXd part(theirs.count(), whole->cols());
        constexpr std::int64_t Most = 1 << 27;
        for (std::int64_t at = 0; at < part.size(); at += Most)
            MPI_Recv(part.data() + at, int(std::min<std::int64_t>(Most, part.size() - at) * 8),
                     MPI_BYTE, rank, 0, PETSC_COMM_WORLD, MPI_STATUS_IGNORE);
        whole->middleRows(theirs.first, theirs.count()) = part;
    }
}

/** Returns Xᵀ Y of distributed columns on all ranks. **/
MatrixXd gramOf(const MatrixXd& X, const MatrixXd& Y) {
    MatrixXd sum = X.transpose() * Y;
    if (sum.size() > 0)
        MPI_Allreduce(MPI_IN_PLACE, sum.data(), int(sum.size()), MPI_DOUBLE, MPI_SUM,
                      PETSC_COMM_WORLD);
    return sum;
}

/** Access to the local rows of a PETSc vector. **/
class VecView {
public:
    VecView(Vec vector, Index size) : m_vector(vector) {
        check(VecGetArray(vector, &m_data), "read a vector");
        new (&map) Eigen::Map<Eigen::VectorXd>(m_data, size);
    }
    ~VecView() { VecRestoreArray(m_vector, &m_data); }
    VecView(const VecView&) = delete;
    VecView& operator=(const VecView&) = delete;
    Eigen::Map<Eigen::VectorXd> map{nullptr, 0};

private:
    Vec m_vector;
    PetscScalar* m_data = nullptr;
};

/** Each process's part of the factored matrix and of the eigenproblem. **/
struct Shared {
    Mat K = nullptr, factor = nullptr, M = nullptr;
    Index numLocal = 0;
    double numFactorEntries = 0;
    MatrixXd U, S;  ///< correction of M; local rows of U
    MatrixXd D, Y;  ///< constraints and K⁻¹D; local rows
    Eigen::LDLT<MatrixXd> DY;
    const ProgressCallback* progress = nullptr;  ///< on rank 0
    std::string phase;
    int numWanted = 0;
    bool cancelled = false;
    std::exception_ptr thrown;  ///< by `progress`

    void freeFactor() {
        if (factor) MatDestroy(&factor);
        if (K) MatDestroy(&K);
    }
} shared;

/** Returns K⁻¹ B of distributed columns. **/
MatrixXd solveLocally(const MatrixXd& B) {
    MatrixXd X(B.rows(), B.cols());
    Vec b = nullptr, x = nullptr;
    check(MatCreateVecs(shared.K, &x, &b), "make vectors");
    for (Index column = 0; column < B.cols(); ++column) {
        VecView(b, B.rows()).map = B.col(column);
        check(MatSolve(shared.factor, b, x), "solve");
        X.col(column) = VecView(x, B.rows()).map;
    }
    VecDestroy(&b);
    VecDestroy(&x);
    return X;
}

/** y = (M + U S Uᵀ) x. **/
PetscErrorCode applyMass(Mat, Vec x, Vec y) {
    return callSafely([&]() -> PetscErrorCode {
        if (const PetscErrorCode code = MatMult(shared.M, x, y)) return code;
        if (shared.U.cols() == 0) return 0;
        const MatrixXd coefficients = shared.S * gramOf(shared.U, VecView(x, shared.numLocal).map);
        VecView(y, shared.numLocal).map += shared.U * coefficients;
        return 0;
    });
}

/** y = (K⁻¹ − Y (DᵀY)⁻¹ Yᵀ) x: the deflection with the constraints held. **/
PetscErrorCode applyInverse(PC, Vec x, Vec y) {
    return callSafely([&]() -> PetscErrorCode {
        if (const PetscErrorCode code = MatSolve(shared.factor, x, y)) return code;
        if (shared.D.cols() == 0) return 0;
        // Twice because of round-off: K⁻¹ can be very soft where the constraints hold.
        for (int pass = 0; pass < 2; ++pass) {
            const MatrixXd missed = gramOf(shared.D, VecView(y, shared.numLocal).map);
            VecView(y, shared.numLocal).map -= shared.Y * shared.DY.solve(missed);
        }
        return 0;
    });
}

/** SLEPc's own test and a check for cancellation on rank 0. **/
PetscErrorCode testStopping(EPS eps, PetscInt iteration, PetscInt mostIterations,
                            PetscInt numConverged, PetscInt numWanted, EPSConvergedReason* reason,
                            void*) {
    if (const PetscErrorCode code = EPSStoppingBasic(eps, iteration, mostIterations, numConverged,
                                                     numWanted, reason, nullptr))
        return code;
    bool stop = false;
    try {
        if (shared.progress && *shared.progress)
            stop = !(*shared.progress)(shared.phase, double(numConverged) / double(numWanted));
    } catch (...) {
        shared.thrown = std::current_exception();
        stop = true;
    }
    if (broadcast(stop)) {
        shared.cancelled = true;
        *reason = EPS_CONVERGED_USER;
    }
    return 0;
}

void factorTogether(const SymmetricMatrix* K) {
    shared.freeFactor();
    shared.K = distribute(K);
    PetscInt rows = 0;
    check(MatGetLocalSize(shared.K, &rows, nullptr), "size a matrix");
    shared.numLocal = rows;
    check(MatSetOption(shared.K, MAT_SPD, PETSC_TRUE), "mark a matrix definite");
    check(MatGetFactor(shared.K, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &shared.factor),
          "find MUMPS");
    MatFactorInfo info;
    check(MatFactorInfoInitialize(&info), "prepare MUMPS");
    check(MatCholeskyFactorSymbolic(shared.factor, shared.K, nullptr, &info), "analyse K");
    check(MatCholeskyFactorNumeric(shared.factor, shared.K, &info), "factor K");
    PetscInt error = 0, where = 0, entries = 0;
    MatMumpsGetInfog(shared.factor, 1, &error);
    MatMumpsGetInfog(shared.factor, 2, &where);
    if (error != 0)
        throw SharedFailure("MUMPS could not factor the stiffness matrix (INFOG " +
                            std::to_string(error) + ", " + std::to_string(where) + ")" +
                            (error == -10 || error == -40 ? ": it is singular" : ""));
    MatMumpsGetInfog(shared.factor, 29, &entries);
    // MUMPS reports counts above a million as negative millions.
    shared.numFactorEntries = entries < 0 ? -1e6 * double(entries) : double(entries);
}

void solveTogether(const MatrixXd* B, MatrixXd* X) {
    const MatrixXd local = solveLocally(scatterRows(B));
    gatherRows(local, X);
}

/** Computes eigenpairs; the vectors are gathered on rank 0. **/
void calcModesTogether(const CorrectedMatrix* M, const MatrixXd* D, int numWanted,
                       Eigenpairs* pairs) {
    shared.numWanted = broadcast(numWanted);
    shared.cancelled = false;
    shared.M = distribute(M ? &M->M : nullptr);
    shared.U = scatterRows(M ? &M->U : nullptr);
    const Index k = shared.U.cols();
    MatrixXd S = M ? M->S : MatrixXd(k, k);
    MPI_Bcast(S.data(), int(S.size()), MPI_DOUBLE, 0, PETSC_COMM_WORLD);
    shared.S = S;
    shared.D = scatterRows(D);
    if (shared.D.cols() > 0) {
        shared.Y = solveLocally(shared.D);
        shared.DY = Eigen::LDLT<MatrixXd>(gramOf(shared.D, shared.Y));
    }

    const PetscInt local = PetscInt(shared.numLocal);
    Mat mass = nullptr;
    check(MatCreateShell(PETSC_COMM_WORLD, local, local, PETSC_DETERMINE, PETSC_DETERMINE, nullptr,
                         &mass),
          "make the mass operator");
    check(MatShellSetOperation(mass, MATOP_MULT, reinterpret_cast<void (*)()>(applyMass)),
          "make the mass operator");
    check(MatSetOption(mass, MAT_SYMMETRIC, PETSC_TRUE), "mark a matrix symmetric");
    EPS eps = nullptr;
    ST st = nullptr;
    KSP ksp = nullptr;
    PC pc = nullptr;
    check(EPSCreate(PETSC_COMM_WORLD, &eps), "make the eigensolver");
    check(EPSSetOperators(eps, shared.K, mass), "set the eigenproblem");
    check(EPSSetProblemType(eps, EPS_GHEP), "set the eigenproblem");
    check(EPSSetType(eps, EPSKRYLOVSCHUR), "choose the eigensolver");
    check(EPSSetTolerances(eps, Accuracy, 500), "set the accuracy");
    check(EPSSetDimensions(eps, PetscInt(shared.numWanted), PETSC_DEFAULT, PETSC_DEFAULT),
          "set the number of modes");
    check(EPSSetTarget(eps, 0), "set the target");
    check(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE), "set the target");
    check(EPSSetStoppingTestFunction(eps, testStopping, nullptr, nullptr), "set the stopping test");
    check(EPSGetST(eps, &st), "set the transformation");
    check(STSetType(st, STSINVERT), "set the transformation");
    check(STSetShift(st, 0), "set the transformation");
    check(STGetKSP(st, &ksp), "set the solver");
    check(KSPSetType(ksp, KSPPREONLY), "set the solver");
    check(KSPGetPC(ksp, &pc), "set the solver");
    check(PCSetType(pc, PCSHELL), "set the solver");
    check(PCShellSetApply(pc, applyInverse), "set the solver");
    check(EPSSolve(eps), "find the modes");

    PetscInt numConverged = 0;
    EPSGetConverged(eps, &numConverged);
    const Index count = std::min<Index>(numConverged, shared.numWanted);
    MatrixXd vectors(shared.numLocal, count);
    Eigen::VectorXd values(count);
    Vec x = nullptr;
    check(MatCreateVecs(shared.K, &x, nullptr), "make a vector");
    for (Index i = 0; i < count; ++i) {
        PetscScalar omegaSquared = 0;
        check(EPSGetEigenpair(eps, PetscInt(i), &omegaSquared, nullptr, x, nullptr), "read a mode");
        values[i] = 1 / omegaSquared;
        // xᵀMx = 1 here.
        vectors.col(i) = VecView(x, shared.numLocal).map * std::sqrt(values[i]);
    }
    VecDestroy(&x);
    EPSDestroy(&eps);
    MatDestroy(&mass);
    MatDestroy(&shared.M);
    if (pairs) {
        pairs->values = values;
        const Index size = broadcast<std::int64_t>(M->M.size);
        MatrixXd whole(size, count);
        gatherRows(vectors, &whole);
        pairs->vectors = whole;
    } else {
        broadcast<std::int64_t>(0);
        gatherRows(vectors, nullptr);
    }
}

/** Serves the requests of rank 0 until it ends. **/
void serve() {
    for (;;) {
        const Request request = broadcast(Request::End);
        if (request == Request::End) return;
        try {
            doTogether([request] {
                if (request == Request::Factor) factorTogether(nullptr);
                if (request == Request::Solve) solveTogether(nullptr, nullptr);
                if (request == Request::Modes) calcModesTogether(nullptr, nullptr, 0, nullptr);
                if (request == Request::Free) shared.freeFactor();
            });
        } catch (const SharedFailure&) {  // rank 0 reports it
        }
    }
}

}  // namespace

int countProcesses() {
    int count = 1;
    if (isRunning) MPI_Comm_size(PETSC_COMM_WORLD, &count);
    return count;
}

int runWithSlepc(int argc, char** argv, const std::function<int()>& program) {
    int noArguments = std::min(argc, 1);
    if (SlepcInitialize(&noArguments, &argv, nullptr, nullptr) != 0) return 1;
    isRunning = true;
    PetscPushErrorHandler(PetscReturnErrorHandler, nullptr);
    int result = 0;
    if (rankOf() == 0) {
        result = program();
        broadcast(Request::End);
    } else {
        serve();
    }
    shared.freeFactor();
    SlepcFinalize();
    isRunning = false;
    return result;
}

SlepcSolver::~SlepcSolver() {
    if (m_size == 0 || !isRunning) return;
    broadcast(Request::Free);
    shared.freeFactor();
}

void SlepcSolver::factor(const SymmetricMatrix& K) {
    m_size = K.size;
    broadcast(Request::Factor);
    doTogether([&] { factorTogether(&K); });
}

MatrixXd SlepcSolver::solve(const MatrixXd& B) const {
    MatrixXd X(B.rows(), B.cols());
    for (Index column = 0; column < B.cols(); column += LargestSolve) {
        const Index count = std::min<Index>(LargestSolve, B.cols() - column);
        const MatrixXd part = B.middleCols(column, count);
        MatrixXd solved(B.rows(), count);
        broadcast(Request::Solve);
        doTogether([&] { solveTogether(&part, &solved); });
        X.middleCols(column, count) = solved;
    }
    return X;
}

Eigenpairs SlepcSolver::calcModes(const CorrectedMatrix& M, const MatrixXd& D,
                                  const ModeRange& range, const std::string& phase,
                                  const ProgressCallback& progress) const {
    shared.phase = phase;
    shared.progress = &progress;
    Eigenpairs pairs;
    int wanted = std::min(range.count, range.smallest > 0 ? 40 : range.count);
    for (;;) {
        wanted = std::min(wanted, m_size);
        broadcast(Request::Modes);
        doTogether([&] { calcModesTogether(&M, &D, wanted, &pairs); });
        if (shared.thrown) std::rethrow_exception(std::exchange(shared.thrown, nullptr));
        if (shared.cancelled) throw Cancelled();
        if (pairs.values.size() < wanted)
            throw std::runtime_error("SLEPc found " + std::to_string(pairs.values.size()) + " of " +
                                     std::to_string(wanted) + " modes; ask for fewer");
        // Stop if all modes down to the smallest are found; otherwise double the number.
        if (wanted >= range.count || wanted >= m_size ||
            pairs.values[pairs.values.size() - 1] < range.smallest)
            break;
        wanted = std::min(2 * wanted, range.count);
    }
    Index kept = 0;
    while (kept < std::min<Index>(pairs.values.size(), range.count) &&
           pairs.values[kept] >= range.smallest)
        ++kept;
    pairs.values.conservativeResize(kept);
    pairs.vectors.conservativeResize(Eigen::NoChange, kept);
    return pairs;
}

long SlepcSolver::numFactorEntries() const {
    return long(shared.numFactorEntries);
}

}  // namespace simflex
