#include "SolidElements.h"

#include <cmath>
#include <complex>
#include <stdexcept>

namespace simflex {
namespace {

using Complex = std::complex<double>;
using Point = std::array<Complex, 3>;

struct WeightedPoint {
    std::array<double, 3> xi;
    double weight;
};

constexpr int kHexCorners[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                   {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
constexpr int kHexEdges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                  {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
constexpr int kTetEdges[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
constexpr int kTriangleEdges[3][2] = {{0, 1}, {1, 2}, {2, 0}};

/** Values of the shape functions. **/
std::vector<Complex> calcShapes(ElementType type, const Point& x) {
    std::vector<Complex> N;
    switch (type) {
        case ElementType::Tet4:
        case ElementType::Tet10: {
            const Complex L[4] = {1.0 - x[0] - x[1] - x[2], x[0], x[1], x[2]};
            for (const Complex& l : L)
                N.push_back(type == ElementType::Tet4 ? l : l * (2.0 * l - 1.0));
            if (type == ElementType::Tet10)
                for (const auto& edge : kTetEdges) N.push_back(4.0 * L[edge[0]] * L[edge[1]]);
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
                for (const auto& edge : kTriangleEdges)
                    N.push_back(2.0 * L[edge[0]] * L[edge[1]] * (1.0 + end * x[2]));
            for (const Complex& l : L) N.push_back(l * bubble);
            break;
        }
        case ElementType::Hex8:
        case ElementType::Hex20: {
            const bool quadratic = type == ElementType::Hex20;
            for (const auto& c : kHexCorners) {
                const Complex a = double(c[0]) * x[0], b = double(c[1]) * x[1],
                              d = double(c[2]) * x[2];
                N.push_back(0.125 * (1.0 + a) * (1.0 + b) * (1.0 + d) *
                            (quadratic ? a + b + d - 2.0 : 1.0));
            }
            if (!quadratic) break;
            for (const auto& edge : kHexEdges) {
                Complex value = 0.25;
                for (int axis = 0; axis < 3; ++axis) {
                    const int at = (kHexCorners[edge[0]][axis] + kHexCorners[edge[1]][axis]) / 2;
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

/** Products of a line rule, x fastest. **/
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
    if (type == "C3D8" || type == "C3D20R") return makeHexRule({{-two, 1}, {two, 1}});
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
                                " are not known");
}

std::vector<IntegrationPoint> makePoints(const std::vector<WeightedPoint>& rule, ElementType type) {
    constexpr double kStep = 1e-30;  // derivatives by a complex step are exact
    std::vector<IntegrationPoint> points;
    for (const WeightedPoint& at : rule) {
        IntegrationPoint point;
        point.weight = at.weight;
        point.gradients.resize(size_t(numNodesOf(type)));
        for (size_t axis = 0; axis < 3; ++axis) {
            Point x{at.xi[0], at.xi[1], at.xi[2]};
            x[axis] += Complex(0, kStep);
            const auto N = calcShapes(type, x);
            for (size_t k = 0; k < N.size(); ++k) point.gradients[k][axis] = N[k].imag() / kStep;
            if (axis > 0) continue;
            for (const Complex& value : N) point.values.push_back(value.real());
        }
        points.push_back(std::move(point));
    }
    return points;
}

}  // namespace

std::vector<IntegrationPoint> makeIntegrationPoints(const std::string& calculixType,
                                                    ElementType type) {
    return makePoints(makeRule(calculixType), type);
}

std::vector<IntegrationPoint> makeBeamIntegrationPoints() {
    // Kronrod's five points about Gauss's two.
    const double inner = 1 / std::sqrt(3.0), outer = std::sqrt(6.0 / 7);
    const std::pair<double, double> line[5] = {{-outer, 98.0 / 495},
                                               {-inner, 27.0 / 55},
                                               {0, 28.0 / 45},
                                               {inner, 27.0 / 55},
                                               {outer, 98.0 / 495}};
    std::vector<WeightedPoint> rule;
    for (const auto& [z, wz] : line)
        for (const auto& [y, wy] : line)
            for (const double x : {-inner, inner}) rule.push_back({{x, y, z}, wy * wz});
    return makePoints(rule, ElementType::Hex20);
}

}  // namespace simflex
