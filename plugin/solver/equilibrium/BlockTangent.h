#pragma once
/** @file
Tangent matrices in blocks (private header). The residual of a block depends on the positions of the
block and its neighbours, to which joints or force elements connect it. Blocks without a common
neighbour are displaced together, so that ∂r/∂q·N takes as many evaluations as for a few blocks,
whatever their number. **/

#include "simflex/solver/equilibrium/TangentMatrices.h"

namespace simflex {

struct BlockGraph {
    enum class Links {
        OfJoints,   ///< by joints and force elements; between all blocks with Simbody's forces or
                    ///< constraints
        Everywhere  ///< between all blocks
    };
    BlockGraph(const Evaluation& equations, Links links);

    std::vector<int> firstU, sizes;            ///< of blocks
    std::vector<std::vector<int>> neighbours;  ///< of each block, including itself, ascending
    std::vector<std::vector<int>> groups;      ///< blocks without a common neighbour
};

struct BlockMass;

/** Modes of a block, its last coordinates, that are coupled only through a few shapes W, apart from
a diagonal: the block then has coordinates (first ones, Wᵀξ). **/
template <class Scalar>
struct BlockModes {
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1> diagonal;  ///< of all modes; empty: no shapes
    /** W, modes×shapes; the last three columns are those of the mass matrix. **/
    Eigen::MatrixXd shapes;
};

/** Skew part of a stiffness matrix of scaled rows and columns, BlockMatrix::findSkew(), above which
the forces have no potential. **/
constexpr double LargestSkewOfPotential = 1e-6;

/** A square matrix with a block for each pair of neighbours. **/
template <class Scalar>
struct BlockMatrix {
    using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
    using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
    using Modes = std::vector<BlockModes<Scalar>>;  ///< by block; empty: no shapes

    /** Zero. **/
    explicit BlockMatrix(const BlockGraph& graph, Modes modes = {});

    Vector multiply(const Vector& x) const;
    Vector getDiagonal() const;
    BlockMatrix transpose() const;
    /** The largest entry of scale·(A − Aᵀ)·scale; an upper bound if there are shapes. **/
    double findSkew(const Eigen::VectorXd& scale) const;
    /** Bounds of the entries of scale·A·scale for a block's coordinates in `columns`. **/
    Eigen::VectorXd calcCoordinateScale(const Eigen::VectorXd& scale, size_t block) const;
    /** Block of a column's k-th neighbour, in terms of speeds. **/
    Matrix expand(size_t column, size_t k) const;
    /** The same matrix without shapes. **/
    BlockMatrix expandModes() const;
    void addMass(const BlockMass& mass, Scalar factor);
    /** @pre neither has shapes, and both have this graph **/
    void add(const BlockMatrix& other, Scalar factor);
    /** The largest entry of scale·A·scale. @pre no shapes **/
    double findLargest(const Eigen::VectorXd& scale) const;

    bool hasShapes(size_t block) const {
        return block < modes.size() && modes[block].diagonal.size() > 0;
    }
    /** Number of coordinates of a block in `columns`, and of its first ones. **/
    int countCoordinates(size_t block) const {
        return countFirst(block) + (hasShapes(block) ? int(modes[block].shapes.cols()) : 0);
    }
    int countFirst(size_t block) const {
        return graph->sizes[block] - (hasShapes(block) ? int(modes[block].diagonal.size()) : 0);
    }
    Matrix& at(int row, int column);

    const BlockGraph* graph;
    Modes modes;
    std::vector<std::vector<Matrix>> columns;  ///< by block, for each of its neighbours
};

/** ∂r/∂δ of the free speeds, as differentiateByQ() computes it.
@param firstBlock  columns of earlier blocks are left zero **/
BlockMatrix<double> differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph, double t,
    const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& r)>& evaluate,
    int firstBlock = 0, KinkedSpeeds* kinks = nullptr, const Eigen::VectorXd& terms = {});

/** ∂r/∂u at a point, by differences throughout.
@param observer  called before every evaluation of r **/
BlockMatrix<double> differentiateByU(Evaluation& equations, const CoordinateScales& scales,
                                     const BlockGraph& graph, const SolutionPoint& point,
                                     const std::function<void()>& observer,
                                     KinkedSpeeds* kinks = nullptr,
                                     const Eigen::VectorXd& terms = {});

/** The same; at rest, u = u̇ = 0, derivatives with respect to coordinates of flexible bodies are
formed in the frames of joints and force elements, whatever the number of modes, and for the body's
own loads. Rigid trees, and everything in systems evaluated by Simbody, by differences of r.
@param mass  at the point **/
BlockMatrix<double> calcStiffness(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph,
    const BlockMass& mass, const SolutionPoint& point,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& r)>& evaluate,
    KinkedSpeeds* kinks = nullptr);

/** ∂r/∂u at a point, zero in columns of prescribed speeds: modal damping, and force elements in
their frames; by differences of r for systems that move, are evaluated by Simbody, or have friction.
@param mass  at the point
@param observer  called before every evaluation of r **/
BlockMatrix<double> calcDampingBlocks(Evaluation& equations, const CoordinateScales& scales,
                                      const BlockGraph& graph, const BlockMass& mass,
                                      const SolutionPoint& point,
                                      const std::function<void()>& observer,
                                      KinkedSpeeds* kinks = nullptr);

/** A force element without a derivative where the blocks were last realized. **/
struct KinkedElement {
    std::string name;      ///< "force 'stop'"
    bool isForce;          ///< force by displacement or speed; else by rotation, or a torque
    double before, after;  ///< slopes on either side
    bool isJump;
};
/** Lists those with respect to positions, or to speeds. **/
std::vector<KinkedElement> listKinkedElements(Evaluation& equations, const CoordinateScales& scales,
                                              MotionLevel level);
/** Why forces cannot be linearised where the blocks were last realized, and a remedy. **/
std::string describeKinks(Evaluation& equations, const CoordinateScales& scales,
                          const KinkedSpeeds& kinks);

/** Mass matrix of one block: an arrow, with modes of nearly unit mass coupled to the rotation, or a
full matrix. **/
struct BodyMass {
    Eigen::MatrixXd head;      ///< 6×6 of an arrow, else n×n
    Eigen::MatrixXd coupling;  ///< f×3: modes with the body's rotation
    Eigen::VectorXd tail;      ///< f

    Eigen::Index size() const { return head.rows() + tail.size(); }
    /** y += M x. **/
    void addProduct(const Eigen::Ref<const Eigen::VectorXd>& x,
                    Eigen::Ref<Eigen::VectorXd> y) const;
    Eigen::MatrixXd expand() const;
};

/** Mass matrix and constraint Jacobian by blocks, at the last realize(). **/
struct BlockMass {
    explicit BlockMass(Evaluation& equations);

    Eigen::VectorXd multiply(const Eigen::VectorXd& x) const;    ///< M x
    Eigen::VectorXd multiplyG(const Eigen::VectorXd& x) const;   ///< G x
    Eigen::VectorXd multiplyGt(const Eigen::VectorXd& y) const;  ///< Gᵀy
    Eigen::VectorXd getDiagonal() const;

    int numMultipliers;
    std::vector<int> firstU;
    std::vector<BodyMass> M;
    std::vector<Eigen::MatrixXd> Gt;     ///< n×columns
    std::vector<std::vector<int>> rows;  ///< of the columns, ascending
};

}  // namespace simflex
