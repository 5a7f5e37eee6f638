#include "GlTargets.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace simflex {

namespace {

constexpr int wantedSamples = 4;

void checkComplete(const GlFunctions& gl, int width, int height) {
    if (gl.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
        throw std::runtime_error("the OpenGL context cannot draw a picture of " +
                                 std::to_string(width) + "x" + std::to_string(height) + " pixels");
}

}  // namespace

PictureTarget::PictureTarget(const GlFunctions& functions, int pictureWidth, int pictureHeight)
    : gl(functions), width(pictureWidth), height(pictureHeight) {
    GLint maxSamples = 0, maxSize = 0;
    gl.GetIntegerv(GL_MAX_SAMPLES, &maxSamples);
    gl.GetIntegerv(GL_MAX_RENDERBUFFER_SIZE, &maxSize);
    numSamples = std::max(1, std::min(wantedSamples, int(maxSamples)));
    if (width <= 0 || height <= 0 || width > maxSize || height > maxSize)
        throw std::runtime_error("a picture of " + std::to_string(width) + "x" +
                                 std::to_string(height) + " pixels is not between 1x1 and " +
                                 std::to_string(maxSize) + "x" + std::to_string(maxSize));

    const auto makeStorage = [&](GLuint& buffer, GLenum format, GLenum attachment, int samples) {
        gl.GenRenderbuffers(1, &buffer);
        gl.BindRenderbuffer(GL_RENDERBUFFER, buffer);
        if (samples > 1)
            gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, samples, format, width, height);
        else
            gl.RenderbufferStorage(GL_RENDERBUFFER, format, width, height);
        gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, buffer);
    };
    gl.GenFramebuffers(1, &drawBuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, drawBuffer);
    makeStorage(drawColor, GL_RGBA8, GL_COLOR_ATTACHMENT0, numSamples);
    makeStorage(drawDepth, GL_DEPTH_COMPONENT24, GL_DEPTH_ATTACHMENT, numSamples);
    checkComplete(gl, width, height);

    gl.GenFramebuffers(1, &readBuffer);
    gl.BindFramebuffer(GL_FRAMEBUFFER, readBuffer);
    makeStorage(readColor, GL_RGBA8, GL_COLOR_ATTACHMENT0, 1);
    checkComplete(gl, width, height);
}

PictureTarget::~PictureTarget() {
    gl.DeleteFramebuffers(1, &drawBuffer);
    gl.DeleteFramebuffers(1, &readBuffer);
    gl.DeleteRenderbuffers(1, &drawColor);
    gl.DeleteRenderbuffers(1, &drawDepth);
    gl.DeleteRenderbuffers(1, &readColor);
}

void PictureTarget::bind() {
    gl.BindFramebuffer(GL_FRAMEBUFFER, drawBuffer);
    gl.Viewport(0, 0, width, height);
}

Image PictureTarget::read() {
    gl.BindFramebuffer(GL_READ_FRAMEBUFFER, drawBuffer);
    gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, readBuffer);
    gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    gl.BindFramebuffer(GL_FRAMEBUFFER, readBuffer);
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
