#pragma once
/** @file
∂r/∂u and ∂r/∂q·N of rigid trees (private header). The trees know those of inertia, of gravity and
of linear forces on mobilities (RigidTree::knowsDerivatives()); what else acts, and trees whose
mobilizers only Simbody knows, go by differences, two evaluations for each speed: forces of any
kind, unsymmetric as they are. Forces of constraints are left out: near singular positions they grow
without bound, and the matrix is the norm of projections too. **/

#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/NewtonFactors.h"

namespace simflex {

class Checkpoint;
class Evaluation;

class TreeDerivatives {
public:
    TreeDerivatives(const Topology& topology, const Blocks& blocks);

    /** Of what the trees know.
    @param dense  everything that can be had is wanted **/
    BlockDerivatives choose(bool dense) const;
    /** True if every step wants a new Newton matrix, which costs no more than an evaluation or two.
    In long chains an old one is soon of no use: M⁻¹ΔM is large where M's condition is. **/
    bool renewMatrices(bool dense) const {
        return m_areLong && choose(dense) == BlockDerivatives::ByBodies;
    }
    /** True if there is something to be differenced. **/
    bool canCalc() const { return !m_trees.empty(); }
    /** The dense form of the Newton matrix has the differences from now on.
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
    bool m_areAlwaysWanted = false;  ///< in the form that is not dense too
    bool m_mayBeByBodies = false;    ///< nothing else is written into the matrices then
    bool m_hasLoads = false;         ///< which the dense form differences
    std::vector<Tree> m_trees;
    std::vector<double> m_metres;  ///< displacement per unit of each speed
    bool m_areKnown = false;
};

}  // namespace simflex
