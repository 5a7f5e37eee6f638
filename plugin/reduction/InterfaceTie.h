#pragma once
/** @file
Rigid interface ties (RBE2) by transformation. Internal to reduction.

The nodes of an interface follow its master point x_I: u = u_I + θ_I × (x − x_I), or u_s = T q_b
with the boundary degrees of freedom q_b = (u_I, θ_I) of all interfaces. Nothing is eliminated from
K: with the free nodes i and the tied nodes s,

    K_ib = K_is T,   K_bb = Tᵀ K_ss T,   and the same for M. **/

#include <array>
#include <string>
#include <vector>

#include "SymmetricProduct.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {

class InterfaceTies {
public:
    struct Tie {
        std::string name;
        std::array<double, 3> master{};  ///< deck coordinates [m]
        std::vector<int> nodes;          ///< mesh indices, ascending
    };

    /** Finds the nodes and checks them.
    @throws std::invalid_argument as reduce(). **/
    InterfaceTies(const FeModel& model, const ReductionOptions& options);

    const std::vector<Tie>& ties() const { return _ties; }
    int numBoundaryDofs() const { return 6 * int(_ties.size()); }

    /** Nodes that belong to no interface, ascending. **/
    const std::vector<int>& freeNodes() const { return _freeNodes; }

    /** Displacement of every node for a unit of each boundary DOF with the free nodes held:
    numDofs×numBoundaryDofs. **/
    Shapes calcTiedMotion(const Mesh& mesh) const;

    /** Rows and columns of the free nodes out of a nodal matrix (dofsPerNode 1) or one of
    translations (dofsPerNode 3). **/
    SymmetricMatrix takeFree(const SymmetricMatrix& A, int dofsPerNode) const;

private:
    std::vector<Tie> _ties;
    std::vector<int> _freeNodes;
    std::vector<int> _freeIndexOf;  ///< per node: place among the free nodes, −1 if tied
};

/** Velocity of position `arm` for the six rigid motions about the origin: [1₃, −arm×], 3×6. **/
Eigen::Matrix<double, 3, 6> calcRigidMotion(const Eigen::Vector3d& arm);

}  // namespace simflex
