#pragma once
/** @file
A constant matrix laid out for products with a few vectors at a time: y_c = A x_c, c = 1 … count
(private header).

Rows are packed in tiles of 8, and each tile is stored column by column, so a product reads memory
once and in order, and several vectors share each read. Every sum runs over the columns in order:
results depend neither on count nor on alignment.

Matrices of symmetric parts are mostly zero, in no visible pattern. Rows with the same non-zero
columns then share a tile, which stores these columns only. **/

#include <Eigen/Dense>
#include <vector>

namespace simflex {

class TiledMatrix {
public:
    static constexpr int TileHeight = 8;

    TiledMatrix() = default;
    /** @param negligible  relative to the largest entry: smaller entries are treated as zero if
    that saves half of the multiplications **/
    explicit TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double negligible = 0);

    /** Sets the entries to those of Aᵀ. Allocates only if the size changes. **/
    void assignTransposed(const Eigen::Ref<const Eigen::MatrixXd>& A);

    int cols() const { return m_cols; }
    /** Number of rows rounded up to whole tiles: the length of each y. **/
    int paddedRows() const { return m_numTiles * TileHeight; }

    /** y[c] ← A x[c]. 2·rows·cols·count flops. **/
    void multiply(int count, const double* const* x, double* const* y) const;

private:
    template <int Tiles, int Columns>
    void multiplyTiles(int tile, const double* const* x, double* const* y) const;
    template <int Tiles, int Columns>
    void multiplyStrip(int tile, int count, const double* const* x, double* const* y) const;

    void skipZeros(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double negligible);
    template <int Columns>
    void multiplyKept(int count, const double* const* x, double* const* y) const;

    int m_cols = 0, m_numTiles = 0;
    Eigen::VectorXd m_values;
    std::vector<int> m_rows;       ///< matrix row of each tile row; empty if all columns are kept
    std::vector<int> m_kept;       ///< column indices, tile by tile
    std::vector<int> m_firstKept;  ///< offset of each tile in m_kept, then their total
};

}  // namespace simflex
