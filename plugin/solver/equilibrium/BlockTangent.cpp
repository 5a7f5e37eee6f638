#include "simflex/solver/equilibrium/BlockTangent.h"

#include <algorithm>
#include <numeric>

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
    if (links == Links::Everywhere || topology.hasForeignForces || !topology.simbodyRows.empty()) {
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
    // The first group in which no block has a neighbour of this block's.
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
auto BlockMatrix<Scalar>::multiply(const Vector& x) const -> Vector {
    Vector y = Vector::Zero(x.size());
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) {
            const size_t row = size_t(graph->neighbours[b][k]);
            y.segment(graph->firstU[row], graph->sizes[row]).noalias() +=
                columns[b][k] * x.segment(graph->firstU[b], graph->sizes[b]);
        }
    return y;
}

template <class Scalar>
auto BlockMatrix<Scalar>::getDiagonal() const -> Vector {
    Vector diagonal(graph->firstU.empty() ? 0 : graph->firstU.back() + graph->sizes.back());
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k)
            if (graph->neighbours[b][k] == int(b))
                diagonal.segment(graph->firstU[b], graph->sizes[b]) = columns[b][k].diagonal();
    return diagonal;
}

template <class Scalar>
BlockMatrix<Scalar> BlockMatrix<Scalar>::transpose() const {
    BlockMatrix result(*graph);
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) {
            const size_t row = size_t(graph->neighbours[b][k]);
            const std::vector<int>& list = graph->neighbours[row];
            const size_t own =
                size_t(std::lower_bound(list.begin(), list.end(), int(b)) - list.begin());
            result.columns[row][own] = columns[b][k].transpose();
        }
    return result;
}

template <class Scalar>
double BlockMatrix<Scalar>::findSkew(const VectorXd& scale) const {
    double skew = 0;
    const BlockMatrix other = transpose();
    for (size_t b = 0; b < columns.size(); ++b)
        for (size_t k = 0; k < columns[b].size(); ++k) {
            const size_t row = size_t(graph->neighbours[b][k]);
            const Matrix scaled =
                scale.segment(graph->firstU[row], graph->sizes[row]).asDiagonal() *
                (columns[b][k] - other.columns[b][k]) *
                scale.segment(graph->firstU[b], graph->sizes[b]).asDiagonal();
            if (scaled.size() > 0) skew = std::max(skew, double(scaled.cwiseAbs().maxCoeff()));
        }
    return skew;
}

template struct BlockMatrix<double>;
template struct BlockMatrix<std::complex<double>>;

BlockMass::BlockMass(Evaluation& equations)
    : numMultipliers(equations.getTopology().numMultipliers) {
    NewtonSystem system = equations.getTopology().makeNewtonSystem();
    equations.formMassSystem(system);
    for (int b = 0; b < equations.getTopology().numBlocks(); ++b) {
        const NewtonSystem::Block& block = system.blocks[size_t(b)];
        const int n = block.size;
        firstU.push_back(equations.getBlock(b).firstU);
        M.push_back(MatrixXd::Zero(n, n));
        MatrixXd& own = M.back();
        if (block.form == NewtonSystem::Block::Form::Arrow) {
            const NewtonSystem::Part& part = system.parts[size_t(block.part)];
            const Eigen::Map<const MatrixXd> coupling(block.coupling.data(), n - 6, 3);
            own.topLeftCorner(6, 6) = Eigen::Map<const MatrixXd>(block.head.data(), 6, 6);
            own.bottomLeftCorner(n - 6, 3) = coupling;
            own.topRightCorner(3, n - 6) = coupling.transpose();
            for (int i = 0; i < n - 6; ++i) own(6 + i, 6 + i) = part.diagonal[size_t(i)];
        } else {
            own = Eigen::Map<const MatrixXd>(block.matrix.data(), n, n);
        }
        MatrixXd all(n, block.numColumns());
        system.expandGt(block, all.data());
        // A row may have several columns; those beyond constraints' stand for force elements.
        rows.push_back(block.rows);
        std::vector<int>& list = rows.back();
        std::sort(list.begin(), list.end());
        list.erase(std::unique(list.begin(), list.end()), list.end());
        while (!list.empty() && list.back() >= numMultipliers) list.pop_back();
        Gt.push_back(MatrixXd::Zero(n, Eigen::Index(list.size())));
        for (int column = 0; column < block.numColumns(); ++column) {
            const auto at = std::lower_bound(list.begin(), list.end(), block.rows[size_t(column)]);
            if (at != list.end()) Gt.back().col(at - list.begin()) += all.col(column);
        }
    }
}

VectorXd BlockMass::multiply(const VectorXd& x) const {
    VectorXd y(x.size());
    for (size_t b = 0; b < M.size(); ++b)
        y.segment(firstU[b], M[b].rows()) = M[b] * x.segment(firstU[b], M[b].rows());
    return y;
}

VectorXd BlockMass::multiplyG(const VectorXd& x) const {
    VectorXd y = VectorXd::Zero(numMultipliers);
    for (size_t b = 0; b < M.size(); ++b) {
        const VectorXd own = Gt[b].transpose() * x.segment(firstU[b], M[b].rows());
        for (size_t k = 0; k < rows[b].size(); ++k) y[rows[b][k]] += own[Eigen::Index(k)];
    }
    return y;
}

VectorXd BlockMass::multiplyGt(const VectorXd& y) const {
    VectorXd x(firstU.empty() ? 0 : firstU.back() + M.back().rows());
    for (size_t b = 0; b < M.size(); ++b) {
        VectorXd own(Eigen::Index(rows[b].size()));
        for (size_t k = 0; k < rows[b].size(); ++k) own[Eigen::Index(k)] = y[rows[b][k]];
        x.segment(firstU[b], M[b].rows()) = Gt[b] * own;
    }
    return x;
}

VectorXd BlockMass::getDiagonal() const {
    VectorXd diagonal(firstU.empty() ? 0 : firstU.back() + M.back().rows());
    for (size_t b = 0; b < M.size(); ++b)
        diagonal.segment(firstU[b], M[b].rows()) = M[b].diagonal();
    return diagonal;
}

}  // namespace simflex
