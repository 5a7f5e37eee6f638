#pragma once
/** @file
Framebuffers the renderer draws into. Internal to the renderer. **/

#include "GlFunctions.h"
#include "simflex/render/Image.h"

namespace simflex {

/** Two layers of one picture: a multisampled one with depth for the scene, transparent where
nothing is drawn, and a plain one for what lies behind it, onto which the scene is laid at the end.
**/
class PictureTarget {
public:
    /** @throws std::runtime_error when the context cannot make a picture of this size. **/
    PictureTarget(const GlFunctions& gl, int width, int height);
    ~PictureTarget();
    PictureTarget(const PictureTarget&) = delete;
    PictureTarget& operator=(const PictureTarget&) = delete;

    int getWidth() const { return width; }
    int getHeight() const { return height; }

    static constexpr int numSamples = 4;  // what OpenGL 3.3 guarantees

    /** Makes the scene's layer the target of drawing, cleared. **/
    void bindScene();

    /** Makes the plain layer the target of drawing. **/
    void bindPicture();

    /** The scene's colours, a multisampled texture with premultiplied alpha. **/
    GLuint getSceneTexture() const { return sceneColor; }

    /** Makes the backdrop the target of drawing: a plain layer that keeps from frame to frame. **/
    void bindBackdrop();

    /** Copies the backdrop to the plain layer. **/
    void copyBackdrop();

    /** Copies the plain layer to memory. **/
    Image read();

private:
    const GlFunctions& gl;
    int width, height;
    GLuint sceneBuffer = 0, sceneColor = 0, sceneDepth = 0;
    GLuint pictureBuffer = 0, pictureColor = 0;
    GLuint backdropBuffer = 0, backdropColor = 0;
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
