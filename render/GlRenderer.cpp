#include "GlRenderer.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "Shaders.h"

namespace simflex {

using SimTK::Mat33;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr int shadowSize = 256;
constexpr int colorMapSize = 256;
constexpr int textPixelSize = 64;

std::array<float, 16> toMatrix(const Transform& X, const Vec3& scale) {
    std::array<float, 16> m{};
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            m[4 * column + row] = float(X.R()[row][column] * scale[column]);
    for (int row = 0; row < 3; ++row) m[12 + row] = float(X.p()[row]);
    m[15] = 1;
    return m;
}

// Normals go with the inverse transpose: R·scale⁻¹.
std::array<float, 9> toNormalMatrix(const SimTK::Rotation& R, const Vec3& scale) {
    std::array<float, 9> m{};
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            m[3 * column + row] = float(R[row][column] / scale[column]);
    return m;
}

const void* bufferOffset(std::size_t numFloats) {
    return reinterpret_cast<const void*>(numFloats * sizeof(float));
}

void append(std::vector<float>& out, const Vec3& v) {
    for (int k = 0; k < 3; ++k) out.push_back(float(v[k]));
}

}  // namespace

GlRenderer::GlRenderer() : context(GlContext::create()) {
    const GlContextUse use(*context);
    gl.load([this](const char* name) { return context->getProcAddress(name); });
    shadow = std::make_unique<ShadowTarget>(gl, shadowSize);

    const auto make = [this](const char* vertex, const char* fragment) {
        return std::make_unique<GlProgram>(gl, vertex, fragment);
    };
    const std::string version = "#version 330 core\n";
    surfaceProgram =
        make(shaders::surfaceVertex,
             (version + shaders::lighting + shaders::baseColor + shaders::surfaceFragment).c_str());
    fineSurfaceProgram =
        make((version + shaders::lighting + shaders::fineSurfaceVertex).c_str(),
             (version + shaders::baseColor + shaders::fineSurfaceFragment).c_str());
    edgeProgram = make(shaders::surfaceVertex, shaders::edgeFragment);
    lineProgram = make(shaders::lineVertex, shaders::colorFragment);
    pointProgram = make(shaders::pointVertex, shaders::pointFragment);
    backgroundProgram = make(shaders::backgroundVertex, shaders::backgroundFragment);
    layerProgram = make(shaders::backgroundVertex, shaders::layerFragment);
    groundProgram = make(shaders::groundVertex, shaders::groundFragment);
    groundShadowProgram = make(shaders::groundVertex, shaders::groundShadowFragment);
    shadowProgram = make(shaders::shadowVertex, shaders::shadowFragment);
    blurProgram = make(shaders::backgroundVertex, shaders::blurFragment);
    textProgram = make(shaders::textVertex, shaders::textFragment);

    gl.GenVertexArrays(1, &emptyArray);
    gl.GenVertexArrays(1, &instanceArray);
    gl.GenBuffers(1, &instanceBuffer);
    gl.GenVertexArrays(1, &quadArray);
    gl.GenBuffers(1, &quadBuffer);
    const float corners[] = {-1, -1, 1, -1, -1, 1, 1, 1};
    gl.BindVertexArray(quadArray);
    gl.BindBuffer(GL_ARRAY_BUFFER, quadBuffer);
    gl.BufferData(GL_ARRAY_BUFFER, sizeof corners, corners, GL_STATIC_DRAW);
    gl.EnableVertexAttribArray(0);
    gl.VertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, 0, nullptr);
    gl.GenTextures(1, &colorMapTexture);
}

GlRenderer::~GlRenderer() {
    const GlContextUse use(*context);
    canvases.clear();
    for (auto& entry : buffersOf) deleteBuffers(entry.second);
    for (auto& entry : texts) gl.DeleteTextures(1, &entry.second.texture);
    gl.DeleteTextures(1, &colorMapTexture);
    for (const GLuint array : {emptyArray, instanceArray, quadArray})
        gl.DeleteVertexArrays(1, &array);
    for (const GLuint buffer : {instanceBuffer, quadBuffer}) gl.DeleteBuffers(1, &buffer);
}

void GlRenderer::deleteBuffers(Buffers& buffers) {
    gl.DeleteVertexArrays(1, &buffers.vertexArray);
    for (const GLuint buffer :
         {buffers.vertices, buffers.triangles, buffers.featureEdges, buffers.elementEdges})
        gl.DeleteBuffers(1, &buffer);
}

GlRenderer::Buffers& GlRenderer::getBuffers(const SurfaceGeometryPtr& geometry) {
    Buffers& buffers = buffersOf[geometry.get()];
    if (!buffers.geometry) {
        buffers.geometry = geometry;
        gl.GenVertexArrays(1, &buffers.vertexArray);
        gl.BindVertexArray(buffers.vertexArray);
        gl.GenBuffers(1, &buffers.vertices);
        gl.BindBuffer(GL_ARRAY_BUFFER, buffers.vertices);
        constexpr GLsizei stride = SurfaceGeometry::floatsPerVertex * sizeof(float);
        gl.EnableVertexAttribArray(0);
        gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, bufferOffset(0));
        gl.EnableVertexAttribArray(1);
        gl.VertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, stride, bufferOffset(3));
        gl.EnableVertexAttribArray(2);
        gl.VertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, stride, bufferOffset(6));
        const auto upload = [this](GLuint& buffer, const std::vector<std::uint32_t>& indices) {
            gl.GenBuffers(1, &buffer);
            gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer);
            gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(indices.size() * sizeof indices[0]),
                          indices.data(), GL_STATIC_DRAW);
        };
        upload(buffers.triangles, geometry->triangles);
        upload(buffers.featureEdges, geometry->featureEdges);
        upload(buffers.elementEdges, geometry->elementEdges);
    }
    if (buffers.version != geometry->version) {
        const std::size_t bytes = geometry->vertices.size() * sizeof(float);
        gl.BindBuffer(GL_ARRAY_BUFFER, buffers.vertices);
        if (bytes == buffers.vertexBytes)
            gl.BufferSubData(GL_ARRAY_BUFFER, 0, GLsizeiptr(bytes), geometry->vertices.data());
        else
            gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(bytes), geometry->vertices.data(),
                          GL_DYNAMIC_DRAW);
        buffers.vertexBytes = bytes;
        buffers.version = geometry->version;
    }
    return buffers;
}

void GlRenderer::dropUnused() {
    for (auto entry = buffersOf.begin(); entry != buffersOf.end();) {
        const bool isUsed = entry->second.geometry.use_count() > 1;
        if (!isUsed) deleteBuffers(entry->second);
        entry = isUsed ? std::next(entry) : buffersOf.erase(entry);
    }
    for (auto entry = texts.begin(); entry != texts.end();) {
        const bool isUsed = entry->second.isUsed;
        entry->second.isUsed = false;
        if (!isUsed) gl.DeleteTextures(1, &entry->second.texture);
        entry = isUsed ? std::next(entry) : texts.erase(entry);
    }
}

void GlRenderer::selectCanvas(int width, int height) {
    constexpr std::size_t manyCanvases = 6;
    if (canvases.size() >= manyCanvases && canvases.count({width, height}) == 0)
        canvases.erase(std::min_element(
            canvases.begin(), canvases.end(),
            [](const auto& a, const auto& b) { return a.second.lastUse < b.second.lastUse; }));
    canvas = &canvases[{width, height}];
    canvas->lastUse = ++numSelections;
    if (!canvas->target) canvas->target = std::make_unique<PictureTarget>(gl, width, height);
    target = canvas->target.get();
}

Image GlRenderer::draw(const Scene& scene, const Camera& frameCamera, const FrameStyle& frameStyle,
                       int width, int height) {
    const GlContextUse use(*context);
    selectCanvas(width, height);
    camera = &frameCamera;
    style = &frameStyle;
    projection = camera->calcProjection(getAspect());
    if (loadedColorMap != int(style->colorMap)) {
        loadedColorMap = int(style->colorMap);
        std::vector<std::uint8_t> texels;
        for (int i = 0; i < colorMapSize; ++i) {
            const Vec3 c = calcColor(style->colorMap, double(i) / (colorMapSize - 1));
            for (int k = 0; k < 3; ++k) texels.push_back(std::uint8_t(std::lround(255 * c[k])));
            texels.push_back(255);
        }
        gl.BindTexture(GL_TEXTURE_2D, colorMapTexture);
        gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, colorMapSize, 1, 0, GL_RGBA, GL_UNSIGNED_BYTE,
                      texels.data());
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    }

    // Seen from above only.
    const Transform X_PC = ~style->ground.X_GP * camera->X_GC;
    const double aboveGround = camera->isOrthographic ? X_PC.R().z()[2] : X_PC.p()[2];
    const bool hasGround = style->ground.isShown && aboveGround > 0;
    std::vector<Vec3> bounds;
    scene.appendBounds(bounds);
    const bool hasShadow = hasGround && style->ground.hasShadow && drawShadow(scene);

    target->bindScene();
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_LESS);
    if (hasGround) hideBelowGround(bounds);
    // Surfaces step back a little, so that the lines on them win.
    gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.PolygonOffset(1, 1);
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) drawSurface(item);
    gl.Disable(GL_POLYGON_OFFSET_FILL);

    gl.Enable(GL_BLEND);
    gl.BlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    gl.DepthMask(GL_FALSE);
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) drawEdges(item);
    drawLines(scene);
    drawPoints(scene);
    drawTransparent(scene);
    drawGhosts(scene);
    drawTexts(scene);
    gl.DepthMask(GL_TRUE);
    gl.Disable(GL_BLEND);
    if (style->hasTriad) drawTriad();
    gl.Disable(GL_DEPTH_TEST);

    updateBackdrop(hasGround);
    target->copyBackdrop();
    target->bindPicture();
    gl.Enable(GL_BLEND);
    if (hasShadow) drawGroundShadow();
    drawLayer(scene.texts.empty() ? &bounds : nullptr);
    gl.Disable(GL_BLEND);

    Image image = target->read();
    dropUnused();
    return image;
}

// Where something reaches below the ground, the ground takes part in the depth test.
void GlRenderer::hideBelowGround(const std::vector<Vec3>& bounds) {
    const Transform X_PG = ~style->ground.X_GP;
    const bool isBelow =
        std::any_of(bounds.begin(), bounds.end(), [&](const Vec3& p) { return (X_PG * p)[2] < 0; });
    if (!isBelow) return;
    groundProgram->use();
    groundProgram->set("modelView", toMatrix(~camera->X_GC * style->ground.X_GP, Vec3(1)));
    groundProgram->set("projection", camera->calcProjection(getAspect()));
    groundProgram->set("middle", 0.0, 0.0);
    groundProgram->set("halfWidth", style->ground.radius);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.BindVertexArray(quadArray);
    gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

// Lays the scene over the background, only where there is something: in the rectangle that holds
// the bounds, and in that of the axes. No bounds stand for the whole picture.
void GlRenderer::drawLayer(const std::vector<Vec3>* bounds) {
    struct Rectangle {
        int left, bottom, right, top;
    };
    const int width = target->getWidth(), height = target->getHeight();
    Rectangle whole = {0, 0, width, height}, used = {width, height, 0, 0};
    constexpr int padding = 24;  // for wide lines and points
    if (!bounds) used = whole;
    if (bounds)
        for (const Vec3& p : *bounds) {
            const Vec3 pixel = camera->calcPixel(p, width, height);
            if (!(pixel[2] > camera->nearPlane)) {
                used = whole;
                break;
            }
            const auto limit = [](double x, int end) {
                return int(std::min(double(end), std::max(0.0, x)));
            };
            used.left = std::min(used.left, limit(pixel[0] - padding, width));
            used.right = std::max(used.right, limit(pixel[0] + padding, width));
            used.bottom = std::min(used.bottom, limit(height - pixel[1] - padding, height));
            used.top = std::max(used.top, limit(height - pixel[1] + padding, height));
        }

    std::vector<Rectangle> rectangles;
    if (style->hasTriad) {
        const TriadPlace place = calcTriadPlace(height, style->unit);
        const int half = place.getHalfSize();
        const Rectangle triad = {int(place.x) - half, height - int(place.y) - half,
                                 int(place.x) + half, height - int(place.y) + half};
        const bool isApart = used.left >= triad.right || used.right <= triad.left ||
                             used.bottom >= triad.top || used.top <= triad.bottom;
        if (isApart)
            rectangles.push_back(triad);
        else
            used = {std::min(used.left, triad.left), std::min(used.bottom, triad.bottom),
                    std::max(used.right, triad.right), std::max(used.top, triad.top)};
    }
    if (used.left < used.right && used.bottom < used.top) rectangles.push_back(used);

    gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    layerProgram->use();
    layerProgram->set("layer", 0);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, target->getSceneTexture());
    gl.BindVertexArray(emptyArray);
    gl.Enable(GL_SCISSOR_TEST);
    for (const Rectangle& r : rectangles) {
        gl.Scissor(r.left, r.bottom, r.right - r.left, r.top - r.bottom);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    gl.Disable(GL_SCISSOR_TEST);
}

void GlRenderer::drawBackground() {
    backgroundProgram->use();
    backgroundProgram->set("topColor", style->palette.backgroundTop);
    backgroundProgram->set("bottomColor", style->palette.backgroundBottom);
    gl.BindVertexArray(emptyArray);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
}

// False when the light comes from below the horizon.
bool GlRenderer::drawShadow(const Scene& scene) {
    const Transform X_PG = ~style->ground.X_GP;
    const Vec3 light = X_PG.R() * Vec3(style->toLight);
    if (!(light[2] > 0.05)) return false;

    // Slides a point of P along the light onto z = 0.
    const auto toGround = [&](const Vec3& p) {
        return Vec3(p[0] - light[0] / light[2] * p[2], p[1] - light[1] / light[2] * p[2], 0);
    };
    Scene casting;
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) casting.surfaces.push_back(item);
    std::vector<Vec3> bounds;
    casting.appendBounds(bounds);
    shadowRegion = SimTK::Vec4(0, 0, 1, 1);
    if (!bounds.empty()) {
        Vec3 lower(SimTK::Infinity), upper(-SimTK::Infinity);
        for (const Vec3& p : bounds) {
            const Vec3 q = toGround(X_PG * p);
            for (int k = 0; k < 2; ++k) {
                lower[k] = std::min(lower[k], q[k]);
                upper[k] = std::max(upper[k], q[k]);
            }
        }
        const double extent = 1.25 * std::max({upper[0] - lower[0], upper[1] - lower[1], 1e-9});
        const Vec3 middle = 0.5 * (lower + upper);
        shadowRegion =
            SimTK::Vec4(middle[0] - extent / 2, middle[1] - extent / 2, 1 / extent, 1 / extent);
    }

    shadow->bind(0);
    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_BLEND);
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT);
    shadowProgram->use();
    shadowProgram->set("strength", 1.0);
    for (const SurfaceItem& item : casting.surfaces) {
        const Transform X_PM = X_PG * item.X_GM;
        std::array<float, 16> m{};
        const auto setColumn = [&](int column, const Vec3& v, double offset) {
            const Vec3 q = toGround(v);
            for (int k = 0; k < 2; ++k)
                m[4 * column + k] =
                    float(2 * shadowRegion[2 + k] * (q[k] - offset * shadowRegion[k]) - offset);
        };
        for (int column = 0; column < 3; ++column)
            setColumn(column, Vec3(X_PM.R().col(column)) * item.scale[column], 0);
        setColumn(3, X_PM.p(), 1);
        m[15] = 1;
        shadowProgram->set("modelToShadow", m);
        if (item.geometry->isClosed) gl.Enable(GL_CULL_FACE);
        drawTriangles(item);
        gl.Disable(GL_CULL_FACE);
    }

    // Two rounds of a blur that is wider than one kernel.
    blurProgram->use();
    blurProgram->set("source", 0);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindVertexArray(emptyArray);
    const double step = 1.0 / shadowSize;
    for (int pass = 0; pass < 2; ++pass) {
        shadow->bind(1 - pass);
        gl.BindTexture(GL_TEXTURE_2D, shadow->getTexture(pass));
        blurProgram->set("texel", pass == 0 ? step : 0.0, pass == 0 ? 0.0 : step);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    return true;
}

// The plain layer has no depth: its clipping planes lie far apart and do not follow the scene.
std::array<float, 16> GlRenderer::calcGroundProjection() const {
    Camera wide = *camera;
    wide.nearPlane = 1e-3 * style->ground.radius;
    wide.farPlane = 1e3 * style->ground.radius;
    return wide.calcProjection(getAspect());
}

// Background and ground are drawn again only when camera, colours or grid have changed.
void GlRenderer::updateBackdrop(bool hasGround) {
    const GroundStyle& ground = style->ground;
    std::vector<double> key = {double(hasGround), ground.radius, ground.gridSpacing,
                               ground.gridOffset[0], ground.gridOffset[1]};
    for (const Vec3& color : {style->palette.backgroundTop, style->palette.backgroundBottom,
                              style->palette.ground, style->palette.grid})
        key.insert(key.end(), {color[0], color[1], color[2]});
    if (hasGround) {
        const auto sceneProjection = calcGroundProjection();
        const auto modelView = toMatrix(~camera->X_GC * ground.X_GP, Vec3(1));
        key.insert(key.end(), sceneProjection.begin(), sceneProjection.end());
        key.insert(key.end(), modelView.begin(), modelView.end());
    }
    if (key == canvas->backdropKey) return;
    canvas->backdropKey = key;
    target->bindBackdrop();
    drawBackground();
    if (!hasGround) return;
    gl.Enable(GL_BLEND);
    drawGround();
    gl.Disable(GL_BLEND);
}

void GlRenderer::drawGroundShadow() {
    gl.BlendFunc(GL_ZERO, GL_SRC_COLOR);
    groundShadowProgram->use();
    groundShadowProgram->set("modelView", toMatrix(~camera->X_GC * style->ground.X_GP, Vec3(1)));
    groundShadowProgram->set("projection", calcGroundProjection());
    groundShadowProgram->set("middle", shadowRegion[0] + 0.5 / shadowRegion[2],
                             shadowRegion[1] + 0.5 / shadowRegion[3]);
    groundShadowProgram->set("halfWidth", 0.5 / shadowRegion[2]);
    groundShadowProgram->set("size", style->ground.radius);
    groundShadowProgram->set("shadowRegion", shadowRegion[0], shadowRegion[1], shadowRegion[2],
                             shadowRegion[3]);
    groundShadowProgram->set("shadow", 0);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D, shadow->getTexture(0));
    gl.BindVertexArray(quadArray);
    gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

void GlRenderer::drawGround() {
    const GroundStyle& ground = style->ground;
    gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    groundProgram->use();
    groundProgram->set("modelView", toMatrix(~camera->X_GC * ground.X_GP, Vec3(1)));
    groundProgram->set("projection", calcGroundProjection());
    groundProgram->set("middle", 0.0, 0.0);
    groundProgram->set("halfWidth", ground.radius);
    groundProgram->set("size", ground.radius);
    groundProgram->set("gridOrigin", ground.gridOffset[0], ground.gridOffset[1]);
    groundProgram->set("spacing", ground.gridSpacing);
    groundProgram->set("groundColor", style->palette.ground);
    groundProgram->set("gridColor", style->palette.grid);
    gl.BindVertexArray(quadArray);
    gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
}

// A small triangle costs the whole blocks of pixels that it touches: light is found at the vertices
// of finely divided shapes, unless they are seen from close by.
bool GlRenderer::isLitPerVertex(const SurfaceItem& item) const {
    const SurfaceGeometry& geometry = *item.geometry;
    if (!geometry.isFine || !geometry.isClosed || !style->isLit ||
        item.style == SurfaceItem::Style::Ghost ||
        item.representation != SimTK::DecorativeGeometry::DrawSurface)
        return false;
    const Vec3 middle = 0.5 * (geometry.lower + geometry.upper).elementwiseMultiply(item.scale);
    const Vec3 extent = (geometry.upper - geometry.lower).elementwiseMultiply(item.scale);
    return camera->toCamera(item.X_GM * middle).norm() > extent.norm();
}

void GlRenderer::setSurfaceUniforms(const SurfaceItem& item) {
    const Transform X_CM = ~camera->X_GC * item.X_GM;
    GlProgram& program = isLitPerVertex(item) ? *fineSurfaceProgram : *surfaceProgram;
    program.use();
    program.set("modelView", toMatrix(X_CM, item.scale));
    program.set("projection", projection);
    program.set("normalMatrix", toNormalMatrix(X_CM.R(), item.scale));
    program.set("color", item.color);
    program.set("opacity", item.opacity);
    program.set("isContour", item.style == SurfaceItem::Style::Contour);
    program.set("isGhost", item.style == SurfaceItem::Style::Ghost);
    program.set("isLit",
                style->isLit && item.representation == SimTK::DecorativeGeometry::DrawSurface);
    const double range = style->contourHigh - style->contourLow;
    program.set("contourRange", style->contourLow, range > 0 ? 1 / range : 0.0);
    program.set("colorMap", 0);
    program.set("up", Vec3(~camera->X_GC.R() * Vec3(style->up)));
    program.set("keyDirection", Vec3(~camera->X_GC.R() * Vec3(style->toLight)));
    program.set("viewDirection", Vec3(0, 0, 1));
    program.set("isPerspective", !camera->isOrthographic);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D, colorMapTexture);
}

void GlRenderer::drawTriangles(const SurfaceItem& item) {
    const Buffers& buffers = getBuffers(item.geometry);
    gl.BindVertexArray(buffers.vertexArray);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers.triangles);
    gl.DrawElements(GL_TRIANGLES, GLsizei(item.geometry->triangles.size()), GL_UNSIGNED_INT,
                    nullptr);
}

void GlRenderer::drawSurface(const SurfaceItem& item) {
    setSurfaceUniforms(item);
    if (item.representation == SimTK::DecorativeGeometry::DrawWireframe) {
        gl.PolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    } else if (item.representation == SimTK::DecorativeGeometry::DrawPoints) {
        gl.PolygonMode(GL_FRONT_AND_BACK, GL_POINT);
        gl.PointSize(3);
    }
    const bool hidesBack = item.geometry->isClosed &&
                           (!item.isTransparent() || item.style == SurfaceItem::Style::Ghost) &&
                           item.representation == SimTK::DecorativeGeometry::DrawSurface;
    if (hidesBack) gl.Enable(GL_CULL_FACE);
    drawTriangles(item);
    if (hidesBack) gl.Disable(GL_CULL_FACE);
    gl.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
}

void GlRenderer::drawEdges(const SurfaceItem& item) {
    if (!item.showFeatureEdges && !item.showElementEdges) return;
    const Buffers& buffers = getBuffers(item.geometry);
    edgeProgram->use();
    edgeProgram->set("modelView", toMatrix(~camera->X_GC * item.X_GM, item.scale));
    edgeProgram->set("projection", projection);
    edgeProgram->set("color", style->palette.edge);
    gl.BindVertexArray(buffers.vertexArray);
    const auto drawSome = [&](GLuint buffer, std::size_t count, double opacity) {
        edgeProgram->set("opacity", opacity);
        gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer);
        gl.DrawElements(GL_LINES, GLsizei(count), GL_UNSIGNED_INT, nullptr);
    };
    if (item.showElementEdges)
        drawSome(buffers.elementEdges, item.geometry->elementEdges.size(), 0.22);
    if (item.showFeatureEdges)
        drawSome(buffers.featureEdges, item.geometry->featureEdges.size(), 0.45);
}

void GlRenderer::drawTransparent(const Scene& scene) {
    std::vector<std::pair<double, const SurfaceItem*>> items;
    for (const SurfaceItem& item : scene.surfaces)
        if (item.isTransparent() && item.style != SurfaceItem::Style::Ghost) {
            const Vec3 middle = (0.5 * (item.geometry->lower + item.geometry->upper))
                                    .elementwiseMultiply(item.scale);
            items.emplace_back(camera->toCamera(item.X_GM * middle)[2], &item);
        }
    std::stable_sort(items.begin(), items.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    gl.Enable(GL_CULL_FACE);
    for (const auto& entry : items)
        for (const GLenum hidden : {GL_FRONT, GL_BACK}) {
            gl.CullFace(hidden);
            drawSurface(*entry.second);
        }
    gl.Disable(GL_CULL_FACE);
}

void GlRenderer::drawGhosts(const Scene& scene) {
    // Depth first, then colour: only the nearest layer of a ghost shows. It stands a little behind
    // the deformed part, which wins where both coincide.
    std::vector<const SurfaceItem*> ghosts;
    for (const SurfaceItem& item : scene.surfaces)
        if (item.style == SurfaceItem::Style::Ghost) ghosts.push_back(&item);
    if (ghosts.empty()) return;

    gl.Enable(GL_POLYGON_OFFSET_FILL);
    gl.PolygonOffset(2, 8);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    gl.DepthMask(GL_TRUE);
    gl.Enable(GL_CULL_FACE);
    edgeProgram->use();
    edgeProgram->set("projection", projection);
    for (const SurfaceItem* item : ghosts) {
        edgeProgram->set("modelView", toMatrix(~camera->X_GC * item->X_GM, item->scale));
        drawTriangles(*item);
    }
    gl.Disable(GL_CULL_FACE);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.DepthMask(GL_FALSE);
    gl.DepthFunc(GL_LEQUAL);
    for (const SurfaceItem* item : ghosts) drawSurface(*item);
    gl.DepthFunc(GL_LESS);
    gl.Disable(GL_POLYGON_OFFSET_FILL);
}

void GlRenderer::drawLines(const Scene& scene) {
    constexpr int floatsPerLine = 11;
    std::vector<float> data;
    for (const LineItem& line : scene.lines) {
        // Ends behind the camera are pulled up to the near plane.
        Vec3 a = camera->toCamera(line.start), b = camera->toCamera(line.end);
        const double limit = -camera->nearPlane;
        if (a[2] > limit && b[2] > limit) continue;
        if (a[2] > limit) a += (limit - a[2]) / (b[2] - a[2]) * (b - a);
        if (b[2] > limit) b += (limit - b[2]) / (a[2] - b[2]) * (a - b);
        append(data, a);
        append(data, b);
        append(data, line.color);
        data.push_back(float(line.opacity));
        data.push_back(float(line.width * style->unit));
    }
    if (data.empty()) return;

    gl.BindVertexArray(instanceArray);
    gl.BindBuffer(GL_ARRAY_BUFFER, instanceBuffer);
    gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(data.size() * sizeof(float)), data.data(),
                  GL_STREAM_DRAW);
    const int sizes[] = {3, 3, 4, 1}, starts[] = {0, 3, 6, 10};
    for (GLuint i = 0; i < 4; ++i) {
        gl.EnableVertexAttribArray(i);
        gl.VertexAttribPointer(i, sizes[i], GL_FLOAT, GL_FALSE, floatsPerLine * sizeof(float),
                               bufferOffset(starts[i]));
        gl.VertexAttribDivisor(i, 1);
    }
    lineProgram->use();
    lineProgram->set("projection", projection);
    lineProgram->set("viewport", double(target->getWidth()), double(target->getHeight()));
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(data.size() / floatsPerLine));
}

void GlRenderer::drawPoints(const Scene& scene) {
    constexpr int floatsPerPoint = 8;
    std::vector<float> data;
    for (const PointItem& point : scene.points) {
        append(data, camera->toCamera(point.location));
        append(data, point.color);
        data.push_back(float(point.opacity));
        data.push_back(float(point.diameter * style->unit));
    }
    if (data.empty()) return;

    gl.BindVertexArray(instanceArray);
    gl.BindBuffer(GL_ARRAY_BUFFER, instanceBuffer);
    gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(data.size() * sizeof(float)), data.data(),
                  GL_STREAM_DRAW);
    const int sizes[] = {3, 4, 1}, starts[] = {0, 3, 7};
    for (GLuint i = 0; i < 3; ++i) {
        gl.EnableVertexAttribArray(i);
        gl.VertexAttribPointer(i, sizes[i], GL_FLOAT, GL_FALSE, floatsPerPoint * sizeof(float),
                               bufferOffset(starts[i]));
        gl.VertexAttribDivisor(i, 1);
    }
    pointProgram->use();
    pointProgram->set("projection", projection);
    pointProgram->set("viewport", double(target->getWidth()), double(target->getHeight()));
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(data.size() / floatsPerPoint));
}

const GlRenderer::TextTexture& GlRenderer::getText(const std::string& text) {
    TextTexture& entry = texts[text];
    entry.isUsed = true;
    if (entry.texture != 0) return entry;

    if (!font) font = std::make_unique<Font>(Font::Weight::Regular);
    constexpr double capHeight = 0.73 * textPixelSize;  // of DejaVu Sans
    constexpr int descent = textPixelSize / 3, ascent = textPixelSize;
    const int width = int(std::ceil(font->calcWidth(text, textPixelSize))) + 4;
    Image image(width, ascent + descent, {0, 0, 0, 255});
    font->draw(image, 2, ascent, text, textPixelSize, {255, 255, 255, 255});

    gl.GenTextures(1, &entry.texture);
    gl.BindTexture(GL_TEXTURE_2D, entry.texture);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, image.getHeight(), 0, GL_RGBA,
                  GL_UNSIGNED_BYTE, image.getData());
    gl.GenerateMipmap(GL_TEXTURE_2D);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    entry.width = width / capHeight;
    entry.height = image.getHeight() / capHeight;
    entry.descent = descent / capHeight;
    return entry;
}

void GlRenderer::drawTexts(const Scene& scene) {
    std::vector<std::pair<double, const TextItem*>> items;
    for (const TextItem& item : scene.texts)
        items.emplace_back(camera->toCamera(item.X_GT.p())[2], &item);
    std::stable_sort(items.begin(), items.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [depth, item] : items) {
        if (depth > -camera->nearPlane) continue;
        const TextTexture& text = getText(item->text);
        const SimTK::Rotation R_CT =
            item->facesCamera ? SimTK::Rotation() : ~camera->X_GC.R() * item->X_GT.R();
        const Vec3 right = item->height * Vec3(R_CT.x()), top = item->height * Vec3(R_CT.y());
        textProgram->use();
        textProgram->set("projection", projection);
        textProgram->set("origin", Vec3(camera->toCamera(item->X_GT.p()) - text.descent * top));
        textProgram->set("right", Vec3(text.width * right));
        textProgram->set("top", Vec3(text.height * top));
        textProgram->set("color", item->color);
        textProgram->set("opacity", item->opacity);
        textProgram->set("coverage", 0);
        gl.ActiveTexture(GL_TEXTURE0);
        gl.BindTexture(GL_TEXTURE_2D, text.texture);
        gl.BindVertexArray(quadArray);
        gl.DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
    }
}

void GlRenderer::drawTriad() {
    // Seen by a camera of its own, with the same orientation and no perspective to speak of.
    const TriadPlace place = calcTriadPlace(target->getHeight(), style->unit);
    const int half = place.getHalfSize();
    gl.Viewport(int(place.x) - half, target->getHeight() - int(place.y) - half, 2 * half, 2 * half);
    gl.Clear(GL_DEPTH_BUFFER_BIT);

    Camera triadCamera;
    triadCamera.fieldOfView = 2 * std::atan(1.5 / 30);
    triadCamera.X_GC = Transform(camera->X_GC.R(), camera->X_GC.R() * Vec3(0, 0, 30));
    triadCamera.nearPlane = 20;
    triadCamera.farPlane = 40;
    const Camera* const sceneCamera = camera;
    camera = &triadCamera;
    projection = triadCamera.calcProjection(1);

    Scene triad;
    ShapeCache& shapes = triadShapes;
    SceneBuilder builder(
        triad, shapes, [](int) { return Transform(); }, [](const Vec3&, double) { return 6.0; });
    builder.add(SimTK::DecorativeFrame(1));
    for (const SurfaceItem& item : triad.surfaces) drawSurface(item);
    camera = sceneCamera;
}

}  // namespace simflex
