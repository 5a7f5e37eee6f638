#include "GlTexts.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "Shaders.h"

namespace simflex {

using SimTK::Vec3;

namespace {

constexpr int pixelSize = 64;

}  // namespace

GlTexts::GlTexts(const GlFunctions& functions, const GlScreen& sharedScreen)
    : gl(functions),
      screen(sharedScreen),
      program(gl, shaders::textVertex, shaders::textFragment) {}

GlTexts::~GlTexts() {
    for (const auto& entry : textures) gl.DeleteTextures(1, &entry.second.name);
}

const GlTexts::Texture& GlTexts::getTexture(const std::string& text) {
    Texture& texture = textures[text];
    texture.isUsed = true;
    if (texture.name != 0) return texture;

    if (!font) font = std::make_unique<Font>(Font::Weight::Regular);
    constexpr double capHeight = 0.73 * pixelSize;  // cap height of DejaVu Sans
    constexpr int descent = pixelSize / 3, ascent = pixelSize;
    const int width = int(std::ceil(font->calcWidth(text, pixelSize))) + 4;
    Image image(width, ascent + descent, {0, 0, 0, 255});
    font->draw(image, 2, ascent, text, pixelSize, {255, 255, 255, 255});

    gl.GenTextures(1, &texture.name);
    gl.BindTexture(GL_TEXTURE_2D, texture.name);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, width, image.getHeight(), 0, GL_RGBA,
                  GL_UNSIGNED_BYTE, image.getData());
    gl.GenerateMipmap(GL_TEXTURE_2D);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    texture.width = width / capHeight;
    texture.height = image.getHeight() / capHeight;
    texture.descent = descent / capHeight;
    return texture;
}

void GlTexts::draw(const Scene& scene, const GlView& view) {
    std::vector<std::pair<double, const TextItem*>> items;
    for (const TextItem& item : scene.texts)
        items.emplace_back(view.toCamera(item.X_GT.p())[2], &item);
    std::stable_sort(items.begin(), items.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [depth, item] : items) {
        if (depth > -view.camera.nearPlane) continue;
        const Texture& texture = getTexture(item->text);
        const SimTK::Rotation R_CT =
            item->facesCamera ? SimTK::Rotation() : ~view.camera.X_GC.R() * item->X_GT.R();
        const Vec3 right = item->widthFactor * item->height * Vec3(R_CT.x());
        const Vec3 top = item->height * Vec3(R_CT.y());
        const double base = -texture.descent - TextItem::lineSpacing * item->line;
        program.use();
        program.set("projection", view.projection);
        program.set("origin", Vec3(view.toCamera(item->X_GT.p()) + base * top));
        program.set("right", Vec3(texture.width * right));
        program.set("top", Vec3(texture.height * top));
        program.set("color", item->color);
        program.set("opacity", item->opacity);
        program.set("coverage", 0);
        gl.ActiveTexture(GL_TEXTURE0);
        gl.BindTexture(GL_TEXTURE_2D, texture.name);
        screen.drawSquare();
    }
}

void GlTexts::dropUnused() {
    for (auto entry = textures.begin(); entry != textures.end();) {
        const bool isUsed = entry->second.isUsed;
        entry->second.isUsed = false;
        if (!isUsed) gl.DeleteTextures(1, &entry->second.name);
        entry = isUsed ? std::next(entry) : textures.erase(entry);
    }
}

}  // namespace simflex
