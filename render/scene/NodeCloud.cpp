#include "NodeCloud.h"

#include <cmath>

namespace simflex {

using SimTK::Vec3;

void appendNodeCloud(const SurfaceItem& item, const FrameStyle& style, Scene& scene) {
    const SurfaceGeometry& geometry = *item.geometry;
    if (!geometry.triangles.empty() || item.style == SurfaceItem::Style::Ghost) return;
    const double range = style.contourHigh - style.contourLow;
    for (int v = 0; v < geometry.numVertices(); ++v) {
        const float* vertex = &geometry.vertices[std::size_t(v) * SurfaceGeometry::floatsPerVertex];
        PointItem point;
        point.location =
            item.X_GM * Vec3(vertex[0], vertex[1], vertex[2]).elementwiseMultiply(item.scale);
        point.color = item.color;
        point.diameter = 5;
        if (item.style == SurfaceItem::Style::Contour && !std::isnan(vertex[6]))
            point.color =
                calcColor(style.colorMap, range > 0 ? (vertex[6] - style.contourLow) / range : 0.0);
        scene.points.push_back(point);
    }
}

}  // namespace simflex
