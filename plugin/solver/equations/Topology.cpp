#include "simflex/solver/equations/Topology.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace simflex {

using namespace SimTK;

bool Topology::hasModes() const {
    return std::any_of(blockSizes.begin(), blockSizes.begin() + numFlexible,
                       [](int size) { return size > 6; });
}

std::vector<int> Topology::listOwnStates() const {
    std::vector<int> list;
    for (const auto& state : states)
        if (state.equation->isHeld())
            throw std::runtime_error("state '" + state.equation->getName() +
                                     "' changes at times of its own and holds its value between "
                                     "them: such a system has no equilibria and no natural modes");
    for (size_t i = 0; i < states.size(); ++i)
        if (!states[i].equation->followsMotion()) list.push_back(firstZ + int(i));
    return list;
}

NewtonSystem Topology::makeNewtonSystem() const {
    NewtonSystem made;
    for (const PartGroup& part : parts) {
        const int n = blockSizes[size_t(part.firstBlock)] - 6;
        made.parts.push_back({n, int(part.frames.size()), {}, part.shapes});
        made.parts.back().diagonal.assign(size_t(n), 0);
    }
    made.blocks.resize(blockSizes.size());
    for (size_t b = 0; b < blockSizes.size(); ++b) {
        if (partOfBlock[b] < 0) {
            made.blocks[b].resize(blockSizes[b], blockRows[b]);
            continue;
        }
        if (hasOwnColumns[b]) {
            made.blocks[b].resize(partOfBlock[b], blockSizes[b] - 6, blockRows[b]);
            continue;
        }
        std::vector<NewtonSystem::Side> sides;
        for (const BlockSide& side : blockSides[b])
            sides.push_back({side.partFrame, joints[size_t(side.owner)].numRows()});
        for (const BlockSide& side : frictionSides[b])
            sides.push_back({side.partFrame, frictions[size_t(side.owner)].numRows()});
        for (const BlockSide& side : elementSides[b])
            sides.push_back({side.partFrame, elements[size_t(side.owner)].numRows()});
        // Differenced forces act on rigid motions only: the frame's shapes get no coefficients.
        for (const DifferencedForce& forces : differenced)
            for (const DifferencedForce::Side& side : forces.sides)
                if (side.block == int(b)) sides.push_back({sides.front().frame, forces.numTerms});
        made.blocks[b].resize(partOfBlock[b], blockSizes[b] - 6, std::move(sides), blockRows[b]);
    }
    made.r.assign(size_t(numU), 0);
    made.c.assign(size_t(numMultipliers + numElementRows), 0);
    for (const Friction& friction : frictions) {
        NewtonSystem::Coupling coupling;
        for (int i = 0; i < friction.numRows(); ++i) coupling.rows.push_back(friction.firstRow + i);
        const Joint& joint = joints[size_t(friction.joint)];
        for (int k = 0; k < joint.numRows(); ++k) coupling.rows.push_back(joint.firstRow + k);
        coupling.values.assign(coupling.rows.size() * coupling.rows.size(), 0);
        made.couplings.push_back(std::move(coupling));
    }
    if (numElementRows > 0) {
        made.compliance.assign(made.c.size(), 0);
        std::fill(made.compliance.begin() + numMultipliers, made.compliance.end(), 1.0);
        for (const Element& element : elements)
            for (int i = 0; i < element.numPairs; ++i)
                made.pairs.push_back(element.firstRow + element.numTerms + 2 * i);
    }
    return made;
}

std::pair<int, int> Topology::findRows(ConstraintIndex constraint) const {
    const auto isOwn = [&](const SimbodyRow& row) { return row.constraint == constraint; };
    const auto first = std::find_if(simbodyRows.begin(), simbodyRows.end(), isOwn);
    const int count = int(std::count_if(first, simbodyRows.end(), isOwn));
    return {firstSimbodyRow + (count > 0 ? int(first - simbodyRows.begin()) : 0), count};
}

int Topology::findFirstRow(JointIndex joint) const {
    for (const Joint& own : joints)
        if (own.record == &guts->joint(joint)) return own.firstRow;
    return -1;
}

int Topology::findFirstFrictionRow(JointIndex joint) const {
    for (const Friction& friction : frictions)
        if (joints[size_t(friction.joint)].record == &guts->joint(joint)) return friction.firstRow;
    return -1;
}

MotionLevel Topology::getRowLevel(int row) const {
    if (row >= firstFrictionRow) return MotionLevel::Velocity;
    return row < firstSimbodyRow ? MotionLevel::Position
                                 : simbodyRows[size_t(row - firstSimbodyRow)].level;
}

const std::string& Topology::getJointName(int row) const {
    for (const Joint& joint : joints)
        if (row < joint.firstRow + joint.numRows()) return joint.record->name;
    if (row >= numMultipliers)
        throw std::out_of_range("no joint has multiplier " + std::to_string(row));
    for (const Friction& friction : frictions)
        if (friction.firstRow <= row && row < friction.firstRow + friction.numRows())
            return joints[size_t(friction.joint)].record->name;
    return simbodyRows[size_t(row - firstSimbodyRow)].name;
}

std::string Topology::describeConstraint(int row) const {
    const std::string& name = getJointName(row);
    if (row >= firstFrictionRow) return "the friction of joint '" + name + "'";
    return row < firstSimbodyRow ? "joint '" + name + "'" : name;
}

std::string Topology::describeRow(int row) const {
    if (row >= firstFrictionRow) return describeConstraint(row);
    int first = firstSimbodyRow;
    for (const Joint& joint : joints)
        if (joint.firstRow <= row && row < firstSimbodyRow) first = joint.firstRow;
    while (row >= firstSimbodyRow && first < row && getJointName(first) != getJointName(row))
        ++first;
    return "equation " + std::to_string(row - first + 1) + " of '" + getJointName(row) + "'";
}

bool Topology::mayLoseCount(const double* g, double scale) const {
    // Errors grow by 2³ = 8 when order 2 doubles its step, and by 1.5⁶ = 11 at order 5.
    constexpr double LargestPart = 1.0 / 24;
    for (const auto& [row, period] : periods)
        if (std::abs(scale * g[row]) > LargestPart * period) return true;
    return false;
}

}  // namespace simflex
