#include "GlDepthReader.h"

#include "Shaders.h"

namespace simflex {

GlDepthReader::GlDepthReader(const GlFunctions& functions, const GlScreen& sharedScreen)
    : gl(functions),
      screen(sharedScreen),
      program(gl, shaders::backgroundVertex, shaders::depthFragment) {}

void GlDepthReader::read(const PictureTarget& target, int rows, float* values) {
    const int width = target.getWidth();
    GLuint buffer = 0, texture = 0;
    gl.GenFramebuffers(1, &buffer);
    gl.GenTextures(1, &texture);
    gl.ActiveTexture(GL_TEXTURE0);
    gl.BindTexture(GL_TEXTURE_2D, texture);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_R32F, width, rows, 0, GL_RED, GL_FLOAT, nullptr);
    gl.BindFramebuffer(GL_FRAMEBUFFER, buffer);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    checkFramebuffer(gl, width, rows);
    gl.Viewport(0, 0, width, rows);

    gl.Disable(GL_DEPTH_TEST);
    gl.Disable(GL_BLEND);
    program.use();
    program.set("scene", 0);
    target.getSceneDepth().bind(0);
    screen.drawAll();
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, width, rows, GL_RED, GL_FLOAT, values);
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_BLEND);

    gl.DeleteFramebuffers(1, &buffer);
    gl.DeleteTextures(1, &texture);
}

}  // namespace simflex
