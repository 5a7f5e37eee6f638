#pragma once
/** @file
The interfaces of a part: which nodes hang on which master point, and how. Internal to reduction.

- rigid (RBE2): the nodes follow the master, u = u_I + θ_I × (x − x_I).
- distributing (RBE3): the master is the weighted mean of the nodes, the rigid motion that fits them
  best, (u_I, θ_I) = D u with D = (Σ w RᵀR)⁻¹ wRᵀ, R = [1₃, −(x − x_I)×], w of
  calcNodeWeights(). Its load is shared out among the nodes by Dᵀ, a force evenly over the area; it
  stiffens nothing. One node of a beam is always this: the mean of its section. **/

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

#include "simflex/reduction/Reduction.h"

namespace simflex {

class InterfaceTies {
public:
    struct Tie {
        std::string name;
        TieType type = TieType::Rigid;
        std::array<double, 3> master{};  ///< deck coordinates [m]
        std::vector<int> nodes;          ///< mesh indices, ascending
        std::vector<double> weights;     ///< of a distributing tie
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
    int rigidTieOf(int node) const { return m_rigidTieOf[size_t(node)]; }

    /** D of a distributing tie: 6×(3·its nodes). **/
    Eigen::MatrixXd calcMean(const Mesh& mesh, const Tie& tie) const;

private:
    std::vector<Tie> m_ties;
    std::vector<int> m_rigidTieOf;  ///< per node
};

}  // namespace simflex
