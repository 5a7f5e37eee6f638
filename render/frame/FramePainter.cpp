#include "FramePainter.h"

#include <algorithm>
#include <cmath>

#include "simflex/render/scene/NodeCloud.h"

namespace simflex {

using SimTK::Vec3;

namespace {

// Returns half the distance to the nearest surface whose box does not contain the camera: a small
// part may be in front of a ground that extends behind the camera, whose corners are useless.
double calcNearest(const Scene& scene, const Camera& camera) {
    double nearest = SimTK::Infinity;
    for (const SurfaceItem& item : scene.surfaces) {
        const Vec3 eye = ~item.X_GM * camera.X_GC.p();
        double sum = 0;
        for (int k = 0; k < 3; ++k) {
            const double low = item.scale[k] * item.geometry->lower[k];
            const double high = item.scale[k] * item.geometry->upper[k];
            const double outside = std::max({low - eye[k], eye[k] - high, 0.0});
            sum += outside * outside;
        }
        if (sum > 0) nearest = std::min(nearest, 0.5 * std::sqrt(sum));
    }
    return nearest;
}

}  // namespace

DeformedSurface& FramePainter::getSurface(const FrameSnapshot& snapshot, std::size_t part) {
    if (surfaces.size() <= part) surfaces.resize(part + 1);
    std::unique_ptr<DeformedSurface>& surface = surfaces[part];
    const auto& skin = snapshot.parts[part].skin;
    if (!surface || &surface->getSkin() != skin.get())
        surface = std::make_unique<DeformedSurface>(skin);
    return *surface;
}

Extremes FramePainter::deform(const FrameSnapshot& snapshot) {
    values = {};
    for (std::size_t i = 0; i < snapshot.parts.size(); ++i) {
        DeformedSurface& surface = getSurface(snapshot, i);
        const PartSnapshot& part = snapshot.parts[i];
        workspace.values.clear();
        if (part.field)
            values.include(part.field->calcValues(
                part,
                part.field->isOfDisplacements() ? surface.calcDisplacements(part.xi, part.reference)
                                                : surface.calcDisplacements(part.xi),
                workspace));
        surface.update(part.xi, snapshot.partStyle.deformationFactor, workspace.values,
                       part.reference);
    }
    return values;
}

void LargestDisplacement::include(const LargestDisplacement& other) {
    length = std::max(length, other.length);
    shareOfPart = std::max(shareOfPart, other.shareOfPart);
}

LargestDisplacement FramePainter::calcLargestDisplacement(const FrameSnapshot& snapshot) {
    LargestDisplacement largest;
    for (std::size_t i = 0; i < snapshot.parts.size(); ++i) {
        const PartSnapshot& part = snapshot.parts[i];
        if (!part.look.isVisible) continue;
        const double length =
            getSurface(snapshot, i).calcLargestDisplacement(part.xi, part.reference);
        const double size = (part.skin->undeformed->upper - part.skin->undeformed->lower).norm();
        largest.include({length, size > 0 ? length / size : 0});
    }
    return largest;
}

SurfaceItem FramePainter::makeItem(const FrameSnapshot& snapshot, std::size_t part) const {
    const PartSnapshot& motion = snapshot.parts[part];
    SurfaceItem item;
    item.geometry = surfaces[part]->getDeformed();
    item.X_GM = motion.X_GD;
    item.color = motion.look.hasColor() ? motion.look.color : Vec3(0.66, 0.70, 0.75);
    item.opacity = motion.look.opacity;
    item.style = motion.field ? SurfaceItem::Style::Contour : SurfaceItem::Style::Solid;
    item.showElementEdges = snapshot.partStyle.showElementEdges;
    item.showFeatureEdges = snapshot.partStyle.showFeatureEdges;
    return item;
}

void FramePainter::appendParts(const FrameSnapshot& snapshot, Scene& scene) const {
    for (std::size_t i = 0; i < snapshot.parts.size(); ++i) {
        if (!snapshot.parts[i].look.isVisible) continue;
        SurfaceItem item = makeItem(snapshot, i);
        scene.surfaces.push_back(item);
        if (!snapshot.partStyle.showUndeformed) continue;

        item.geometry = surfaces[i]->getUndeformed();
        item.X_GM = snapshot.parts[i].X_GD * snapshot.parts[i].reference.calcPose();
        item.style = SurfaceItem::Style::Ghost;
        item.color = snapshot.style.palette.ghost;
        item.opacity = 0.42 * snapshot.parts[i].look.opacity;
        item.showElementEdges = false;
        item.showFeatureEdges = false;
        scene.surfaces.push_back(item);
    }
}

void FramePainter::appendBounds(const FrameSnapshot& snapshot, std::vector<Vec3>& points_G) const {
    snapshot.scene.appendBounds(points_G);
    Scene parts;
    appendParts(snapshot, parts);
    parts.appendBounds(points_G);
}

void FramePainter::appendSolidBounds(const FrameSnapshot& snapshot,
                                     std::vector<Vec3>& points_G) const {
    snapshot.scene.appendSolidBounds(points_G);
    Scene parts;
    appendParts(snapshot, parts);
    parts.appendBounds(points_G);
}

// Compares with a tolerance for single precision.
static bool isBeyond(double larger, double smaller) {
    return larger > smaller + 1e-6 * std::abs(smaller);
}

Image FramePainter::paint(const FrameSnapshot& snapshot, const SimTK::Vec2& contourRange) {
    if (!renderer) renderer = std::make_unique<GlRenderer>();
    Scene scene = snapshot.scene;
    appendParts(snapshot, scene);
    std::vector<Vec3> bounds;
    scene.appendBounds(bounds);
    if (bounds.empty()) bounds.push_back(snapshot.center_G);

    FrameStyle style = snapshot.style;
    style.contourLow = contourRange[0];
    style.contourHigh = contourRange[1];
    for (const SurfaceItem& item : scene.surfaces) appendNodeCloud(item, style, scene);

    Image frame;
    for (const ViewSnapshot& view : snapshot.views) {
        Camera camera = view.camera;
        if (view.fitsClippingPlanes) {
            camera.fitClippingPlanes(bounds);
            if (!camera.isOrthographic)
                camera.nearPlane = std::min(
                    camera.nearPlane, std::max(calcNearest(scene, camera), 1e-6 * camera.farPlane));
            // Room for the ground in front of and behind the scene.
            const double distance =
                std::max(-camera.toCamera(snapshot.center_G)[2], snapshot.radius);
            camera.nearPlane = std::min(camera.nearPlane, 0.2 * distance);
            if (style.ground.isShown)
                camera.farPlane = std::max(camera.farPlane, distance + 8 * snapshot.radius);
        }
        style.unit = view.unit;
        style.hasTriad = view.showAxes;
        Image image = renderer->draw(scene, camera, style, view.width, view.height);
        OverlayContent content = view.overlay;
        content.unit = view.unit;
        content.colorBar.low = contourRange[0];
        content.colorBar.high = contourRange[1];
        content.colorBar.hasBelow = isBeyond(contourRange[0], values.low);
        content.colorBar.hasAbove = isBeyond(values.high, contourRange[1]);
        overlay.draw(image, content, style.palette);
        if (view.width == snapshot.width && view.height == snapshot.height) {
            frame = std::move(image);
            continue;
        }
        if (frame.isEmpty())
            frame = Image(snapshot.width, snapshot.height, style.palette.faintText);
        frame.paste(image, view.left, view.top);
    }
    return frame;
}

}  // namespace simflex
