#pragma once
/** @file
Step 1 of block elimination for an arrow block (private header): J_b factored, and what it adds to
the Schur complement, S_b = G_b J_b⁻¹ G_bᵀ.

An arrow's tail is a diagonal d that all bodies of a part share, and the modal rows of its G_bᵀ are
shapes·coefficients. With A = shapes, K = coefficients, E the coupling, Y = G_rigidᵀ − Eᵀd⁻¹A K,
H̃ = H − Eᵀd⁻¹E:

    S_b = Kᵀ (Aᵀd⁻¹A) K + Yᵀ H̃⁻¹ Y

Aᵀd⁻¹A is computed once per part: what is left costs O(n_f) with small factors, whatever the number
of constraints. Columns of a block's own, g in its modes, cost O(n_f) for each pair: gᵀd⁻¹g stands
for Kᵀ (Aᵀd⁻¹A) K. Modes are worked on eight at a time, columns of 6 entries as one chunk. **/

#include <array>
#include <vector>

#include "simflex/solver/elimination/PartFactors.h"

namespace simflex {

class ArrowFactors {
public:
    /** @param part  of the block; asked for the compliances that the block needs **/
    ArrowFactors(const NewtonSystem::Block& block, PartFactors& part);

    /** Factors J_b and writes S_b (m×m). @returns false if J_b is singular or not finite. **/
    bool factor(const NewtonSystem::Block& block, double* schur);

    /** Writes G_b J_b⁻¹ r_b (m), and keeps what substitute() needs. **/
    void eliminate(const double* r, double* Gz);

    /** deltaU ← −J_b⁻¹ (r_b + G_bᵀ Δλ), Δλ by the block's columns.
    @param r  that of eliminate(), or null: zero, eliminate() is not called before **/
    void substitute(const double* r, const double* lambda, double* deltaU);

private:
    /** Consecutive columns that act through one frame. **/
    struct Side {
        int frame, place;  ///< of the part; in m_frames
        int firstColumn, endColumn;
    };

    /** d⁻¹E, and H̃⁻¹ from H − Eᵀd⁻¹E. @returns false if that is not positive definite. **/
    bool condenseHead(const NewtonSystem::Block& block);
    void condenseColumns(const NewtonSystem::Block& block);
    /** The same of own columns. **/
    void condenseOwnColumns(const NewtonSystem::Block& block);
    bool formSchur(double* schur) const;
    bool formOwnSchur(double* schur) const;

    const PartFactors* m_part;
    int m_numModes, m_stride, m_numColumns;
    std::array<Chunk, 6> m_inverseHead;  ///< H̃⁻¹ by columns
    Chunk m_top{};  ///< H̃⁻¹(r − Eᵀd⁻¹r), rigid rows of −Δu without Δλ
    std::vector<Chunk> m_columns;  ///< K and Y, by turns
    bool m_ownsColumns;
    std::vector<double> m_g, m_dg;     ///< own columns' modal rows g, and d⁻¹g, padded
    std::vector<double> m_dE;          ///< d⁻¹E, 3 columns
    std::vector<double> m_products;    ///< (d⁻¹A)ᵀE, or (d⁻¹A)ᵀr in its first column
    std::vector<Chunk> m_frameForces;  ///< KΔλ summed by frame
    std::vector<Side> m_sides;
    std::vector<int> m_frames;  ///< in use, without repetition
};

}  // namespace simflex
