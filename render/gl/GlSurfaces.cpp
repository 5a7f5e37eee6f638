#include "GlSurfaces.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "Shaders.h"

namespace simflex {

using SimTK::DecorativeGeometry;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr int colorMapSize = 256;

// Moves a ghost slightly behind the deformed part, which is visible where they coincide.
SimTK::Vec2 calcShift(const SurfaceItem& item, const GlView& view) {
    return view.calcShift(item.style == SurfaceItem::Style::Ghost ? -1.5 : 0);
}

// The cost of a small triangle is that of all pixel blocks it touches. Finely divided shapes are
// therefore lit per vertex, unless they are seen from close by or also from inside.
bool isLitPerVertex(const SurfaceItem& item, const GlView& view) {
    const SurfaceGeometry& geometry = *item.geometry;
    if (!geometry.isFine || !geometry.isClosed || !view.style.isLit || item.isTransparent() ||
        item.representation != DecorativeGeometry::DrawSurface)
        return false;
    const Vec3 middle = 0.5 * (geometry.lower + geometry.upper).elementwiseMultiply(item.scale);
    const Vec3 extent = (geometry.upper - geometry.lower).elementwiseMultiply(item.scale);
    return view.toCamera(item.X_GM * middle).norm() > extent.norm();
}

}  // namespace

GlSurfaces::GlSurfaces(const GlFunctions& functions)
    : gl(functions),
      shapes(gl),
      surfaceProgram(gl, shaders::surfaceVertex,
                     shaders::compose({shaders::version330, shaders::lighting, shaders::baseColor,
                                       shaders::surfaceShade, shaders::surfaceFragment})),
      fineSurfaceProgram(
          gl,
          shaders::compose({shaders::version330, shaders::lighting, shaders::fineSurfaceVertex}),
          shaders::compose(
              {shaders::version330, shaders::baseColor, shaders::fineSurfaceFragment})),
      edgeProgram(gl, shaders::edgeVertex, shaders::edgeFragment) {
    gl.GenTextures(1, &colorMapTexture);
    GLfloat range[2] = {1, 1};
    gl.GetFloatv(GL_ALIASED_LINE_WIDTH_RANGE, range);
    maxLineWidth = range[1];
}

GlSurfaces::~GlSurfaces() {
    gl.DeleteTextures(1, &colorMapTexture);
}

void GlSurfaces::setColorMap(ColorMap map) {
    if (loadedColorMap == int(map)) return;
    loadedColorMap = int(map);
    std::vector<std::uint8_t> texels;
    for (int i = 0; i < colorMapSize; ++i) {
        const Vec3 c = calcColor(map, double(i) / (colorMapSize - 1));
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

GlSurfaces::Sides GlSurfaces::chooseSides(const SurfaceItem& item) {
    const bool hidesBack = item.geometry->isClosed &&
                           (!item.isTransparent() || item.style == SurfaceItem::Style::Ghost) &&
                           item.representation == DecorativeGeometry::DrawSurface;
    return hidesBack ? Sides::Outer : Sides::Both;
}

void GlSurfaces::draw(const SurfaceItem& item, const GlView& view, Sides sides, Alpha alpha) {
    GlProgram& program = isLitPerVertex(item, view) ? fineSurfaceProgram : surfaceProgram;
    program.use();
    program.set("isPremultiplied", alpha == Alpha::Premultiplied);
    draw(item, view, sides, program);
}

void GlSurfaces::draw(const SurfaceItem& item, const GlView& view, Sides sides,
                      GlProgram& program) {
    const FrameStyle& style = view.style;
    const Transform X_CM = view.toCamera(item.X_GM);
    const SimTK::Rotation R_CG = ~view.camera.X_GC.R();
    program.set("modelView", calcModelView(X_CM, item.scale));
    program.set("projection", view.projection);
    program.set("normalMatrix", calcNormalMatrix(X_CM.R(), item.scale));
    program.set("color", item.color);
    program.set("opacity", item.opacity);
    program.set("isContour", item.style == SurfaceItem::Style::Contour);
    program.set("isGhost", item.style == SurfaceItem::Style::Ghost);
    program.set("isLit", style.isLit && item.representation == DecorativeGeometry::DrawSurface);
    const double range = style.contourHigh - style.contourLow;
    program.set("contourRange", style.contourLow, range > 0 ? 1 / range : 0.0);
    program.set("colorMap", 0);
    program.set("up", Vec3(R_CG * Vec3(style.up)));
    program.set("keyDirection", Vec3(R_CG * Vec3(style.toLight)));
    program.set("viewDirection", Vec3(0, 0, 1));
    program.set("isPerspective", view.isPerspective);
    program.set("shift", calcShift(item, view));
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D, colorMapTexture);
    drawRepresentation(item, sides);
}

void GlSurfaces::drawShape(const SurfaceItem& item, const GlView& view, Sides sides,
                           GlProgram& program) {
    program.set("modelView", calcModelView(view.toCamera(item.X_GM), item.scale));
    program.set("shift", calcShift(item, view));
    drawRepresentation(item, sides);
}

void GlSurfaces::drawRepresentation(const SurfaceItem& item, Sides sides) {
    if (item.representation == DecorativeGeometry::DrawWireframe) {
        shapes.drawSkeleton(item.geometry, GlShapes::Skeleton::Edges);
    } else if (item.representation == DecorativeGeometry::DrawPoints) {
        gl.PointSize(3);
        shapes.drawSkeleton(item.geometry, GlShapes::Skeleton::Points);
    } else {
        if (sides == Sides::Outer) gl.Enable(GL_CULL_FACE);
        shapes.drawTriangles(item.geometry);
        if (sides == Sides::Outer) gl.Disable(GL_CULL_FACE);
    }
}

void GlSurfaces::drawEdges(const SurfaceItem& item, const GlView& view) {
    if (!item.showFeatureEdges && !item.showElementEdges) return;
    edgeProgram.use();
    const Transform X_CM = view.toCamera(item.X_GM);
    const double width = std::min(maxLineWidth, std::max(1.0, view.style.unit));
    edgeProgram.set("modelView", calcModelView(X_CM, item.scale));
    edgeProgram.set("projection", view.projection);
    edgeProgram.set("normalMatrix", calcNormalMatrix(X_CM.R(), item.scale));
    edgeProgram.set("pixel", view.calcPixelSize());
    edgeProgram.set("width", width);
    gl.LineWidth(GLfloat(width));
    edgeProgram.set("color", view.style.palette.edge);
    if (item.showElementEdges) {
        edgeProgram.set("opacity", 0.22);
        shapes.drawEdges(item.geometry, GlShapes::Edges::Element);
    }
    if (item.showFeatureEdges) {
        edgeProgram.set("opacity", 0.45);
        shapes.drawEdges(item.geometry, GlShapes::Edges::Feature);
    }
    gl.LineWidth(1);
}

}  // namespace simflex
