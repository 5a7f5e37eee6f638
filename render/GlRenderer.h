#pragma once
/** @file
Draws a Scene through OpenGL 3.3 core into an Image. Internal.

Order: shadow map; then, multisampled, opaque surfaces, edges, lines, points, transparent surfaces
from far to near, ghosts, texts, axes; then, plain, background, ground, and the former over them.
Buffers of a shape live as long as the shape does; a shape that changes is uploaded again into the
same buffers. **/

#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "Camera.h"
#include "Font.h"
#include "FrameStyle.h"
#include "GlContext.h"
#include "GlProgram.h"
#include "GlTargets.h"
#include "SceneBuilder.h"

namespace simflex {

class GlRenderer {
public:
    /** @throws std::runtime_error when there is no context. **/
    GlRenderer();
    ~GlRenderer();
    GlRenderer(const GlRenderer&) = delete;
    GlRenderer& operator=(const GlRenderer&) = delete;

    /** The picture, without what the overlay writes on it.
    @throws std::runtime_error when the context cannot draw one of this size. **/
    Image draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
               int height);

    /** "OSMesa" or "EGL". **/
    std::string getContextName() const { return context->getName(); }

private:
    // One shape on the GPU.
    struct Buffers {
        SurfaceGeometryPtr geometry;
        unsigned version = 0;
        GLuint vertexArray = 0, vertices = 0, triangles = 0, featureEdges = 0, elementEdges = 0;
        std::size_t vertexBytes = 0;
    };

    struct TextTexture {
        GLuint texture = 0;
        double width = 1, height = 1, descent = 0;  // in heights of a capital letter
        bool isUsed = true;
    };

    // Where pictures of one size are drawn.
    struct Canvas {
        std::unique_ptr<PictureTarget> target;
        std::vector<double> backdropKey;  // what the target's backdrop was drawn from
        int lastUse = 0;
    };

    void selectCanvas(int width, int height);
    Buffers& getBuffers(const SurfaceGeometryPtr& geometry);
    const TextTexture& getText(const std::string& text);
    void deleteBuffers(Buffers& buffers);
    void dropUnused();

    double getAspect() const { return double(target->getWidth()) / target->getHeight(); }

    void hideBelowGround(const std::vector<SimTK::Vec3>& bounds);
    void drawBackground();
    void drawLayer(const std::vector<SimTK::Vec3>* bounds);
    bool drawShadow(const Scene& scene);
    std::array<float, 16> calcGroundProjection() const;
    void updateBackdrop(bool hasGround);
    void drawGround();
    void drawGroundShadow();
    void drawSurface(const SurfaceItem& item);
    void drawEdges(const SurfaceItem& item);
    void drawTransparent(const Scene& scene);
    void drawGhosts(const Scene& scene);
    void drawLines(const Scene& scene);
    void drawPoints(const Scene& scene);
    void drawTexts(const Scene& scene);
    void drawTriad();
    bool isLitPerVertex(const SurfaceItem& item) const;
    void setSurfaceUniforms(const SurfaceItem& item);
    void drawTriangles(const SurfaceItem& item);

    std::unique_ptr<GlContext> context;
    GlFunctions gl;
    std::map<std::pair<int, int>, Canvas> canvases;  // by size
    int numSelections = 0;
    std::unique_ptr<ShadowTarget> shadow;
    std::unique_ptr<GlProgram> surfaceProgram, fineSurfaceProgram, edgeProgram, lineProgram,
        pointProgram, backgroundProgram, layerProgram, groundProgram, groundShadowProgram,
        shadowProgram, blurProgram, textProgram;
    std::unordered_map<const SurfaceGeometry*, Buffers> buffersOf;
    std::unordered_map<std::string, TextTexture> texts;
    std::unique_ptr<Font> font;
    ShapeCache triadShapes;
    GLuint emptyArray = 0;
    GLuint instanceArray = 0, instanceBuffer = 0;
    GLuint quadArray = 0, quadBuffer = 0;
    GLuint colorMapTexture = 0;
    int loadedColorMap = -1;

    // Of the frame being drawn.
    Canvas* canvas = nullptr;
    PictureTarget* target = nullptr;
    const Camera* camera = nullptr;
    const FrameStyle* style = nullptr;
    std::array<float, 16> projection{};
    SimTK::Vec4 shadowRegion{0};  // on the ground: origin x, y, 1 / extent x, y
};

}  // namespace simflex
