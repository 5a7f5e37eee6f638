#pragma once
/** @file
What the arrow blocks of one part share in the elimination, for one diagonal d (private header):
d⁻¹, d⁻¹A with A = shapes of the part's frames, and the compliances Aᵀd⁻¹A between frames. Computed
once per part, whatever the number of bodies. **/

#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "simflex/base/Chunk.h"
#include "simflex/base/TiledMatrix.h"
#include "simflex/solver/NewtonSystem.h"

namespace simflex {

class PartFactors {
public:
    explicit PartFactors(const NewtonSystem::Part& part);

    /** Asks for the compliance between two frames. **/
    void requestPair(int frame, int other);

    /** @returns false if an entry of d is zero or not finite. **/
    bool factor(const NewtonSystem::Part& part);

    int numModes() const { return m_numModes; }

    /** d⁻¹, padded with zeros to whole chunks. **/
    const double* getInverseDiagonal() const { return m_inverseDiagonal.data(); }

    /** Aᵀd⁻¹A of a requested pair: 6 columns of `other`, each with rows of `frame` and two zeros.
     * **/
    const Chunk* getCompliance(int frame, int other) const {
        return m_compliances.data() + 6 * m_pairIndex[size_t(frame * m_numFrames + other)];
    }

    /** d⁻¹A of a frame: 6 columns, getStride() apart, padded with zeros to whole chunks. **/
    const double* getFlexibility(int frame) const {
        return m_flexibility.data() + 6 * frame * getStride();
    }
    int getStride() const { return int(m_flexibility.rows()); }

    /** (d⁻¹A)ᵀ x for `count` vectors x: 6 rows a frame, padded to getNumProductRows(). **/
    void multiplyByFlexibility(int count, const double* const* x, double* const* y) const {
        m_flexibilityTiles.multiply(count, x, y);
    }
    int getNumProductRows() const { return m_flexibilityTiles.paddedRows(); }

private:
    int m_numModes, m_numFrames;
    Eigen::VectorXd m_inverseDiagonal;
    Eigen::MatrixXd m_shapes, m_flexibility;  ///< A, d⁻¹A
    TiledMatrix m_flexibilityTiles;           ///< (d⁻¹A)ᵀ
    std::vector<int> m_pairIndex;
    std::vector<std::pair<int, int>> m_pairs;
    std::vector<Chunk> m_compliances;
};

}  // namespace simflex
