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

    /** Finds DejaVu Sans in the usual folders, or the file named by the environment variable
    SIMFLEX_FONT.
    @throws std::runtime_error naming the places searched and the package with the font. **/
    explicit Font(Weight weight);
    ~Font();
    Font(const Font&) = delete;
    Font& operator=(const Font&) = delete;

    /** Returns the file of a weight. @throws std::runtime_error if there is none. **/
    static std::string findFile(Weight weight);

    /** Returns the width of a line of UTF-8 text [pixel]. **/
    double calcWidth(const std::string& text, int pixelSize);

    /** Draws a line of UTF-8 text on its base line y; `anchor` determines the meaning of x. **/
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
