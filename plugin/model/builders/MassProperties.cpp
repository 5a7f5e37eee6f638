#include "simflex/model/builders/MassProperties.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <utility>

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

Mat33 outer(const Vec3& a, const Vec3& b) {
    return a * ~b;
}

SolidMoments makeDiagonal(double volume, const Vec3& second) {
    SolidMoments moments;
    moments.volume = volume;
    moments.second = Mat33(second[0], 0, 0, 0, second[1], 0, 0, 0, second[2]);
    return moments;
}

std::string formatNumbers(const char* text, double a, double b = 0, double c = 0) {
    char buffer[200];
    std::snprintf(buffer, sizeof buffer, text, a, b, c);
    return buffer;
}

/** Requires that faces traverse each edge equally often in both directions. **/
void checkClosed(const PolygonalMesh& mesh, const std::string& name) {
    std::map<std::pair<int, int>, int> passes;  // uses of an edge, by direction
    for (int f = 0; f < mesh.getNumFaces(); ++f) {
        const int n = mesh.getNumVerticesForFace(f);
        for (int k = 0; k < n; ++k)
            ++passes[{mesh.getFaceVertex(f, k), mesh.getFaceVertex(f, (k + 1) % n)}];
    }
    for (const auto& [edge, count] : passes) {
        if (edge.first == edge.second) continue;
        const auto back = passes.find({edge.second, edge.first});
        const int other = back == passes.end() ? 0 : back->second;
        if (count == other) continue;
        const Vec3 p = mesh.getVertexPosition(edge.first);
        const std::string place = formatNumbers("near (%.6g, %.6g, %.6g) m", p[0], p[1], p[2]);
        if (count + other == 1)
            throw std::invalid_argument("the mesh '" + name + "' is not closed: it has a hole " +
                                        place + "; give mass and inertia, or mend the mesh");
        throw std::invalid_argument("faces of the mesh '" + name +
                                    "' are oriented inconsistently " + place +
                                    "; give mass and inertia, or mend the mesh");
    }
}

}  // namespace

SolidMoments& SolidMoments::operator+=(const SolidMoments& other) {
    const double sum = volume + other.volume;
    center = (volume * center + other.volume * other.center) / sum;
    volume = sum;
    second += other.second;
    return *this;
}

SolidMoments SolidMoments::moved(const Transform& X) const {
    SolidMoments result;
    result.volume = volume;
    result.center = X * center;
    // Second moments about the centroid rotate with X.R().
    const Mat33 central = second - volume * outer(center, center);
    const Mat33 R = X.R().asMat33();
    result.second = R * central * ~R + volume * outer(result.center, result.center);
    return result;
}

SimTK::MassProperties SolidMoments::calcMassProperties(double density) const {
    const Mat33& S = second;
    const double trace = S(0, 0) + S(1, 1) + S(2, 2);
    const double rho = density;
    const Inertia aboutOrigin(rho * Vec3(trace - S(0, 0), trace - S(1, 1), trace - S(2, 2)),
                              -rho * Vec3(S(0, 1), S(0, 2), S(1, 2)));
    return SimTK::MassProperties(rho * volume, center, aboutOrigin);
}

SolidMoments calcBoxMoments(const Vec3& sides) {
    const double volume = sides[0] * sides[1] * sides[2];
    return makeDiagonal(volume,
                        volume / 12 * Vec3(square(sides[0]), square(sides[1]), square(sides[2])));
}

SolidMoments calcSphereMoments(double radius) {
    const double volume = 4 * Pi / 3 * cube(radius);
    return makeDiagonal(volume, Vec3(volume * square(radius) / 5));
}

SolidMoments calcCylinderMoments(double radius, double length, CoordinateAxis axis) {
    const double volume = Pi * square(radius) * length;
    Vec3 second(volume * square(radius) / 4);
    second[axis] = volume * square(length) / 12;
    return makeDiagonal(volume, second);
}

SolidMoments calcMeshMoments(const PolygonalMesh& mesh, const std::string& name) {
    if (mesh.getNumFaces() < 4)
        throw std::invalid_argument("the mesh '" + name + "' has " +
                                    std::to_string(mesh.getNumFaces()) +
                                    " faces; a solid has at least four");
    checkClosed(mesh, name);
    Vec3 middle(0), low(Infinity), high(-Infinity);
    for (int i = 0; i < mesh.getNumVertices(); ++i) {
        const Vec3& p = mesh.getVertexPosition(i);
        middle += p / mesh.getNumVertices();
        for (int a = 0; a < 3; ++a)
            low[a] = std::min(low[a], p[a]), high[a] = std::max(high[a], p[a]);
    }
    // Use tetrahedra (middle, a, b, c) to avoid cancellation far from the origin.
    double volume = 0;
    Vec3 first(0);
    Mat33 second(0);
    for (int f = 0; f < mesh.getNumFaces(); ++f) {
        const Vec3 a = mesh.getVertexPosition(mesh.getFaceVertex(f, 0)) - middle;
        for (int k = 1; k + 1 < mesh.getNumVerticesForFace(f); ++k) {
            const Vec3 b = mesh.getVertexPosition(mesh.getFaceVertex(f, k)) - middle;
            const Vec3 c = mesh.getVertexPosition(mesh.getFaceVertex(f, k + 1)) - middle;
            const double v = dot(a, b % c) / 6;
            const Vec3 sum = a + b + c;
            volume += v;
            first += v / 4 * sum;
            second += v / 20 * (outer(sum, sum) + outer(a, a) + outer(b, b) + outer(c, c));
        }
    }
    const Vec3 box = high - low;
    if (std::abs(volume) <= 1e-9 * box[0] * box[1] * box[2] || volume == 0)
        throw std::invalid_argument("the mesh '" + name + "' encloses no volume");
    SolidMoments moments;
    moments.volume = std::abs(volume);
    moments.center = first / volume;
    moments.second = volume > 0 ? second : Mat33(-1 * second);  // inside out
    return moments.moved(Transform(middle));
}

void checkInertia(double mass, const Mat33& inertia) {
    if (!(mass > 0) || !std::isfinite(mass))
        throw std::invalid_argument(
            formatNumbers("the mass is %.6g kg; it must be more than 0", mass));
    Vector_<std::complex<Real>> values;
    Matrix dense(3, 3);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) dense(i, j) = inertia(i, j);
    Eigen(dense).getAllEigenValues(values);
    Vec3 I(values[0].real(), values[1].real(), values[2].real());
    std::sort(&I[0], &I[0] + 3);
    const std::string found =
        formatNumbers("its principal moments are %.6g, %.6g and %.6g kg m²", I[0], I[1], I[2]);
    if (!(I[0] > 0)) throw std::invalid_argument("the inertia is not positive: " + found);
    if (I[2] > (I[0] + I[1]) * (1 + 1e-9))
        throw std::invalid_argument("no body has this inertia: " + found +
                                    ", and the largest is more than the other two together");
}

}  // namespace model
}  // namespace simflex
