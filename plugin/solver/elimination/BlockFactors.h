#pragma once
/** @file
Step 1 of block elimination, for one block (private header): J_b factored, and what it adds to the
Schur complement, S_b = G_b J_b⁻¹ G_bᵀ. Arrows go by ArrowFactors, other forms by dense matrices.

Dense numbers are worked on in Eigen's own, aligned storage: how a sum is split then never depends
on an address, and results are the same to the bit from run to run. **/

#include <Eigen/Dense>
#include <optional>
#include <vector>

#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/elimination/ArrowFactors.h"
#include "simflex/solver/elimination/ChunkedLu.h"

namespace simflex {

class BlockFactors {
public:
    BlockFactors(const NewtonSystem::Block& block, std::vector<PartFactors>& parts);

    /** Factors J_b and forms S_b. @returns false if J_b is singular or not finite. **/
    bool factor(const NewtonSystem& system, const NewtonSystem::Block& block);

    /** The m×m matrix S_b. **/
    const double* getSchur() const { return m_schur.data(); }

    /** First half of a solution: keeps what substitute() needs and writes G_b J_b⁻¹ r_b (m). **/
    void eliminate(const double* r, double* Gz);

    /** Second half: deltaU ← −J_b⁻¹ (r_b + G_bᵀ Δλ), Δλ by the block's columns.
    @param r  that of eliminate(), or null: zero, eliminate() is not called before **/
    void substitute(const double* r, const double* lambda, double* deltaU);

private:
    using Form = NewtonSystem::Block::Form;

    Form m_form = Form::Symmetric;
    Eigen::MatrixXd m_schur;
    std::optional<ArrowFactors> m_arrow;  ///< if the block has a part

    // Symmetric: W = L⁻¹Gᵀ, z = L⁻¹r; general: W = J⁻¹Gᵀ, z = J⁻¹r.
    Eigen::LLT<Eigen::MatrixXd> m_symmetric;
    ChunkedLu m_general;
    Eigen::PartialPivLU<Eigen::MatrixXd> m_pivoting;  ///< where that fails
    bool m_needsPivoting = false;
    Eigen::MatrixXd m_Gt, m_W;
    Eigen::VectorXd m_r, m_z, m_Gz, m_lambda;
};

}  // namespace simflex
