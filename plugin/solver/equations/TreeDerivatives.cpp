#include "simflex/solver/equations/TreeDerivatives.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/Checkpoint.h"
#include "simflex/solver/equations/CoordinateScales.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

TreeDerivatives::TreeDerivatives(const Topology& topology, const Blocks& blocks) {
    // Joints alone need no derivatives, and pass singular positions best with a symmetric matrix.
    const bool mayBeStiff = topology.hasSimbodyForces() || topology.numMultipliers == 0;
    m_areWanted = topology.setting == Topology::Setting::Implicit && topology.numFlexible == 0 &&
                  topology.numU > 0 && mayBeStiff;
    m_areAlwaysWanted = topology.numMultipliers == 0;
    m_mayBeByBodies = topology.differenced.empty() &&
                      std::none_of(topology.isPrescribed.begin(), topology.isPrescribed.end(),
                                   [](char is) { return is != 0; });
    m_hasLoads = !topology.loadedBlocks.empty();
    constexpr int LargestShort = 12;  // speeds
    m_areLong = std::any_of(blocks.rigid.begin(), blocks.rigid.end(),
                            [](const RigidTree* tree) { return tree->numU > LargestShort; });
    const bool knowsAll =
        !topology.hasForeignForces &&
        std::all_of(blocks.rigid.begin(), blocks.rigid.end(),
                    [](const RigidTree* tree) { return tree->knowsDerivatives(); });
    if (!m_areWanted || knowsAll) return;
    m_metres = CoordinateScales(blocks).metres;
    for (int b = 0; b < topology.numBlocks(); ++b) {
        const size_t n = size_t(topology.blockSizes[size_t(b)]);
        m_trees.push_back({b, std::vector<double>(n * n, 0), std::vector<double>(n * n, 0)});
    }
}

BlockDerivatives TreeDerivatives::choose(bool dense) const {
    if (!m_areWanted || !(dense || m_areAlwaysWanted)) return BlockDerivatives::Constant;
    const bool isWrittenOut = dense && (canCalc() || m_hasLoads);
    return m_areAlwaysWanted && m_mayBeByBodies && !isWrittenOut ? BlockDerivatives::ByBodies
                                                                 : BlockDerivatives::Dense;
}

bool TreeDerivatives::calc(Evaluation& equations, const double* q, const double* u,
                           const double* uDot) {
    // Small compared with contact depths and with the speeds at which friction reverses.
    constexpr double Shift = 1e-8, Speed = 1e-7;  // [m], [m/s]
    const Topology& topology = equations.getTopology();
    const double time = equations.updFunctions().get().time;
    const size_t numU = size_t(topology.numU);
    std::vector<double> r0(numU), r(numU), movedQ(q, q + topology.numQ), movedU(u, u + numU),
        delta(numU);
    bool isFinite = true;
    // Elements with matrix terms of their own are left out.
    const auto evaluate = [&](const double* atQ, const double* atU, double* residual) {
        equations.realize(time, atQ, atU);
        equations.updLoads().clearStiffForces();
        equations.calcUnknownForces(atQ, atU, uDot, residual);
    };
    evaluate(q, u, r0.data());
    const auto visitSpeeds = [&](double size, auto&& matrixOf, const auto& move) {
        for (Tree& tree : m_trees) {
            const Block& block = equations.getBlock(tree.block);
            const size_t n = size_t(block.numU), first = size_t(block.firstU);
            for (size_t j = 0; j < n; ++j) {
                double h = size / std::max(m_metres[first + j], 1e-3);
                h = move(first + j, h);
                for (size_t i = 0; i < n; ++i) {
                    const double slope = (r[first + i] - r0[first + i]) / h;
                    isFinite = isFinite && std::isfinite(slope);
                    matrixOf(tree)[i + j * n] = slope;
                }
            }
        }
    };
    visitSpeeds(
        Speed, [](Tree& tree) -> std::vector<double>& { return tree.byU; },
        [&](size_t speed, double h) {
            movedU[speed] = u[speed] + h;
            evaluate(q, movedU.data(), r.data());
            h = movedU[speed] - u[speed];
            movedU[speed] = u[speed];
            return h;
        });
    equations.realize(time, q, u);
    visitSpeeds(
        Shift, [](Tree& tree) -> std::vector<double>& { return tree.byQ; },
        [&](size_t speed, double h) {
            std::copy_n(q, topology.numQ, movedQ.begin());
            if (equations.getBlocks().askForN()) equations.realize(time, q, u);
            delta[speed] = h;
            equations.getBlocks().displaceQ(delta.data(), movedQ.data());
            delta[speed] = 0;
            evaluate(movedQ.data(), u, r.data());
            return h;
        });
    equations.realize(time, q, u);
    m_areKnown = isFinite;
    return isFinite;
}

void TreeDerivatives::addIn(const NewtonFactors& factors, NewtonSystem& system) const {
    for (const Tree& tree : m_trees) {
        NewtonSystem::Block& block = system.blocks[size_t(tree.block)];
        block.form = NewtonSystem::Block::Form::General;
        for (size_t k = 0; k < tree.byQ.size(); ++k)
            block.matrix[k] += tree.byU[k] + factors.stiffness * tree.byQ[k];
    }
}

void TreeDerivatives::visit(Checkpoint& checkpoint) {
    checkpoint.visit(m_areKnown);
    if (m_areKnown)
        for (Tree& tree : m_trees) checkpoint.visit(tree.byQ, tree.byU);
}

}  // namespace simflex
