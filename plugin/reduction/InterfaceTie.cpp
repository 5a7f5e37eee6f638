#include "InterfaceTie.h"

#include <algorithm>
#include <limits>
#include <sstream>
#include <stdexcept>

#include "RigidMotion.h"
#include "simflex/fe/NodeSelection.h"

namespace simflex {
namespace {

/** Ratio of the second to the first singular value of the node positions below which nodes are
collinear. **/
constexpr double Collinear = 1e-6;

/** Distance of a master point from its nodes, in part sizes, that causes a warning and an
error. **/
constexpr double Near = 0.5, Farthest = 10;

double calcDiagonal(const Mesh& mesh) {
    const Eigen::Map<const Eigen::Matrix3Xd> x(mesh.positions.data(), 3, mesh.numNodes());
    return (x.rowwise().maxCoeff() - x.rowwise().minCoeff()).norm();
}

/** Returns the distance from the master to the nearest of its nodes. **/
double calcDistance(const Mesh& mesh, const InterfaceTies::Tie& tie) {
    const Eigen::Map<const Eigen::Vector3d> master(tie.master.data());
    double distance = std::numeric_limits<double>::infinity();
    for (const int node : tie.nodes)
        distance = std::min(
            distance,
            (Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * size_t(node)]) - master).norm());
    return distance;
}

std::string describeDistance(const Mesh& mesh, const InterfaceTies::Tie& tie) {
    std::ostringstream text;
    text << "the master point (" << tie.master[0] << ", " << tie.master[1] << ", " << tie.master[2]
         << ") is " << calcDistance(mesh, tie)
         << " m away from the nearest of its nodes, the part is " << calcDiagonal(mesh)
         << " m across";
    return text.str();
}

/** Whether nodes are those that one node of a beam or shell has become. **/
bool isThinNode(const Mesh& mesh, const std::vector<int>& nodes) {
    return std::any_of(mesh.expandedNodes.begin(), mesh.expandedNodes.end(),
                       [&](const auto& entry) { return entry.second == nodes; });
}

bool isBeamNode(const Mesh& mesh, const std::vector<int>& nodes) {
    constexpr size_t MostOfShell = 3;
    return nodes.size() > MostOfShell && isThinNode(mesh, nodes);
}

/** Requires three non-collinear nodes: otherwise rotations have no stiffness. **/
void checkNodes(const std::string& where, const std::string& selection, const Mesh& mesh,
                const std::vector<int>& nodes) {
    const std::string cure =
        "; an interface needs at least three nodes that do not lie on one line";
    if (nodes.size() < 3)
        throw std::invalid_argument(where + "'" + selection + "' has only " +
                                    std::to_string(nodes.size()) +
                                    (nodes.size() == 1 ? " node" : " nodes") + cure);
    Eigen::Matrix3Xd x(3, nodes.size());
    for (size_t k = 0; k < nodes.size(); ++k)
        x.col(k) = Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * nodes[k]]);
    x.colwise() -= x.rowwise().mean().eval();
    const Eigen::Vector3d spread =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(x * x.transpose(), Eigen::EigenvaluesOnly)
            .eigenvalues();
    const bool isLine = spread[1] <= Collinear * Collinear * spread[2] || !(spread[2] > 0);
    if (isLine && isThinNode(mesh, nodes))
        throw std::invalid_argument(where + "'" + selection +
                                    "' is one node of a shell, which does not hold it about its "
                                    "normal; choose several nodes, such as those around it");
    if (isLine)
        throw std::invalid_argument(where + "the " + std::to_string(nodes.size()) + " nodes of '" +
                                    selection + "' are collinear" + cure);
}

}  // namespace

InterfaceTies::InterfaceTies(const FeModel& model, const ReductionOptions& options)
    : m_tieOf(size_t(model.mesh.numNodes()), -1) {
    const Mesh& mesh = model.mesh;
    for (const InterfaceOptions& wanted : options.interfaces) {
        const std::string where = "part '" + options.name + "', interface '" + wanted.name + "': ";
        if (wanted.name.empty())
            throw std::invalid_argument("part '" + options.name + "': an interface has no name");
        for (const Tie& other : m_ties)
            if (other.name == wanted.name)
                throw std::invalid_argument(where + "the name is given to two interfaces");
        Tie tie;
        tie.name = wanted.name;
        tie.type = wanted.tie;
        try {
            tie.nodes = selectNodes(mesh, wanted.nodes);
        } catch (const std::invalid_argument& error) {
            throw std::invalid_argument(where + error.what());
        }
        checkNodes(where, wanted.nodes, mesh, tie.nodes);
        tie.master = wanted.master ? *wanted.master : findMiddle(mesh, wanted.nodes);
        // A beam node follows the mean of its section, which may contract freely.
        if (isBeamNode(mesh, tie.nodes)) tie.type = TieType::Distributing;
        if (tie.type == TieType::Distributing) tie.shares = calcNodeShares(mesh, tie.nodes);
        if (calcDistance(mesh, tie) > Farthest * calcDiagonal(mesh))
            throw std::invalid_argument(where + describeDistance(mesh, tie) +
                                        "; it is given in metres, where the mesh is");
        for (const int node : tie.nodes) {
            int& owner = m_tieOf[size_t(node)];
            if (owner != -1)
                throw std::invalid_argument(where + "node " +
                                            std::to_string(mesh.nodeNumbers[size_t(node)]) +
                                            " belongs to interface '" +
                                            m_ties[size_t(owner >= 0 ? owner : -2 - owner)].name +
                                            "' as well; interfaces must not overlap");
            owner = int(m_ties.size());
            if (tie.type == TieType::Distributing) owner = -2 - owner;
        }
        m_ties.push_back(std::move(tie));
    }
}

std::vector<std::string> InterfaceTies::listWarnings(const Mesh& mesh) const {
    std::vector<std::string> warnings;
    for (const Tie& tie : m_ties)
        if (calcDistance(mesh, tie) > Near * calcDiagonal(mesh))
            warnings.push_back("interface '" + tie.name + "': " + describeDistance(mesh, tie));
    return warnings;
}

bool InterfaceTies::hasRigid() const {
    return std::any_of(m_ties.begin(), m_ties.end(),
                       [](const Tie& tie) { return tie.type == TieType::Rigid; });
}

Eigen::MatrixXd InterfaceTies::calcMean(const Mesh& mesh, const Tie& tie) const {
    const Eigen::Index count = Eigen::Index(tie.nodes.size());
    Eigen::VectorXd w(count);
    Eigen::Matrix3Xd moments(3, count), arms(3, count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const NodeShare& share = tie.shares[size_t(k)];
        w[k] = share.weight;
        moments.col(k) = Eigen::Map<const Eigen::Vector3d>(share.moment.data());
        arms.col(k) =
            Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * size_t(tie.nodes[size_t(k)])]);
    }
    const Eigen::Vector3d center = moments.rowwise().sum() / w.sum();
    arms.colwise() -= center;
    moments -= center * w.transpose();
    // About the middle, translations and rotations are decoupled.
    const Eigen::Matrix3d spread = moments * arms.transpose();
    const Eigen::Matrix3d inverse =
        (spread.trace() * Eigen::Matrix3d::Identity() - spread).inverse();
    const Eigen::Matrix<double, 3, 3> toMaster =
        calcRigidMotion(Eigen::Map<const Eigen::Vector3d>(tie.master.data()) - center)
            .rightCols<3>();
    Eigen::MatrixXd D(6, 3 * count);
    for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::Matrix3d rotation =
            inverse * calcRigidMotion(moments.col(k)).rightCols<3>().transpose();
        D.block<3, 3>(3, 3 * k) = rotation;
        D.block<3, 3>(0, 3 * k) =
            w[k] / w.sum() * Eigen::Matrix3d::Identity() + toMaster * rotation;
    }
    return D;
}

}  // namespace simflex
