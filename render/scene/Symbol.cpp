#include "Symbol.h"

#include <cmath>

namespace simflex {

using SimTK::Array_;
using SimTK::UnitVec3;
using SimTK::Vec3;

void Symbol::addWire(const std::vector<Vec3>& points_G, double radius, const Vec3& color) {
    constexpr int around = 12;
    const std::size_t count = points_G.size();
    if (count < 2) return;
    SimTK::PolygonalMesh mesh;
    Vec3 side(0);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3 along = points_G[std::min(i + 1, count - 1)] - points_G[i == 0 ? 0 : i - 1];
        if (!(along.norm() > 0)) return;
        const UnitVec3 tangent(along);
        // Transport the previous ring with minimal rotation.
        side -= SimTK::dot(side, Vec3(tangent)) * Vec3(tangent);
        side = side.norm() > 1e-6 ? side / side.norm() : Vec3(tangent.perp());
        const Vec3 up = SimTK::cross(Vec3(tangent), side);
        for (int k = 0; k < around; ++k) {
            const double angle = 2 * SimTK::Pi * k / around;
            mesh.addVertex(points_G[i] + radius * (std::cos(angle) * side + std::sin(angle) * up));
        }
    }
    for (int i = 0; i + 1 < int(count); ++i)
        for (int k = 0; k < around; ++k) {
            const int a = i * around + k, b = i * around + (k + 1) % around;
            Array_<int> face;
            for (const int vertex : {a, b, b + around, a + around}) face.push_back(vertex);
            mesh.addFace(face);
        }
    add(SimTK::DecorativeMesh(mesh), SimTK::Transform(), color);
}

}  // namespace simflex
