#include "simflex/solver/equations/Blocks.h"

#include <algorithm>
#include <cmath>

#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

void Blocks::chooseNumThreads(int most) {
    constexpr double FlopsPerThread = 2e5;
    double flops = 0;  // about two passes over the invariants
    for (const auto& block : all) flops += 36.0 * block->numU * block->numU;
    numThreads = simflex::chooseNumThreads(most, flops, FlopsPerThread);
}

bool Blocks::findRigidSlots(const Topology& topology, MobilizedBodyIndex body, int& q0, int& nq,
                            int& u0) const {
    const int b = topology.findBlock(body), tree = b - topology.numFlexible;
    if (tree < 0) return false;
    const RigidTree::Slots slots = rigid[size_t(tree)]->findSlots(body);
    q0 = all[size_t(b)]->firstQ + slots.q0;
    nq = slots.nq;
    u0 = all[size_t(b)]->firstU + slots.u0;
    return true;
}

void Blocks::setColumn(int b, int frame, int column, const SpatialVec& d,
                       NewtonSystem::Block& block) const {
    const size_t k = size_t(column);
    if (block.columns == NewtonSystem::Block::Columns::Own)
        all[size_t(b)]->addInRow(frame, d, block.Gt.data() + k * size_t(block.size));
    else
        flexible[size_t(b)]->calcColumn(frame, d, block.Gt.data() + 6 * k,
                                        block.coefficients.data() + 6 * k);
}

void Blocks::integrateQ(const double* qHist, double gamma, const double* u, double* q) const {
    parallelFor(int(all.size()), numThreads, [&](int b) {
        const Block& block = *all[size_t(b)];
        block.integrateQ(context, qHist + block.firstQ, gamma, u + block.firstU, q + block.firstQ);
    });
}

void Blocks::calcQDot(const double* q, const double* u, double* qDot) const {
    parallelFor(int(all.size()), numThreads, [&](int b) {
        const Block& block = *all[size_t(b)];
        block.calcQDot(context, q + block.firstQ, u + block.firstU, qDot + block.firstQ);
    });
}

void Blocks::displaceQ(const double* delta, double* q) const {
    parallelFor(int(all.size()), numThreads, [&](int b) {
        const Block& block = *all[size_t(b)];
        block.displaceQ(context, delta + block.firstU, q + block.firstQ);
    });
}

void Blocks::moveQ(const double* delta, double* q) const {
    for (const auto& block : all) block->moveQ(context, delta + block->firstU, q + block->firstQ);
}

void Blocks::turnAlong(const double* fromQ, const double* toQ, double* u) const {
    for (const auto& block : all)
        block->turnAlong(fromQ + block->firstQ, toQ + block->firstQ, u + block->firstU);
}

void Blocks::normalizeQ(double* q) const {
    parallelFor(int(all.size()), numThreads,
                [&](int b) { all[size_t(b)]->normalizeQ(q + all[size_t(b)]->firstQ); });
}

bool Blocks::askForN() const {
    return std::any_of(rigid.begin(), rigid.end(),
                       [](const RigidTree* tree) { return tree->asksForN(); });
}

double Blocks::calcDisplacement(const double* delta, int* worst,
                                const std::function<void(int b)>& prepare) const {
    return findLargest(
        [&](int b) {
            if (prepare) prepare(b);
            return all[size_t(b)]->calcDisplacement(delta + all[size_t(b)]->firstU);
        },
        worst);
}

void Blocks::addInPower(const double* q, const double* u, double& power) const {
    std::vector<double>& powers = *m_sizes;
    powers.resize(all.size());
    parallelFor(int(all.size()), numThreads, [&](int b) {
        Block& block = *all[size_t(b)];
        powers[size_t(b)] = block.calcDampingPower(u + block.firstU) +
                            block.calcLoadPower(context, q + block.firstQ, u + block.firstU);
    });
    for (const double ofBlock : powers) power += ofBlock;
}

void Blocks::followPose() {
    for (RigidTree* tree : rigid) tree->followPose();
}

void Blocks::getFromState(const State& state, double* q, double* u) const {
    for (const auto& block : all) block->getFromState(state, q + block->firstQ, u + block->firstU);
}

void Blocks::putIntoState(double time, const double* q, const double* u, State& state) const {
    state.setTime(time);
    for (const auto& block : all) block->putIntoState(q + block->firstQ, u + block->firstU, state);
}

Vector Blocks::calcSimbodyUDot(const double* q, const double* uDot) const {
    Vector simbodyUDot(numSimbodyU, Real(0));
    for (const auto& block : all)
        block->putUDot(q + block->firstQ, uDot + block->firstU, simbodyUDot);
    return simbodyUDot;
}

}  // namespace simflex
