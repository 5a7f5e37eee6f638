#pragma once
/** @file
A constant matrix laid out for products with a few vectors at a time: y_c = A x_c, c = 1 … count
(private header).

Rows are packed in tiles of 8, each tile's columns one after another, so that a product reads memory
once and in order, whatever the number of vectors; several vectors share each read. Every sum runs
over the columns in order: results do not depend on count or on addresses.

Of matrices of symmetric parts most entries are zero, in no order that one sees. Then rows whose
entries stand in the same columns share a tile, which keeps these columns alone. **/

#include <Eigen/Dense>
#include <vector>

namespace simflex {

class TiledMatrix {
public:
    static constexpr int TileHeight = 8;

    TiledMatrix() = default;
    /** @param negligible  entries so small, measured by the largest one, are taken for zero where
    that saves half of the products **/
    explicit TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix, double negligible = 0);

    /** Takes the entries of Aᵀ; allocates only when the size changes. **/
    void assignTransposed(const Eigen::Ref<const Eigen::MatrixXd>& A);

    int cols() const { return m_cols; }
    /** Rows rounded up to whole tiles: the length of each y. **/
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
    std::vector<int> m_rows;       ///< that each tile's rows are, if not all columns are kept
    std::vector<int> m_kept;       ///< columns, tile after tile
    std::vector<int> m_firstKept;  ///< by tile; the number of all last
};

}  // namespace simflex
