#pragma once
/** @file
Text drawn into pictures through FreeType (DejaVu Sans). Internal to the renderer. **/

#include <memory>
#include <string>

#include "simflex/render/Image.h"

namespace simflex {

class Font {
public:
    enum class Weight { Regular, Bold };
    enum class Anchor { Left, Center, Right };

    /** Finds DejaVu Sans in the usual folders, or the file that the environment variable
    SIMFLEX_FONT names.
    @throws std::runtime_error that says where it looked and which package has the font. **/
    explicit Font(Weight weight);
    ~Font();
    Font(const Font&) = delete;
    Font& operator=(const Font&) = delete;

    /** The file that a weight is read from. @throws std::runtime_error when there is none. **/
    static std::string findFile(Weight weight);

    /** Width of a line of UTF-8 text [pixel]. **/
    double calcWidth(const std::string& text, int pixelSize);

    /** Draws a line of UTF-8 text on its base line y; `anchor` says what x is. **/
    void draw(Image& image, double x, double y, const std::string& text, int pixelSize,
              const Image::Pixel& color, Anchor anchor = Anchor::Left);

    /** Draws text with a soft halo of another colour, legible on any background. **/
    void drawWithHalo(Image& image, double x, double y, const std::string& text, int pixelSize,
                      const Image::Pixel& color, const Image::Pixel& halo,
                      Anchor anchor = Anchor::Left);

private:
    struct Impl;
    std::unique_ptr<Impl> impl;
};

}  // namespace simflex
