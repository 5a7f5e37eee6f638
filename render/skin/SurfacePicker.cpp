#include "SurfacePicker.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace simflex {

using SimTK::Vec3;

namespace {

constexpr int stride = SurfaceGeometry::floatsPerVertex;
constexpr double roundOff = 1e-6;  // of positions in single precision

Vec3 getPosition(const SurfaceGeometry& geometry, std::uint32_t vertex) {
    const float* p = &geometry.vertices[std::size_t(vertex) * stride];
    return Vec3(p[0], p[1], p[2]);
}

bool hides(const SurfaceItem& item) {
    const bool isFilled = item.representation == SimTK::DecorativeGeometry::DrawSurface ||
                          item.representation == SimTK::DecorativeGeometry::DrawDefault;
    return isFilled && !item.isTransparent();
}

}  // namespace

SurfacePicker::SurfacePicker(const FrameSnapshot& frame) : snapshot(frame) {
    painter.deform(snapshot);
    for (std::size_t i = 0; i < snapshot.parts.size(); ++i)
        partScene.surfaces.push_back(painter.makeItem(snapshot, i));
}

SurfacePicker::Ray SurfacePicker::calcRay(const ViewSnapshot& view, double x, double y) const {
    const Camera& camera = view.camera;
    const double size = camera.calcPixelSize(1, view.height);
    const Vec3 offset((x - view.left - 0.5 * view.width) * size,
                      (0.5 * view.height - (y - view.top)) * size, 0);
    if (camera.isOrthographic) return {camera.X_GC * offset, -Vec3(camera.X_GC.R().z())};
    return {camera.X_GC.p(), camera.X_GC.R() * (offset - Vec3(0, 0, 1))};
}

// Möller–Trumbore intersection. Closed surfaces are hit from outside only, as drawn.
void SurfacePicker::intersect(const Ray& ray_G, const SurfaceItem& item, int part,
                              Hit& nearest) const {
    const SurfaceGeometry& geometry = *item.geometry;
    Vec3 origin = ~item.X_GM * ray_G.origin, direction = ~item.X_GM.R() * ray_G.direction;
    for (int k = 0; k < 3; ++k) {
        origin[k] /= item.scale[k];
        direction[k] /= item.scale[k];
    }
    const double slack = 1e-9;  // keeps rays along an edge from slipping through
    const std::vector<std::uint32_t>& triangles = geometry.triangles;
    std::size_t found = triangles.size();
    double b1 = 0, b2 = 0;
    for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
        const Vec3 p0 = getPosition(geometry, triangles[t]);
        const Vec3 e1 = getPosition(geometry, triangles[t + 1]) - p0,
                   e2 = getPosition(geometry, triangles[t + 2]) - p0;
        const Vec3 P = direction % e2;
        const double det = SimTK::dot(e1, P);
        if (det == 0 || (geometry.isClosed && det < 0)) continue;
        const Vec3 T = origin - p0;
        const double u = SimTK::dot(T, P) / det;
        if (!(u >= -slack && u <= 1 + slack)) continue;
        const Vec3 Q = T % e1;
        const double v = SimTK::dot(direction, Q) / det;
        if (!(v >= -slack && u + v <= 1 + slack)) continue;
        const double distance = SimTK::dot(e2, Q) / det;
        if (!(distance > 0 && distance < nearest.distance)) continue;
        nearest.distance = distance;
        found = t;
        b1 = u;
        b2 = v;
    }
    if (found == triangles.size()) return;

    nearest.part = part;
    nearest.location_G = ray_G.origin + nearest.distance * ray_G.direction;
    nearest.skinNode = -1;
    nearest.value = SimTK::NaN;
    if (part < 0) return;
    const double weights[] = {1 - b1 - b2, b1, b2};
    nearest.value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t vertex = triangles[found + k];
        nearest.value += weights[k] * double(geometry.vertices[vertex * stride + 6]);
    }
    // Points between nodes are represented by the nodes of their face.
    const SkinModes& skin = *snapshot.parts[std::size_t(part)].skin;
    std::set<int> candidates;
    for (std::size_t k = 0; k < 3; ++k) {
        const int point = skin.vertexPoint[triangles[found + k]], between = point - skin.numNodes();
        if (between < 0)
            candidates.insert(point);
        else
            for (int i = skin.between.starts[between]; i < skin.between.starts[between + 1]; ++i)
                candidates.insert(skin.between.nodes[i]);
    }
    double least = SimTK::Infinity;
    for (const int node : candidates) {
        const double away = (calcLocation(part, node) - nearest.location_G).normSqr();
        if (away >= least) continue;
        least = away;
        nearest.skinNode = node;
    }
}

std::optional<SurfacePicker::Hit> SurfacePicker::cast(double x, double y) const {
    const ViewSnapshot* view = nullptr;  // the topmost view at this position
    for (const ViewSnapshot& candidate : snapshot.views)
        if (x >= candidate.left && x < candidate.left + candidate.width && y >= candidate.top &&
            y < candidate.top + candidate.height)
            view = &candidate;
    if (!view) return std::nullopt;
    const Ray ray = calcRay(*view, x, y);
    Hit nearest;
    nearest.distance = SimTK::Infinity;
    for (const SurfaceItem& item : snapshot.scene.surfaces)
        if (hides(item)) intersect(ray, item, -1, nearest);
    for (std::size_t i = 0; i < partScene.surfaces.size(); ++i)
        if (snapshot.parts[i].look.isVisible && hides(partScene.surfaces[i]))
            intersect(ray, partScene.surfaces[i], int(i), nearest);
    if (!std::isfinite(nearest.distance)) return std::nullopt;
    return nearest;
}

int SurfacePicker::findVertex(int part, int skinNode) const {
    const std::vector<int>& vertexPoint = snapshot.parts[std::size_t(part)].skin->vertexPoint;
    return int(std::find(vertexPoint.begin(), vertexPoint.end(), skinNode) - vertexPoint.begin());
}

Vec3 SurfacePicker::calcLocation(int part, int skinNode) const {
    const SurfaceItem& item = partScene.surfaces[std::size_t(part)];
    return item.X_GM * getPosition(*item.geometry, std::uint32_t(findVertex(part, skinNode)));
}

Vec3 SurfacePicker::calcInnerLocation(int part, int node) const {
    const PartSnapshot& motion = snapshot.parts[std::size_t(part)];
    const DeformedSurface surface(motion.skin);
    return motion.X_GD * surface.calcNodePosition(node, motion.xi,
                                                  snapshot.partStyle.deformationFactor,
                                                  motion.reference);
}

double SurfacePicker::getValue(int part, int skinNode) const {
    const PartSnapshot& snapshotOfPart = snapshot.parts[std::size_t(part)];
    if (!snapshotOfPart.field) return SimTK::NaN;
    return double(partScene.surfaces[std::size_t(part)]
                      .geometry->vertices[std::size_t(findVertex(part, skinNode)) * stride + 6]);
}

Vec3 SurfacePicker::calcPixel(const Vec3& point_G) const {
    const ViewSnapshot& view = snapshot.views.front();
    return view.camera.calcPixel(point_G, view.width, view.height) + Vec3(view.left, view.top, 0);
}

bool SurfacePicker::isVisible(const Vec3& point_G) const {
    const ViewSnapshot& view = snapshot.views.front();
    const Vec3 pixel = calcPixel(point_G);
    if (!(pixel[2] > 0) || pixel[0] < view.left || pixel[0] >= view.left + view.width ||
        pixel[1] < view.top || pixel[1] >= view.top + view.height)
        return false;
    const std::optional<Hit> hit = cast(pixel[0], pixel[1]);
    return !hit || hit->distance >= pixel[2] * (1 - roundOff);
}

}  // namespace simflex
