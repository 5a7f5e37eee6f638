#include "GlTargets.h"

#include <stdexcept>
#include <string>

namespace simflex {

void checkFramebuffer(const GlFunctions& gl, int width, int height) {
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw std::runtime_error("the OpenGL context cannot draw a picture of " +
                                 std::to_string(width) + "x" + std::to_string(height) + " pixels");
}

SampleTexture::SampleTexture(const GlFunctions& functions, Kind textureKind, int width, int height)
    : gl(functions), kind(textureKind) {
    gl.GenTextures(1, &name);
    gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
    const GLenum format = kind == Kind::Color   ? GL_RGBA8
                          : kind == Kind::Depth ? GL_DEPTH_COMPONENT24
                                                : GL_DEPTH_COMPONENT32F;
    gl.TexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, samplesPerPixel, format, width, height,
                             GL_TRUE);
}

SampleTexture::~SampleTexture() {
    gl.DeleteTextures(1, &name);
}

void SampleTexture::attach() const {
    gl.FramebufferTexture2D(GL_FRAMEBUFFER,
                            kind == Kind::Color ? GL_COLOR_ATTACHMENT0 : GL_DEPTH_ATTACHMENT,
                            GL_TEXTURE_2D_MULTISAMPLE, name, 0);
}

void SampleTexture::bind(int unit) const {
    gl.ActiveTexture(GLenum(GL_TEXTURE0 + unit));
    gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
}

PictureTarget::PictureTarget(const GlFunctions& functions, int pictureWidth, int pictureHeight)
    : gl(functions),
      width(pictureWidth),
      height(pictureHeight),
      sceneColor(gl, SampleTexture::Kind::Color, width, height),
      sceneDepth(gl, SampleTexture::Kind::Depth, width, height) {
    gl.GenFramebuffers(1, &sceneBuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, sceneBuffer);
    sceneColor.attach();
    sceneDepth.attach();
    checkFramebuffer(gl, width, height);

    const auto makePlain = [&](GLuint& buffer, GLuint& color) {
        gl.GenFramebuffers(1, &buffer);
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffer);
        gl.GenRenderbuffers(1, &color);
        gl.BindRenderbuffer(GL_RENDERBUFFER, color);
        gl.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
        gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
        checkFramebuffer(gl, width, height);
    };
    makePlain(pictureBuffer, pictureColor);
    makePlain(backdropBuffer, backdropColor);
}

PictureTarget::~PictureTarget() {
    for (const GLuint buffer : {sceneBuffer, pictureBuffer, backdropBuffer})
        gl.DeleteFramebuffers(1, &buffer);
    for (const GLuint color : {pictureColor, backdropColor}) gl.DeleteRenderbuffers(1, &color);
}

void PictureTarget::bindScene() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, sceneBuffer);
    gl.Viewport(0, 0, width, height);
}

void PictureTarget::bindPicture() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, pictureBuffer);
    gl.Viewport(0, 0, width, height);
}

void PictureTarget::bindBackdrop() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, backdropBuffer);
    gl.Viewport(0, 0, width, height);
}

void PictureTarget::copyBackdrop() {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, backdropBuffer);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, pictureBuffer);
    gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
}

void PictureTarget::read(int rows, std::uint8_t* bytes) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, pictureBuffer);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.ReadPixels(0, 0, width, rows, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    if (gl.GetError() != GL_NO_ERROR)
        throw std::runtime_error("OpenGL reported an error while a picture was drawn");
}

}  // namespace simflex
