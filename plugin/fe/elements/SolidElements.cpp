#include "SolidElements.h"

#include <Eigen/Dense>
#include <cmath>
#include <complex>
#include <map>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

const std::map<std::string, ElementType> Solids = {
    {"C3D4", ElementType::Tet4},
    {"C3D6", ElementType::Wedge6},
    {"C3D8", ElementType::Hex8},
    {"C3D8R", ElementType::Hex8},
    {IncompatibleSolid, ElementType::Hex8},
    {"C3D10", ElementType::Tet10},
    {"C3D10T", ElementType::Tet10},
    {"C3D15", ElementType::Wedge15},
    {"C3D20", ElementType::Hex20},
    {"C3D20R", ElementType::Hex20},
    {BeamSolid, ElementType::Hex20},
    {LayeredHex, ElementType::Hex20},
    {LayeredWedge, ElementType::Wedge15},
    {ShellHex, ElementType::Hex8},
    {ShellWedge, ElementType::Wedge6},
};

using Complex = std::complex<double>;
using Point = std::array<Complex, 3>;

struct WeightedPoint {
    Vec3d xi;
    double weight;
};

constexpr int HexCorners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                  {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
constexpr int HexEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                 {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr int TetEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
constexpr int TriangleEdges[3][2] = {{0, 1}, {1, 2}, {2, 0}};

/** Returns the values of the shape functions. **/
std::vector<Complex> calcShapes(ElementType type, const Point& x) {
    std::vector<Complex> N;
    switch (type) {
        case ElementType::Tet4:
        case ElementType::Tet10: {
            const Complex L[4] = {1.0 - x[0] - x[1] - x[2], x[0], x[1], x[2]};
            for (const Complex& l : L)
                N.push_back(type == ElementType::Tet4 ? l : l * (2.0 * l - 1.0));
            if (type == ElementType::Tet10)
                for (const auto& edge : TetEdges) N.push_back(4.0 * L[edge[0]] * L[edge[1]]);
            break;
        }
        case ElementType::Wedge6:
        case ElementType::Wedge15: {
            const Complex L[3] = {1.0 - x[0] - x[1], x[0], x[1]}, bubble = 1.0 - x[2] * x[2];
            const bool quadratic = type == ElementType::Wedge15;
            for (const double end : {-1.0, 1.0})
                for (const Complex& l : L)
                    N.push_back(0.5 * l * (1.0 + end * x[2]) * (quadratic ? 2.0 * l - 1.0 : 1.0) -
                                (quadratic ? 0.5 * l * bubble : 0.0));
            if (!quadratic) break;
            for (const double end : {-1.0, 1.0})
                for (const auto& edge : TriangleEdges)
                    N.push_back(2.0 * L[edge[0]] * L[edge[1]] * (1.0 + end * x[2]));
            for (const Complex& l : L) N.push_back(l * bubble);
            break;
        }
        case ElementType::Hex8:
        case ElementType::Hex20: {
            const bool quadratic = type == ElementType::Hex20;
            for (const auto& c : HexCorners) {
                const Complex a = double(c[0]) * x[0], b = double(c[1]) * x[1],
                              d = double(c[2]) * x[2];
                N.push_back(0.125 * (1.0 + a) * (1.0 + b) * (1.0 + d) *
                            (quadratic ? a + b + d - 2.0 : 1.0));
            }
            if (!quadratic) break;
            for (const auto& edge : HexEdges) {
                Complex value = 0.25;
                for (int axis = 0; axis < 3; ++axis) {
                    const int at = (HexCorners[edge[0]][axis] + HexCorners[edge[1]][axis]) / 2;
                    value *= at == 0 ? 1.0 - x[size_t(axis)] * x[size_t(axis)]
                                     : 1.0 + double(at) * x[size_t(axis)];
                }
                N.push_back(value);
            }
            break;
        }
    }
    return N;
}

/** Returns the tensor product of a line rule, x fastest. **/
std::vector<WeightedPoint> makeHexRule(const std::vector<std::pair<double, double>>& line) {
    std::vector<WeightedPoint> rule;
    for (const auto& [z, wz] : line)
        for (const auto& [y, wy] : line)
            for (const auto& [x, wx] : line) rule.push_back({{x, y, z}, wx * wy * wz});
    return rule;
}

std::vector<WeightedPoint> makeRule(const std::string& type) {
    const double two = 1 / std::sqrt(3.0), three = std::sqrt(0.6);
    if (type == "C3D8R") return makeHexRule({{0, 2}});
    if (type == "C3D8" || type == "C3D8I" || type == "C3D20R")
        return makeHexRule({{-two, 1}, {two, 1}});
    if (type == "C3D20" || type == "B32R")
        return makeHexRule({{-three, 5.0 / 9}, {0, 8.0 / 9}, {three, 5.0 / 9}});
    if (type == "C3D4") return {{{0.25, 0.25, 0.25}, 1.0 / 6}};
    if (type == "C3D10" || type == "C3D10T") {
        const double a = (5 + 3 * std::sqrt(5.0)) / 20, b = (5 - std::sqrt(5.0)) / 20;
        return {{{b, b, b}, 1.0 / 24},
                {{a, b, b}, 1.0 / 24},
                {{b, a, b}, 1.0 / 24},
                {{b, b, a}, 1.0 / 24}};
    }
    const double third = 1.0 / 3, sixth = 1.0 / 6;
    if (type == "C3D6") return {{{third, third, -two}, 0.5}, {{third, third, two}, 0.5}};
    if (type == "C3D15") {
        std::vector<WeightedPoint> rule;
        for (const double z : {-three, 0.0, three}) {
            const double weight = (z == 0 ? 8.0 / 9 : 5.0 / 9) / 6;
            rule.push_back({{sixth, sixth, z}, weight});
            rule.push_back({{4 * sixth, sixth, z}, weight});
            rule.push_back({{sixth, 4 * sixth, z}, weight});
        }
        return rule;
    }
    throw std::invalid_argument("the integration points of element type " + type +
                                " are not known, so that it has no stress and no geometric "
                                "stiffness; use C3D8 or C3D20R, of shells S8R");
}

ElementType findLinear(ElementType type) {
    switch (type) {
        case ElementType::Tet10:
            return ElementType::Tet4;
        case ElementType::Hex20:
            return ElementType::Hex8;
        case ElementType::Wedge15:
            return ElementType::Wedge6;
        default:
            return type;
    }
}

/** Natural coordinates of a node, and the corners adjacent to a mid-edge node. **/
struct Node {
    Vec3d xi{};
    std::array<int, 2> ends{};
};

std::vector<Node> getNodes(ElementType type) {
    std::vector<Node> nodes;
    std::vector<std::array<int, 2>> edges;
    const ElementType linear = findLinear(type);
    if (linear == ElementType::Tet4) {
        for (int k = 0; k < 4; ++k)
            nodes.push_back({{double(k == 1), double(k == 2), double(k == 3)}, {k, k}});
        for (const auto& edge : TetEdges) edges.push_back({edge[0], edge[1]});
    } else if (linear == ElementType::Wedge6) {
        for (int k = 0; k < 6; ++k)
            nodes.push_back({{double(k % 3 == 1), double(k % 3 == 2), k < 3 ? -1.0 : 1.0}, {k, k}});
        for (const int first : {0, 3})
            for (const auto& edge : TriangleEdges)
                edges.push_back({first + edge[0], first + edge[1]});
        for (int k = 0; k < 3; ++k) edges.push_back({k, k + 3});
    } else {
        for (int k = 0; k < 8; ++k) {
            const auto& c = HexCorners[k];
            nodes.push_back({{double(c[0]), double(c[1]), double(c[2])}, {k, k}});
        }
        for (const auto& edge : HexEdges) edges.push_back({edge[0], edge[1]});
    }
    if (type == linear) return nodes;
    for (const auto& ends : edges) {
        Node middle{{}, ends};
        for (size_t a = 0; a < 3; ++a)
            middle.xi[a] = 0.5 * (nodes[size_t(ends[0])].xi[a] + nodes[size_t(ends[1])].xi[a]);
        nodes.push_back(middle);
    }
    return nodes;
}

std::vector<IntegrationPoint> makePoints(const std::vector<WeightedPoint>& rule, ElementType type) {
    constexpr double Step = 1e-30;  // derivatives by complex step are exact
    std::vector<IntegrationPoint> points;
    for (const WeightedPoint& at : rule) {
        IntegrationPoint point;
        point.xi = at.xi;
        point.weight = at.weight;
        point.gradients.resize(size_t(numNodesOf(type)));
        for (size_t axis = 0; axis < 3; ++axis) {
            Point x{at.xi[0], at.xi[1], at.xi[2]};
            x[axis] += Complex(0, Step);
            const auto N = calcShapes(type, x);
            for (size_t k = 0; k < N.size(); ++k) point.gradients[k][axis] = N[k].imag() / Step;
            if (axis > 0) continue;
            for (const Complex& value : N) point.values.push_back(value.real());
        }
        points.push_back(std::move(point));
    }
    return points;
}

}  // namespace

const ElementType* findSolid(const std::string& type) {
    const auto found = Solids.find(type);
    return found == Solids.end() ? nullptr : &found->second;
}

ElementType getSolid(const std::string& type) {
    return Solids.at(type);
}

bool isShell(const std::string& type) {
    return type == ShellHex || type == ShellWedge;
}

std::vector<std::string> listSolids() {
    std::vector<std::string> types;
    for (const auto& solid : Solids) types.push_back(solid.first);
    return types;
}

std::vector<IntegrationPoint> makeIntegrationPoints(const std::string& calculixType,
                                                    ElementType type) {
    return makePoints(makeRule(calculixType), type);
}

std::vector<SectionPoint> makeFullSection() {
    // Kronrod's five-point extension of the two-point Gauss rule.
    const double inner = 1 / std::sqrt(3.0), outer = std::sqrt(6.0 / 7);
    const std::pair<double, double> line[5] = {{-outer, 98.0 / 495},
                                               {-inner, 27.0 / 55},
                                               {0, 28.0 / 45},
                                               {inner, 27.0 / 55},
                                               {outer, 98.0 / 495}};
    std::vector<SectionPoint> points;
    for (const auto& [z, wz] : line)
        for (const auto& [y, wy] : line) points.push_back({y, z, wy * wz});
    return points;
}

std::vector<IntegrationPoint> makeBeamPoints(const std::vector<SectionPoint>& section) {
    const double along = 1 / std::sqrt(3.0);
    std::vector<WeightedPoint> rule;
    for (const SectionPoint& at : section)
        for (const double x : {-along, along}) rule.push_back({{x, at.eta, at.zeta}, at.weight});
    return makePoints(rule, ElementType::Hex20);
}

std::vector<IntegrationPoint> makeLayerPoints(ElementType type, double from, double to) {
    constexpr double Sixth = 1.0 / 6;
    std::vector<WeightedPoint> rule;
    if (type == ElementType::Hex20) {
        rule = makeRule("C3D20R");
    } else {
        for (const double z : {-1 / std::sqrt(3.0), 1 / std::sqrt(3.0)})
            for (const auto& [x, y] : {std::pair(Sixth, Sixth), std::pair(4 * Sixth, Sixth),
                                       std::pair(Sixth, 4 * Sixth)})
                rule.push_back({{x, y, z}, Sixth});
    }
    for (WeightedPoint& at : rule) {
        at.xi[2] = 0.5 * (from + to + (to - from) * at.xi[2]);
        at.weight *= 0.5 * (to - from);
    }
    return makePoints(rule, type);
}

std::vector<std::array<double, 2>> listShellStressPlaces(const std::string& type) {
    if (type == ShellWedge) return {{1.0 / 3, 1.0 / 3}};
    const double g = 1 / std::sqrt(3.0);
    return {{-g, -g}, {g, -g}, {-g, g}, {g, g}};
}

/** Lower and upper faces separately. **/
std::vector<double> makeShellExtrapolation(const std::string& type) {
    const auto places = listShellStressPlaces(type);
    const size_t count = places.size(), numCorners = type == ShellWedge ? 3 : 4;
    std::vector<double> result(2 * numCorners * 2 * count, 0);
    for (size_t corner = 0; corner < numCorners; ++corner)
        for (size_t p = 0; p < count; ++p) {
            double share = 1;
            if (count > 1)
                for (size_t a = 0; a < 2; ++a)
                    share *= 0.5 + 1.5 * HexCorners[corner][a] * places[p][a];
            for (const size_t face : {0, 1})
                result[(face * numCorners + corner) * 2 * count + face * count + p] = share;
        }
    return result;
}

bool hasExtrapolation(const std::string& calculixType) {
    return calculixType != LayeredHex && calculixType != LayeredWedge;
}

std::vector<double> makeExtrapolation(const std::string& calculixType, ElementType type) {
    if (calculixType == BeamSolid) return makeExtrapolation("C3D20R", type);
    if (isShell(calculixType)) return makeShellExtrapolation(calculixType);
    const auto rule = makeRule(calculixType);
    const auto nodes = getNodes(type);
    const ElementType linear = findLinear(type);
    const size_t numCorners = size_t(numNodesOf(linear));
    // Functions fitted to the values at the points, by least squares if there are more points.
    const auto fitted = [&](const Vec3d& x) -> std::vector<double> {
        if (calculixType == "C3D8R" || calculixType == "C3D4") return {1};
        if (calculixType == "C3D6") return {1, x[2]};
        if (calculixType == "C3D15") return {1, x[0], x[1], x[2], x[0] * x[2], x[1] * x[2]};
        std::vector<double> values;
        for (const Complex& N :
             calcShapes(calculixType == "C3D20" ? type : linear, {x[0], x[1], x[2]}))
            values.push_back(N.real());
        return values;
    };
    const auto toMatrix = [&](size_t count, const auto& place) {
        Eigen::MatrixXd F(Eigen::Index(count), Eigen::Index(fitted(place(0)).size()));
        for (size_t k = 0; k < count; ++k) {
            const auto row = fitted(place(k));
            F.row(Eigen::Index(k)) =
                Eigen::Map<const Eigen::RowVectorXd>(row.data(), Eigen::Index(row.size()));
        }
        return F;
    };
    const Eigen::MatrixXd atPoints = toMatrix(rule.size(), [&](size_t k) { return rule[k].xi; });
    Eigen::MatrixXd A = toMatrix(nodes.size(), [&](size_t k) { return nodes[k].xi; }) *
                        calcColumnSpace(atPoints).pseudoInverse;
    if (calculixType != "C3D20")
        for (size_t k = numCorners; k < nodes.size(); ++k)
            A.row(Eigen::Index(k)) = 0.5 * (A.row(nodes[k].ends[0]) + A.row(nodes[k].ends[1]));
    std::vector<double> result;
    for (Eigen::Index k = 0; k < A.rows(); ++k)
        for (Eigen::Index p = 0; p < A.cols(); ++p) result.push_back(A(k, p));
    return result;
}

std::vector<double> makeRoundExtrapolation() {
    std::vector<double> result = makeExtrapolation(BeamSolid, ElementType::Hex20);
    const std::vector<double> square = result;
    const size_t numPoints = square.size() / 20;
    // Corners at 1/√2 of theirs, between all four of their end.
    constexpr size_t Ends[2][4] = {{0, 3, 7, 4}, {1, 2, 6, 5}};
    for (const auto& end : Ends)
        for (size_t k = 0; k < 4; ++k)
            for (size_t p = 0; p < numPoints; ++p) {
                double value = 0;
                for (size_t l = 0; l < 4; ++l) {
                    const double same = 0.5 + std::sqrt(0.125), other = 0.5 - std::sqrt(0.125);
                    const double weight = k == l             ? same * same
                                          : (k + 2) % 4 == l ? other * other
                                                             : same * other;
                    value += weight * square[end[l] * numPoints + p];
                }
                result[end[k] * numPoints + p] = value;
            }
    // The middle of an edge along the beam is one of such corners.
    constexpr size_t Along[4][3] = {{8, 0, 1}, {10, 3, 2}, {14, 7, 6}, {12, 4, 5}};
    for (const auto& [middle, from, to] : Along)
        for (size_t p = 0; p < numPoints; ++p)
            result[middle * numPoints + p] =
                0.5 * (result[from * numPoints + p] + result[to * numPoints + p]);
    return result;
}

std::array<Vec3d, 3> calcTangents(const std::vector<Vec3d>& positions,
                                  const IntegrationPoint& point) {
    Vec3d first{}, second{}, third{};  // separate variables stay in registers
    for (size_t k = 0; k < point.gradients.size(); ++k) {
        const Vec3d &x = positions[k], &g = point.gradients[k];
        for (size_t a = 0; a < 3; ++a) {
            first[a] += x[a] * g[0];
            second[a] += x[a] * g[1];
            third[a] += x[a] * g[2];
        }
    }
    return {first, second, third};
}

double calcDeterminant(const std::array<Vec3d, 3>& tangents) {
    const Vec3d normal = cross(tangents[1], tangents[2]);
    return tangents[0][0] * normal[0] + tangents[0][1] * normal[1] + tangents[0][2] * normal[2];
}

std::vector<IntegrationPoint> makeCornerPoints(ElementType type) {
    const ElementType linear = findLinear(type);
    std::vector<WeightedPoint> corners;
    for (const Node& node : getNodes(linear)) corners.push_back({node.xi, 1});
    return makePoints(corners, linear);
}

std::vector<std::array<int, 2>> getEdgeEnds(ElementType type) {
    std::vector<std::array<int, 2>> ends;
    for (const Node& node : getNodes(type)) ends.push_back(node.ends);
    return ends;
}

double calcGradients(const std::vector<Vec3d>& positions, const IntegrationPoint& point,
                     std::vector<Vec3d>& gradients) {
    const auto columns = calcTangents(positions, point);
    const Vec3d rows[3] = {cross(columns[1], columns[2]), cross(columns[2], columns[0]),
                           cross(columns[0], columns[1])};
    const double determinant = calcDeterminant(columns);
    gradients.assign(positions.size(), Vec3d{0, 0, 0});
    for (size_t k = 0; k < positions.size(); ++k)
        for (size_t b = 0; b < 3; ++b)
            for (size_t a = 0; a < 3; ++a)
                gradients[k][a] += point.gradients[k][b] * rows[b][a] / determinant;
    return std::abs(determinant) * point.weight;
}

}  // namespace simflex
