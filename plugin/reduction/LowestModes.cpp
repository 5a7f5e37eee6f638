#include "LowestModes.h"

#include <dlfcn.h>

#include <stdexcept>

namespace simflex {
namespace {

/** C = L⁻¹ M L⁻ᵀ. **/
class InverseOperator : public SymmetricOperator {
public:
    InverseOperator(const SparseCholesky& factored, const MassProduct& multiplyMass)
        : _factored(factored), _multiplyMass(multiplyMass) {}

    Eigen::Index size() const override { return _factored.size(); }

    void apply(const Eigen::MatrixXd& X, Eigen::MatrixXd& Y) const override {
        _factored.solveUpper(X, Y);
        Y = _multiplyMass(Y);
        _factored.solveLower(Y, Y);
    }

private:
    const SparseCholesky& _factored;
    const MassProduct& _multiplyMass;
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

Eigen::MatrixXd calcLowestModes(const SparseCholesky& factored, const MassProduct& multiplyMass,
                                const ModeRange& range, const ProgressCallback& progress) {
    const bool counted = range.count != ModeRange().count;
    if (counted && range.count > factored.size()) refuseModes(range.count, factored.size());
    const OneBlasThread oneThread;
    const Eigenpairs pairs = calcLargestEigenpairs(InverseOperator(factored, multiplyMass), range,
                                                   "normal modes", progress);
    if (counted && range.smallest == 0 && pairs.values.size() < range.count)
        refuseModes(range.count, pairs.values.size());
    Eigen::MatrixXd modes;
    factored.solveUpper(pairs.vectors, modes);
    return modes;
}

Eigen::MatrixXd calcLowestModes(const SparseCholesky& factored, const FullRows& m, int numModes,
                                const ProgressCallback& progress) {
    return calcLowestModes(
        factored, [&m](const Shapes& U) { return m.multiplyPerAxis(U); }, {numModes}, progress);
}

}  // namespace simflex
