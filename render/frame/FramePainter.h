#pragma once
/** @file
Draws snapshots. Internal to the renderer.

A painter belongs to one thread at a time; different painters give the same bytes. The OpenGL
context is created for the first picture.

    const Extremes values = painter.deform(snapshot);
    run.include(values);
    Image image = painter.paint(snapshot, calcContourRange(settings, values, run));  **/

#include <memory>
#include <vector>

#include "simflex/render/gl/GlRenderer.h"
#include "simflex/render/overlay/Overlay.h"
#include "simflex/render/scene/FrameSnapshot.h"
#include "simflex/render/skin/DeformedSurface.h"

namespace simflex {

/** Largest displacement of all parts, unscaled. **/
struct LargestDisplacement {
    double length = 0;       ///< [m]
    double shareOfPart = 0;  ///< relative to the diagonal of the part's bounding box

    void include(const LargestDisplacement& other);
};

class FramePainter {
public:
    /** Deforms the parts.
    @return the range of their contour values. **/
    Extremes deform(const FrameSnapshot& snapshot);

    LargestDisplacement calcLargestDisplacement(const FrameSnapshot& snapshot);

    /** Appends points whose convex hull contains the decorations and the parts as deformed by
    deform(). **/
    void appendBounds(const FrameSnapshot& snapshot, std::vector<SimTK::Vec3>& points_G) const;
    /** As appendBounds(), without lines and texts. **/
    void appendSolidBounds(const FrameSnapshot& snapshot, std::vector<SimTK::Vec3>& points_G) const;

    /** Appends the parts as deformed by deform(), with their ghosts if these are shown. **/
    void appendParts(const FrameSnapshot& snapshot, Scene& scene) const;

    /** Returns one part, whether hidden or not. **/
    SurfaceItem makeItem(const FrameSnapshot& snapshot, std::size_t part) const;

    /** Draws the snapshot of the last call of deform(). **/
    Image paint(const FrameSnapshot& snapshot, const SimTK::Vec2& contourRange);

private:
    DeformedSurface& getSurface(const FrameSnapshot& snapshot, std::size_t part);

    std::vector<std::unique_ptr<DeformedSurface>> surfaces;
    ContourField::Workspace workspace;
    Extremes values;  // of the snapshot of the last call of deform()
    std::unique_ptr<GlRenderer> renderer;
    Overlay overlay;
};

}  // namespace simflex
