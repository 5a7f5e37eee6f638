#pragma once
/** @file
∂r/∂u and ∂r/∂q·N of rigid trees by differences (private header): forces of any kind, unsymmetric as
they are, and gyroscopic terms. Forces of constraints are left out: near singular positions they
grow without bound, and the matrix is the norm of projections too. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

class Checkpoint;
class Evaluation;

class TreeDerivatives {
public:
    TreeDerivatives(const Topology& topology, const Blocks& blocks);

    /** True if calc() has a use: all is rigid, not too large, and something acts besides inertia
    and gravity. **/
    bool canCalc() const { return !m_trees.empty(); }
    /** The dense form of the Newton matrix has them from now on.
    @pre the last evaluation was at this q and u, where it is left
    @returns false if a force is not a finite number nearby **/
    bool calc(Evaluation& equations, const double* q, const double* u, const double* uDot);
    bool areKnown() const { return m_areKnown; }
    void forget() { m_areKnown = false; }
    /** J += ∂r/∂u + stiffness ∂r/∂q·N. **/
    void addIn(const NewtonFactors& factors, NewtonSystem& system) const;

    void visit(Checkpoint& checkpoint);

private:
    /** n×n matrices of one tree. **/
    struct Tree {
        int block;
        std::vector<double> byQ, byU;
    };
    std::vector<Tree> m_trees;
    std::vector<double> m_metres;  ///< displacement per unit of each speed
    bool m_areKnown = false;
};

}  // namespace simflex
