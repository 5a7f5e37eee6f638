#pragma once
/** @file
The interfaces of a part: which nodes hang on which master point, and how. Internal to reduction.

- rigid (RBE2): the nodes follow the master, u = u_I + θ_I × (x − x_I).
- distributing (RBE3): the master is the mean of the area (volume) between the nodes, the rigid
motion that fits its displacement best, (u_I, θ_I) = D u with D = (∫ RᵀR)⁻¹ ∫ Rᵀ N, R = [1₃, −(x −
x_I)×]. Its load is spread out by Dᵀ, as a traction that is linear over a flat section; it stiffens
  nothing. One node of a beam is always this: the mean of its section. **/

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "simflex/fe/NodeSelection.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {

class InterfaceTies {
public:
    struct Tie {
        std::string name;
        TieType type = TieType::Rigid;
        std::array<double, 3> master{};  ///< deck coordinates [m]
        std::vector<int> nodes;          ///< mesh indices, ascending
        std::vector<NodeShare> shares;   ///< of a distributing tie, of its area or volume
    };

    /** Finds the nodes and checks them.
    @throws std::invalid_argument as reduce(). **/
    InterfaceTies(const FeModel& model, const ReductionOptions& options);

    /** What is odd about the master points, for people. **/
    std::vector<std::string> listWarnings(const Mesh& mesh) const;

    const std::vector<Tie>& ties() const { return m_ties; }
    int numBoundaryDofs() const { return 6 * int(m_ties.size()); }
    bool hasRigid() const;

    /** The rigid tie that a node belongs to, −1 if none. **/
    int rigidTieOf(int node) const { return std::max(-1, m_tieOf[size_t(node)]); }

    /** By node: k ≥ 0 of the rigid tie k, −2 − k of the distributing tie k, −1 of none. **/
    const std::vector<int>& tieOf() const { return m_tieOf; }

    /** D of a distributing tie: 6×(3·its nodes). **/
    Eigen::MatrixXd calcMean(const Mesh& mesh, const Tie& tie) const;

private:
    std::vector<Tie> m_ties;
    std::vector<int> m_tieOf;
};

}  // namespace simflex
