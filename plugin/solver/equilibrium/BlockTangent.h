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

struct BlockMass;

/** Modes of a block, its last coordinates, that act on each other and on the rest through few
shapes W, but for a diagonal: the block has coordinates (its first ones, Wᵀξ) instead. **/
template <class Scalar>
struct BlockModes {
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1> diagonal;  ///< of all modes; empty: as they are
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
    using Modes = std::vector<BlockModes<Scalar>>;  ///< by block; none at all: as they are

    /** Zero. **/
    explicit BlockMatrix(const BlockGraph& graph, Modes modes = {});

    Vector multiply(const Vector& x) const;
    Vector getDiagonal() const;
    BlockMatrix transpose() const;
    /** The largest entry of scale·(A − Aᵀ)·scale; more, where there are shapes. **/
    double findSkew(const Eigen::VectorXd& scale) const;
    /** Of a block's coordinates in `columns`: what entries of scale·A·scale are at most. **/
    Eigen::VectorXd calcCoordinateScale(const Eigen::VectorXd& scale, size_t block) const;
    /** A block by speeds: that of a column's k-th neighbour. **/
    Matrix expand(size_t column, size_t k) const;
    /** The same with all modes as they are. **/
    BlockMatrix expandModes() const;
    void addMass(const BlockMass& mass, Scalar factor);
    /** @pre neither has shapes, and both have this graph **/
    void add(const BlockMatrix& other, Scalar factor);
    /** The largest entry of scale·A·scale. @pre no shapes **/
    double findLargest(const Eigen::VectorXd& scale) const;

    bool hasShapes(size_t block) const {
        return block < modes.size() && modes[block].diagonal.size() > 0;
    }
    /** Coordinates of a block in `columns`, and how many of them are its first ones. **/
    int countCoordinates(size_t block) const {
        return countFirst(block) + (hasShapes(block) ? int(modes[block].shapes.cols()) : 0);
    }
    int countFirst(size_t block) const {
        return graph->sizes[block] - (hasShapes(block) ? int(modes[block].diagonal.size()) : 0);
    }
    Matrix& at(int row, int column);

    const BlockGraph* graph;
    Modes modes;
    std::vector<std::vector<Matrix>> columns;  ///< of a block, for each of its neighbours
};

/** ∂r/∂δ of the free speeds as differentiateByQ() has it.
@param firstBlock  columns of the blocks before are left zero **/
BlockMatrix<double> differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph, double t,
    const std::vector<double>& q, const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& r)>& evaluate,
    int firstBlock = 0, KinkedSpeeds* kinks = nullptr, const Eigen::VectorXd& terms = {});

/** ∂r/∂u at a point, by differences of all of it.
@param observer  called before every evaluation of r **/
BlockMatrix<double> differentiateByU(Evaluation& equations, const CoordinateScales& scales,
                                     const BlockGraph& graph, const SolutionPoint& point,
                                     const std::function<void()>& observer,
                                     KinkedSpeeds* kinks = nullptr,
                                     const Eigen::VectorXd& terms = {});

/** The same; at rest, u = u̇ = 0, what flexible bodies' coordinates change is found where they act,
in the frames of joints and force elements, whatever the number of modes, and in loads of their own.
Rigid trees, and all where Simbody has a say, by differences of r.
@param mass  at the point **/
BlockMatrix<double> calcStiffness(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph,
    const BlockMass& mass, const SolutionPoint& point,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& r)>& evaluate,
    KinkedSpeeds* kinks = nullptr);

/** ∂r/∂u at a point, zero in columns of prescribed speeds: of modes by themselves, and what force
elements do in their frames; where something moves, Simbody has a say, or friction, by differences
of r.
@param mass  at the point
@param observer  called before every evaluation of r **/
BlockMatrix<double> calcDampingBlocks(Evaluation& equations, const CoordinateScales& scales,
                                      const BlockGraph& graph, const BlockMass& mass,
                                      const SolutionPoint& point,
                                      const std::function<void()>& observer,
                                      KinkedSpeeds* kinks = nullptr);

/** A force element whose force has no slope where the blocks were realized last. **/
struct KinkedElement {
    std::string name;      ///< "force 'stop'"
    bool isForce;          ///< by a displacement or speed; else a turning, or a torque
    double before, after;  ///< slopes on both sides
    bool isJump;
};
/** Those along positions, or along speeds. **/
std::vector<KinkedElement> listKinkedElements(Evaluation& equations, const CoordinateScales& scales,
                                              MotionLevel level);
/** Why forces cannot be linearised where the blocks were realized last, and what helps. **/
std::string describeKinks(Evaluation& equations, const CoordinateScales& scales,
                          const KinkedSpeeds& kinks);

/** Of one block: an arrow, whose modes have unit mass or nearly and turn with the body, or full.
 * **/
struct BodyMass {
    Eigen::MatrixXd head;      ///< 6×6 of an arrow, n×n
    Eigen::MatrixXd coupling;  ///< f×3: of modes with the body's turning
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
