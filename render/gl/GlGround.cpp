#include "GlGround.h"

#include <algorithm>

#include "Shaders.h"

namespace simflex {

using SimTK::Transform;
using SimTK::Vec3;

GlGround::GlGround(const GlFunctions& functions, const GlScreen& sharedScreen)
    : gl(functions),
      screen(sharedScreen),
      backgroundProgram(gl, shaders::backgroundVertex, shaders::backgroundFragment),
      groundProgram(gl, shaders::groundVertex, shaders::groundFragment),
      groundShadowProgram(gl, shaders::groundVertex, shaders::groundShadowFragment) {
    gl.GenTextures(1, &shadowTexture);
    gl.BindTexture(GL_TEXTURE_2D, shadowTexture);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

GlGround::~GlGround() {
    gl.DeleteTextures(1, &shadowTexture);
}

bool GlGround::isVisible(const Camera& camera, const FrameStyle& style) {
    if (!style.ground.isShown) return false;
    const Transform X_PC = ~style.ground.X_GP * camera.X_GC;
    const bool isPerspective = camera.calcProjection(1)[11] != 0;
    return isPerspective ? X_PC.p()[2] > 0 : X_PC.R().z()[2] > 0;
}

bool GlGround::updateShadow(const Scene& scene, const FrameStyle& style) {
    const Transform X_PG = ~style.ground.X_GP;
    const Vec3 light = X_PG.R() * Vec3(style.toLight);
    if (!(light[2] > 0.05)) return false;

    // Projects a point of P along the light onto z = 0.
    const auto toGround = [&](const Vec3& p) {
        return Vec3(p[0] - light[0] / light[2] * p[2], p[1] - light[1] / light[2] * p[2], 0);
    };
    Scene casting;
    for (const SurfaceItem& item : scene.surfaces)
        if (!item.isTransparent()) casting.surfaces.push_back(item);
    std::vector<Vec3> bounds;
    casting.appendBounds(bounds);
    if (bounds.empty()) return false;
    Vec3 lower(SimTK::Infinity), upper(-SimTK::Infinity);
    for (const Vec3& p : bounds) {
        const Vec3 q = toGround(X_PG * p);
        for (int k = 0; k < 2; ++k) {
            lower[k] = std::min(lower[k], q[k]);
            upper[k] = std::max(upper[k], q[k]);
        }
    }
    const double smallest = 1e-9 * style.ground.radius;
    const double extent = 1.25 * std::max({upper[0] - lower[0], upper[1] - lower[1], smallest});
    const Vec3 middle = 0.5 * (lower + upper);
    shadowRegion =
        SimTK::Vec4(middle[0] - extent / 2, middle[1] - extent / 2, 1 / extent, 1 / extent);

    shadow.clear();
    for (const SurfaceItem& item : casting.surfaces) {
        const Transform X_PM = X_PG * item.X_GM;
        const double texels = GroundShadow::size / extent;
        GroundShadow::ToTexel toTexel;
        const auto setColumn = [&](std::size_t column, const Vec3& v) {
            for (std::size_t k = 0; k < 2; ++k) toTexel[2 * column + k] = float(texels * v[int(k)]);
        };
        for (int column = 0; column < 3; ++column)
            setColumn(std::size_t(column),
                      toGround(Vec3(X_PM.R().col(column)) * item.scale[column]));
        setColumn(3, toGround(X_PM.p()) - Vec3(shadowRegion[0], shadowRegion[1], 0));
        shadow.add(*item.geometry, toTexel);
    }
    shadow.blur();
    if (shadow.getBox().isEmpty()) return false;
    gl.BindTexture(GL_TEXTURE_2D, shadowTexture);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_R8, GroundShadow::size, GroundShadow::size, 0, GL_RED,
                  GL_UNSIGNED_BYTE, shadow.getTexels().data());
    return true;
}

// The plain layer has no depth buffer, so its clipping planes are far apart and independent of the
// scene.
std::array<float, 16> GlGround::calcProjection(const GlView& view) const {
    Camera wide = view.camera;
    wide.farPlane = 1e3 * view.style.ground.radius;
    wide.nearPlane = view.isPerspective ? 1e-6 * wide.farPlane : -wide.farPlane;
    return view.cut(wide.calcProjection(view.getAspect()));
}

void GlGround::updateBackdrop(const GlView& view, bool hasGround, PictureTarget& target) {
    const FrameStyle& style = view.style;
    const GroundStyle& ground = style.ground;
    std::vector<double> key = {
        double(hasGround),    ground.radius,       ground.gridSpacing,  ground.gridOffset[0],
        ground.gridOffset[1], double(view.bottom), double(view.height), style.unit};
    for (const Vec3& color : {style.palette.backgroundTop, style.palette.backgroundBottom,
                              style.palette.ground, style.palette.grid})
        key.insert(key.end(), {color[0], color[1], color[2]});
    if (hasGround) {
        const auto projection = calcProjection(view);
        const auto modelView = calcModelView(view.toCamera(ground.X_GP), Vec3(1));
        key.insert(key.end(), projection.begin(), projection.end());
        key.insert(key.end(), modelView.begin(), modelView.end());
    }
    if (key == target.updBackdropKey()) return;
    target.updBackdropKey() = key;

    target.bindBackdrop();
    backgroundProgram.use();
    backgroundProgram.set("topColor", style.palette.backgroundTop);
    backgroundProgram.set("bottomColor", style.palette.backgroundBottom);
    backgroundProgram.set("band", double(view.bottom), double(view.height));
    screen.drawAll();
    if (!hasGround) return;
    gl.Enable(GL_BLEND);
    drawGround(view);
    gl.Disable(GL_BLEND);
}

void GlGround::drawGround(const GlView& view) {
    const GroundStyle& ground = view.style.ground;
    gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    groundProgram.use();
    groundProgram.set("modelView", calcModelView(view.toCamera(ground.X_GP), Vec3(1)));
    groundProgram.set("projection", calcProjection(view));
    groundProgram.set("middle", 0.0, 0.0);
    groundProgram.set("halfWidth", ground.radius, ground.radius);
    groundProgram.set("size", ground.radius);
    groundProgram.set("gridOrigin", ground.gridOffset[0], ground.gridOffset[1]);
    groundProgram.set("spacing", ground.gridSpacing);
    groundProgram.set("groundColor", view.style.palette.ground);
    groundProgram.set("gridColor", view.style.palette.grid);
    groundProgram.set("lineWidth", std::max(1.0, view.style.unit));
    screen.drawSquare();
}

void GlGround::drawShadow(const GlView& view) {
    const FrameStyle& style = view.style;
    if (style.isBackgroundTransparent)
        gl.BlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
    else
        gl.BlendFunc(GL_ZERO, GL_SRC_COLOR);
    GlProgram& program = groundShadowProgram;
    program.use();
    program.set("modelView", calcModelView(view.toCamera(style.ground.X_GP), Vec3(1)));
    program.set("projection", calcProjection(view));
    // The shadow's bounds and one more texel, which is interpolated.
    const GroundShadow::Box& box = shadow.getBox();
    const double texel = 1 / (GroundShadow::size * shadowRegion[2]);
    program.set("middle", shadowRegion[0] + 0.5 * (box.left + box.right) * texel,
                shadowRegion[1] + 0.5 * (box.bottom + box.top) * texel);
    program.set("halfWidth", (0.5 * (box.right - box.left) + 1) * texel,
                (0.5 * (box.top - box.bottom) + 1) * texel);
    program.set("size", style.ground.radius);
    program.set("shadowRegion", shadowRegion[0], shadowRegion[1], shadowRegion[2], shadowRegion[3]);
    program.set("shadow", 0);
    program.set("groundColor", style.palette.ground);
    program.set("isLaidOver", style.isBackgroundTransparent);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D, shadowTexture);
    screen.drawSquare();
}

void GlGround::hideBelow(const GlView& view, const std::vector<Vec3>& bounds_G) {
    const Transform X_PG = ~view.style.ground.X_GP;
    const bool isBelow = std::any_of(bounds_G.begin(), bounds_G.end(),
                                     [&](const Vec3& p) { return (X_PG * p)[2] < 0; });
    if (!isBelow) return;
    groundProgram.use();
    groundProgram.set("modelView", calcModelView(view.toCamera(view.style.ground.X_GP), Vec3(1)));
    groundProgram.set("projection", view.projection);
    groundProgram.set("middle", 0.0, 0.0);
    groundProgram.set("halfWidth", view.style.ground.radius, view.style.ground.radius);
    groundProgram.set("size", view.style.ground.radius);
    gl.ColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    screen.drawSquare();
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
}

}  // namespace simflex
