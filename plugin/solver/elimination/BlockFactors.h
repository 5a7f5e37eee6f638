#pragma once
/** @file
Step 1 of block elimination for one block (private header): factors J_b and forms its contribution
to the Schur complement, S_b = G_b J_b⁻¹ G_bᵀ. Uses ArrowFactors for arrows, TreeFactors for trees,
and dense matrices otherwise.

Dense matrices use Eigen's own aligned storage, so that summation order never depends on addresses
and results are bit-identical from run to run. **/

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/elimination/ArrowFactors.h"
#include "simflex/solver/elimination/ChunkedLu.h"
#include "simflex/solver/elimination/TreeFactors.h"

namespace simflex {

template <class Scalar>
class BlockFactors {
public:
    using System = BasicNewtonSystem<Scalar>;
    using Block = typename System::Block;

    BlockFactors(const Block& block, std::vector<PartFactors<Scalar>>& parts);

    /** Factors J_b and forms S_b. @returns false if J_b is singular or not finite. **/
    bool factor(const System& system, const Block& block);

    /** The m×m matrix S_b. **/
    const Scalar* getSchur() const { return m_schur.data(); }

    /** First half of a solution: stores what substitute() needs and writes G_b J_b⁻¹ r_b (m). **/
    void eliminate(const Scalar* r, Scalar* Gz);

    /** Second half: deltaU ← −J_b⁻¹ (r_b + G_bᵀ Δλ), Δλ by the block's columns.
    @param r  that of eliminate(), or null for zero, without eliminate() **/
    void substitute(const Scalar* r, const Scalar* lambda, Scalar* deltaU);

    /** Prefetches the data of both into cache. **/
    void prefetch() const {
        if (m_form == Form::Arrow) m_arrow->prefetch();
    }

private:
    using Form = NewtonBlock::Form;
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

    Form m_form = Form::Symmetric;
    Matrix m_schur;
    std::optional<ArrowFactors<Scalar>> m_arrow;  ///< if the block has a part

    // With LLᵀ: W = L⁻¹Gᵀ, z = L⁻¹r; otherwise W = J⁻¹Gᵀ, z = J⁻¹r. Eigen's LLᵀ is Hermitian, so
    // complex symmetric matrices are factored as general ones.
    Eigen::LLT<Eigen::MatrixXd> m_symmetric;
    ChunkedLu<Scalar> m_general;
    Eigen::PartialPivLU<Matrix> m_pivoting;  ///< fallback
    bool m_needsPivoting = false;
    TreeFactors<Scalar> m_tree;
    std::vector<Scalar> m_workspace;
    Matrix m_expanded;  ///< a tree's J for the fallback
    /** For the general form and trees. **/
    void solveInPlace(Scalar* x);
    Eigen::MatrixXd m_Gt;
    Matrix m_W;
    Vector m_r, m_z, m_Gz, m_lambda;
};

}  // namespace simflex
