#pragma once
/** @file
Solves tangent equations by blocks (private header),

    [ A   Gᵀ ] [x]   [f]        A = K + σM, or −ω²M + iωD + K
    [ G   0  ] [λ] = [g]

multifrontally: the speeds of a block, then the multipliers of its joints as soon as the blocks on
both sides are gone. Rows of G get a compliance of 1e-10, in scaled equations, so that redundant
ones do no harm.

    TangentElimination<double> elimination(graph, mass);
    elimination.factor(A, scale);
    elimination.solve(f, g);             // in place: x and λ  **/

#include "simflex/solver/elimination/FrontSolver.h"
#include "simflex/solver/equilibrium/BlockTangent.h"

namespace simflex {

template <class Scalar>
class TangentElimination {
public:
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

    /** @param mass  its G; both must stay. **/
    TangentElimination(const BlockGraph& graph, const BlockMass& mass);

    enum class Symmetry { Symmetric, General };
    /** @param A  symmetric: only its symmetric part counts
    @param scale  of the speeds: x = scale·(unknowns of order 1); zero where they are held **/
    void factor(const BlockMatrix<Scalar>& A, const Eigen::VectorXd& scale, Symmetry symmetry);

    /** In place: unknowns for right-hand sides, speeds first, both scaled. **/
    void solveScaled(Vector& y);
    /** In place. **/
    void solve(Vector& f, Vector& g);
    /** Of the rows of G: λ = scale·(unknowns of order 1). **/
    const Eigen::VectorXd& getRowScale() const { return m_rowScale; }

    /** How many more negative eigenvalues it has than multipliers: those of A along the motions
    that G leaves free. @pre factor(), symmetric and real **/
    int countNegative() const;

private:
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    /** Rows of G that act on the same blocks, in one of these. **/
    struct Side {
        int block;
        std::vector<int> columns;  ///< of the block's Gᵀ
    };
    CliquePattern makePattern();

    const BlockGraph& m_graph;
    const BlockMass& m_mass;
    int m_numSpeeds;
    std::vector<std::array<int, 3>> m_pairs;  ///< block column, place among its neighbours, row
    std::vector<Side> m_sides;
    std::vector<Matrix> m_values;  ///< of cliques: pairs, sides, multipliers
    FrontSolver<Scalar> m_fronts;
    Eigen::VectorXd m_scale, m_rowScale;
};

template <>
int TangentElimination<double>::countNegative() const;

/** x with A x = b by GMRES, in as many steps as it takes to leave 1e-11 of b, at most.
@param precondition  x ≈ A⁻¹b **/
Eigen::VectorXd solveByGmres(
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& multiply,
    const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& precondition,
    const Eigen::VectorXd& b, int maxSteps);

}  // namespace simflex
