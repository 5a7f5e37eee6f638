#pragma once
/** @file
Solves a NewtonSystem by block Gaussian elimination, first of bodies, then of multipliers:

    1. per block, in parallel:  factor J_b,  S_b = G_b J_b⁻¹ G_bᵀ
    2. Schur complement:        S = Σ_b S_b, sparse: its graph is that of joints sharing a body
    3.                          S Δλ = c − Σ_b G_b z_b,   z_b = J_b⁻¹ r_b
    4. per block, in parallel:  Δu_b = −z_b − J_b⁻¹ G_bᵀ Δλ

An arrow block costs O(36 n). S is factored by a multifrontal method in a nested-dissection order
found once, or as one dense matrix if small; by LDLᵀ if every block is symmetric and there are
neither pairs nor couplings, else by LU. Eliminating a body with very many joints would couple them
all; such a late block keeps its speeds as unknowns of step 3.

Redundant constraints make S singular: Δλ is then the least-squares solution of least norm, and
getRedundantRows() lists the redundant rows. Sums over blocks have a fixed order, so results are
bit-identical for any number of threads.

    BlockEliminationSolver solver(system);   // symbolic: sizes and rows
    solver.factor(system);
    solver.solve(system);
    solver.getDeltaU(), solver.getDeltaLambda()

States: symbolic (after construction) → factored (after factor()); solve() may be called repeatedly.
After the first call of each, neither allocates memory (redundant constraints excepted).

ComplexBlockEliminationSolver solves complex systems in the same way; a symmetric J is then complex
symmetric, with positive definite real part. **/

#include <complex>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/solver/NewtonSystem.h"

namespace simflex {

/** A block's matrix is singular or not finite. **/
class SingularBlock : public std::runtime_error {
public:
    SingularBlock(int singularBlock, const std::string& message)
        : std::runtime_error(message), block(singularBlock) {}
    const int block;
};

template <class Scalar>
class BlockElimination {
public:
    using System = BasicNewtonSystem<Scalar>;

    /** Wall time of the phases since construction [s]; excludes eliminate() and substitute(). **/
    struct Timing {
        double factor = 0;            ///< step 1
        double schur = 0;             ///< steps 2 and 3
        double backSubstitution = 0;  ///< z_b and step 4
    };

    /** Analyses sizes and rows only; numerical values are not read. **/
    explicit BlockElimination(const System& system);
    ~BlockElimination();
    BlockElimination(BlockElimination&&) noexcept;
    BlockElimination& operator=(BlockElimination&&) noexcept;

    /** Maximum number of threads; small systems use fewer. **/
    void setNumThreads(int threads);

    /** True if the last factor() succeeded. **/
    bool isFactored() const;
    /** True while blocks with very many columns remain unknowns of step 3; factor() ends this for
    good if it finds redundancies beside them. **/
    bool hasLateBlocks() const;
    /** Eliminates late blocks like all others from now on. **/
    void dissolveLateBlocks(const System& system);

    /** Factors every J_b and S.
    @pre same topology as in the constructor.
    @throws SingularBlock naming the block if a J_b is singular or not finite, std::runtime_error
    naming the part if its diagonal is. **/
    void factor(const System& system);

    /** Solves for r and c of `system`; reads only Gt of its matrices.
    @pre factor().
    @throws std::logic_error if the system has not been factored. **/
    void solve(const System& system);

    /** @name solve() in three steps
    For callers that loop over the blocks anyway and have each in cache: eliminate() for every
    block, from any threads, then solveForMultipliers(), then substitute() for every block. **/
    /**@{**/
    /** Computes z_b and G_b z_b. **/
    void eliminate(const System& system, int block);
    /** Solves S Δλ = c − Σ_b G_b z_b. **/
    void solveForMultipliers(const System& system);
    /** Computes the block's Δu. **/
    void substitute(const System& system, int block);
    /**@}**/

    /** Solves with r = 0, ignoring the system's r: the projection onto the constraints. **/
    void solveForConstraints(const System& system);

    /** Δu of all speeds, block by block. **/
    const std::vector<Scalar>& getDeltaU() const;
    const Scalar* getDeltaLambda() const;
    int getNumRedundant() const;
    /** Rows of Δλ that follow from others, one per redundancy; from the last factor(). **/
    const std::vector<int>& getRedundantRows() const;
    /** Returns all rows of the k-th redundancy, ascending, including the redundant one. **/
    std::vector<int> findInvolvedRows(int k) const;
    const Timing& getTiming() const;

private:
    class Implementation;
    std::unique_ptr<Implementation> m_impl;
};

using BlockEliminationSolver = BlockElimination<double>;
using ComplexBlockEliminationSolver = BlockElimination<std::complex<double>>;

}  // namespace simflex
