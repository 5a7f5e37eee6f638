#include "simflex/solver/equilibrium/BlockTangent.h"

#include <algorithm>
#include <numeric>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/FlexibleBlock.h"

namespace simflex {

using Eigen::MatrixXd;
using Eigen::VectorXd;

BlockGraph::BlockGraph(const Evaluation& equations, Links links) {
    const Topology& topology = equations.getTopology();
    const int count = topology.numBlocks();
    for (int b = 0; b < count; ++b) {
        firstU.push_back(equations.getBlock(b).firstU);
        sizes.push_back(equations.getBlock(b).numU);
        neighbours.push_back({b});
    }
    const auto join = [&](const std::vector<int>& blocks) {
        for (const int a : blocks)
            for (const int b : blocks)
                if (a >= 0 && b >= 0 && a != b) neighbours[size_t(a)].push_back(b);
    };
    const auto joinFrames = [&](const std::vector<FrameRef>& frames) {
        std::vector<int> blocks;
        for (const FrameRef& frame : frames) blocks.push_back(frame.block);
        join(blocks);
    };
    if (links == Links::Everywhere || topology.hasSimbodyForces() ||
        !topology.simbodyRows.empty()) {
        std::vector<int> all(static_cast<size_t>(count));
        std::iota(all.begin(), all.end(), 0);
        join(all);
    }
    for (const Topology::Joint& joint : topology.joints) joinFrames(joint.sides);
    for (const Topology::Element& element : topology.elements) joinFrames(element.frames);
    for (std::vector<int>& list : neighbours) {
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
    }
    // Find the first group in which no block shares a neighbour with this one.
    std::vector<std::vector<char>> isTaken;
    for (int b = 0; b < count; ++b) {
        const auto clashes = [&](const std::vector<char>& taken) {
            return std::any_of(neighbours[size_t(b)].begin(), neighbours[size_t(b)].end(),
                               [&](int row) { return taken[size_t(row)] != 0; });
        };
        size_t group = 0;
        while (group < groups.size() && clashes(isTaken[group])) ++group;
        if (group == groups.size()) {
            groups.emplace_back();
            isTaken.emplace_back(size_t(count), char(0));
        }
        groups[group].push_back(b);
        for (const int row : neighbours[size_t(b)]) isTaken[group][size_t(row)] = 1;
    }
}

template <class Scalar>
BlockMatrix<Scalar>::BlockMatrix(const BlockGraph& blockGraph, Modes blockModes)
    : graph(&blockGraph), modes(std::move(blockModes)) {
    for (size_t b = 0; b < graph->sizes.size(); ++b) {
        columns.emplace_back();
        for (const int row : graph->neighbours[b])
            columns.back().push_back(
                Matrix::Zero(countCoordinates(size_t(row)), countCoordinates(b)));
    }
}

template <class Scalar>
auto BlockMatrix<Scalar>::at(int row, int column) -> Matrix& {
    const std::vector<int>& list = graph->neighbours[size_t(column)];
    return columns[size_t(column)]
                  [size_t(std::lower_bound(list.begin(), list.end(), row) - list.begin())];
}

template <class Scalar>
auto BlockMatrix<Scalar>::multiply(const Vector& x) const -> Vector {
    Vector y = Vector::Zero(x.size());
    std::vector<Vector> products;
    for (size_t b = 0; b < columns.size(); ++b)
        products.push_back(Vector::Zero(countCoordinates(b)));
    Vector own;
    for (size_t b = 0; b < columns.size(); ++b) {
        const Eigen::Index first = countFirst(b), rest = graph->sizes[b] - first;
        own.resize(products[b].size());
        own.head(first) = x.segment(graph->firstU[b], first);
        if (rest > 0)
            own.tail(own.size() - first).noalias() =
                modes[b].shapes.transpose() * x.segment(graph->firstU[b] + first, rest);
        for (size_t k = 0; k < columns[b].size(); ++k)
            products[size_t(graph->neighbours[b][k])].noalias() += columns[b][k] * own;
    }
    for (size_t b = 0; b < columns.size(); ++b) {
        const Eigen::Index first = countFirst(b), rest = graph->sizes[b] - first;
        y.segment(graph->firstU[b], first) = products[b].head(first);
        if (rest > 0)
            y.segment(graph->firstU[b] + first, rest) =
                modes[b].diagonal.cwiseProduct(x.segment(graph->firstU[b] + first, rest)) +
                modes[b].shapes * products[b].tail(products[b].size() - first);
    }
    return y;
}

template <class Scalar>
auto BlockMatrix<Scalar>::getDiagonal() const -> Vector {
    Vector diagonal(graph->firstU.empty() ? 0 : graph->firstU.back() + graph->sizes.back());
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) {
            if (graph->neighbours[b][k] != int(b)) continue;
            const Matrix& own = columns[b][k];
            const Eigen::Index first = countFirst(b), rest = graph->sizes[b] - first,
                               count = own.cols() - first;
            diagonal.segment(graph->firstU[b], first) = own.diagonal().head(first);
            if (rest > 0)
                diagonal.segment(graph->firstU[b] + first, rest) =
                    modes[b].diagonal + (modes[b].shapes * own.bottomRightCorner(count, count))
                                            .cwiseProduct(modes[b].shapes)
                                            .rowwise()
                                            .sum();
        }
    return diagonal;
}

template <class Scalar>
BlockMatrix<Scalar> BlockMatrix<Scalar>::transpose() const {
    BlockMatrix result(*graph, modes);
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k)
            result.at(int(b), graph->neighbours[b][k]) = columns[b][k].transpose();
    return result;
}

template <class Scalar>
VectorXd BlockMatrix<Scalar>::calcCoordinateScale(const VectorXd& scale, size_t b) const {
    const VectorXd own = scale.segment(graph->firstU[b], graph->sizes[b]);
    if (!hasShapes(b)) return own;
    VectorXd result(countCoordinates(b));
    result << own.head(countFirst(b)),
        (own.tail(modes[b].shapes.rows()).asDiagonal() * modes[b].shapes)
            .colwise()
            .norm()
            .transpose();
    return result;
}

template <class Scalar>
double BlockMatrix<Scalar>::findSkew(const VectorXd& scale) const {
    double skew = 0;
    const BlockMatrix other = transpose();
    for (size_t b = 0; b < columns.size(); ++b) {
        const VectorXd right = calcCoordinateScale(scale, b);
        for (size_t k = 0; k < columns[b].size(); ++k) {
            const Matrix difference = columns[b][k] - other.columns[b][k];
            if (difference.size() == 0 || !(difference.cwiseAbs().maxCoeff() > 0)) continue;
            const Matrix scaled =
                calcCoordinateScale(scale, size_t(graph->neighbours[b][k])).asDiagonal() *
                difference * right.asDiagonal();
            skew = std::max(skew, double(scaled.cwiseAbs().maxCoeff()));
        }
    }
    return skew;
}

template <class Scalar>
auto BlockMatrix<Scalar>::expand(size_t b, size_t k) const -> Matrix {
    const size_t row = size_t(graph->neighbours[b][k]);
    const Matrix& own = columns[b][k];
    if (!hasShapes(row) && !hasShapes(b)) return own;
    const auto widen = [&](size_t of, const Matrix& rows) {
        if (!hasShapes(of)) return rows;
        const Eigen::Index first = countFirst(of), count = modes[of].shapes.cols();
        Matrix wide(graph->sizes[of], rows.cols());
        wide.topRows(first) = rows.topRows(first);
        wide.bottomRows(wide.rows() - first).noalias() = modes[of].shapes * rows.bottomRows(count);
        return wide;
    };
    Matrix full = widen(b, widen(row, own).transpose()).transpose();
    if (row == b) full.diagonal().tail(modes[b].diagonal.size()) += modes[b].diagonal;
    return full;
}

template <class Scalar>
BlockMatrix<Scalar> BlockMatrix<Scalar>::expandModes() const {
    BlockMatrix result(*graph);
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) result.columns[b][k] = expand(b, k);
    return result;
}

template <class Scalar>
void BlockMatrix<Scalar>::addMass(const BlockMass& mass, Scalar factor) {
    for (size_t b = 0; b < columns.size(); ++b) {
        Matrix& own = at(int(b), int(b));
        const BodyMass& body = mass.M[b];
        if (!hasShapes(b)) {
            const Eigen::Index head = body.head.rows(), tail = body.tail.size();
            own.topLeftCorner(head, head) += factor * body.head;
            if (tail == 0) continue;
            own.diagonal().tail(tail) += factor * body.tail;
            own.bottomLeftCorner(tail, head).leftCols(3) += factor * body.coupling;
            own.topRightCorner(head, tail).topRows(3) += factor * body.coupling.transpose();
            continue;
        }
        const Eigen::Index first = countFirst(b), last = own.cols() - 3;
        own.topLeftCorner(first, first) += factor * body.head;
        for (Eigen::Index a = 0; a < 3; ++a) {
            own(last + a, a) += factor;
            own(a, last + a) += factor;
        }
        modes[b].diagonal.array() += factor;
    }
}

template <class Scalar>
void BlockMatrix<Scalar>::add(const BlockMatrix& other, Scalar factor) {
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k)
            columns[b][k] += factor * other.columns[b][k];
}

template <class Scalar>
double BlockMatrix<Scalar>::findLargest(const VectorXd& scale) const {
    double largest = 0;
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) {
            const size_t row = size_t(graph->neighbours[b][k]);
            for (Eigen::Index j = 0; j < columns[b][k].cols(); ++j)
                for (Eigen::Index i = 0; i < columns[b][k].rows(); ++i)
                    largest = std::max(largest, std::abs(columns[b][k](i, j)) *
                                                    scale[graph->firstU[row] + i] *
                                                    scale[graph->firstU[b] + j]);
        }
    return largest;
}

template struct BlockMatrix<double>;
template struct BlockMatrix<std::complex<double>>;

namespace {

/** Largest number of shapes, relative to a block's modes, for which shape coordinates pay off. **/
constexpr double ShareOfShapes = 0.7;

/** All frames of a block, without duplicates. **/
std::vector<const FrameShapes*> listShapes(const FlexibleBlock& block) {
    std::vector<const FrameShapes*> shapes;
    for (int frame = 0; frame < int(block.frames.size()); ++frame)
        if (std::find(shapes.begin(), shapes.end(), block.getShapes(frame)) == shapes.end())
            shapes.push_back(block.getShapes(frame));
    return shapes;
}

/** Shape coordinates of blocks with many more modes than shapes. **/
BlockMatrix<double>::Modes listModes(Evaluation& equations, const BlockMass& mass) {
    const Topology& topology = equations.getTopology();
    BlockMatrix<double>::Modes all(size_t(topology.numBlocks()));
    for (int b = 0; b < topology.numFlexible; ++b) {
        const FlexibleBlock& block = *equations.getBlocks().flexible[size_t(b)];
        const auto firstHeld = topology.isPrescribed.begin() + block.firstU + 6;
        const int n = block.numU - 6;
        if (block.hasCurvedFrames() || block.hasLoads() ||
            std::count(firstHeld, firstHeld + n, char(0)) < n)
            continue;
        const std::vector<const FrameShapes*> shapes = listShapes(block);
        const Eigen::Index count = Eigen::Index(6 * shapes.size());
        if (count + 3 > ShareOfShapes * n) continue;
        BlockModes<double>& modes = all[size_t(b)];
        modes.diagonal = block.getModel().omegaSquared;
        modes.shapes.resize(n, count + 3);
        for (size_t k = 0; k < shapes.size(); ++k)
            modes.shapes.middleCols(Eigen::Index(6 * k), 6) =
                Eigen::Map<const MatrixXd>(shapes[k]->columns.data(), n, 6);
        modes.shapes.rightCols(3) = mass.M[size_t(b)].coupling;
    }
    return all;
}

/** Effect of a unit of each force and torque on a frame, in Ground, on its block: n×6. **/
MatrixXd calcFrameRows(const Evaluation& equations, int inBlock, int frame,
                       const BlockMatrix<double>& of) {
    const size_t b = size_t(inBlock);
    MatrixXd rows = MatrixXd::Zero(of.countCoordinates(b), 6);
    for (int i = 0; i < 6; ++i) {
        SimTK::SpatialVec unit(SimTK::Vec3(0), SimTK::Vec3(0));
        unit[i / 3][i % 3] = 1;
        if (!of.hasShapes(b)) {
            equations.getBlock(inBlock).addInRow(frame, unit, rows.col(i).data());
            continue;
        }
        const FlexibleBlock& block = *equations.getBlocks().flexible[b];
        const std::vector<const FrameShapes*> list = listShapes(block);
        const auto place =
            std::find(list.begin(), list.end(), block.getShapes(frame)) - list.begin();
        double coefficients[6];
        block.calcColumn(frame, unit, rows.col(i).data(), coefficients);
        std::copy_n(coefficients, 6, rows.col(i).data() + 6 + 6 * place);
    }
    return rows;
}

/** Tangent of the forces on some frames with respect to displacements of their flexible bodies.
Such a frame moves by the body's rotation and position and two sums of its shapes, twelve
coordinates y; its part of r is Yᵀρ, and y = Yδ. A frame on a rigid body rotates and moves in
Ground, and ρ is the force there. **/
class FrameTangent {
public:
    using Forces = SimTK::Array_<SimTK::SpatialVec>;
    /** Writes the terms of each frame in r: Gᵀλ, or the negative of an applied force. **/
    using Law = std::function<void(const SimTK::Array_<FrameMotion>& motions, Forces& forces)>;

    FrameTangent(const Evaluation& equations, const std::vector<FrameRef>& frames, Law law)
        : m_law(std::move(law)) {
        for (const FrameRef& frame : frames) {
            Side side;
            side.block = frame.block;
            side.frame = frame.frame;
            side.firstRow = m_numRows;
            if (frame.block >= 0 && frame.block < equations.getTopology().numFlexible) {
                side.flexible = equations.getBlocks().flexible[size_t(frame.block)];
                side.firstColumn = m_numColumns;
                m_numColumns += 12;
                m_numRows += 12;
            } else {
                side.firstColumn = m_numColumns;
                if (frame.block >= 0) m_numColumns += 6;
                m_numRows += 6;
            }
            m_sides.push_back(side);
            m_motions.push_back(equations.getBlocks().motionOf(frame));
        }
        m_rest = m_motions;
        m_forces.resize(unsigned(m_sides.size()));
    }

    void differentiate(const CoordinateScales& scales, bool canHaveKinks) {
        std::vector<double> steps(size_t(m_numColumns), CoordinateScales::StepFraction);
        for (const Side& side : m_sides) {
            if (side.block < 0) continue;
            for (int i = 0; i < (side.flexible ? 6 : 3); ++i)
                steps[size_t(side.firstColumn + 3 + i)] *= scales.lengths[size_t(side.block)];
        }
        std::vector<double> y(steps.size(), 0);
        m_middle.resize(m_numRows);
        evaluate(y, m_middle);
        m_derivative = MatrixXd::Zero(m_numRows, m_numColumns);
        if (canHaveKinks) {
            std::vector<std::vector<DifferenceColumn>> groups;
            for (int j = 0; j < m_numColumns; ++j)
                groups.push_back(
                    {{j,
                      {{0, m_numRows}},
                      [this, j](const VectorXd& slopes, const std::vector<Kink>& kinks) {
                          m_derivative.col(j) = slopes;
                          for (const Kink& kink : kinks) m_kinks.emplace_back(j, kink);
                      }}});
            simflex::differentiate(
                [this](const std::vector<double>& of, VectorXd& rho) { evaluate(of, rho); }, steps,
                m_middle, groups, {}, scales.originDistance);
            return;
        }
        VectorXd rho(m_numRows);
        for (int j = 0; j < m_numColumns; ++j) {
            const double h = steps[size_t(j)];
            for (int k = 0; k < 4; ++k) {
                y[size_t(j)] = DifferencePlaces[k] * h;
                evaluate(y, rho);
                m_derivative.col(j) += DifferenceWeights[k] / h * rho;
            }
            y[size_t(j)] = 0;
        }
    }

    /** Columns, and rows without a slope along them. **/
    const std::vector<std::pair<int, Kink>>& getKinks() const { return m_kinks; }
    /** Whether it is the force on a frame, as that is displaced. **/
    bool isForce(int column, int row) const {
        const auto isAlong = [](int first, bool isFlexible, int place) {
            return place >= first + 3 && place < first + (isFlexible ? 9 : 6);
        };
        bool moves = false, pushes = false;
        for (const Side& side : m_sides) {
            if (side.block < 0) continue;
            moves |= isAlong(side.firstColumn, side.flexible, column);
            pushes |= isAlong(side.firstRow, side.flexible, row);
        }
        return moves && pushes;
    }

    /** Adds the columns of one side's block, except those among rigid trees. **/
    void addInColumns(const Evaluation& equations, int column, BlockMatrix<double>& K) const {
        const Side& from = m_sides[size_t(column)];
        const MatrixXd right = calcCoordinates(equations, from, K);
        for (const Side& side : m_sides) {
            if (side.block < 0 || !(side.flexible || from.flexible)) continue;
            K.at(side.block, from.block).noalias() +=
                calcCoordinates(equations, side, K) *
                m_derivative.block(side.firstRow, from.firstColumn, side.flexible ? 12 : 6,
                                   right.cols()) *
                right.transpose();
        }
        const FrameShapes* curved =
            from.flexible ? from.flexible->findCurvature(from.frame) : nullptr;
        if (!curved) return;
        MatrixXd& own = K.at(from.block, from.block);
        const Eigen::Index n = curved->numModes();
        for (int a = 0; a < 6; ++a)
            own.bottomRightCorner(n, n) += m_middle[from.firstRow + 6 + a] *
                                           Shapes(curved->curvature.data() + a * n * n, n, n);
    }

    int getNumSides() const { return int(m_sides.size()); }
    /** −1: Ground. **/
    int getBlock(int side) const { return m_sides[size_t(side)].block; }

private:
    using Shapes = Eigen::Map<const MatrixXd>;  ///< n_f×6
    struct Side {
        const FlexibleBlock* flexible = nullptr;
        int block = -1, frame = -1, firstRow = 0, firstColumn = 0;
    };
    struct Moved {
        FlexibleFramePose pose;
        SimTK::Rotation R_GB;
    };

    /** Yᵀ in the coordinates that the block has in K. **/
    static MatrixXd calcCoordinates(const Evaluation& equations, const Side& side,
                                    const BlockMatrix<double>& K) {
        const size_t b = size_t(side.block);
        const int count = K.countCoordinates(b);
        if (!side.flexible) return calcFrameRows(equations, side.block, side.frame, K);
        MatrixXd Y = MatrixXd::Zero(count, 12);
        Y.topLeftCorner(6, 6).setIdentity();
        const FrameShapes* shapes = side.flexible->getShapes(side.frame);
        if (K.hasShapes(b)) {
            const std::vector<const FrameShapes*> list = listShapes(*side.flexible);
            const auto place = std::find(list.begin(), list.end(), shapes) - list.begin();
            Y.block(6 + 6 * place, 6, 6, 6).setIdentity();
        } else {
            Y.bottomRightCorner(count - 6, 6) = Shapes(shapes->columns.data(), count - 6, 6);
        }
        return Y;
    }

    void evaluate(const std::vector<double>& y, VectorXd& rho) {
        using SimTK::Vec3;
        m_moved.resize(m_sides.size());
        for (size_t k = 0; k < m_sides.size(); ++k) {
            const Side& side = m_sides[k];
            const double* own = y.data() + side.firstColumn;
            if (!side.flexible) {
                if (side.block < 0) continue;
                const SimTK::Transform& X = m_rest[unsigned(k)].X;
                m_motions[unsigned(k)].X =
                    SimTK::Transform(SimTK::Rotation(calcExponential(Vec3::getAs(own)) * X.R()),
                                     X.p() + Vec3::getAs(own + 3));
                continue;
            }
            const FlexibleFrame& frame = side.flexible->getFrame(side.frame);
            const FlexibleFramePose& pose = side.flexible->getPose(side.frame);
            const BodyFrame& body = side.flexible->getBody();
            Moved& moved = m_moved[k];
            moved.pose = calcFramePose(
                frame, FrameSums{pose.r - pose.rho - frame.shapes->s + Vec3::getAs(own + 6),
                                 pose.theta + Vec3::getAs(own + 9)});
            moved.R_GB = SimTK::Rotation(body.R_GB * calcExponential(Vec3::getAs(own)));
            FrameMotion& motion = m_motions[unsigned(k)];
            motion.X =
                SimTK::Transform(moved.R_GB * moved.pose.R_BA,
                                 body.p_GB + Vec3::getAs(own + 3) + moved.R_GB * moved.pose.r);
        }
        for (SimTK::SpatialVec& force : m_forces) force = SimTK::SpatialVec(Vec3(0), Vec3(0));
        m_law(m_motions, m_forces);
        for (size_t k = 0; k < m_sides.size(); ++k) {
            const SimTK::SpatialVec& force = m_forces[unsigned(k)];
            double* own = rho.data() + m_sides[k].firstRow;
            if (m_sides[k].flexible) {
                calcFrameForce(m_moved[k].pose, m_moved[k].R_GB, force, Vec3::updAs(own),
                               Vec3::updAs(own + 3), Vec3::updAs(own + 6), Vec3::updAs(own + 9));
            } else {
                Vec3::updAs(own) = force[0];
                Vec3::updAs(own + 3) = force[1];
            }
        }
    }

    Law m_law;
    std::vector<Side> m_sides;
    int m_numRows = 0, m_numColumns = 0;
    SimTK::Array_<FrameMotion> m_rest, m_motions;
    Forces m_forces;
    std::vector<Moved> m_moved;
    VectorXd m_middle;
    MatrixXd m_derivative;
    std::vector<std::pair<int, Kink>> m_kinks;
};

FrameTangent makeElementTangent(const Evaluation& equations, int e) {
    return FrameTangent(equations, equations.getTopology().elements[size_t(e)].frames,
                        [&loads = equations.getLoads(), e](
                            const SimTK::Array_<FrameMotion>& motions, FrameTangent::Forces& F) {
                            loads.calcForcesAt(e, motions, F);
                            for (SimTK::SpatialVec& force : F) force *= -1;
                        });
}

/** Tangents of joints and force elements where the equations were last realized. **/
std::vector<FrameTangent> listFrameTangents(Evaluation& equations,
                                            const std::vector<double>& lambda) {
    const Topology& topology = equations.getTopology();
    std::vector<FrameTangent> tangents;
    for (size_t k = 0; k < topology.joints.size(); ++k) {
        const Topology::Joint& joint = topology.joints[k];
        const int numRows = joint.numRows(), count = int(joint.sides.size());
        std::vector<SimTK::SpatialVec> D(size_t(numRows * count));
        tangents.emplace_back(
            equations, joint.sides,
            [&joint, &drive = equations.getJoints().getDrive(int(k)), numRows, D,
             frames = std::vector<const FrameMotion*>(), forces = &lambda[size_t(joint.firstRow)]](
                const SimTK::Array_<FrameMotion>& motions, FrameTangent::Forces& F) mutable {
                frames.clear();
                for (const FrameMotion& motion : motions) frames.push_back(&motion);
                joint.record->equations->calcJacobian(drive, frames.data(), D.data());
                for (size_t s = 0; s < frames.size(); ++s)
                    for (int row = 0; row < numRows; ++row)
                        F[unsigned(s)] += forces[row] * D[s * size_t(numRows) + size_t(row)];
            });
    }
    for (int e = 0; e < int(topology.elements.size()); ++e)
        tangents.push_back(makeElementTangent(equations, e));
    return tangents;
}

/** Clears rows and columns of held speeds; held modes have no shapes. **/
void clearHeld(const Topology& topology, BlockMatrix<double>& A) {
    const BlockGraph& graph = *A.graph;
    for (int b = 0; b < topology.numBlocks(); ++b)
        for (size_t k = 0; k < A.columns[size_t(b)].size(); ++k) {
            MatrixXd& part = A.columns[size_t(b)][k];
            const int row = graph.neighbours[size_t(b)][k];
            for (Eigen::Index i = 0; i < A.countFirst(size_t(row)); ++i)
                if (topology.isPrescribed[size_t(graph.firstU[size_t(row)] + i)])
                    part.row(i).setZero();
            for (Eigen::Index j = 0; j < A.countFirst(size_t(b)); ++j)
                if (topology.isPrescribed[size_t(graph.firstU[size_t(b)] + j)])
                    part.col(j).setZero();
        }
}

/** Forces of an element on all its frames by the six speeds of each frame. **/
class SpeedTangent {
public:
    SpeedTangent(const Evaluation& equations, int e, const CoordinateScales& scales) {
        const std::vector<FrameRef>& frames = equations.getTopology().elements[size_t(e)].frames;
        const int numFrames = int(frames.size());
        SimTK::Array_<FrameMotion> motions;
        for (const FrameRef& frame : frames)
            motions.push_back(equations.getBlocks().motionOf(frame));
        slopes = MatrixXd::Zero(6 * numFrames, 6 * numFrames);
        std::vector<double> steps(size_t(6 * numFrames), CoordinateScales::StepFraction);
        std::vector<std::vector<DifferenceColumn>> columns;
        for (int k = 0; k < 6 * numFrames; ++k) {
            const int block = frames[size_t(k / 6)].block;
            if (block < 0) continue;
            if (k % 6 >= 3) steps[size_t(k)] *= scales.lengths[size_t(block)];
            columns.push_back({{k,
                                {{0, 6 * numFrames}},
                                [this, k](const VectorXd& column, const std::vector<Kink>& found) {
                                    slopes.col(k) = column;
                                    for (const Kink& kink : found) kinks.emplace_back(k, kink);
                                }}});
        }
        LoadTerms::Forces forces;
        forces.resize(unsigned(numFrames));
        const auto evaluate = [&](const std::vector<double>& delta, VectorXd& f) {
            SimTK::Array_<FrameMotion> moved = motions;
            for (int k = 0; k < 6 * numFrames; ++k)
                moved[unsigned(k / 6)].V[k % 6 / 3][k % 3] += delta[size_t(k)];
            for (SimTK::SpatialVec& force : forces)
                force = SimTK::SpatialVec(SimTK::Vec3(0), SimTK::Vec3(0));
            equations.getLoads().calcForcesAt(e, moved, forces);
            f.resize(6 * numFrames);
            for (int k = 0; k < 6 * numFrames; ++k)
                f[k] = forces[unsigned(k / 6)][k % 6 / 3][k % 3];
        };
        VectorXd middle;
        evaluate(std::vector<double>(steps.size(), 0), middle);
        differentiate(evaluate, steps, middle, columns, {}, scales.originDistance);
    }

    MatrixXd slopes;
    std::vector<std::pair<int, Kink>> kinks;  ///< of columns
};

/** Adds the derivatives of a block's own loads; leaves the block at another position. **/
void differentiateLoads(Evaluation& equations, const CoordinateScales& scales, FlexibleBlock& block,
                        const SolutionPoint& point, MatrixXd& K) {
    std::vector<double> delta(size_t(block.numU), 0), moved;
    const double *q = point.q.data() + block.firstQ, *u = point.u.data() + block.firstU;
    const EvaluationContext& context = equations.getBlocks().context;
    VectorXd r(block.numU);
    for (int j = 0; j < block.numU; ++j) {
        const double h = scales.step[size_t(block.firstU + j)];
        for (int k = 0; k < 4; ++k) {
            delta[size_t(j)] = DifferencePlaces[k] * h;
            moved.assign(q, q + block.numQ);
            block.moveQ(context, delta.data(), moved.data());
            block.realize(context, moved.data(), u);
            r.setZero();
            block.subtractLoads(context, moved.data(), r.data());
            K.col(j) += DifferenceWeights[k] / h * r;
        }
        delta[size_t(j)] = 0;
    }
}

}  // namespace

BlockMatrix<double> calcStiffness(
    Evaluation& equations, const CoordinateScales& scales, const BlockGraph& graph,
    const BlockMass& mass, const SolutionPoint& point,
    const std::function<void(const std::vector<double>& q, VectorXd& r)>& evaluate,
    KinkedSpeeds* kinks) {
    const Topology& topology = equations.getTopology();
    const auto isZero = [](double value) { return value == 0; };
    if (topology.hasSimbodyForces() || !topology.simbodyRows.empty() ||
        !topology.frictions.empty() || !std::all_of(point.u.begin(), point.u.end(), isZero) ||
        !std::all_of(point.uDot.begin(), point.uDot.end(), isZero))
        return differentiateByQ(equations, scales, graph, point.t, point.q, point.u, evaluate, 0,
                                kinks,
                                calcInertiaChanges(equations, scales, point, mass.getDiagonal()));

    const int numFlexible = topology.numFlexible;
    BlockMatrix<double> K(graph, listModes(equations, mass));
    if (topology.numBlocks() > numFlexible) {
        const BlockMatrix<double> ofTrees = differentiateByQ(
            equations, scales, graph, point.t, point.q, point.u, evaluate, numFlexible, kinks);
        for (size_t b = size_t(numFlexible); b < K.columns.size(); ++b)
            for (size_t k = 0; k < K.columns[b].size(); ++k)
                if (graph.neighbours[b][k] >= numFlexible) K.columns[b][k] = ofTrees.columns[b][k];
    }
    equations.realize(point.t, point.q.data(), point.u.data());
    const int threads = equations.getBlocks().numThreads;
    std::vector<FrameTangent> tangents = listFrameTangents(equations, point.lambda);
    parallelFor(int(tangents.size()), threads, [&](int k) {
        tangents[size_t(k)].differentiate(scales, k >= int(topology.joints.size()));
    });
    if (kinks)
        for (const FrameTangent& tangent : tangents)
            for (int side = 0; side < tangent.getNumSides() && !tangent.getKinks().empty(); ++side)
                if (tangent.getBlock(side) >= 0 && tangent.getBlock(side) < numFlexible) {
                    kinks->byPosition.push_back(graph.firstU[size_t(tangent.getBlock(side))]);
                    break;
                }
    std::vector<std::vector<std::pair<int, int>>> sidesOf(size_t(topology.numBlocks()));
    for (int k = 0; k < int(tangents.size()); ++k)
        for (int side = 0; side < tangents[size_t(k)].getNumSides(); ++side) {
            const int b = tangents[size_t(k)].getBlock(side);
            if (b >= 0) sidesOf[size_t(b)].emplace_back(k, side);
        }
    parallelFor(topology.numBlocks(), threads, [&](int b) {
        for (const auto& [k, side] : sidesOf[size_t(b)])
            tangents[size_t(k)].addInColumns(equations, side, K);
    });
    for (int b = 0; b < numFlexible; ++b) {
        if (K.hasShapes(size_t(b))) continue;
        FlexibleBlock& block = *equations.getBlocks().flexible[size_t(b)];
        MatrixXd& own = K.at(b, b);
        own.diagonal().tail(block.numU - 6) += block.getModel().omegaSquared;
        if (block.hasLoads()) differentiateLoads(equations, scales, block, point, own);
    }
    clearHeld(topology, K);
    equations.realize(point.t, point.q.data(), point.u.data());
    return K;
}

BlockMatrix<double> calcDampingBlocks(Evaluation& equations, const CoordinateScales& scales,
                                      const BlockGraph& graph, const BlockMass& mass,
                                      const SolutionPoint& point,
                                      const std::function<void()>& observer, KinkedSpeeds* kinks) {
    const Topology& topology = equations.getTopology();
    if (topology.hasSimbodyForces() || !topology.simbodyRows.empty() ||
        !topology.frictions.empty() ||
        std::any_of(point.u.begin(), point.u.end(), [](double value) { return value != 0; }))
        return differentiateByU(equations, scales, graph, point, observer, kinks,
                                calcInertiaChanges(equations, scales, point, mass.getDiagonal()));

    if (observer) observer();
    equations.realize(point.t, point.q.data(), point.u.data());
    BlockMatrix<double>::Modes modes = listModes(equations, mass);
    for (int b = 0; b < topology.numFlexible; ++b) {
        const FlexibleBlock& block = *equations.getBlocks().flexible[size_t(b)];
        if (topology.guts->bodies()[size_t(b)].dampingCoupling.size() > 0)
            modes[size_t(b)] = {};
        else if (modes[size_t(b)].diagonal.size() > 0)
            modes[size_t(b)].diagonal = block.getDamping();
    }
    BlockMatrix<double> D(graph, std::move(modes));
    for (int b = 0; b < topology.numFlexible; ++b) {
        const FlexibleBlock& block = *equations.getBlocks().flexible[size_t(b)];
        const MatrixXd& coupling = topology.guts->bodies()[size_t(b)].dampingCoupling;
        const Eigen::Index n = block.numU - 6;
        MatrixXd& own = D.at(b, b);
        if (!D.hasShapes(size_t(b))) own.diagonal().tail(n) += block.getDamping();
        if (coupling.size() > 0 && n > 0) own.bottomRightCorner(n, n) += coupling;
    }
    // Forces on frames by their speeds.
    for (size_t e = 0; e < topology.elements.size(); ++e) {
        const std::vector<FrameRef>& frames = topology.elements[e].frames;
        const SpeedTangent tangent(equations, int(e), scales);
        if (kinks)
            for (const auto& [column, kink] : tangent.kinks)
                if (kink.isJump)
                    kinks->byJump.push_back(graph.firstU[size_t(frames[size_t(column / 6)].block)]);
        std::vector<MatrixXd> rows;
        for (const FrameRef& frame : frames)
            rows.push_back(frame.block < 0 ? MatrixXd()
                                           : calcFrameRows(equations, frame.block, frame.frame, D));
        for (size_t side = 0; side < frames.size(); ++side) {
            const int column = frames[side].block;
            if (column < 0) continue;
            for (size_t s = 0; s < frames.size(); ++s)
                if (frames[s].block >= 0)
                    D.at(frames[s].block, column).noalias() -=
                        rows[s] *
                        tangent.slopes.block(Eigen::Index(6 * s), Eigen::Index(6 * side), 6, 6) *
                        rows[side].transpose();
        }
    }
    clearHeld(topology, D);
    return D;
}

std::vector<KinkedElement> listKinkedElements(Evaluation& equations, const CoordinateScales& scales,
                                              MotionLevel level) {
    const Topology& topology = equations.getTopology();
    std::vector<KinkedElement> elements;
    for (int e = 0; e < int(topology.elements.size()); ++e) {
        KinkedElement own{topology.elements[size_t(e)].element->describe(), false, 0, 0, false};
        double largest = -1;
        // A force by a displacement is more informative than a torque by a rotation.
        const auto take = [&](const Kink& kink, bool isForce) {
            const double change = std::abs(kink.after - kink.before);
            own.isJump |= kink.isJump;
            if (own.isForce && !isForce) return;
            if (own.isForce == isForce && change <= largest) return;
            largest = change;
            own.isForce = isForce;
            own.before = std::abs(kink.before);
            own.after = std::abs(kink.after);
        };
        if (level == MotionLevel::Position) {
            FrameTangent tangent = makeElementTangent(equations, e);
            tangent.differentiate(scales, true);
            for (const auto& [column, kink] : tangent.getKinks())
                take(kink, tangent.isForce(column, kink.value));
        } else {
            const SpeedTangent tangent(equations, e, scales);
            for (const auto& [column, kink] : tangent.kinks)
                take(kink, column % 6 >= 3 && kink.value % 6 >= 3);
        }
        if (largest >= 0) elements.push_back(own);
    }
    return elements;
}

std::string describeKinks(Evaluation& equations, const CoordinateScales& scales,
                          const KinkedSpeeds& kinks) {
    const bool isOfPositions = !kinks.byPosition.empty();
    std::ostringstream text;
    bool isNamed = false;
    for (const KinkedElement& element : listKinkedElements(
             equations, scales, isOfPositions ? MotionLevel::Position : MotionLevel::Velocity)) {
        if (!isOfPositions && !element.isJump) continue;
        text << (isNamed ? ", " : "") << element.name;
        if (element.isForce && !element.isJump)
            text << " (" << writeGeneral(std::min(element.before, element.after), 4)
                 << " N/m one way, " << writeGeneral(std::max(element.before, element.after), 4)
                 << " N/m the other)";
        isNamed = true;
    }
    const std::vector<int>& speeds = isOfPositions ? kinks.byPosition : kinks.byJump;
    if (!isNamed && speeds.front() < 0) {
        text << "an equation of the system's states";
    } else if (!isNamed) {
        int b = equations.getTopology().numBlocks() - 1;
        while (b > 0 && equations.getBlock(b).firstU > speeds.front()) --b;
        text << "a force on '" << equations.getBlock(b).name << "'";
    }
    if (isOfPositions)
        text << " has a kink exactly here, so that no linear equations hold for small motions: "
                "give it a preload or a gap, or replace it by a spring";
    else
        text << " jumps here, so that no linear equations hold for small motions: replace the jump "
                "by a slope (of a friction law, a smooth transition near speed zero), or leave it "
                "out";
    return text.str();
}

BlockMass::BlockMass(Evaluation& equations)
    : numMultipliers(equations.getTopology().numMultipliers) {
    NewtonSystem system = equations.getTopology().makeNewtonSystem();
    equations.formMassSystem(system);
    const size_t count = system.blocks.size();
    firstU.resize(count);
    M.resize(count);
    rows.resize(count);
    Gt.resize(count);
    parallelFor(int(count), equations.getBlocks().numThreads, [&](int b) {
        const NewtonSystem::Block& block = system.blocks[size_t(b)];
        const int n = block.size;
        firstU[size_t(b)] = equations.getBlock(b).firstU;
        BodyMass& own = M[size_t(b)];
        if (block.form == NewtonSystem::Block::Form::Arrow) {
            const NewtonSystem::Part& part = system.parts[size_t(block.part)];
            own.head = Eigen::Map<const MatrixXd>(block.head.data(), 6, 6);
            own.coupling = Eigen::Map<const MatrixXd>(block.coupling.data(), n - 6, 3);
            own.tail = Eigen::Map<const VectorXd>(part.diagonal.data(), n - 6);
        } else {
            own.head = Eigen::Map<const MatrixXd>(block.matrix.data(), n, n);
        }
        MatrixXd all(n, block.numColumns());
        system.expandGt(block, all.data());
        // A row may have several columns; those beyond the constraints' belong to force elements.
        std::vector<int>& list = rows[size_t(b)];
        list = block.rows;
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        while (!list.empty() && list.back() >= numMultipliers) list.pop_back();
        MatrixXd& ofRows = Gt[size_t(b)];
        ofRows = MatrixXd::Zero(n, Eigen::Index(list.size()));
        for (int column = 0; column < block.numColumns(); ++column) {
            const auto at = std::lower_bound(list.begin(), list.end(), block.rows[size_t(column)]);
            if (at != list.end()) ofRows.col(at - list.begin()) += all.col(column);
        }
    });
}

void BodyMass::addProduct(const Eigen::Ref<const VectorXd>& x, Eigen::Ref<VectorXd> y) const {
    const Eigen::Index h = head.rows(), f = tail.size();
    y.head(h).noalias() += head * x.head(h);
    if (f == 0) return;
    y.head<3>().noalias() += coupling.transpose() * x.tail(f);
    y.tail(f).noalias() += coupling * x.head<3>();
    y.tail(f) += tail.cwiseProduct(x.tail(f));
}

MatrixXd BodyMass::expand() const {
    const Eigen::Index h = head.rows(), f = tail.size();
    if (f == 0) return head;
    MatrixXd full = MatrixXd::Zero(h + f, h + f);
    full.topLeftCorner(h, h) = head;
    full.bottomLeftCorner(f, h).leftCols(3) = coupling;
    full.topRightCorner(h, f).topRows(3) = coupling.transpose();
    full.diagonal().tail(f) = tail;
    return full;
}

VectorXd BlockMass::multiply(const VectorXd& x) const {
    VectorXd y = VectorXd::Zero(x.size());
    for (size_t b = 0; b < M.size(); ++b)
        M[b].addProduct(x.segment(firstU[b], M[b].size()), y.segment(firstU[b], M[b].size()));
    return y;
}

VectorXd BlockMass::multiplyG(const VectorXd& x) const {
    VectorXd y = VectorXd::Zero(numMultipliers);
    for (size_t b = 0; b < M.size(); ++b) {
        const VectorXd own = Gt[b].transpose() * x.segment(firstU[b], M[b].size());
        for (size_t k = 0; k < rows[b].size(); ++k) y[rows[b][k]] += own[Eigen::Index(k)];
    }
    return y;
}

VectorXd BlockMass::multiplyGt(const VectorXd& y) const {
    VectorXd x(firstU.empty() ? 0 : firstU.back() + M.back().size());
    for (size_t b = 0; b < M.size(); ++b) {
        VectorXd own(Eigen::Index(rows[b].size()));
        for (size_t k = 0; k < rows[b].size(); ++k) own[Eigen::Index(k)] = y[rows[b][k]];
        x.segment(firstU[b], M[b].size()).noalias() = Gt[b] * own;
    }
    return x;
}

VectorXd BlockMass::getDiagonal() const {
    VectorXd diagonal(firstU.empty() ? 0 : firstU.back() + M.back().size());
    for (size_t b = 0; b < M.size(); ++b)
        diagonal.segment(firstU[b], M[b].size()) << M[b].head.diagonal(), M[b].tail;
    return diagonal;
}

}  // namespace simflex
