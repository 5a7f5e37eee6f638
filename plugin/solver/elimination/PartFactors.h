#pragma once
/** @file
Data shared by the arrow blocks of one part in the elimination, for one diagonal d (private header):
d⁻¹, d⁻¹A with A = shapes of the part's frames, and the compliances Aᵀd⁻¹A between frames. Computed
once per part, whatever the number of bodies. A is real: if d is complex, products use A, and d⁻¹ is
applied to the vectors. **/

#include <Eigen/Dense>
#include <utility>
#include <vector>

#include "simflex/base/TiledMatrix.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/elimination/ScalarChunk.h"

namespace simflex {

template <class Scalar>
class PartFactors {
public:
    using Part = typename BasicNewtonSystem<Scalar>::Part;

    explicit PartFactors(const Part& part);

    /** Requests the compliance between two frames. **/
    void requestPair(int frame, int other);

    /** @returns false if an entry of d is zero or not finite. **/
    bool factor(const Part& part);

    int numModes() const { return m_numModes; }

    /** d⁻¹, one column. **/
    const PaddedColumns<Scalar>& getInverseDiagonal() const { return m_inverseDiagonal; }

    /** Aᵀd⁻¹A of a requested pair: 6 columns of `other`, each with the rows of `frame` and two
    zeros. **/
    const ChunkOf<Scalar>* getCompliance(int frame, int other) const {
        return m_compliances.data() + 6 * m_pairIndex[size_t(frame * m_numFrames + other)];
    }

    /** 6 columns of a frame, getStride() apart, padded with zeros to whole chunks: d⁻¹A of a real
    part, A of a complex one. **/
    const double* getColumns(int frame) const { return m_columns.data() + 6 * frame * getStride(); }
    int getStride() const { return int(m_columns.rows()); }

    /** These columns, transposed, times `count` real vectors x: 6 rows per frame, padded to
    getNumProductRows(). **/
    void multiplyTransposed(int count, const double* const* x, double* const* y) const {
        m_tiles.multiply(count, x, y);
    }
    int getNumProductRows() const { return m_tiles.paddedRows(); }

private:
    void formCompliance(int frame, int other, ChunkOf<Scalar>* compliance) const;

    int m_numModes, m_numFrames;
    PaddedColumns<Scalar> m_inverseDiagonal;
    Eigen::MatrixXd m_shapes, m_columns;  ///< A; see getColumns()
    std::vector<Chunk> m_rows;            ///< A of a complex part, by frames, then modes
    TiledMatrix m_tiles;                  ///< of the columns, transposed
    std::vector<int> m_pairIndex;
    std::vector<std::pair<int, int>> m_pairs;
    std::vector<ChunkOf<Scalar>> m_compliances;
};

}  // namespace simflex
