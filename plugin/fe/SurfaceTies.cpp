#include "SurfaceTies.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace simflex {
namespace {

constexpr double FirstStep = 0.25, LastStep = 1e-10;
constexpr double Snap = 1e-7;  // points closer than this to a corner or mid-edge node are moved
                               // there

double distanceSquared(const Vec3d& a, const Vec3d& b) {
    const Vec3d d = sumOf(a, -1, b);
    return dot(d, d);
}

/** Returns ξ, η of the face point nearest to a point, by a pattern search, since faces may be
curved. **/
std::array<double, 2> searchNearest(const std::vector<Vec3d>& nodes, const Vec3d& point) {
    const int size = int(nodes.size());
    const double lowest = size % 4 ? 0 : -1;
    std::array<double, 2> best{lowest, lowest};
    double least = std::numeric_limits<double>::infinity();
    const auto tryPlace = [&](double xi, double eta) {
        if (!isOnFace(size, xi, eta)) return false;
        const double distance = distanceSquared(calcFacePoint(nodes, xi, eta).position, point);
        if (!(distance < least)) return false;
        least = distance;
        best = {xi, eta};
        return true;
    };
    for (double xi = lowest; xi <= 1; xi += FirstStep)
        for (double eta = lowest; eta <= 1; eta += FirstStep) tryPlace(xi, eta);
    for (double step = FirstStep; step > LastStep;) {
        const auto center = best;
        bool moved = false;
        for (int i = -1; i <= 1; ++i)
            for (int j = -1; j <= 1; ++j)
                if (i || j) moved |= tryPlace(center[0] + i * step, center[1] + j * step);
        if (!moved) step /= 4;
    }
    // Refine by Newton inside the face: ∂x/∂ξ·g = ∂x/∂η·g = 0 (without curvature terms).
    for (int iteration = 0; iteration < 3; ++iteration) {
        const FacePoint at = calcFacePoint(nodes, best[0], best[1]);
        const Vec3d gap = sumOf(point, -1, at.position);
        const double a = dot(at.tangentXi, at.tangentXi), b = dot(at.tangentXi, at.tangentEta),
                     c = dot(at.tangentEta, at.tangentEta);
        const double f = dot(at.tangentXi, gap), g = dot(at.tangentEta, gap);
        const double determinant = a * c - b * b;
        if (!(determinant > 0)) break;
        tryPlace(best[0] + (c * f - b * g) / determinant, best[1] + (a * g - b * f) / determinant);
    }
    for (double& x : best) {
        const double near = std::round(2 * x) / 2;
        if (std::abs(x - near) < Snap) x = near;
    }
    return best;
}

Vec3d normalOf(const FacePoint& at) {
    const Vec3d n = cross(at.tangentXi, at.tangentEta);
    return sumOf({0, 0, 0}, 1 / normOf(n), n);
}

/** Returns a, b of the gap's component in the face's tangent plane. **/
std::array<double, 2> tangentPart(const FacePoint& at, const Vec3d& gap) {
    const double a = dot(at.tangentXi, at.tangentXi), b = dot(at.tangentXi, at.tangentEta),
                 c = dot(at.tangentEta, at.tangentEta);
    const double f = dot(at.tangentXi, gap), g = dot(at.tangentEta, gap);
    const double determinant = a * c - b * b;
    return {(c * f - b * g) / determinant, (a * g - b * f) / determinant};
}

}  // namespace

TieSurface::TieSurface(std::vector<TieFace> faces) : m_faces(std::move(faces)) {
    double sum = 0;
    size_t numTriangles = 0;
    for (const TieFace& face : m_faces) {
        Box box{face.positions[0], face.positions[0]};
        double reach = 0;
        for (const Vec3d& x : face.positions) {
            for (size_t a = 0; a < 3; ++a) {
                box.low[a] = std::min(box.low[a], x[a]);
                box.high[a] = std::max(box.high[a], x[a]);
            }
            reach = std::max(reach, std::sqrt(distanceSquared(x, face.positions[0])));
        }
        // A curved face extends beyond the box of its nodes by less than a quarter of its size.
        for (size_t a = 0; a < 3 && face.nodes.size() > 4; ++a) {
            box.low[a] -= 0.25 * reach;
            box.high[a] += 0.25 * reach;
        }
        m_boxes.push_back(box);
        const size_t numCorners = face.nodes.size() % 4 ? 3 : 4;
        for (size_t k = 2; k < numCorners; ++k) {
            const Vec3d &p = face.positions[0], &q = face.positions[k - 1], &r = face.positions[k];
            // Distance from the centroid to an edge: a third of the height.
            sum += normOf(cross(sumOf(q, -1, p), sumOf(r, -1, p))) / normOf(sumOf(q, -1, p)) / 3;
            ++numTriangles;
        }
    }
    if (numTriangles) m_defaultTolerance = 0.025 * sum / double(numTriangles);
}

TiePlace TieSurface::findPlace(const Vec3d& point) const {
    std::vector<std::pair<double, int>> order;
    order.reserve(m_boxes.size());
    for (size_t face = 0; face < m_boxes.size(); ++face) {
        double distance = 0;
        for (size_t a = 0; a < 3; ++a) {
            const double outside =
                std::max({0.0, m_boxes[face].low[a] - point[a], point[a] - m_boxes[face].high[a]});
            distance += outside * outside;
        }
        order.emplace_back(distance, int(face));
    }
    std::make_heap(order.begin(), order.end(), std::greater<>());
    TiePlace best;
    double least = std::numeric_limits<double>::infinity();
    while (!order.empty()) {
        std::pop_heap(order.begin(), order.end(), std::greater<>());
        const auto [nearest, face] = order.back();
        order.pop_back();
        if (nearest > least) break;
        const auto at = searchNearest(m_faces[size_t(face)].positions, point);
        const FacePoint place = calcFacePoint(m_faces[size_t(face)].positions, at[0], at[1]);
        const double distance = distanceSquared(place.position, point);
        if (!(distance < least)) continue;
        least = distance;
        best.face = face;
        best.xi = at[0];
        best.eta = at[1];
        best.position = place.position;
        const Vec3d gap = sumOf(point, -1, place.position), n = normalOf(place);
        best.normalGap = std::abs(dot(gap, n));
        best.tangentGap = normOf(sumOf(gap, -dot(gap, n), n));
    }
    return best;
}

std::vector<std::array<double, 9>> calcTieCoefficients(const std::vector<Vec3d>& face, double xi,
                                                       double eta, const Vec3d& slave) {
    constexpr double NoGap = 1e-13;
    const FacePoint at = calcFacePoint(face, xi, eta);
    Vec3d gap = sumOf(slave, -1, at.position);
    const Vec3d normal = cross(at.tangentXi, at.tangentEta);
    const double area = normOf(normal);
    const Vec3d n = sumOf({0, 0, 0}, 1 / area, normal);
    if (normOf(gap) <= NoGap * (std::sqrt(area) + normOf(slave))) gap = {0, 0, 0};
    const double d = dot(gap, n);
    const auto [a, b] = tangentPart(at, gap);
    std::vector<std::array<double, 9>> W(face.size());
    for (size_t k = 0; k < face.size(); ++k) {
        const double along = at.shapes.N[k] + a * at.shapes.dXi[k] + b * at.shapes.dEta[k];
        for (size_t column = 0; column < 3; ++column) {
            Vec3d e{};
            e[column] = 1;
            // δn of a unit translation of the node: the component of δ(t₁×t₂) normal to n, divided
            // by its length.
            Vec3d turn = sumOf(sumOf({0, 0, 0}, at.shapes.dXi[k], cross(e, at.tangentEta)),
                               at.shapes.dEta[k], cross(at.tangentXi, e));
            turn = sumOf(turn, -dot(turn, n), n);
            for (size_t row = 0; row < 3; ++row)
                W[k][3 * row + column] = (row == column ? along : 0) + d / area * turn[row];
        }
    }
    return W;
}

}  // namespace simflex
