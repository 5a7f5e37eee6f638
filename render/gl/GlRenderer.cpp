#include "GlRenderer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "GlDepthReader.h"
#include "GlGround.h"
#include "GlMarks.h"
#include "GlOcclusion.h"
#include "GlScreen.h"
#include "GlSurfaces.h"
#include "GlTargets.h"
#include "GlTexts.h"
#include "GlTransparency.h"
#include "Shaders.h"

namespace simflex {

using SimTK::Transform;
using SimTK::Vec3;

// Objects that need a current context for construction and destruction.
class GlRenderer::Parts {
public:
    explicit Parts(const GlFunctions& gl)
        : screen(gl),
          surfaces(gl),
          marks(gl),
          texts(gl, screen),
          ground(gl, screen),
          transparency(gl, screen, surfaces),
          depthReader(gl, screen),
          occlusion(gl, screen),
          layerProgram(gl, shaders::backgroundVertex, shaders::layerFragment) {}

    GlScreen screen;
    GlSurfaces surfaces;
    GlMarks marks;
    GlTexts texts;
    GlGround ground;
    GlTransparency transparency;
    GlDepthReader depthReader;
    GlOcclusion occlusion;
    GlProgram layerProgram;
};

GlRenderer::GlRenderer() : context(GlContext::create()) {
    const GlContextUse use(*context);
    gl.load([this](const char* name) { return context->getProcAddress(name); });
    parts = std::make_unique<Parts>(gl);
    GLint sizes[3] = {0, 0, 0};
    gl.GetIntegerv(GL_MAX_TEXTURE_SIZE, &sizes[0]);
    gl.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &sizes[1]);
    gl.GetIntegerv(GL_MAX_VIEWPORT_DIMS, &sizes[2]);
    maxSize = std::min({sizes[0], sizes[1], sizes[2]});
}

GlRenderer::~GlRenderer() {
    const GlContextUse use(*context);
    canvases.clear();
    parts.reset();
}

GlTransparency& GlRenderer::updTransparency() {
    return parts->transparency;
}

PictureTarget& GlRenderer::selectTarget(int width, int height) {
    constexpr std::size_t manyCanvases = 6;
    if (canvases.size() >= manyCanvases && canvases.count({width, height}) == 0)
        canvases.erase(std::min_element(
            canvases.begin(), canvases.end(),
            [](const auto& a, const auto& b) { return a.second.lastUse < b.second.lastUse; }));
    Canvas& canvas = canvases[{width, height}];
    canvas.lastUse = ++numSelections;
    if (!canvas.target) canvas.target = std::make_unique<PictureTarget>(gl, width, height);
    return *canvas.target;
}

Image GlRenderer::draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
                       int height, DepthPicture* depth) {
    if (width <= 0 || height <= 0 || width > maxSize || height > maxSize)
        throw std::runtime_error("a picture of " + std::to_string(width) + "x" +
                                 std::to_string(height) + " pixels is not between 1x1 and " +
                                 std::to_string(maxSize) + "x" + std::to_string(maxSize) +
                                 ", which is what " + context->getName() + " can draw");
    const GlContextUse use(*context);
    const bool hasOcclusion = style.isLit && style.occlusionRadius > 0;
    // Ambient occlusion depends on the surroundings, so there are no bands.
    const int numBands =
        hasOcclusion ? 1 : 1 + int((std::int64_t(width) * height - 1) / maxBandPixels);
    const int bandHeight = (height + numBands - 1) / numBands;
    PictureTarget& target = selectTarget(width, bandHeight);

    parts->surfaces.setColorMap(style.colorMap);
    bounds_G.clear();
    scene.appendBounds(bounds_G);
    const bool hasGround = GlGround::isVisible(camera, style);
    const bool hasShadow =
        hasGround && style.ground.hasShadow && parts->ground.updateShadow(scene, style);
    Image image(width, height);
    if (depth) *depth = {width, height, std::vector<float>(std::size_t(width) * height)};

    for (int bottom = 0; bottom < height; bottom += bandHeight) {
        const GlView view(camera, style, width, height, bottom, bandHeight);
        drawScene(scene, view, target, hasGround, depth);
        if (style.isBackgroundTransparent) {
            target.bindPicture();
            gl.ClearColor(0, 0, 0, 0);
            gl.Clear(GL_COLOR_BUFFER_BIT);
        } else {
            parts->ground.updateBackdrop(view, hasGround, target);
            target.copyBackdrop();
            target.bindPicture();
        }
        gl.Enable(GL_BLEND);
        if (hasShadow) parts->ground.drawShadow(view);
        layScene(scene, view, target);
        gl.Disable(GL_BLEND);
        readPicture(view, target, image);
    }
    parts->surfaces.updShapes().dropUnused();
    parts->texts.dropUnused();
    return image;
}

void GlRenderer::drawScene(const Scene& scene, const GlView& view, PictureTarget& target,
                           bool hasGround, DepthPicture* depth) {
    GlSurfaces& surfaces = parts->surfaces;
    target.bindScene();
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    if (hasGround) parts->ground.hideBelow(view, bounds_G);
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) surfaces.draw(item, view, GlSurfaces::chooseSides(item));
    if (view.style.isLit && view.style.occlusionRadius > 0)
        parts->occlusion.darken(view, bounds_G, target);

    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    gl.DepthMask(GL_FALSE);
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) surfaces.drawEdges(item, view);
    parts->marks.draw(scene, view);
    if (depth) {
        readDepth(view, target, *depth);
        target.bindScene();
    }
    parts->transparency.draw(scene, view, target);
    parts->texts.draw(scene, view);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_BLEND);
    if (view.style.hasTriad) drawTriad(view);
    gl.Disable(GL_DEPTH_TEST);
}

void GlRenderer::drawTriad(const GlView& view) {
    // Drawn by a separate camera with the same orientation and negligible perspective.
    const TriadPlace place = calcTriadPlace(view.height, view.style.unit);
    const int half = place.getHalfSize(), low = view.height - int(place.y) - half - view.bottom;
    if (low >= view.rows || low + 2 * half <= 0) return;
    gl.Viewport(int(place.x) - half, low, 2 * half, 2 * half);
    gl.Clear(GL_DEPTH_BUFFER_BIT);

    Camera camera;
    camera.fieldOfView = 2 * std::atan(1.5 / 30);
    camera.X_GC = Transform(view.camera.X_GC.R(), view.camera.X_GC.R() * Vec3(0, 0, 30));
    camera.nearPlane = 20;
    camera.farPlane = 40;
    const GlView triadView(camera, view.style, 2 * half, 2 * half, 0, 2 * half);

    Scene triad;
    SceneBuilder builder(
        triad, triadShapes, [](int) { return Transform(); },
        [](const Vec3&, double) { return 6.0; });
    for (int axis = 0; axis < 3; ++axis) {
        Vec3 end(0);
        end[axis] = 1;
        builder.add(SimTK::DecorativeArrow(Vec3(0), end, 0.22).setColor(getAxisColor(axis)));
    }
    for (const SurfaceItem& item : triad.surfaces)
        parts->surfaces.draw(item, triadView, GlSurfaces::chooseSides(item));
}

// Composites the scene over the background where it is not empty: in the rectangle of the bounds
// and in that of the axes. Texts may extend beyond the bounds.
void GlRenderer::layScene(const Scene& scene, const GlView& view, PictureTarget& target) {
    const int padding = int(24 * std::max(1.0, view.style.unit));  // for wide lines and points
    GlRectangle used = scene.texts.empty() ? calcCoveredRectangle(view, bounds_G, padding)
                                           : GlRectangle{0, 0, view.width, view.rows};
    std::vector<GlRectangle> rectangles;
    if (view.style.hasTriad) {
        const TriadPlace place = calcTriadPlace(view.height, view.style.unit);
        const int half = place.getHalfSize(), low = view.height - int(place.y) - half - view.bottom;
        const GlRectangle triad = {int(place.x) - half, low, int(place.x) + half, low + 2 * half};
        if (used.overlaps(triad))
            used.include(triad);
        else
            rectangles.push_back(triad);
    }
    if (!used.isEmpty()) rectangles.push_back(used);

    gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    parts->layerProgram.use();
    parts->layerProgram.set("layer", 0);
    target.getSceneColor().bind(0);
    gl.Enable(GL_SCISSOR_TEST);
    for (const GlRectangle& r : rectangles) {
        gl.Scissor(r.left, r.bottom, r.right - r.left, r.top - r.bottom);
        parts->screen.drawAll();
    }
    gl.Disable(GL_SCISSOR_TEST);
}

void GlRenderer::readDepth(const GlView& view, PictureTarget& target, DepthPicture& depth) {
    const int numRows = std::min(view.rows, view.height - view.bottom);
    std::vector<float> values(std::size_t(view.width) * numRows);
    parts->depthReader.read(target, numRows, values.data());
    const double a = view.projection[10], b = view.projection[14];
    for (int row = 0; row < numRows; ++row)
        for (int x = 0; x < view.width; ++x) {
            const double z = values[std::size_t(row) * view.width + x];
            const double clip = 2 * z - 1;
            const double distance = z >= 1               ? SimTK::Infinity
                                    : view.isPerspective ? b / (clip + a)
                                                         : (b - clip) / a;
            depth.distances[std::size_t(view.height - 1 - view.bottom - row) * view.width + x] =
                float(distance);
        }
}

void GlRenderer::readPicture(const GlView& view, PictureTarget& target, Image& image) {
    const int numRows = std::min(view.rows, view.height - view.bottom);
    const std::size_t rowBytes = 4 * std::size_t(view.width);
    rows.resize(numRows * rowBytes);
    const std::uint8_t alphaOnly[4] = {0, 0, 0, 255};
    std::uint32_t opaque;
    std::memcpy(&opaque, alphaOnly, 4);
    target.read(numRows, rows.data());
    for (int row = 0; row < numRows; ++row) {
        const std::uint8_t* from = rows.data() + row * rowBytes;
        std::uint8_t* to = image.updData() + (view.height - 1 - view.bottom - row) * rowBytes;
        if (!view.style.isBackgroundTransparent) {
            // Over an opaque background the result is opaque.
            for (std::size_t i = 0; i < rowBytes; i += 4) {
                std::uint32_t pixel;
                std::memcpy(&pixel, from + i, 4);
                pixel |= opaque;
                std::memcpy(to + i, &pixel, 4);
            }
        } else {
            for (std::size_t i = 0; i < rowBytes; i += 4) {
                const int alpha = to[i + 3] = from[i + 3];
                for (int k = 0; k < 3; ++k)
                    to[i + k] =
                        alpha == 0
                            ? std::uint8_t(0)
                            : std::uint8_t(std::min(255, (255 * from[i + k] + alpha / 2) / alpha));
            }
        }
    }
}

}  // namespace simflex
