#pragma once
/** @file
Step 1 of block elimination, for one block (private header): J_b factored, and what it adds to the
Schur complement, S_b = G_b J_b⁻¹ G_bᵀ.

An arrow's tail is a diagonal d that all bodies of a part share, and the modal rows of its G_bᵀ are
shapes·coefficients. With A = shapes, K = coefficients, E the coupling, Y = G_rigidᵀ − Eᵀd⁻¹A K,
H̃ = H − Eᵀd⁻¹E:

    S_b = Kᵀ (Aᵀd⁻¹A) K + Yᵀ H̃⁻¹ Y

Aᵀd⁻¹A is computed once per part: what is left costs O(n_f) with small factors, whatever the number
of constraints.

Numbers are worked on in Eigen's own, aligned storage: how a sum is split then never depends on an
address, and results are the same to the bit from run to run. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/body/TiledMatrix.h"
#include "simflex/solver/NewtonSystem.h"

namespace simflex {

/** What the blocks of one part share, for one diagonal d. **/
class PartFactors {
public:
    explicit PartFactors(const NewtonSystem::Part& part);

    /** Asks for the compliance between two frames. **/
    void requestPair(int frame, int other);

    /** @returns false if an entry of d is zero or not finite. **/
    bool factor(const NewtonSystem::Part& part);

    int numModes() const { return int(inverseDiagonal.size()); }

    /** Aᵀd⁻¹A of a requested pair, 6×6: rows of `frame`, columns of `other`. **/
    Eigen::Map<const Eigen::Matrix<double, 6, 6>> getCompliance(int frame, int other) const {
        const int index = m_pairIndex[size_t(frame * m_numFrames + other)];
        return Eigen::Map<const Eigen::Matrix<double, 6, 6>>(m_compliances.col(index).data());
    }
    /** d⁻¹A of a frame, n_f×6. **/
    Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, 6>> getFlexibility(int frame) const {
        return {m_flexibility.col(6 * frame).data(), numModes(), 6};
    }

    /** (d⁻¹A)ᵀ x for `count` vectors x: 6 rows a frame, padded to getNumProductRows(). **/
    void multiplyByFlexibility(int count, const double* const* x, double* const* y) const {
        m_flexibilityTiles.multiply(count, x, y);
    }
    int getNumProductRows() const { return m_flexibilityTiles.paddedRows(); }

    Eigen::VectorXd inverseDiagonal;

private:
    int m_numFrames;
    Eigen::MatrixXd m_shapes, m_flexibility;  ///< A, d⁻¹A
    TiledMatrix m_flexibilityTiles;           ///< (d⁻¹A)ᵀ
    std::vector<int> m_pairIndex;
    std::vector<std::pair<int, int>> m_pairs;
    Eigen::Matrix<double, 36, Eigen::Dynamic> m_compliances;
};

class BlockFactors {
public:
    BlockFactors(const NewtonSystem::Block& block, std::vector<PartFactors>& parts);

    /** Factors J_b and forms S_b. @returns false if J_b is singular or not finite. **/
    bool factor(const NewtonSystem& system, const NewtonSystem::Block& block);

    /** The m×m matrix S_b. **/
    const double* getSchur() const { return m_schur.data(); }
    bool isSymmetric() const { return m_form != Form::General; }

    /** First half of a solution: keeps J_b⁻¹r_b as far as needed and writes G_b J_b⁻¹ r_b (m). **/
    void eliminate(const NewtonSystem::Block& block, double* Gz);

    /** The same for r_b = 0. **/
    void eliminateZero();

    /** Second half: deltaU ← −J_b⁻¹ (r_b + G_bᵀ Δλ), Δλ by the block's columns. **/
    void substitute(const NewtonSystem::Block& block, const double* lambda);

    const Eigen::VectorXd& getDeltaU() const { return m_deltaU; }

private:
    using Form = NewtonSystem::Block::Form;
    using Matrix6Xd = Eigen::Matrix<double, 6, Eigen::Dynamic>;
    using MatrixX3d = Eigen::Matrix<double, Eigen::Dynamic, 3>;

    /** Place of a frame in m_frames. **/
    Eigen::Index findFrame(int frame) const;
    bool factorArrow(const NewtonSystem::Block& block);
    bool factorMatrix(const NewtonSystem& system, const NewtonSystem::Block& block);

    const PartFactors* m_part = nullptr;
    Form m_form = Form::Symmetric;
    Eigen::MatrixXd m_schur;
    Eigen::VectorXd m_z;  ///< arrow: r of the modes; symmetric: L⁻¹r; general: J⁻¹r
    Eigen::VectorXd m_Gz, m_lambda, m_deltaU;

    // Arrow.
    MatrixX3d m_dE;                          ///< d⁻¹E
    Matrix6Xd m_K, m_Y, m_LY;                ///< coefficients, Y, L⁻¹Y with H̃ = LLᵀ
    Eigen::Matrix<double, 6, 6> m_inverseL;  ///< L⁻¹
    Eigen::Matrix<double, 6, 1> m_top;       ///< rigid rows of r with the modes eliminated
    std::vector<int> m_frames;               ///< frames in use, without repetition
    Matrix6Xd m_frameForce;                  ///< 6×frames in use
    Eigen::MatrixXd m_products;  ///< (d⁻¹A)ᵀE, or (d⁻¹A)ᵀr in its first column

    // Matrix.
    Eigen::LLT<Eigen::MatrixXd> m_symmetric;
    Eigen::PartialPivLU<Eigen::MatrixXd> m_general;
    Eigen::MatrixXd m_Gt, m_W;
};

}  // namespace simflex
