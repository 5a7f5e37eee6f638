#pragma once
/** @file
∂r/∂u and ∂r/∂q·N of rigid trees (private header). The trees differentiate inertia, gravity and
linear forces on mobilities (RigidTree::knowsDerivatives()). All other forces, unsymmetric ones
included, and trees with mobilizers known to Simbody only, are differenced, at two evaluations per
speed. Constraint forces are left out: they grow without bound near singular positions, and the
matrix also defines the norm of projections. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

class Checkpoint;
class Evaluation;

class TreeDerivatives {
public:
    TreeDerivatives(const Topology& topology, const Blocks& blocks);

    /** Terms that the trees can differentiate.
    @param dense  with all available terms **/
    BlockDerivatives choose(bool dense) const;
    /** True if every step needs a new Newton matrix, which costs no more than one or two
    evaluations. In long chains an old one is soon useless: M⁻¹ΔM is large where M is
    ill-conditioned. **/
    bool renewMatrices(bool dense) const {
        return m_areLong && choose(dense) == BlockDerivatives::ByBodies;
    }
    /** True if some terms need differences. **/
    bool canCalc() const { return !m_trees.empty(); }
    /** Updates the differences in the dense form of the Newton matrix.
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
    bool m_areWanted = false;
    bool m_areLong = false;
    bool m_areAlwaysWanted = false;  ///< in all forms, not only the dense one
    bool m_mayBeByBodies = false;    ///< if nothing else is added to the matrices
    bool m_hasLoads = false;         ///< differenced in the dense form
    std::vector<Tree> m_trees;
    std::vector<double> m_metres;  ///< displacement per unit of each speed
    bool m_areKnown = false;
};

}  // namespace simflex
