#pragma once
/** @file
The interfaces of a part: how nodes are tied to master points. Internal to reduction.

- rigid (RBE2): the nodes follow the master, u = u_I + θ_I × (x − x_I).
- distributing (RBE3): the master is the rigid motion that fits the displacement of the area
  (volume) between the nodes best, (u_I, θ_I) = D u with D = (∫ RᵀR)⁻¹ ∫ Rᵀ N, R = [1₃, −(x −
  x_I)×]. Dᵀ distributes its load as a traction, linear over a flat section, and adds no stiffness.
  A single beam node is always tied this way: to the mean of its section. **/

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
        std::vector<NodeShare> shares;   ///< of a distributing tie: shares of its area or volume
    };

    /** Selects the nodes and checks them.
    @throws std::invalid_argument as reduce(). **/
    InterfaceTies(const FeModel& model, const ReductionOptions& options);

    /** Returns warnings about unusual master points. **/
    std::vector<std::string> listWarnings(const Mesh& mesh) const;

    const std::vector<Tie>& ties() const { return m_ties; }
    int numBoundaryDofs() const { return 6 * int(m_ties.size()); }
    bool hasRigid() const;

    /** Returns the rigid tie of a node, −1 if none. **/
    int rigidTieOf(int node) const { return std::max(-1, m_tieOf[size_t(node)]); }

    /** By node: k ≥ 0 for rigid tie k, −2 − k for distributing tie k, −1 for none. **/
    const std::vector<int>& tieOf() const { return m_tieOf; }

    /** Returns D of a distributing tie: 6×(3·its nodes). **/
    Eigen::MatrixXd calcMean(const Mesh& mesh, const Tie& tie) const;

private:
    std::vector<Tie> m_ties;
    std::vector<int> m_tieOf;
};

}  // namespace simflex
