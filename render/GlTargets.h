#pragma once
/** @file
Framebuffers the renderer draws into. Internal to the renderer. **/

#include "GlFunctions.h"
#include "simflex/render/Image.h"

namespace simflex {

/** A multisampled picture with depth, and the plain picture it is resolved to. **/
class PictureTarget {
public:
    /** @throws std::runtime_error when the context cannot make a picture of this size. **/
    PictureTarget(const GlFunctions& gl, int width, int height);
    ~PictureTarget();
    PictureTarget(const PictureTarget&) = delete;
    PictureTarget& operator=(const PictureTarget&) = delete;

    int getWidth() const { return width; }
    int getHeight() const { return height; }

    /** Samples per pixel; 1 when the context has no multisampling. **/
    int getNumSamples() const { return numSamples; }

    /** Makes it the target of drawing, with the whole picture as viewport. **/
    void bind();

    /** Averages the samples and copies the picture to memory. **/
    Image read();

private:
    const GlFunctions& gl;
    int width, height, numSamples;
    GLuint drawBuffer = 0, drawColor = 0, drawDepth = 0;
    GLuint readBuffer = 0, readColor = 0;
};

/** Two one-channel square textures to draw into, for the shadow and its blur. **/
class ShadowTarget {
public:
    ShadowTarget(const GlFunctions& gl, int size);
    ~ShadowTarget();
    ShadowTarget(const ShadowTarget&) = delete;
    ShadowTarget& operator=(const ShadowTarget&) = delete;

    int getSize() const { return size; }
    GLuint getTexture(int i) const { return textures[i]; }

    /** Makes texture i the target of drawing. **/
    void bind(int i);

private:
    const GlFunctions& gl;
    int size;
    GLuint buffers[2] = {0, 0}, textures[2] = {0, 0};
};

}  // namespace simflex
