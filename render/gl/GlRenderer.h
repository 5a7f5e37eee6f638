#pragma once
/** @file
Draws a Scene with OpenGL 3.3 core into an Image. Internal.

Order: shadow on the ground; multisampled: opaque surfaces, ambient occlusion, edges, lines, points,
transparent surfaces, texts, axes; not multisampled: background and ground, with the multisampled
layer on top. Large pictures are drawn in bands of rows to limit memory. **/

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "GlContext.h"
#include "GlView.h"
#include "simflex/render/scene/Camera.h"
#include "simflex/render/scene/FrameStyle.h"
#include "simflex/render/scene/SceneBuilder.h"

namespace simflex {

class GlTransparency;
class PictureTarget;

/** Distance along the view direction of the visible surface, row by row from the top [m]; infinity
where there is none. Transparent surfaces are ignored. **/
struct DepthPicture {
    int width = 0, height = 0;
    std::vector<float> distances;

    double getDistance(int x, int y) const { return distances[std::size_t(y) * width + x]; }
};

class GlRenderer {
public:
    /** @throws std::runtime_error if there is no context. **/
    GlRenderer();
    ~GlRenderer();
    GlRenderer(const GlRenderer&) = delete;
    GlRenderer& operator=(const GlRenderer&) = delete;

    /** Draws the picture without overlay, and its depth if `depth` is not null.
    @throws std::runtime_error if the context does not support the size. **/
    Image draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
               int height, DepthPicture* depth = nullptr);

    static constexpr int defaultBandPixels = 1 << 22;

    /** Limits the band size. Larger pictures are drawn in bands, except with ambient occlusion.
    Memory: 40 bytes per pixel, with fragment lists 4 more, and 24 bytes per fragment, at most 120
    MB. **/
    void setMaxBandPixels(int number) { maxBandPixels = number; }

    /** State of the last band's transparent surfaces; see GlTransparency.h. **/
    GlTransparency& updTransparency();

    /** "OSMesa" or "EGL". **/
    std::string getContextName() const { return context->getName(); }

private:
    class Parts;

    PictureTarget& selectTarget(int width, int height);
    void drawScene(const Scene& scene, const GlView& view, PictureTarget& target, bool hasGround,
                   DepthPicture* depth);
    void drawTriad(const GlView& view);
    void layScene(const Scene& scene, const GlView& view, PictureTarget& target);
    void readDepth(const GlView& view, PictureTarget& target, DepthPicture& depth);
    void readPicture(const GlView& view, PictureTarget& target, Image& image);

    // Target for pictures of one size.
    struct Canvas {
        std::unique_ptr<PictureTarget> target;
        int lastUse = 0;
    };

    std::unique_ptr<GlContext> context;
    GlFunctions gl;
    std::unique_ptr<Parts> parts;
    std::map<std::pair<int, int>, Canvas> canvases;  // by size
    int numSelections = 0;
    int maxBandPixels = defaultBandPixels;
    int maxSize = 0;
    ShapeCache triadShapes;
    std::vector<SimTK::Vec3> bounds_G;  // of the scene being drawn
    std::vector<std::uint8_t> rows;
};

}  // namespace simflex
