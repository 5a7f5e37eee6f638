#pragma once
/** @file
A constant matrix laid out for products with a few vectors at a time: y_c = A x_c, c = 1 … count
(private header).

Rows are packed in tiles of 8, each tile's columns one after another, so that a product reads memory
once and in order, whatever the number of vectors; several vectors share each read. Every sum runs
over the columns in order: results do not depend on count or on addresses. **/

#include <Eigen/Dense>
#include <vector>

namespace simflex {

class TiledMatrix {
public:
    static constexpr int TileHeight = 8;

    TiledMatrix() = default;
    explicit TiledMatrix(const Eigen::Ref<const Eigen::MatrixXd>& matrix);

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

    int m_cols = 0, m_numTiles = 0;
    Eigen::VectorXd m_values;
};

}  // namespace simflex
