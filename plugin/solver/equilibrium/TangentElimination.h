#pragma once
/** @file
Solves tangent equations by blocks (private header),

    [ A   Gᵀ ] [x]   [f]        A = K + σM, or −ω²M + iωD + K
    [ G   0  ] [λ] = [g]

multifrontally: the speeds of a block, then the multipliers of its joints once the blocks on both
sides are eliminated. Where modes act through few shapes (BlockModes), those orthogonal to the
shapes are eliminated first, at the cost of a diagonal: with Λ their diagonal, U an orthonormal
basis of the shapes and y = Uᵀξ,

    Uᵀ(A − Λ)U + T,    T = (UᵀΛ⁻¹U)⁻¹,    right-hand side T UᵀΛ⁻¹f,
    ξ = Λ⁻¹f + Λ⁻¹U T (y − UᵀΛ⁻¹f)

Rows of G get a compliance of 1e-10, in scaled equations, so that redundant ones do no harm, and A
gets 1e-4 GᵀG (as in an augmented Lagrangian), which does not affect x.

    TangentElimination<double> elimination(graph, mass);
    elimination.factor(A, scale);
    elimination.solve(f, g);             // in place: x and λ  **/

#include <array>
#include <optional>

#include "simflex/solver/elimination/FrontSolver.h"
#include "simflex/solver/equilibrium/BlockTangent.h"

namespace simflex {

template <class Scalar>
class TangentElimination {
public:
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

    /** @param mass  provides G; both arguments must outlive this, with the same rows; new values
    take effect at the next factor() **/
    TangentElimination(const BlockGraph& graph, const BlockMass& mass);
    void setNumThreads(int threads) { m_numThreads = threads; }

    enum class Symmetry { Symmetric, General };
    /** @param A  symmetric: only its symmetric part is used
    @param scale  of the speeds: x = scale·(unknowns of order 1); zero where they are held **/
    void factor(const BlockMatrix<Scalar>& A, const Eigen::VectorXd& scale, Symmetry symmetry);

    /** Solves in place for scaled right-hand sides, speeds first. **/
    void solveScaled(Vector& y) { solveScaled(y.data(), 1); }
    /** Solves in place. **/
    void solve(Vector& f, Vector& g);
    /** Solves in place for x of each column, with zero right-hand side of the constraints. **/
    void solveEach(Matrix& F);
    /** Removes from each column of X the component that violates the joints. @pre real **/
    void close(Matrix& X);
    /** Scale of the rows of G: λ = scale·(unknowns of order 1). **/
    const Eigen::VectorXd& getRowScale() const { return m_rowScale; }

    /** Number of negative eigenvalues of A on the null space of G: those of the whole matrix less
    the number of multipliers. @pre factor(), symmetric and real **/
    int countNegative() const;

private:
    void solveScaled(Scalar* columns, int count);
    /** Rows of G that act on the same blocks. **/
    struct Bond {
        std::vector<int> blocks;
        int numRows;
        std::vector<std::array<int, 3>> columns;  ///< block, column of its Gᵀ, row among these
    };
    /** A block's modes at the last factor(), in scaled unknowns. **/
    struct Condensed {
        Eigen::VectorXd scale;     ///< of the first coordinates
        Eigen::MatrixXd shapes;    ///< scaled; empty without shapes
        Eigen::MatrixXd U, R;      ///< shapes = U R
        Vector inverse;            ///< Λ⁻¹
        Matrix inverseU, weights;  ///< Λ⁻¹U, T
        int numNegative = 0;       ///< negative pivots of the modes eliminated first
    };
    CliquePattern makePattern();
    void condense(const BlockMatrix<Scalar>& A, size_t block);
    /** A block of A, scaled. **/
    Matrix keep(const Matrix& values, size_t row, size_t column) const;

    const BlockGraph& m_graph;
    const BlockMass& m_mass;
    int m_numSpeeds, m_numThreads = 1;
    std::vector<std::array<int, 3>> m_pairs;  ///< block column, place among its neighbours, row
    std::vector<Bond> m_bonds;
    std::vector<int> m_kept, m_firstKept;  ///< by block, and all at last
    std::vector<Condensed> m_condensed;
    std::vector<Matrix> m_values;  ///< of cliques: pairs, bonds
    std::optional<FrontSolver<Scalar>> m_fronts;
    Eigen::VectorXd m_scale, m_rowScale;
};

template <>
int TangentElimination<double>::countNegative() const;
template <>
void TangentElimination<double>::close(Eigen::MatrixXd& X);

/** Solves A x = b by GMRES to a residual of 1e-11 of b, in a limited number of steps.
@param precondition  x ≈ A⁻¹b **/
Eigen::VectorXd solveByGmres(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& multiply,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& precondition,
    const Eigen::VectorXd& b, int maxSteps);

}  // namespace simflex
