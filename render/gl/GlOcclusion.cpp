#include "GlOcclusion.h"

#include "Shaders.h"

namespace simflex {

GlOcclusion::GlOcclusion(const GlFunctions& functions, const GlScreen& sharedScreen)
    : gl(functions),
      screen(sharedScreen),
      distanceProgram(gl, shaders::backgroundVertex, shaders::distanceFragment),
      occlusionProgram(gl, shaders::backgroundVertex, shaders::occlusionFragment),
      blurProgram(gl, shaders::backgroundVertex, shaders::occlusionBlurFragment),
      darkenProgram(gl, shaders::backgroundVertex, shaders::darkenFragment) {
    gl.GenFramebuffers(1, &sceneBuffer);
}

GlOcclusion::~GlOcclusion() {
    drop();
    gl.DeleteFramebuffers(1, &sceneBuffer);
}

void GlOcclusion::drop() {
    if (width == 0) return;
    gl.DeleteFramebuffers(3, buffers);
    gl.DeleteTextures(3, textures);
    width = height = 0;
}

void GlOcclusion::prepare(int newWidth, int newHeight) {
    if (newWidth == width && newHeight == height) return;
    drop();
    width = newWidth;
    height = newHeight;
    gl.GenFramebuffers(3, buffers);
    gl.GenTextures(3, textures);
    for (int i = 0; i < 3; ++i) {
        gl.BindTexture(GL_TEXTURE_2D, textures[i]);
        gl.TexImage2D(GL_TEXTURE_2D, 0, i == 0 ? GL_R32F : GL_R8, width, height, 0, GL_RED,
                      i == 0 ? GL_FLOAT : GL_UNSIGNED_BYTE, nullptr);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffers[i]);
        gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[i],
                                0);
        checkFramebuffer(gl, width, height);
    }
}

void GlOcclusion::darken(const GlView& view, const std::vector<SimTK::Vec3>& bounds_G,
                         PictureTarget& target) {
    const GlRectangle used = calcCoveredRectangle(view, bounds_G, 2);
    if (used.isEmpty()) return;
    prepare((view.width + 1) / 2, (view.rows + 1) / 2);
    const auto bindTexture = [&](int unit, int i) {
        gl.ActiveTexture(GLenum(GL_TEXTURE0 + unit));
        gl.BindTexture(GL_TEXTURE_2D, textures[i]);
    };
    const auto bindHalf = [&](int i) {
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffers[i]);
        gl.Viewport(0, 0, width, height);
        // Clear all: neighbours outside the rectangle are read, too.
        gl.ClearColor(0, 0, 0, 0);
        gl.Disable(GL_SCISSOR_TEST);
        gl.Clear(GL_COLOR_BUFFER_BIT);
        gl.Enable(GL_SCISSOR_TEST);
        gl.Scissor(used.left / 2, used.bottom / 2, used.right / 2 + 1 - used.left / 2,
                   used.top / 2 + 1 - used.bottom / 2);
    };

    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_BLEND);
    const auto& P = view.projection;
    const double radius = view.style.occlusionRadius;

    distanceProgram.use();
    distanceProgram.set("scene", 0);
    distanceProgram.set("depthTerms", P[10], P[14]);
    distanceProgram.set("isPerspective", view.isPerspective);
    target.getSceneDepth().bind(0);
    bindHalf(0);
    screen.drawAll();

    occlusionProgram.use();
    occlusionProgram.set("distances", 0);
    occlusionProgram.set("isPerspective", view.isPerspective);
    occlusionProgram.set("ray", 1 / P[0], 1 / P[5],
                         view.isPerspective ? P[8] / P[0] : -P[12] / P[0],
                         view.isPerspective ? P[9] / P[5] : -P[13] / P[5]);
    occlusionProgram.set("radius", radius);
    occlusionProgram.set("pixelsPerMetre", 0.5 * height * double(P[5]));
    bindTexture(0, 0);
    bindHalf(1);
    screen.drawAll();

    for (const int direction : {0, 1}) {
        blurProgram.use();
        blurProgram.set("distances", 0);
        blurProgram.set("light", 1);
        blurProgram.set("along", direction == 0 ? 1.0 : 0.0, direction == 0 ? 0.0 : 1.0);
        blurProgram.set("radius", radius);
        bindTexture(0, 0);
        bindTexture(1, direction == 0 ? 1 : 2);
        bindHalf(direction == 0 ? 2 : 1);
        screen.drawAll();
    }

    gl.BindFramebuffer(GL_FRAMEBUFFER, sceneBuffer);
    target.getSceneColor().attach();
    gl.Viewport(0, 0, target.getWidth(), target.getHeight());
    gl.Scissor(used.left, used.bottom, used.right - used.left, used.top - used.bottom);
    darkenProgram.use();
    darkenProgram.set("scene", 0);
    darkenProgram.set("distances", 1);
    darkenProgram.set("light", 2);
    darkenProgram.set("depthTerms", P[10], P[14]);
    darkenProgram.set("isPerspective", view.isPerspective);
    darkenProgram.set("radius", radius);
    target.getSceneDepth().bind(0);
    bindTexture(1, 0);
    bindTexture(2, 1);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_ZERO, GL_SRC_COLOR);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_FALSE);
    screen.drawAll();
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.Disable(GL_BLEND);
    gl.Disable(GL_SCISSOR_TEST);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.Enable(GL_DEPTH_TEST);
    target.bindScene();
}

}  // namespace simflex
