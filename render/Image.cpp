#include "simflex/render/Image.h"

#include <libdeflate.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "simflex/base/UnfinishedFile.h"

namespace simflex {

namespace {

constexpr int pngLevel = 1;  // compression level

struct FileCloser {
    void operator()(std::FILE* file) const { std::fclose(file); }
};
using File = std::unique_ptr<std::FILE, FileCloser>;

// libpng reports errors by callback; the error pointer carries the message to the jump target.
void keepPngError(png_structp png, png_const_charp text) {
    *static_cast<std::string*>(png_get_error_ptr(png)) = text;
    longjmp(png_jmpbuf(png), 1);
}

void ignorePngWarning(png_structp, png_const_charp) {}

void appendNumber(std::vector<std::uint8_t>& out, std::uint32_t number) {
    for (const int shift : {24, 16, 8, 0}) out.push_back(std::uint8_t(number >> shift));
}

/** Appends a PNG chunk: length, name, content and checksum. **/
void appendChunk(std::vector<std::uint8_t>& out, const char* name, const std::uint8_t* content,
                 std::size_t length) {
    appendNumber(out, std::uint32_t(length));
    const std::size_t begin = out.size();
    out.insert(out.end(), name, name + 4);
    out.insert(out.end(), content, content + length);
    appendNumber(out, libdeflate_crc32(0, out.data() + begin, out.size() - begin));
}

/** Writes a row in PNG format, unfiltered, which is smallest and fastest to compress for these
pictures.
@param to  1 + numChannels·width bytes, and one more that is written to **/
void copyRow(const std::uint8_t* pixels, int width, int numChannels, std::uint8_t* to) {
    *to++ = 0;
    for (int x = 0; x < width; ++x, pixels += 4, to += numChannels) {
        std::uint32_t pixel;
        std::memcpy(&pixel, pixels, 4);
        std::memcpy(to, &pixel, 4);  // an unused fourth channel is overwritten
    }
}

/** One compressor per thread. **/
libdeflate_compressor& getCompressor() {
    struct Freer {
        void operator()(libdeflate_compressor* compressor) const {
            libdeflate_free_compressor(compressor);
        }
    };
    thread_local const std::unique_ptr<libdeflate_compressor, Freer> compressor(
        libdeflate_alloc_compressor(pngLevel));
    if (!compressor) throw std::bad_alloc();
    return *compressor;
}

bool readPngInfo(png_structp png, png_infop info, std::FILE* file) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_init_io(png, file);
    png_read_info(png, info);
    png_set_expand(png);
    png_set_strip_16(png);
    png_set_gray_to_rgb(png);
    png_set_filler(png, 255, PNG_FILLER_AFTER);
    png_read_update_info(png, info);
    return true;
}

bool readPngRows(png_structp png, png_bytepp rows) {
    if (setjmp(png_jmpbuf(png))) return false;
    png_read_image(png, rows);
    png_read_end(png, nullptr);
    return true;
}

}  // namespace

Image::Image(int imageWidth, int imageHeight, const Pixel& color)
    : width(imageWidth), height(imageHeight) {
    if (width <= 0 || height <= 0)
        throw std::invalid_argument("Image: size must be positive, not " + std::to_string(width) +
                                    "x" + std::to_string(height));
    bytes.resize(4 * std::size_t(width) * height);
    if (color == Pixel{0, 0, 0, 0}) return;
    const std::size_t rowBytes = 4 * std::size_t(width);
    for (std::size_t i = 0; i < rowBytes; i += 4) std::memcpy(&bytes[i], color.data(), 4);
    for (int y = 1; y < height; ++y) std::memcpy(&bytes[offsetOf(0, y)], bytes.data(), rowBytes);
}

Image::Pixel Image::getPixel(int x, int y) const {
    if (x < 0 || y < 0 || x >= width || y >= height)
        throw std::out_of_range("Image: no pixel (" + std::to_string(x) + ", " + std::to_string(y) +
                                ") in a picture of " + std::to_string(width) + "x" +
                                std::to_string(height));
    const std::uint8_t* p = &bytes[offsetOf(x, y)];
    return {p[0], p[1], p[2], p[3]};
}

void Image::setPixel(int x, int y, const Pixel& color) {
    getPixel(x, y);
    std::copy(color.begin(), color.end(), bytes.begin() + std::ptrdiff_t(offsetOf(x, y)));
}

void Image::blendPixel(int x, int y, const Pixel& color, double coverage) {
    if (x < 0 || y < 0 || x >= width || y >= height) return;
    const double a = std::min(1.0, std::max(0.0, coverage)) * color[3] / 255.0;
    std::uint8_t* p = &bytes[offsetOf(x, y)];
    // The colour behind a transparent pixel has little weight in the result.
    const double alpha = a + (1 - a) * p[3] / 255.0, share = alpha > 0 ? a / alpha : 0;
    for (int c = 0; c < 3; ++c)
        p[c] = std::uint8_t(std::lround(p[c] + share * (double(color[c]) - p[c])));
    p[3] = std::uint8_t(std::lround(255 * alpha));
}

bool Image::hasTransparency() const {
    for (int y = 0; y < height; ++y) {
        Pixel common{255, 255, 255, 255};
        std::uint32_t all;
        std::memcpy(&all, common.data(), 4);
        const std::uint8_t* pixel = &bytes[offsetOf(0, y)];
        for (int x = 0; x < width; ++x, pixel += 4) {
            std::uint32_t one;
            std::memcpy(&one, pixel, 4);
            all &= one;
        }
        std::memcpy(common.data(), &all, 4);
        if (common[3] != 255) return true;
    }
    return false;
}

Image Image::cropped(int x, int y, int partWidth, int partHeight) const {
    if (x < 0 || y < 0 || partWidth > width - x || partHeight > height - y)
        throw std::out_of_range("Image: no part of " + std::to_string(partWidth) + "x" +
                                std::to_string(partHeight) + " at (" + std::to_string(x) + ", " +
                                std::to_string(y) + ") in a picture of " + std::to_string(width) +
                                "x" + std::to_string(height));
    Image part(partWidth, partHeight);
    part.paste(*this, -x, -y);
    return part;
}

Image Image::resized(int newWidth, int newHeight) const {
    Image result(newWidth, newHeight);
    const double sx = double(width) / newWidth, sy = double(height) / newHeight;
    for (int y = 0; y < newHeight; ++y) {
        const double top = y * sy, bottom = std::min(double(height), (y + 1) * sy);
        for (int x = 0; x < newWidth; ++x) {
            const double left = x * sx, right = std::min(double(width), (x + 1) * sx);
            double sum[4] = {0, 0, 0, 0}, area = 0;
            for (int j = int(top); j < height && j < bottom; ++j) {
                const double h = std::min(bottom, j + 1.0) - std::max(top, double(j));
                for (int i = int(left); i < width && i < right; ++i) {
                    const double a = h * (std::min(right, i + 1.0) - std::max(left, double(i)));
                    const std::uint8_t* p = &bytes[offsetOf(i, j)];
                    for (int c = 0; c < 4; ++c) sum[c] += a * p[c];
                    area += a;
                }
            }
            std::uint8_t* q = &result.bytes[result.offsetOf(x, y)];
            for (int c = 0; c < 4; ++c) q[c] = std::uint8_t(std::lround(sum[c] / area));
        }
    }
    return result;
}

void Image::paste(const Image& other, int x, int y) {
    const int x0 = std::max(0, x), x1 = std::min(width, x + other.width);
    for (int j = std::max(0, y); j < std::min(height, y + other.height) && x0 < x1; ++j)
        std::memcpy(&bytes[offsetOf(x0, j)], &other.bytes[other.offsetOf(x0 - x, j - y)],
                    4 * std::size_t(x1 - x0));
}

std::vector<std::uint8_t> Image::encodePng(const std::string& keyword,
                                           const std::string& text) const {
    if (isEmpty()) throw std::runtime_error("cannot code a picture as PNG: it is empty");
    const bool hasAlpha = hasTransparency();
    // Reused between pictures: allocating fresh memory costs as much as the encoding.
    thread_local std::vector<std::uint8_t> rows, packed;
    const int numChannels = hasAlpha ? 4 : 3;
    const std::size_t rowBytes = 1 + std::size_t(numChannels) * std::size_t(width);
    const std::size_t numBytes = rowBytes * std::size_t(height);
    rows.resize(numBytes + 1);
    for (int y = 0; y < height; ++y)
        copyRow(&bytes[offsetOf(0, y)], width, numChannels,
                rows.data() + std::size_t(y) * rowBytes);
    libdeflate_compressor& compressor = getCompressor();
    packed.resize(libdeflate_zlib_compress_bound(&compressor, numBytes));
    const std::size_t length =
        libdeflate_zlib_compress(&compressor, rows.data(), numBytes, packed.data(), packed.size());

    const std::uint8_t signature[] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};
    std::vector<std::uint8_t> png(std::begin(signature), std::end(signature)), header;
    png.reserve(length + 256 + keyword.size() + text.size());
    appendNumber(header, std::uint32_t(width));
    appendNumber(header, std::uint32_t(height));
    const std::uint8_t format[] = {8, std::uint8_t(hasAlpha ? 6 : 2), 0, 0, 0};
    header.insert(header.end(), std::begin(format), std::end(format));
    appendChunk(png, "IHDR", header.data(), header.size());
    if (!keyword.empty()) {
        std::vector<std::uint8_t> words(keyword.begin(), keyword.end());
        words.push_back(0);
        words.insert(words.end(), text.begin(), text.end());
        appendChunk(png, "tEXt", words.data(), words.size());
    }
    appendChunk(png, "IDAT", packed.data(), length);
    appendChunk(png, "IEND", nullptr, 0);
    return png;
}

void Image::writePng(const std::string& path) const {
    if (isEmpty()) throw std::runtime_error("cannot write '" + path + "': the picture is empty");
    replaceFile(path, encodePng(), Durability::ProcessEnd);
}

std::string readPngText(const std::string& path, const std::string& keyword) {
    File file(std::fopen(path.c_str(), "rb"));
    if (!file) return "";
    std::string error, result;
    png_structp png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, &error, keepPngError, ignorePngWarning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    if (info && readPngInfo(png, info, file.get())) {
        png_textp texts = nullptr;
        int count = 0;
        png_get_text(png, info, &texts, &count);
        for (int i = 0; i < count; ++i)
            if (keyword == texts[i].key) result.assign(texts[i].text, texts[i].text_length);
    }
    png_destroy_read_struct(&png, &info, nullptr);
    return result;
}

bool isPngComplete(const std::string& path) {
    File file(std::fopen(path.c_str(), "rb"));
    if (!file) return false;
    unsigned char start[8], end[12];
    const unsigned char last[12] = {0, 0, 0, 0, 'I', 'E', 'N', 'D', 0xAE, 0x42, 0x60, 0x82};
    return std::fread(start, 1, 8, file.get()) == 8 && png_sig_cmp(start, 0, 8) == 0 &&
           std::fseek(file.get(), -12, SEEK_END) == 0 && std::fread(end, 1, 12, file.get()) == 12 &&
           std::memcmp(end, last, 12) == 0;
}

Image Image::readPng(const std::string& path) {
    File file(std::fopen(path.c_str(), "rb"));
    if (!file) throw std::runtime_error("cannot read '" + path + "': " + std::strerror(errno));

    std::string error;
    png_structp png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, &error, keepPngError, ignorePngWarning);
    png_infop info = png ? png_create_info_struct(png) : nullptr;
    bool ok = info && readPngInfo(png, info, file.get());
    Image result;
    if (ok) {
        result = Image(int(png_get_image_width(png, info)), int(png_get_image_height(png, info)));
        std::vector<std::uint8_t*> rows(result.height);
        for (int y = 0; y < result.height; ++y) rows[y] = &result.bytes[result.offsetOf(0, y)];
        ok = readPngRows(png, rows.data());
    }
    png_destroy_read_struct(&png, &info, nullptr);
    if (!ok) throw std::runtime_error("cannot read '" + path + "' as PNG: " + error);
    return result;
}

}  // namespace simflex
