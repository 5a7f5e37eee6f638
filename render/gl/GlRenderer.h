#pragma once
/** @file
Draws a Scene through OpenGL 3.3 core into an Image. Internal.

Order: shadow on the ground; then, multisampled, opaque surfaces, ambient occlusion, edges, lines,
points, what is transparent, texts, axes; then, plain, background, ground, and the former over them.
Large pictures are drawn in bands of rows, so that their memory stays bounded. **/

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

/** Distance along the view direction of what a picture shows, row by row from the top [m];
infinity where there is nothing. What is transparent does not count. **/
struct DepthPicture {
    int width = 0, height = 0;
    std::vector<float> distances;

    double getDistance(int x, int y) const { return distances[std::size_t(y) * width + x]; }
};

class GlRenderer {
public:
    /** @throws std::runtime_error when there is no context. **/
    GlRenderer();
    ~GlRenderer();
    GlRenderer(const GlRenderer&) = delete;
    GlRenderer& operator=(const GlRenderer&) = delete;

    /** The picture, without what the overlay writes on it; and its depth, if wanted.
    @throws std::runtime_error when the context cannot draw one of this size. **/
    Image draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
               int height, DepthPicture* depth = nullptr);

    static constexpr int defaultBandPixels = 1 << 22;

    /** Pictures of more pixels are drawn in bands, at 40 bytes a pixel and 4 more where
    transparent surfaces are listed, besides 24 for each fragment of those, 120 MB at most; but with
    ambient occlusion in one piece. **/
    void setMaxBandPixels(int number) { maxBandPixels = number; }

    /** How the last picture's last band got its transparent surfaces; see GlTransparency.h. **/
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

    // Where pictures of one size are drawn.
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
