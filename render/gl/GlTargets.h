#pragma once
/** @file
Framebuffers of the renderer. Internal to the renderer. **/

#include <cstdint>
#include <vector>

#include "GlFunctions.h"

namespace simflex {

constexpr int samplesPerPixel = 4;  ///< guaranteed by OpenGL 3.3

/** A multisampled texture usable as a render target. **/
class SampleTexture {
public:
    /** ExactDepth preserves a fragment's depth, so that it can be compared with another's. **/
    enum class Kind { Color, Depth, ExactDepth };

    SampleTexture(const GlFunctions& gl, Kind kind, int width, int height);
    ~SampleTexture();
    SampleTexture(const SampleTexture&) = delete;
    SampleTexture& operator=(const SampleTexture&) = delete;

    GLuint getName() const { return name; }

    /** Attaches it to the bound framebuffer. **/
    void attach() const;

    /** Binds it to a texture unit. **/
    void bind(int unit) const;

private:
    const GlFunctions& gl;
    Kind kind;
    GLuint name = 0;
};

/** Two layers of a picture, or of a band of its rows: a multisampled one with depth for the scene,
initially transparent, and a plain one for the background, onto which the scene is composited at the
end. **/
class PictureTarget {
public:
    /** @throws std::runtime_error if the context does not support this size. **/
    PictureTarget(const GlFunctions& gl, int width, int height);
    ~PictureTarget();
    PictureTarget(const PictureTarget&) = delete;
    PictureTarget& operator=(const PictureTarget&) = delete;

    int getWidth() const { return width; }
    int getHeight() const { return height; }

    /** Makes the scene layer the draw target. **/
    void bindScene();

    /** Scene colours, with premultiplied alpha. **/
    const SampleTexture& getSceneColor() const { return sceneColor; }
    const SampleTexture& getSceneDepth() const { return sceneDepth; }

    /** Makes the plain layer the draw target. **/
    void bindPicture();

    /** Makes the backdrop the draw target: a plain layer that persists between frames. **/
    void bindBackdrop();

    /** Parameters from which the backdrop was drawn. **/
    std::vector<double>& updBackdropKey() { return backdropKey; }

    /** Copies the backdrop to the plain layer. **/
    void copyBackdrop();

    /** Copies the lowest rows of the plain layer to memory, lowest first, four bytes per pixel. **/
    void read(int rows, std::uint8_t* bytes);

private:
    const GlFunctions& gl;
    int width, height;
    SampleTexture sceneColor, sceneDepth;
    GLuint sceneBuffer = 0;
    GLuint pictureBuffer = 0, pictureColor = 0;
    GLuint backdropBuffer = 0, backdropColor = 0;
    std::vector<double> backdropKey;
};

/** @throws std::runtime_error if the bound framebuffer cannot be drawn into. **/
void checkFramebuffer(const GlFunctions& gl, int width, int height);

}  // namespace simflex
