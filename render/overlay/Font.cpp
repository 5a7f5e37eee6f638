#include "Font.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <vector>

#include "simflex/base/Utf8.h"

namespace simflex {

namespace {

struct Glyph {
    int left = 0, top = 0, width = 0, height = 0;
    double advance = 0;
    std::vector<unsigned char> coverage;
};

}  // namespace

struct Font::Impl {
    FT_Library library = nullptr;
    FT_Face face = nullptr;
    int currentSize = 0;
    std::map<std::pair<int, unsigned long>, Glyph> glyphs;

    ~Impl() {
        if (face) FT_Done_Face(face);
        if (library) FT_Done_FreeType(library);
    }

    void setSize(int pixelSize) {
        if (pixelSize == currentSize) return;
        FT_Set_Pixel_Sizes(face, 0, FT_UInt(pixelSize));
        currentSize = pixelSize;
    }

    const Glyph& getGlyph(unsigned long code, int pixelSize) {
        const auto key = std::make_pair(pixelSize, code);
        const auto found = glyphs.find(key);
        if (found != glyphs.end()) return found->second;

        Glyph& glyph = glyphs[key];
        setSize(pixelSize);
        if (FT_Load_Char(face, code, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0) return glyph;
        const FT_GlyphSlot slot = face->glyph;
        glyph.left = slot->bitmap_left;
        glyph.top = slot->bitmap_top;
        glyph.width = int(slot->bitmap.width);
        glyph.height = int(slot->bitmap.rows);
        glyph.advance = double(slot->advance.x) / 64;
        for (int y = 0; y < glyph.height; ++y) {
            const unsigned char* row = slot->bitmap.buffer + y * slot->bitmap.pitch;
            glyph.coverage.insert(glyph.coverage.end(), row, row + glyph.width);
        }
        return glyph;
    }

    double calcKerning(unsigned long left, unsigned long right, int pixelSize) {
        if (left == 0 || !FT_HAS_KERNING(face)) return 0;
        setSize(pixelSize);
        FT_Vector delta{};
        FT_Get_Kerning(face, FT_Get_Char_Index(face, left), FT_Get_Char_Index(face, right),
                       FT_KERNING_DEFAULT, &delta);
        return double(delta.x) / 64;
    }
};

std::string Font::findFile(Weight weight) {
    if (const char* chosen = std::getenv("SIMFLEX_FONT")) {
        if (std::ifstream(chosen)) return chosen;
        throw std::runtime_error(std::string("cannot read the font '") + chosen +
                                 "' that SIMFLEX_FONT names");
    }
    const std::string file = weight == Weight::Bold ? "DejaVuSans-Bold.ttf" : "DejaVuSans.ttf";
    std::string tried;
    for (const char* folder : {"/usr/share/fonts/truetype/dejavu/", "/usr/share/fonts/dejavu/",
                               "/usr/share/fonts/dejavu-sans-fonts/", "/usr/share/fonts/TTF/",
                               "/usr/local/share/fonts/dejavu/"}) {
        if (std::ifstream(folder + file)) return folder + file;
        tried += std::string(" ") + folder;
    }
    throw std::runtime_error("cannot find the font " + file +
                             " (Debian package fonts-dejavu-core) in" + tried +
                             "; set SIMFLEX_FONT to a TrueType file instead");
}

Font::Font(Weight weight) : impl(std::make_unique<Impl>()) {
    const std::string path = findFile(weight);
    if (FT_Init_FreeType(&impl->library) != 0 ||
        FT_New_Face(impl->library, path.c_str(), 0, &impl->face) != 0)
        throw std::runtime_error("FreeType cannot use the font '" + path + "'");
}

Font::~Font() = default;

double Font::calcWidth(const std::string& text, int pixelSize) {
    double width = 0;
    unsigned long previous = 0;
    for (const char32_t code : decodeUtf8(text)) {
        width +=
            impl->calcKerning(previous, code, pixelSize) + impl->getGlyph(code, pixelSize).advance;
        previous = code;
    }
    return width;
}

void Font::draw(Image& image, double x, double y, const std::string& text, int pixelSize,
                const Image::Pixel& color, Anchor anchor) {
    if (anchor != Anchor::Left)
        x -= calcWidth(text, pixelSize) * (anchor == Anchor::Center ? 0.5 : 1.0);
    const int baseLine = int(std::lround(y));
    unsigned long previous = 0;
    for (const char32_t code : decodeUtf8(text)) {
        x += impl->calcKerning(previous, code, pixelSize);
        previous = code;
        const Glyph& glyph = impl->getGlyph(code, pixelSize);
        const int left = int(std::lround(x)) + glyph.left;
        for (int j = 0; j < glyph.height; ++j)
            for (int i = 0; i < glyph.width; ++i)
                if (const unsigned char c = glyph.coverage[std::size_t(j) * glyph.width + i])
                    image.blendPixel(left + i, baseLine - glyph.top + j, color, c / 255.0);
        x += glyph.advance;
    }
}

void Font::drawWithHalo(Image& image, double x, double y, const std::string& text, int pixelSize,
                        const Image::Pixel& color, const Image::Pixel& halo, Anchor anchor) {
    for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx)
            if (dx != 0 || dy != 0) draw(image, x + dx, y + dy, text, pixelSize, halo, anchor);
    draw(image, x, y, text, pixelSize, color, anchor);
}

}  // namespace simflex
