#pragma once
/** @file
Solves tangent equations by blocks (private header),

    [ A   Gᵀ ] [x]   [f]        A = K + σM, or −ω²M + iωD + K
    [ G   0  ] [λ] = [g]

multifrontally: the speeds of a block, then the multipliers of its joints as soon as the blocks on
both sides are gone. Of modes that act through few shapes (BlockModes), all that these do
not see go before, at the cost of a diagonal: with Λ their diagonal, U an orthonormal basis of the
shapes and y = Uᵀξ,

    Uᵀ(A − Λ)U + T,    T = (UᵀΛ⁻¹U)⁻¹,    right-hand side T UᵀΛ⁻¹f,
    ξ = Λ⁻¹f + Λ⁻¹U T (y − UᵀΛ⁻¹f)

Rows of G get a compliance of 1e-10, in scaled equations, so that redundant
ones do no harm, and A gets 1e-4 GᵀG (as an augmented Lagrangian has it), which x does not see.

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

    /** @param mass  its G; both must stay where they are, and its rows what they are; other values
    count from the next factor() on. **/
    TangentElimination(const BlockGraph& graph, const BlockMass& mass);
    void setNumThreads(int threads) { m_numThreads = threads; }

    enum class Symmetry { Symmetric, General };
    /** @param A  symmetric: only its symmetric part counts
    @param scale  of the speeds: x = scale·(unknowns of order 1); zero where they are held **/
    void factor(const BlockMatrix<Scalar>& A, const Eigen::VectorXd& scale, Symmetry symmetry);

    /** In place: unknowns for right-hand sides, speeds first, both scaled. **/
    void solveScaled(Vector& y) { solveScaled(y.data(), 1); }
    /** In place. **/
    void solve(Vector& f, Vector& g);
    /** In place, for forces along the joints alone: x of each column. **/
    void solveEach(Matrix& F);
    /** Takes from each column of X what of it opens the joints. @pre real **/
    void close(Matrix& X);
    /** Of the rows of G: λ = scale·(unknowns of order 1). **/
    const Eigen::VectorXd& getRowScale() const { return m_rowScale; }

    /** How many more negative eigenvalues it has than multipliers: those of A along the motions
    that G leaves free. @pre factor(), symmetric and real **/
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
        Eigen::MatrixXd shapes;    ///< scaled; nothing if modes are as they are
        Eigen::MatrixXd U, R;      ///< shapes = U R
        Vector inverse;            ///< Λ⁻¹
        Matrix inverseU, weights;  ///< Λ⁻¹U, T
        int numNegative = 0;       ///< of what went before
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

/** x with A x = b by GMRES, in as many steps as it takes to leave 1e-11 of b, at most.
@param precondition  x ≈ A⁻¹b **/
Eigen::VectorXd solveByGmres(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& multiply,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& precondition,
    const Eigen::VectorXd& b, int maxSteps);

}  // namespace simflex
