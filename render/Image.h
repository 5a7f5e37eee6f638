#pragma once
/** @file
A picture in memory: 8-bit red, green, blue, alpha; row 0 is the top row.

@code
    simflex::Image image = viz.drawFrame(state);
    image.writePng("frame.png");
@endcode **/

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace simflex {

class Image {
public:
    using Pixel = std::array<std::uint8_t, 4>;  ///< red, green, blue, alpha, 0…255

    Image() = default;

    /** Creates a picture of one colour.
    @throws std::invalid_argument unless both sizes are positive. **/
    Image(int width, int height, const Pixel& color = {255, 255, 255, 255});

    int getWidth() const { return width; }
    int getHeight() const { return height; }
    bool isEmpty() const { return bytes.empty(); }

    /** Returns the pixel in column x from the left and row y from the top.
    @throws std::out_of_range naming the pixel and the size of the picture. **/
    Pixel getPixel(int x, int y) const;
    void setPixel(int x, int y, const Pixel& color);

    /** Blends a colour over a pixel; `coverage` in 0…1. Pixels outside the picture are ignored. **/
    void blendPixel(int x, int y, const Pixel& color, double coverage);

    /** Returns all bytes, row by row from the top, four per pixel; size 4·width·height. **/
    const std::uint8_t* getData() const { return bytes.data(); }
    std::uint8_t* updData() { return bytes.data(); }
    std::size_t getNumBytes() const { return bytes.size(); }

    /** Returns whether any pixel is not fully opaque. **/
    bool hasTransparency() const;

    /** Returns the picture at another size; every new pixel is the mean of the area it covers. **/
    Image resized(int newWidth, int newHeight) const;

    /** Returns the part of width×height pixels whose top left corner is at column x, row y.
    @throws std::out_of_range unless the part lies inside the picture. **/
    Image cropped(int x, int y, int partWidth, int partHeight) const;

    /** Copies `other` to column x, row y, clipped to the picture. **/
    void paste(const Image& other, int x, int y);

    /** Writes a PNG file. The file appears only when it is complete and contains no time stamp.
    Fully opaque pictures are written without alpha channel.
    @throws std::runtime_error naming the file and the system's reason. **/
    void writePng(const std::string& path) const;

    /** Returns the bytes of a PNG file, with a text entry if a keyword is given. **/
    std::vector<std::uint8_t> encodePng(const std::string& keyword = "",
                                        const std::string& text = "") const;

    /** Reads a PNG file of any type.
    @throws std::runtime_error naming the file and the error. **/
    static Image readPng(const std::string& path);

    bool operator==(const Image& other) const {
        return width == other.width && height == other.height && bytes == other.bytes;
    }
    bool operator!=(const Image& other) const { return !(*this == other); }

private:
    std::size_t offsetOf(int x, int y) const { return 4 * (std::size_t(y) * width + x); }

    int width = 0;
    int height = 0;
    std::vector<std::uint8_t> bytes;
};

/** Returns the text of a keyword before the pixels of a PNG file; "" if there is none or no such
file. **/
std::string readPngText(const std::string& path, const std::string& keyword);

/** Returns whether a file has the beginning and the end of a PNG file. **/
bool isPngComplete(const std::string& path);

}  // namespace simflex
