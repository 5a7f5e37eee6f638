#pragma once
/** @file
Tangent matrices in blocks (private header). The residual of a block depends on where the block and
its neighbours are: those that a joint or force element joins it to. Blocks without a common
neighbour are displaced together, so that all of ∂r/∂q·N takes as many evaluations as for a few
blocks, however many there are. **/

#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

struct BlockGraph {
    enum class Links {
        OfJoints,   ///< and force elements; all blocks if there are forces or constraints of
                    ///< Simbody's
        Everywhere  ///< between all blocks
    };
    BlockGraph(const Evaluation& equations, Links links);

    std::vector<int> firstU, sizes;            ///< of blocks
    std::vector<std::vector<int>> neighbours;  ///< of each block, itself among them, ascending
    std::vector<std::vector<int>> groups;      ///< of blocks without a common neighbour
};

/** A square matrix with a block for each pair of neighbours. **/
template <class Scalar>
struct BlockMatrix {
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

    explicit BlockMatrix(const BlockGraph& blockGraph) : graph(&blockGraph) {
        for (size_t b = 0; b < graph->sizes.size(); ++b) {
            columns.emplace_back();
            for (const int row : graph->neighbours[b])
                columns.back().push_back(Matrix::Zero(graph->sizes[size_t(row)], graph->sizes[b]));
        }
    }
    Vector multiply(const Vector& x) const;
    Vector getDiagonal() const;
    BlockMatrix transpose() const;
    /** The largest entry of scale·(A − Aᵀ)·scale. **/
    double findSkew(const Eigen::VectorXd& scale) const;

    const BlockGraph* graph;
    std::vector<std::vector<Matrix>> columns;  ///< of a block, for each of its neighbours
};

/** ∂r/∂δ of the free speeds as differentiateByQ() has it. **/
BlockMatrix<double> differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph, double t,
    const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& r)>& evaluate);

/** ∂r/∂u at a point at rest, zero in columns of prescribed speeds.
@param observer  called before every evaluation **/
BlockMatrix<double> calcDampingBlocks(Evaluation& equations, const CoordinateScales& scales,
                                      const BlockGraph& graph, const SolutionPoint& point,
                                      const std::function<void()>& observer);

/** Mass matrix and constraint Jacobian by blocks, at the last realize(). **/
struct BlockMass {
    explicit BlockMass(Evaluation& equations);

    Eigen::VectorXd multiply(const Eigen::VectorXd& x) const;    ///< M x
    Eigen::VectorXd multiplyG(const Eigen::VectorXd& x) const;   ///< G x
    Eigen::VectorXd multiplyGt(const Eigen::VectorXd& y) const;  ///< Gᵀy
    Eigen::VectorXd getDiagonal() const;

    int numMultipliers;
    std::vector<int> firstU;
    std::vector<Eigen::MatrixXd> M;      ///< n×n
    std::vector<Eigen::MatrixXd> Gt;     ///< n×columns
    std::vector<std::vector<int>> rows;  ///< of the columns, ascending
};

}  // namespace simflex
