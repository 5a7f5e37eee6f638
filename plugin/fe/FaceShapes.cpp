#include "FaceShapes.h"

#include <cmath>

namespace simflex {
namespace {

constexpr double Quad[8][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1},
                               {0, -1},  {1, 0},  {0, 1}, {-1, 0}};
constexpr double Triangle[6][2] = {{0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}};

FaceShapes calcTriangle(bool quadratic, double xi, double eta) {
    FaceShapes s;
    const double L[3] = {1 - xi - eta, xi, eta};
    constexpr double dLdXi[3] = {-1, 1, 0}, dLdEta[3] = {-1, 0, 1};
    for (size_t k = 0; k < 3; ++k) {
        s.N[k] = quadratic ? L[k] * (2 * L[k] - 1) : L[k];
        const double slope = quadratic ? 4 * L[k] - 1 : 1;
        s.dXi[k] = slope * dLdXi[k];
        s.dEta[k] = slope * dLdEta[k];
        if (!quadratic) continue;
        const size_t next = (k + 1) % 3;
        s.N[3 + k] = 4 * L[k] * L[next];
        s.dXi[3 + k] = 4 * (dLdXi[k] * L[next] + L[k] * dLdXi[next]);
        s.dEta[3 + k] = 4 * (dLdEta[k] * L[next] + L[k] * dLdEta[next]);
    }
    return s;
}

FaceShapes calcQuad(bool quadratic, double xi, double eta) {
    FaceShapes s;
    for (size_t k = 0; k < 4; ++k) {
        const double a = Quad[k][0], b = Quad[k][1];
        const double p = 1 + a * xi, q = 1 + b * eta;
        const double r = quadratic ? a * xi + b * eta - 1 : 1;
        s.N[k] = 0.25 * p * q * r;
        s.dXi[k] = 0.25 * a * q * (quadratic ? r + p : 1);
        s.dEta[k] = 0.25 * b * p * (quadratic ? r + q : 1);
    }
    for (size_t k = 4; quadratic && k < 8; ++k) {
        const double a = Quad[k][0], b = Quad[k][1];
        if (a == 0) {
            s.N[k] = 0.5 * (1 - xi * xi) * (1 + b * eta);
            s.dXi[k] = -xi * (1 + b * eta);
            s.dEta[k] = 0.5 * b * (1 - xi * xi);
        } else {
            s.N[k] = 0.5 * (1 - eta * eta) * (1 + a * xi);
            s.dXi[k] = 0.5 * a * (1 - eta * eta);
            s.dEta[k] = -eta * (1 + a * xi);
        }
    }
    return s;
}

}  // namespace

FaceShapes calcFaceShapes(int numNodes, double xi, double eta) {
    return numNodes % 4 ? calcTriangle(numNodes == 6, xi, eta) : calcQuad(numNodes == 8, xi, eta);
}

std::array<double, 2> getFaceNodeCoordinates(int numNodes, int node) {
    const auto& at = numNodes % 4 ? Triangle[node] : Quad[node];
    return {at[0], at[1]};
}

bool isOnFace(int numNodes, double xi, double eta) {
    if (numNodes % 4) return xi >= 0 && eta >= 0 && xi + eta <= 1;
    return std::abs(xi) <= 1 && std::abs(eta) <= 1;
}

FacePoint calcFacePoint(const std::vector<Vec3d>& nodes, double xi, double eta) {
    FacePoint point;
    point.shapes = calcFaceShapes(int(nodes.size()), xi, eta);
    for (size_t k = 0; k < nodes.size(); ++k) {
        point.position = sumOf(point.position, point.shapes.N[k], nodes[k]);
        point.tangentXi = sumOf(point.tangentXi, point.shapes.dXi[k], nodes[k]);
        point.tangentEta = sumOf(point.tangentEta, point.shapes.dEta[k], nodes[k]);
    }
    return point;
}

std::vector<int> getFaceNodes(ElementType type, int face) {
    static const std::vector<std::vector<int>> Tet = {
        {0, 1, 2, 4, 5, 6}, {0, 3, 1, 7, 8, 4}, {1, 3, 2, 8, 9, 5}, {2, 3, 0, 9, 7, 6}};
    static const std::vector<std::vector<int>> Wedge = {{0, 1, 2, 6, 7, 8},
                                                        {3, 5, 4, 11, 10, 9},
                                                        {0, 3, 4, 1, 12, 9, 13, 6},
                                                        {1, 4, 5, 2, 13, 10, 14, 7},
                                                        {2, 5, 3, 0, 14, 11, 12, 8}};
    static const std::vector<std::vector<int>> Hex = {
        {0, 1, 2, 3, 8, 9, 10, 11},  {4, 7, 6, 5, 15, 14, 13, 12}, {0, 4, 5, 1, 16, 12, 17, 8},
        {1, 5, 6, 2, 17, 13, 18, 9}, {2, 6, 7, 3, 18, 14, 19, 10}, {3, 7, 4, 0, 19, 15, 16, 11}};
    const bool isTet = type == ElementType::Tet4 || type == ElementType::Tet10;
    const bool isWedge = type == ElementType::Wedge6 || type == ElementType::Wedge15;
    const auto& faces = isTet ? Tet : isWedge ? Wedge : Hex;
    if (face < 1 || size_t(face) > faces.size()) return {};
    std::vector<int> nodes = faces[size_t(face) - 1];
    const bool isLinear =
        type == ElementType::Tet4 || type == ElementType::Wedge6 || type == ElementType::Hex8;
    if (isLinear) nodes.resize(nodes.size() / 2);
    return nodes;
}

}  // namespace simflex
