#pragma once
/** @file
Turns snapshots into pictures. Internal to the renderer.

A painter belongs to one thread at a time; several painters give the same bytes. The OpenGL context
is made when the first picture is wanted.

    const Extremes values = painter.deform(snapshot);
    run.include(values);
    Image image = painter.paint(snapshot, calcContourRange(settings, values, run));
**/

#include <memory>
#include <vector>

#include "simflex/render/gl/GlRenderer.h"
#include "simflex/render/overlay/Overlay.h"
#include "simflex/render/scene/FrameSnapshot.h"
#include "simflex/render/skin/DeformedSurface.h"

namespace simflex {

/** Largest displacement of all parts, not exaggerated. **/
struct LargestDisplacement {
    double length = 0;       ///< [m]
    double shareOfPart = 0;  ///< of the diagonal of the part's bounding box

    void include(const LargestDisplacement& other);
};

class FramePainter {
public:
    /** Deforms the parts.
    @return the values that their colours show. **/
    Extremes deform(const FrameSnapshot& snapshot);

    LargestDisplacement calcLargestDisplacement(const FrameSnapshot& snapshot);

    /** Appends points whose convex hull holds the decorations and the parts as deform() left them.
     **/
    void appendBounds(const FrameSnapshot& snapshot, std::vector<SimTK::Vec3>& points_G) const;
    /** The same without lines and texts. **/
    void appendSolidBounds(const FrameSnapshot& snapshot, std::vector<SimTK::Vec3>& points_G) const;

    /** Appends the parts as deform() left them, each with its ghost if that is shown. **/
    void appendParts(const FrameSnapshot& snapshot, Scene& scene) const;

    /** One of them, hidden or not. **/
    SurfaceItem makeItem(const FrameSnapshot& snapshot, std::size_t part) const;

    /** Draws the snapshot that deform() was called with last. **/
    Image paint(const FrameSnapshot& snapshot, const SimTK::Vec2& contourRange);

private:
    DeformedSurface& getSurface(const FrameSnapshot& snapshot, std::size_t part);

    std::vector<std::unique_ptr<DeformedSurface>> surfaces;
    ContourField::Workspace workspace;
    Extremes values;  // of the snapshot that deform() was called with last
    std::unique_ptr<GlRenderer> renderer;
    Overlay overlay;
};

}  // namespace simflex
