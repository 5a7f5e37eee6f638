#include "simflex/fe/NodeSelection.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "FaceShapes.h"
#include "Vec3d.h"
#include "simflex/fe/elements/SolidElements.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

/** Tolerance for round-off of node positions, relative to the mesh's size. **/
constexpr double Slack = 1e-6;

std::string listNodeSets(const Mesh& mesh) {
    std::string list;
    for (const auto& [name, nodes] : mesh.nodeSets)
        list += (list.empty() ? "" : ", ") + name + " (" + std::to_string(nodes.size()) + ")";
    return list.empty() ? "none" : list;
}

[[noreturn]] void refuse(const std::string& selection, const std::string& why) {
    throw std::invalid_argument("'" + selection + "' " + why);
}

/** Parses the numbers after the colon. **/
std::vector<double> parseNumbers(const std::string& selection, size_t colon,
                                 const std::vector<size_t>& counts, const char* form) {
    std::vector<double> numbers;
    for (size_t at = colon; at < selection.size();) {
        const size_t end = std::min(selection.find(',', at + 1), selection.size());
        numbers.push_back(0);
        if (!readNumber(trimBlanks(std::string_view(selection).substr(at + 1, end - at - 1)),
                        numbers.back()))
            refuse(selection, std::string("is not of the form ") + form);
        at = end;
    }
    if (std::find(counts.begin(), counts.end(), numbers.size()) == counts.end())
        refuse(selection, std::string("is not of the form ") + form);
    return numbers;
}

Vec3d parseDirection(const std::string& selection, const double* numbers) {
    Vec3d a{numbers[0], numbers[1], numbers[2]};
    const double length = normOf(a);
    if (!(length > 0)) refuse(selection, "has a direction of length zero");
    for (double& value : a) value /= length;
    return a;
}

double parseRadius(const std::string& selection, double radius) {
    if (!(radius > 0)) refuse(selection, "has a radius or length that is not positive");
    return radius;
}

/** Returns the distance of a point outside the shape; not positive: inside. **/
std::function<double(const Vec3d&)> makeShape(const std::string& selection, const std::string& kind,
                                              size_t colon) {
    if (kind == "SPHERE") {
        const auto v = parseNumbers(selection, colon, {4}, "sphere:x,y,z,radius");
        const Vec3d center{v[0], v[1], v[2]};
        const double radius = parseRadius(selection, v[3]);
        return [=](const Vec3d& x) {
            const Vec3d d = minus(x, center);
            return normOf(d) - radius;
        };
    }
    if (kind == "CYLINDER") {
        const auto v = parseNumbers(selection, colon, {7, 8},
                                    "cylinder:x,y,z,ax,ay,az,radius or …,radius,length");
        const Vec3d foot{v[0], v[1], v[2]}, axis = parseDirection(selection, &v[3]);
        const double radius = parseRadius(selection, v[6]);
        const bool isEndless = v.size() == 7;
        const double length = isEndless ? 0 : parseRadius(selection, v[7]);
        return [=](const Vec3d& x) {
            const Vec3d d = minus(x, foot);
            const double along = dot(d, axis);
            const double outside = std::sqrt(std::max(0.0, dot(d, d) - along * along)) - radius;
            return isEndless ? outside : std::max({outside, -along, along - length});
        };
    }
    const auto v = parseNumbers(selection, colon, {6}, "plane:x,y,z,nx,ny,nz");
    const Vec3d foot{v[0], v[1], v[2]}, normal = parseDirection(selection, &v[3]);
    return [=](const Vec3d& x) { return std::abs(dot(minus(x, foot), normal)); };
}

double calcSize(const Mesh& mesh) {
    Vec3d low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (int node = 0; node < mesh.numNodes(); ++node)
        for (size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], mesh.position(node)[a]);
            high[a] = std::max(high[a], mesh.position(node)[a]);
        }
    const Vec3d d = minus(high, low);
    return normOf(d);
}

struct AxisLine {
    Vec3d point, direction;  ///< a unit vector
};

Vec3d footOn(const AxisLine& line, const Vec3d& x) {
    const double along = dot(minus(x, line.point), line.direction);
    Vec3d foot = line.point;
    for (size_t a = 0; a < 3; ++a) foot[a] += along * line.direction[a];
    return foot;
}

using NodeShares = std::vector<NodeShare>;  // by node of the mesh

void addShare(NodeShares& shares, int node, double amount, const Vec3d& place) {
    shares[size_t(node)].weight += amount;
    shares[size_t(node)].moment = sumOf(shares[size_t(node)].moment, amount, place);
}

/** Adds shares by volume for the elements whose nodes are all chosen; marks their nodes. **/
void addVolumes(const Mesh& mesh, const std::vector<char>& isChosen, std::vector<char>& isMet,
                NodeShares& shares) {
    for (const ElementBlock& block : mesh.elements) {
        const std::string type = block.type == ElementType::Tet10     ? "C3D10"
                                 : block.type == ElementType::Tet4    ? "C3D4"
                                 : block.type == ElementType::Hex8    ? "C3D8"
                                 : block.type == ElementType::Hex20   ? "C3D20"
                                 : block.type == ElementType::Wedge15 ? "C3D15"
                                                                      : "C3D6";
        const auto points = makeIntegrationPoints(type, block.type);
        const size_t size = size_t(numNodesOf(block.type));
        std::vector<Vec3d> x(size), ignored;
        for (size_t first = 0; first < block.nodes.size(); first += size) {
            const int* nodes = &block.nodes[first];
            if (!std::all_of(nodes, nodes + size, [&](int node) { return isChosen[size_t(node)]; }))
                continue;
            for (size_t k = 0; k < size; ++k) {
                x[k] = mesh.position(nodes[k]);
                isMet[size_t(nodes[k])] = 1;
            }
            for (const IntegrationPoint& point : points) {
                const double volume = calcGradients(x, point, ignored);
                Vec3d at{};
                for (size_t k = 0; k < size; ++k) at = sumOf(at, point.values[k], x[k]);
                for (size_t k = 0; k < size; ++k)
                    addShare(shares, nodes[k], volume * point.values[k], at);
            }
        }
    }
}

/** Adds shares by area for these faces; marks their nodes. **/
void addAreas(const Mesh& mesh, const std::vector<MeshFace>& faces, std::vector<char>& isMet,
              NodeShares& shares) {
    const double outer = std::sqrt(0.6);
    const std::pair<double, double> line[3] = {{-outer, 5.0 / 9}, {0, 8.0 / 9}, {outer, 5.0 / 9}};
    std::vector<int> nodes;
    std::vector<Vec3d> x;
    for (const MeshFace& face : faces) {
        const auto numCorners = std::ptrdiff_t(face.numCorners());
        nodes.assign(face.corners.begin(), face.corners.begin() + numCorners);
        if (face.isQuadratic())
            nodes.insert(nodes.end(), face.middles.begin(), face.middles.begin() + numCorners);
        x.clear();
        for (const int node : nodes) {
            x.push_back(mesh.position(node));
            isMet[size_t(node)] = 1;
        }
        for (const auto& [a, wa] : line)
            for (const auto& [b, wb] : line) {
                // A triangle is a square with one side of length zero.
                const double eta = numCorners == 4 ? b : 0.5 * (1 + b),
                             xi = numCorners == 4 ? a : 0.5 * (1 + a) * (1 - eta),
                             share = numCorners == 4 ? 1 : 0.25 * (1 - eta);
                const FacePoint point = calcFacePoint(x, xi, eta);
                const double area =
                    wa * wb * share * normOf(cross(point.tangentXi, point.tangentEta));
                for (size_t k = 0; k < nodes.size(); ++k)
                    addShare(shares, nodes[k], area * point.shapes.N[k], point.position);
            }
    }
}

/** Adds shares for boundary faces. **/
void addSkin(const Mesh& mesh, const std::vector<char>& isChosen, std::vector<char>& isMet,
             NodeShares& shares) {
    addAreas(mesh, listSkinOf(mesh, isChosen), isMet, shares);
}

/** Adds shares for faces between elements, too, of a surface inside the part. **/
void addInnerFaces(const Mesh& mesh, const std::vector<char>& isChosen, std::vector<char>& isMet,
                   NodeShares& shares) {
    addAreas(mesh, listFacesOf(mesh, isChosen), isMet, shares);
}

Vec3d calcCenter(const Mesh& mesh, const std::vector<int>& nodes) {
    constexpr double RoundOff = 1e-13;  // relative to the nodes' extent: coordinates that should be
                                        // zero become exactly zero
    const std::vector<NodeShare> shares = calcNodeShares(mesh, nodes);
    const Vec3d first = mesh.position(nodes[0]);
    Vec3d moment{};
    double sum = 0, extent = 0;
    for (size_t k = 0; k < nodes.size(); ++k) {
        const Vec3d arm = minus(mesh.position(nodes[k]), first);
        moment = sumOf(moment, shares[k].weight, arm);
        sum += shares[k].weight;
        extent = std::max(extent, normOf(arm));
    }
    Vec3d center = sumOf(first, 1 / sum, moment);
    for (double& value : center)
        if (std::abs(value) < RoundOff * extent) value = 0;
    return center;
}

/** Finds the axis of a cylinder that contains all nodes, if they cover more than half of its
circumference: by Gauss–Newton from each principal direction of the nodes. **/
std::optional<AxisLine> findCylinderAxis(const Mesh& mesh, const std::vector<int>& nodes,
                                         const Vec3d& center) {
    constexpr size_t Fewest = 8;  // a cylinder has five parameters
    constexpr double OnCylinder = 1e-5;
    if (nodes.size() < Fewest) return {};
    const Eigen::Index count = Eigen::Index(nodes.size());
    Eigen::Matrix3Xd x(3, count);
    for (Eigen::Index k = 0; k < count; ++k)
        for (Eigen::Index a = 0; a < 3; ++a)
            x(a, k) = mesh.position(nodes[size_t(k)])[size_t(a)] - center[size_t(a)];
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(x * x.transpose());
    for (Eigen::Index start = 0; start < 3; ++start) {
        Eigen::Vector3d axis = spread.eigenvectors().col(start), foot = Eigen::Vector3d::Zero();
        double radius = 0;
        Eigen::Vector3d e, f;
        Eigen::VectorXd miss(count);
        for (int iteration = 0; iteration < 30; ++iteration) {
            e = axis.unitOrthogonal();
            f = axis.cross(e);
            Eigen::MatrixXd J(count, 5);  // foot along e, f; axis towards e, f; radius
            const auto look = [&] {
                for (Eigen::Index k = 0; k < count; ++k) {
                    const Eigen::Vector3d d = x.col(k) - foot;
                    const double along = d.dot(axis), u = d.dot(e), v = d.dot(f);
                    const double r = std::max(std::hypot(u, v), 1e-300);
                    miss[k] = r - radius;
                    J.row(k) << -u / r, -v / r, -along * u / r, -along * v / r, -1;
                }
            };
            look();
            if (iteration == 0) {
                radius = miss.mean();
                look();
            }
            const Eigen::VectorXd step = solveLeastSquares(J, -miss);
            foot += step[0] * e + step[1] * f;
            axis = (axis + step[2] * e + step[3] * f).normalized();
            radius += step[4];
            if (!step.allFinite()) break;
        }
        if (!(radius > 0)) continue;
        double worst = 0;
        std::vector<double> angles;
        for (Eigen::Index k = 0; k < count; ++k) {
            const Eigen::Vector3d d = x.col(k) - foot;
            const double u = d.dot(e), v = d.dot(f);
            worst = std::max(worst, std::abs(std::hypot(u, v) - radius));
            angles.push_back(std::atan2(v, u));
        }
        std::sort(angles.begin(), angles.end());
        double gap = angles.front() + 2 * M_PI - angles.back();
        for (size_t k = 1; k < angles.size(); ++k) gap = std::max(gap, angles[k] - angles[k - 1]);
        if (!(worst <= OnCylinder * radius) || gap >= M_PI) continue;
        return AxisLine{{center[0] + foot[0], center[1] + foot[1], center[2] + foot[2]},
                        {axis[0], axis[1], axis[2]}};
    }
    return {};
}

/** Finds a set by its exact name, else in upper case as in decks, else ignoring case. **/
std::map<std::string, std::vector<int>>::const_iterator findNodeSet(const Mesh& mesh,
                                                                    const std::string& name) {
    auto set = mesh.nodeSets.find(name);
    if (set == mesh.nodeSets.end()) set = mesh.nodeSets.find(upperCase(name));
    for (auto other = mesh.nodeSets.begin();
         set == mesh.nodeSets.end() && other != mesh.nodeSets.end(); ++other)
        if (upperCase(other->first) == upperCase(name)) return other;
    return set;
}

}  // namespace

std::vector<int> selectNodes(const Mesh& mesh, const std::string& selection) {
    if (const auto set = findNodeSet(mesh, selection); set != mesh.nodeSets.end())
        return set->second;

    const size_t colon = selection.find(':');
    const std::string kind = upperCase(selection.substr(0, colon));
    if (colon == std::string::npos ||
        (kind != "NODE" && kind != "SPHERE" && kind != "CYLINDER" && kind != "PLANE"))
        throw std::invalid_argument("the model has no node set '" + selection + "'; it has " +
                                    listNodeSets(mesh) +
                                    ". Nodes can also be chosen by node:, sphere:, cylinder: or "
                                    "plane:");
    if (kind == "NODE") {
        const double number = parseNumbers(selection, colon, {1}, "node:NUMBER")[0];
        const auto end = mesh.nodeNumbers.end() - mesh.numInternalNodes;
        const auto found = std::find(mesh.nodeNumbers.begin(), end, int(number));
        if (found == end || *found != number)
            refuse(selection, "names a node that the model does not have");
        const auto expanded = mesh.expandedNodes.find(*found);
        if (expanded != mesh.expandedNodes.end()) return expanded->second;
        return {int(found - mesh.nodeNumbers.begin())};
    }
    const auto outside = makeShape(selection, kind, colon);
    const double slack = Slack * calcSize(mesh);
    std::vector<int> nodes;
    double nearest = std::numeric_limits<double>::infinity();
    for (int node = 0; node < mesh.numNodes() - mesh.numInternalNodes; ++node) {
        const double distance = outside(mesh.position(node));
        nearest = std::min(nearest, distance);
        if (distance <= slack) nodes.push_back(node);
    }
    if (nodes.empty()) {
        std::ostringstream text;
        text << "holds no node; the nearest is " << nearest << " m outside";
        refuse(selection, text.str());
    }
    return nodes;
}

std::vector<NodeShare> calcNodeShares(const Mesh& mesh, const std::vector<int>& nodes) {
    std::vector<char> isChosen(size_t(mesh.numNodes()), 0), isOfElement = isChosen;
    for (const ElementBlock& block : mesh.elements)
        for (const int node : block.nodes) isOfElement[size_t(node)] = 1;
    for (const int node : nodes) isChosen[size_t(node)] = isOfElement[size_t(node)];
    for (const auto add : {addVolumes, addSkin, addInnerFaces}) {
        std::vector<char> isMet(isChosen.size(), 0);
        NodeShares ofMesh(isChosen.size());
        add(mesh, isChosen, isMet, ofMesh);
        const bool isAny = std::find(isMet.begin(), isMet.end(), char(1)) != isMet.end();
        if (!isAny || isMet != isChosen) continue;
        std::vector<NodeShare> shares;
        for (const int node : nodes) shares.push_back(ofMesh[size_t(node)]);
        return shares;
    }
    std::vector<NodeShare> alike;
    for (const int node : nodes) alike.push_back({1, mesh.position(node)});
    return alike;
}

std::array<double, 3> findMiddle(const Mesh& mesh, const std::string& selection) {
    const std::vector<int> nodes = selectNodes(mesh, selection);
    const Vec3d center = calcCenter(mesh, nodes);
    const size_t colon = selection.find(':');
    if (findNodeSet(mesh, selection) != mesh.nodeSets.end() || colon == std::string::npos ||
        upperCase(selection.substr(0, colon)) != "CYLINDER") {
        const auto axis = findCylinderAxis(mesh, nodes, center);
        return axis ? footOn(*axis, center) : center;
    }
    const auto v = parseNumbers(selection, colon, {7, 8}, "cylinder:…");
    return footOn({{v[0], v[1], v[2]}, parseDirection(selection, &v[3])}, center);
}

}  // namespace simflex
