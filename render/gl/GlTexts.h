#pragma once
/** @file
Draws texts in space, each from a texture that is kept while frames use it. Internal to the
renderer. **/

#include <memory>
#include <string>
#include <unordered_map>

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlView.h"
#include "simflex/render/overlay/Font.h"
#include "simflex/render/scene/Scene.h"

namespace simflex {

class GlTexts {
public:
    GlTexts(const GlFunctions& gl, const GlScreen& screen);
    ~GlTexts();
    GlTexts(const GlTexts&) = delete;
    GlTexts& operator=(const GlTexts&) = delete;

    void draw(const Scene& scene, const GlView& view);

    /** Call after a frame: deletes unused textures. **/
    void dropUnused();

private:
    struct Texture {
        GLuint name = 0;
        double width = 1, height = 1, descent = 0;  // relative to the height of a capital letter
        bool isUsed = true;
    };

    const Texture& getTexture(const std::string& text);

    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram program;
    std::unordered_map<std::string, Texture> textures;
    std::unique_ptr<Font> font;  // loaded for the first text
};

}  // namespace simflex
