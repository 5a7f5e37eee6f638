#include "simflex/forces/LoadShape.h"

#include <algorithm>
#include <stdexcept>

#include "simflex/part/MeshFaces.h"

namespace simflex {

using namespace SimTK;

namespace {

const std::vector<int>& getNodeSet(const ReducedBody& part, const std::string& name) {
    const auto found = part.mesh.nodeSets.find(name);
    if (found != part.mesh.nodeSets.end()) return found->second;
    std::string known;
    for (const auto& [other, nodes] : part.mesh.nodeSets)
        known += (known.empty() ? "" : ", ") + other;
    throw std::out_of_range("part '" + part.name + "' has no node set '" + name +
                            "'; it has: " + (known.empty() ? "none" : known));
}

/** Shape functions and their two derivatives at a point of a face. **/
struct FacePoint {
    Real weight;
    Real N[8], dr[8], ds[8];
};

// Corners first, then mid-edge nodes, as in MeshFace.

void evaluateTriangle(Real r, Real s, bool isQuadratic, FacePoint& point) {
    const Real L[3] = {1 - r - s, r, s};
    const Real Lr[3] = {-1, 1, 0}, Ls[3] = {-1, 0, 1};
    for (int k = 0; k < 3; ++k) {
        if (!isQuadratic) {
            point.N[k] = L[k];
            point.dr[k] = Lr[k];
            point.ds[k] = Ls[k];
            continue;
        }
        point.N[k] = L[k] * (2 * L[k] - 1);
        point.dr[k] = (4 * L[k] - 1) * Lr[k];
        point.ds[k] = (4 * L[k] - 1) * Ls[k];
        const int j = (k + 1) % 3;
        point.N[3 + k] = 4 * L[k] * L[j];
        point.dr[3 + k] = 4 * (Lr[k] * L[j] + L[k] * Lr[j]);
        point.ds[3 + k] = 4 * (Ls[k] * L[j] + L[k] * Ls[j]);
    }
}

void evaluateQuadrilateral(Real r, Real s, bool isQuadratic, FacePoint& point) {
    const Real rk[4] = {-1, 1, 1, -1}, sk[4] = {-1, -1, 1, 1};
    for (int k = 0; k < 4; ++k) {
        const Real a = 1 + r * rk[k], b = 1 + s * sk[k];
        point.N[k] = a * b / 4;
        point.dr[k] = rk[k] * b / 4;
        point.ds[k] = a * sk[k] / 4;
        if (!isQuadratic) continue;
        // Serendipity: N (r rk + s sk − 1).
        const Real c = r * rk[k] + s * sk[k] - 1;
        point.dr[k] = point.dr[k] * c + point.N[k] * rk[k];
        point.ds[k] = point.ds[k] * c + point.N[k] * sk[k];
        point.N[k] *= c;
        const bool alongR = k % 2 == 0;  // the edge from corner k to k+1
        const Real side = alongR ? sk[k] : (k == 1 ? 1 : -1);
        if (alongR) {
            point.N[4 + k] = (1 - r * r) * (1 + s * side) / 2;
            point.dr[4 + k] = -r * (1 + s * side);
            point.ds[4 + k] = (1 - r * r) * side / 2;
        } else {
            point.N[4 + k] = (1 + r * side) * (1 - s * s) / 2;
            point.dr[4 + k] = side * (1 - s * s) / 2;
            point.ds[4 + k] = -(1 + r * side) * s;
        }
    }
}

/** Gauss points of a face: exact for constant loads on plane faces, and on curved ones whose
 * corners and mid-edge nodes give a polynomial surface. **/
std::vector<FacePoint> makeFacePoints(const MeshFace& face) {
    std::vector<FacePoint> points;
    const bool isQuadratic = face.isQuadratic();
    if (face.numCorners() == 4) {
        const Real root = std::sqrt(0.6);
        const Real at[3] = {-root, 0, root}, weight[3] = {5. / 9, 8. / 9, 5. / 9};
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                FacePoint point{};
                point.weight = weight[i] * weight[j];
                evaluateQuadrilateral(at[i], at[j], isQuadratic, point);
                points.push_back(point);
            }
        return points;
    }
    // Degree 5, seven points (Radon, 1948).
    const Real root = std::sqrt(15.0);
    const Real a = (6 - root) / 21, b = (6 + root) / 21;
    const Real wa = (155 - root) / 2400, wb = (155 + root) / 2400;
    const Real at[7][3] = {{1. / 3, 1. / 3, 9. / 80}, {a, a, wa}, {1 - 2 * a, a, wa},
                           {a, 1 - 2 * a, wa},        {b, b, wb}, {1 - 2 * b, b, wb},
                           {b, 1 - 2 * b, wb}};
    for (const auto& [r, s, weight] : at) {
        FacePoint point{};
        point.weight = weight;
        evaluateTriangle(r, s, isQuadratic, point);
        points.push_back(point);
    }
    return points;
}

/** Nodal forces of a traction on the faces of a set; `loadOf` returns the force on an area vector
(outward normal times area). **/
LoadShape integrate(const ReducedBody& part, const std::vector<int>& set, const std::string& name,
                    const std::function<Vec3(const Vec3& area)>& loadOf) {
    std::vector<char> isChosen(size_t(part.mesh.numNodes()), 0);
    for (const int node : set) isChosen.at(size_t(node)) = 1;
    std::vector<Vec3> forces(size_t(part.mesh.numNodes()), Vec3(0));
    bool isEmpty = true;
    for (const MeshFace& face : listLoadedFaces(part.mesh, isChosen)) {
        isEmpty = false;
        std::vector<int> nodes(face.corners.begin(), face.corners.begin() + face.numCorners());
        if (face.isQuadratic())
            nodes.insert(nodes.end(), face.middles.begin(),
                         face.middles.begin() + face.numCorners());
        for (const FacePoint& point : makeFacePoints(face)) {
            Vec3 alongR(0), alongS(0);
            for (size_t k = 0; k < nodes.size(); ++k) {
                const auto p = part.mesh.position(nodes[k]);
                alongR += point.dr[k] * Vec3(p[0], p[1], p[2]);
                alongS += point.ds[k] * Vec3(p[0], p[1], p[2]);
            }
            const Vec3 force = point.weight * loadOf(alongR % alongS);
            for (size_t k = 0; k < nodes.size(); ++k)
                forces[size_t(nodes[k])] += point.N[k] * force;
        }
    }
    if (isEmpty)
        throw std::invalid_argument(name + " of part '" + part.name +
                                    "' holds no whole element face of the part's skin");
    std::vector<int> all(forces.size());
    for (size_t k = 0; k < all.size(); ++k) all[k] = int(k);
    return LoadShape::fromNodalForces(part, all, forces);
}

/** Force of a pressure of 1 Pa. **/
Vec3 calcPush(const Vec3& area) {
    return -area;
}

}  // namespace

LoadShape LoadShape::fromModalForces(const Vector& forces) {
    LoadShape shape;
    shape.modal = forces;
    shape.torquePerMode = Matrix(3, forces.size(), Real(0));
    return shape;
}

LoadShape LoadShape::fromNodalForces(const ReducedBody& part, const std::vector<int>& nodes,
                                     const std::vector<Vec3>& forces) {
    if (nodes.size() != forces.size())
        throw std::invalid_argument("LoadShape of part '" + part.name +
                                    "': " + std::to_string(forces.size()) + " forces for " +
                                    std::to_string(nodes.size()) + " nodes");
    LoadShape shape = fromModalForces(Vector(part.numModes, Real(0)));
    const size_t rows = 3 * size_t(part.mesh.numNodes());
    for (size_t k = 0; k < nodes.size(); ++k) {
        const int node = nodes[k];
        if (node < 0 || node >= part.mesh.numNodes())
            throw std::invalid_argument("LoadShape of part '" + part.name + "': node index " +
                                        std::to_string(node) + "; the mesh has nodes 0 to " +
                                        std::to_string(part.mesh.numNodes() - 1));
        const Vec3& f = forces[k];
        if (f == Vec3(0)) continue;
        const auto s = part.mesh.position(node);
        shape.force += f;
        shape.torque += Vec3(s[0], s[1], s[2]) % f;
        for (int i = 0; i < part.numModes; ++i) {
            const Vec3& phi = Vec3::getAs(&part.Phi[size_t(i) * rows + 3 * size_t(node)]);
            const Vec3 torque = phi % f;
            shape.modal[i] += ~phi * f;
            for (int a = 0; a < 3; ++a) shape.torquePerMode(a, i) += torque[a];
        }
    }
    return shape;
}

LoadShape LoadShape::nodeSetForce(const ReducedBody& part, const std::string& nodeSet,
                                  const Vec3& force) {
    return nodeForce(part, getNodeSet(part, nodeSet), force);
}

LoadShape LoadShape::nodeForce(const ReducedBody& part, const std::vector<int>& nodes,
                               const Vec3& force) {
    return fromNodalForces(part, nodes,
                           std::vector<Vec3>(nodes.size(), force / Real(nodes.size())));
}

LoadShape LoadShape::pressure(const ReducedBody& part, const std::string& nodeSet) {
    return integrate(part, getNodeSet(part, nodeSet), "node set '" + nodeSet + "'", calcPush);
}

LoadShape LoadShape::pressure(const ReducedBody& part, const std::vector<int>& nodes) {
    return integrate(part, nodes, "the list of nodes", calcPush);
}

LoadShape LoadShape::traction(const ReducedBody& part, const std::string& nodeSet,
                              const Vec3& forcePerArea) {
    return integrate(part, getNodeSet(part, nodeSet), "node set '" + nodeSet + "'",
                     [&](const Vec3& area) { return area.norm() * forcePerArea; });
}

LoadShape LoadShape::traction(const ReducedBody& part, const std::vector<int>& nodes,
                              const Vec3& forcePerArea) {
    return integrate(part, nodes, "the list of nodes",
                     [&](const Vec3& area) { return area.norm() * forcePerArea; });
}

}  // namespace simflex
