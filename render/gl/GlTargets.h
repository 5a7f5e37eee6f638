#pragma once
/** @file
Framebuffers the renderer draws into. Internal to the renderer. **/

#include <cstdint>
#include <vector>

#include "GlFunctions.h"

namespace simflex {

constexpr int samplesPerPixel = 4;  ///< what OpenGL 3.3 guarantees

/** A multisampled texture that can be drawn into. **/
class SampleTexture {
public:
    /** Exact depth keeps the value of a fragment, to be compared with that of another. **/
    enum class Kind { Color, Depth, ExactDepth };

    SampleTexture(const GlFunctions& gl, Kind kind, int width, int height);
    ~SampleTexture();
    SampleTexture(const SampleTexture&) = delete;
    SampleTexture& operator=(const SampleTexture&) = delete;

    GLuint getName() const { return name; }

    /** Attaches it to the framebuffer that is bound. **/
    void attach() const;

    /** Binds it to a texture unit. **/
    void bind(int unit) const;

private:
    const GlFunctions& gl;
    Kind kind;
    GLuint name = 0;
};

/** Two layers of one picture, or of a band of its rows: a multisampled one with depth for the
scene, transparent where nothing is drawn, and a plain one for what lies behind it, onto which the
scene is laid at the end. **/
class PictureTarget {
public:
    /** @throws std::runtime_error when the context cannot make a picture of this size. **/
    PictureTarget(const GlFunctions& gl, int width, int height);
    ~PictureTarget();
    PictureTarget(const PictureTarget&) = delete;
    PictureTarget& operator=(const PictureTarget&) = delete;

    int getWidth() const { return width; }
    int getHeight() const { return height; }

    /** Makes the scene's layer the target of drawing. **/
    void bindScene();

    /** The scene's colours, with premultiplied alpha. **/
    const SampleTexture& getSceneColor() const { return sceneColor; }
    const SampleTexture& getSceneDepth() const { return sceneDepth; }

    /** Makes the plain layer the target of drawing. **/
    void bindPicture();

    /** Makes the backdrop the target of drawing: a plain layer that keeps from frame to frame. **/
    void bindBackdrop();

    /** What the backdrop was drawn from. **/
    std::vector<double>& updBackdropKey() { return backdropKey; }

    /** Copies the backdrop to the plain layer. **/
    void copyBackdrop();

    /** Copies the lowest rows of the plain layer to memory, lowest first, four bytes a pixel. **/
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

/** @throws std::runtime_error when the framebuffer that is bound cannot be drawn into. **/
void checkFramebuffer(const GlFunctions& gl, int width, int height);

}  // namespace simflex
