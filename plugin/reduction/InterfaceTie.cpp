#include "InterfaceTie.h"

#include <algorithm>
#include <cctype>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

/** Second singular value of the node positions over the first, below which nodes are collinear. **/
constexpr double kCollinear = 1e-6;

std::string upperCase(std::string text) {
    for (char& c : text) c = char(std::toupper((unsigned char)(c)));
    return text;
}

std::string listNodeSets(const Mesh& mesh) {
    std::string list;
    for (const auto& [name, nodes] : mesh.nodeSets)
        list += (list.empty() ? "" : ", ") + name + " (" + std::to_string(nodes.size()) + ")";
    return list.empty() ? "none" : list;
}

/** An interface needs three nodes that do not lie on one line: else rotations cost nothing. **/
void checkNodes(const std::string& where, const std::string& set, const Mesh& mesh,
                const std::vector<int>& nodes) {
    const std::string cure =
        "; an interface needs at least three nodes that do not lie on one line";
    if (nodes.size() < 3)
        throw std::invalid_argument(where + "node set '" + set + "' has only " +
                                    std::to_string(nodes.size()) +
                                    (nodes.size() == 1 ? " node" : " nodes") + cure);
    Eigen::Matrix3Xd x(3, nodes.size());
    for (size_t k = 0; k < nodes.size(); ++k)
        x.col(k) = Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * nodes[k]]);
    x.colwise() -= x.rowwise().mean().eval();
    const Eigen::Vector3d spread =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(x * x.transpose(), Eigen::EigenvaluesOnly)
            .eigenvalues();
    if (spread[1] <= kCollinear * kCollinear * spread[2] || !(spread[2] > 0))
        throw std::invalid_argument(where + "the " + std::to_string(nodes.size()) +
                                    " nodes of node set '" + set + "' are collinear" + cure);
}

}  // namespace

Eigen::Matrix<double, 3, 6> calcRigidMotion(const Eigen::Vector3d& arm) {
    Eigen::Matrix<double, 3, 6> R;
    R << 1, 0, 0, 0, arm.z(), -arm.y(),  //
        0, 1, 0, -arm.z(), 0, arm.x(),   //
        0, 0, 1, arm.y(), -arm.x(), 0;
    return R;
}

InterfaceTies::InterfaceTies(const FeModel& model, const ReductionOptions& options)
    : _freeIndexOf(model.mesh.numNodes(), 0) {
    const Mesh& mesh = model.mesh;
    std::vector<int> tieOf(mesh.numNodes(), -1);
    for (const InterfaceOptions& wanted : options.interfaces) {
        const std::string where = "part '" + options.name + "', interface '" + wanted.name + "': ";
        if (wanted.name.empty())
            throw std::invalid_argument("part '" + options.name + "': an interface has no name");
        for (const Tie& other : _ties)
            if (other.name == wanted.name)
                throw std::invalid_argument(where + "the name is given to two interfaces");
        const auto set = mesh.nodeSets.find(upperCase(wanted.nodeSet));
        if (set == mesh.nodeSets.end())
            throw std::invalid_argument(where + "the deck has no node set '" + wanted.nodeSet +
                                        "'; it has " + listNodeSets(mesh));
        Tie tie;
        tie.name = wanted.name;
        tie.nodes = set->second;
        checkNodes(where, set->first, mesh, tie.nodes);
        if (wanted.master) {
            tie.master = *wanted.master;
        } else {
            for (const int node : tie.nodes)
                for (int a = 0; a < 3; ++a)
                    tie.master[a] += mesh.positions[3 * node + a] / double(tie.nodes.size());
        }
        for (const int node : tie.nodes) {
            if (tieOf[node] >= 0)
                throw std::invalid_argument(where + "node " +
                                            std::to_string(mesh.nodeNumbers[node]) +
                                            " belongs to interface '" + _ties[tieOf[node]].name +
                                            "' as well; interfaces must not overlap");
            tieOf[node] = int(_ties.size());
        }
        _ties.push_back(std::move(tie));
    }
    for (int node = 0; node < mesh.numNodes(); ++node) {
        _freeIndexOf[node] = tieOf[node] < 0 ? int(_freeNodes.size()) : -1;
        if (tieOf[node] < 0) _freeNodes.push_back(node);
    }
}

Shapes InterfaceTies::calcTiedMotion(const Mesh& mesh) const {
    Shapes T = Shapes::Zero(3 * mesh.numNodes(), numBoundaryDofs());
    for (size_t k = 0; k < _ties.size(); ++k)
        for (const int node : _ties[k].nodes) {
            const Eigen::Map<const Eigen::Vector3d> x(&mesh.positions[3 * node]);
            const Eigen::Map<const Eigen::Vector3d> master(_ties[k].master.data());
            T.block<3, 6>(3 * node, 6 * k) = calcRigidMotion(x - master);
        }
    return T;
}

SymmetricMatrix InterfaceTies::takeFree(const SymmetricMatrix& A, int dofsPerNode) const {
    SymmetricMatrix result;
    result.size = dofsPerNode * int(_freeNodes.size());
    result.columnStarts.reserve(result.size + 1);
    for (const int node : _freeNodes)
        for (int a = 0; a < dofsPerNode; ++a) {
            const int column = dofsPerNode * node + a;
            result.columnStarts.push_back(result.numEntries());
            for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k) {
                const int row = A.rows[k], place = _freeIndexOf[row / dofsPerNode];
                if (place < 0) continue;
                result.rows.push_back(dofsPerNode * place + row % dofsPerNode);
                result.values.push_back(A.values[k]);
            }
        }
    result.columnStarts.push_back(result.numEntries());
    return result;
}

}  // namespace simflex
