#pragma once
/** @file
Step 1 of block elimination for an arrow block (private header): factors J_b and forms its
contribution to the Schur complement, S_b = G_b J_b⁻¹ G_bᵀ.

An arrow's tail is a diagonal d that all bodies of a part share, and the modal rows of its G_bᵀ are
shapes·coefficients. With A = shapes, K = coefficients, E the coupling, Y = G_rigidᵀ − Eᵀd⁻¹A K,
H̃ = H − Eᵀd⁻¹E:

    S_b = Kᵀ (Aᵀd⁻¹A) K + Yᵀ H̃⁻¹ Y

Aᵀd⁻¹A is computed once per part: the rest costs O(n_f) with small factors, whatever the number of
constraints. A block's own columns, with modal rows g, cost O(n_f) per pair: gᵀd⁻¹g replaces
Kᵀ (Aᵀd⁻¹A) K. Modes are processed eight at a time, columns of 6 entries as one chunk. **/

#include <array>
#include <vector>

#include "simflex/solver/elimination/PartFactors.h"

namespace simflex {

template <class Scalar>
class ArrowFactors {
public:
    using Block = typename BasicNewtonSystem<Scalar>::Block;

    /** @param part  part of the block; the compliances that the block needs are requested from
    it **/
    ArrowFactors(const Block& block, PartFactors<Scalar>& part);

    /** Factors J_b and writes S_b (m×m). @returns false if J_b is singular or not finite. **/
    bool factor(const Block& block, Scalar* schur);

    /** Writes G_b J_b⁻¹ r_b (m), and stores what substitute() needs. **/
    void eliminate(const Scalar* r, Scalar* Gz);

    /** deltaU ← −J_b⁻¹ (r_b + G_bᵀ Δλ), Δλ by the block's columns.
    @param r  that of eliminate(), or null for zero, without eliminate() **/
    void substitute(const Scalar* r, const Scalar* lambda, Scalar* deltaU);

    /** Prefetches the data of both into cache. **/
    void prefetch() const;

private:
    using ScalarChunk = ChunkOf<Scalar>;

    /** Consecutive columns that act through one frame. **/
    struct Side {
        int frame, place;  ///< of the part; in m_frames
        int firstColumn, endColumn;
    };

    /** Computes d⁻¹E, and H̃⁻¹ from H − Eᵀd⁻¹E. @returns false if that is singular or, if real, not
    positive definite. **/
    bool condenseHead(const Block& block);
    void condenseColumns(const Block& block);
    /** The same for own columns. **/
    void condenseOwnColumns(const Block& block);
    bool formSchur(Scalar* schur) const;
    bool formOwnSchur(Scalar* schur) const;
    /** m_products ← (d⁻¹A)ᵀ x, `count` columns.
    @param x  unpadded, used if real
    @param scaled  d⁻¹x, used if complex **/
    void multiplyByFlexibility(int count, const Scalar* const* x,
                               const PaddedColumns<Scalar>& scaled);

    const PartFactors<Scalar>* m_part;
    int m_numModes, m_numColumns;
    std::array<ScalarChunk, 6> m_inverseHead;  ///< H̃⁻¹ by columns
    ScalarChunk m_top{};     ///< H̃⁻¹(r − Eᵀd⁻¹r), rigid rows of −Δu without Δλ
    std::vector<Chunk> m_K;  ///< by columns, if shared
    std::vector<ScalarChunk> m_Y;  ///< by columns
    bool m_ownsColumns;
    PaddedColumns<double> m_g;         ///< modal rows of own columns
    PaddedColumns<Scalar> m_dg;        ///< d⁻¹g
    PaddedColumns<Scalar> m_dE;        ///< d⁻¹E, 3 columns
    PaddedColumns<Scalar> m_dr;        ///< d⁻¹r, if complex
    PaddedColumns<Scalar> m_products;  ///< (d⁻¹A)ᵀE, or (d⁻¹A)ᵀr in its first column
    std::vector<ScalarChunk> m_frameForces;  ///< KΔλ summed by frame
    std::vector<Side> m_sides;
    std::vector<int> m_frames;  ///< in use, without duplicates
};

}  // namespace simflex
