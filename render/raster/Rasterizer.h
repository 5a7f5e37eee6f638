#pragma once
/** @file
Draws a scene into an Image by the processor alone, as GlRenderer does, in a fraction of the time
that a general software rasterizer takes: of each sample only what is seen is lit. Internal to the
renderer.

The picture is made in bands of rows, which threads share out; a band stays in a processor's cache:

    opaque surfaces   nearest triangle at each of four samples a pixel; then light on each
triangle's share of each pixel edges, lines, points    laid over them in their order ghosts the
nearest one at each sample, laid over axes              over all backdrop          kept from picture
to picture, darkened by the shadow; the rest laid over it

    if (Rasterizer::canDraw(scene, camera, style)) image = rasterizer.draw(…);

The bytes are the same for any number of threads. **/

#include <memory>
#include <vector>

#include "Backdrop.h"
#include "Spans.h"
#include "simflex/render/Image.h"
#include "simflex/render/scene/SceneBuilder.h"

namespace simflex {
namespace raster {

struct Light;

class Rasterizer {
public:
    Rasterizer();
    ~Rasterizer();
    Rasterizer(const Rasterizer&) = delete;
    Rasterizer& operator=(const Rasterizer&) = delete;

    /** False for what it leaves to OpenGL: what is transparent besides ghosts, texts in space,
    surfaces as wireframes or points, ambient occlusion, a transparent background, surfaces that
    reach the near plane. **/
    static bool canDraw(const Scene& scene, const Camera& camera, const FrameStyle& style,
                        int width, int height);

    /** The picture, without what the overlay writes on it. @pre canDraw() **/
    Image draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
               int height);

private:
    struct Mesh;
    struct Stroke;
    struct Bins;
    struct Band;

    void collect(const Scene& scene, const GlView& view);
    void addMesh(const SurfaceItem& item, const GlView& view, int pass, double left, double top);
    void addTriad(const GlView& view);
    void addEdges(const SurfaceItem& item, const GlView& view);
    void addMarks(const Scene& scene, const GlView& view, bool isOpaque);
    void sortIntoBands(int height);
    void drawBand(int number, const GlView& view, bool hasGround, bool isBelow,
                  const GroundShadow* shadow, Band& band, Image& image) const;
    void drawTriangles(int number, int pass, Band& band) const;
    void light(int pass, const Area& area, Band& band) const;
    void drawStrokes(int number, Band& band) const;

    static constexpr int bandRows = 16;
    enum Pass { Opaque, Ghosts, Axes, numPasses };

    std::vector<std::unique_ptr<Mesh>> meshes;
    std::size_t numMeshes = 0;
    std::vector<Stroke> strokes;
    std::unique_ptr<Bins> bins;
    std::vector<Band> bands;        // one for each thread
    Area used, triad, shaded;       // by the scene, by the axes, by the shadow
    std::vector<float> baseColors;  // of the contour's map
    int loadedColors = -1;
    float contourLow = 0, contourScale = 0;
    std::unique_ptr<Light> light_C;
    Backdrop backdrop;
    GroundShadow groundShadow;
    ShapeCache triadShapes;
};

}  // namespace raster
}  // namespace simflex
