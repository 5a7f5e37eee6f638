#include "GlTargets.h"

#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace simflex {

namespace {

void checkComplete(const GlFunctions& gl, int width, int height) {
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw std::runtime_error("the OpenGL context cannot draw a picture of " +
                                 std::to_string(width) + "x" + std::to_string(height) + " pixels");
}

}  // namespace

PictureTarget::PictureTarget(const GlFunctions& functions, int pictureWidth, int pictureHeight)
    : gl(functions), width(pictureWidth), height(pictureHeight) {
    GLint maxSize = 0;
    gl.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &maxSize);
    if (width <= 0 || height <= 0 || width > maxSize || height > maxSize)
        throw std::runtime_error("a picture of " + std::to_string(width) + "x" +
                                 std::to_string(height) + " pixels is not between 1x1 and " +
                                 std::to_string(maxSize) + "x" + std::to_string(maxSize));

    gl.GenFramebuffers(1, &sceneBuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, sceneBuffer);
    gl.GenTextures(1, &sceneColor);
    gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, sceneColor);
    gl.TexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, numSamples, GL_RGBA8, width, height,
                             GL_TRUE);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D_MULTISAMPLE,
                            sceneColor, 0);
    gl.GenTextures(1, &sceneDepth);
    gl.BindTexture(GL_TEXTURE_2D_MULTISAMPLE, sceneDepth);
    gl.TexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, numSamples, GL_DEPTH_COMPONENT24, width,
                             height, GL_TRUE);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D_MULTISAMPLE,
                            sceneDepth, 0);
    checkComplete(gl, width, height);

    const auto makePlain = [&](GLuint& buffer, GLuint& color) {
        gl.GenFramebuffers(1, &buffer);
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffer);
        gl.GenRenderbuffers(1, &color);
        gl.BindRenderbuffer(GL_RENDERBUFFER, color);
        gl.RenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, width, height);
        gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, color);
        checkComplete(gl, width, height);
    };
    makePlain(pictureBuffer, pictureColor);
    makePlain(backdropBuffer, backdropColor);
}

PictureTarget::~PictureTarget() {
    gl.DeleteFramebuffers(1, &sceneBuffer);
    gl.DeleteFramebuffers(1, &pictureBuffer);
    gl.DeleteTextures(1, &sceneColor);
    gl.DeleteTextures(1, &sceneDepth);
    gl.DeleteRenderbuffers(1, &pictureColor);
    gl.DeleteFramebuffers(1, &backdropBuffer);
    gl.DeleteRenderbuffers(1, &backdropColor);
}

void PictureTarget::bindScene() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, sceneBuffer);
    gl.Viewport(0, 0, width, height);
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
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

Image PictureTarget::read() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, pictureBuffer);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    Image image(width, height);
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_UNSIGNED_BYTE, image.updData());
    if (gl.GetError() != GL_NO_ERROR)
        throw std::runtime_error("OpenGL reported an error while a picture was drawn");

    // OpenGL's first row is the lowest. What is drawn over an opaque background is opaque.
    const std::size_t row = 4 * std::size_t(width);
    std::vector<std::uint8_t> swap(row);
    for (int y = 0; y < height / 2; ++y) {
        std::uint8_t* a = image.updData() + y * row;
        std::uint8_t* b = image.updData() + (height - 1 - y) * row;
        std::memcpy(swap.data(), a, row);
        std::memcpy(a, b, row);
        std::memcpy(b, swap.data(), row);
    }
    for (std::size_t i = 3; i < image.getNumBytes(); i += 4) image.updData()[i] = 255;
    return image;
}

ShadowTarget::ShadowTarget(const GlFunctions& functions, int textureSize)
    : gl(functions), size(textureSize) {
    gl.GenFramebuffers(2, buffers);
    gl.GenTextures(2, textures);
    for (int i = 0; i < 2; ++i) {
        gl.BindTexture(GL_TEXTURE_2D, textures[i]);
        gl.TexImage2D(GL_TEXTURE_2D, 0, GL_R8, size, size, 0, GL_RED, GL_UNSIGNED_BYTE, nullptr);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
        gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
        gl.BindFramebuffer(GL_FRAMEBUFFER, buffers[i]);
        gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[i],
                                0);
        checkComplete(gl, size, size);
    }
}

ShadowTarget::~ShadowTarget() {
    gl.DeleteFramebuffers(2, buffers);
    gl.DeleteTextures(2, textures);
}

void ShadowTarget::bind(int i) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, buffers[i]);
    gl.Viewport(0, 0, size, size);
}

}  // namespace simflex
