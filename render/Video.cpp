#include "simflex/render/Video.h"

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "simflex/base/AsciiText.h"
#include "simflex/base/ChildProcess.h"
#include "simflex/base/ProgramOutput.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/render/frame/FrameOutput.h"

namespace simflex {

namespace {

enum class Format { Mp4, Gif, WebP };

Format findFormat(const std::string& file) {
    const size_t dot = file.find_last_of("./");
    const std::string suffix =
        dot == std::string::npos || file[dot] == '/' ? "" : lowerCase(file.substr(dot));
    if (suffix == ".mp4") return Format::Mp4;
    if (suffix == ".gif") return Format::Gif;
    if (suffix == ".webp") return Format::WebP;
    throw std::invalid_argument("cannot write the video '" + file + "': its suffix must be .mp4, " +
                                ".gif or .webp" + (suffix.empty() ? "" : ", not " + suffix));
}

std::string formatRate(double value) {
    std::ostringstream text;
    text.precision(10);
    text << value;
    return text.str();
}

/** A running ffmpeg, whose input is a socket: unlike a pipe, a closed socket is reported to the
writer without a signal that would end the program. **/
class Coder {
public:
    /** @param hasInput  whether ffmpeg will read the data of send() **/
    Coder(const std::vector<std::string>& arguments, bool hasInput) {
        int ends[2] = {-1, -1};
        if (hasInput && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
            throw std::runtime_error(std::string("cannot make a socket: ") + std::strerror(errno));
        input = ends[0];

        ChildSetup setup;
        setup.arguments = {"ffmpeg"};
        setup.arguments.insert(setup.arguments.end(), arguments.begin(), arguments.end());
        setup.input = ends[1];
        setup.output = setup.error = log.getDescriptor();
        // Ctrl-C at the terminal is left to the caller, so that finished frames can still be
        // encoded.
        setup.isOwnGroup = true;
        try {
            child = ChildProcess(setup);
        } catch (const std::runtime_error&) {
            closeInput();
            if (hasInput) close(ends[1]);
            throw;
        }
        if (hasInput) close(ends[1]);
    }

    ~Coder() { closeInput(); }
    Coder(const Coder&) = delete;
    Coder& operator=(const Coder&) = delete;

    /** @return false if ffmpeg has stopped reading. **/
    bool send(const std::uint8_t* bytes, size_t count) {
        while (count > 0) {
            const ssize_t sent = ::send(input, bytes, count, MSG_NOSIGNAL);
            if (sent < 0 && errno == EINTR) continue;
            if (sent <= 0) return false;
            bytes += sent;
            count -= size_t(sent);
        }
        return true;
    }

    /** Closes the input and waits for ffmpeg. @return whether it succeeded. **/
    bool finish() {
        closeInput();
        return child.wait().isSuccess();
    }

    std::string readMessages() {
        const std::string text = log.read();
        return text.empty() ? "it " + child.getEnd().describe() : text;
    }

private:
    void closeInput() {
        if (input >= 0) close(input);
        input = -1;
    }
    ProgramOutput log;
    int input = -1;
    ChildProcess child;
};

/** Makes a file name safe for ffmpeg, whatever its first characters. **/
std::string url(const std::string& file) {
    return "file:" + file;
}

void layOnWhite(std::vector<std::uint8_t>& bytes) {
    for (size_t i = 0; i < bytes.size(); i += 4) {
        const int alpha = bytes[i + 3];
        for (size_t c = i; c < i + 3; ++c)
            bytes[c] = std::uint8_t((bytes[c] * alpha + 255 * (255 - alpha) + 127) / 255);
        bytes[i + 3] = 255;
    }
}

}  // namespace

bool isVideoAvailable() {
    return !findProgram("ffmpeg").empty();
}

class VideoWriter::Impl {
public:
    Impl(const std::string& videoFile, const VideoOptions& videoOptions)
        : file(videoFile), options(videoOptions), format(findFormat(videoFile)) {
        const double fps = options.framesPerSecond;
        if (!(fps > 0) || !std::isfinite(fps))
            throw std::invalid_argument("cannot write the video '" + file +
                                        "': frames per second must be positive, not " +
                                        formatRate(fps));
        if (format == Format::Gif && fps > 50)
            throw std::invalid_argument("cannot write the video '" + file +
                                        "': .gif shows 50 frames per second at most, not " +
                                        formatRate(fps) + "; write fewer, or .mp4");
        if (options.numRepeats < 0)
            throw std::invalid_argument("cannot write the video '" + file +
                                        "': numRepeats must not be negative");
        if (!isVideoAvailable())
            throw std::runtime_error("cannot write the video '" + file +
                                     "': there is no program ffmpeg (Debian package ffmpeg)");
        const std::filesystem::path path(file);
        removeUnfinishedFiles(path.parent_path(), path.filename().string() + ".");
    }

    ~Impl() {
        coder.reset();  // before its files are removed
    }

    void write(const Image& image) {
        if (isFinished)
            throw std::runtime_error("the video '" + file + "' is finished: no more can be added");
        if (image.isEmpty())
            throw std::invalid_argument("cannot add an empty picture to the video '" + file + "'");
        if (!coder) start(image);
        if (image.getWidth() != width || image.getHeight() != height)
            throw std::invalid_argument("picture " + std::to_string(numFrames) + " of the video '" +
                                        file + "' is " + std::to_string(image.getWidth()) + "x" +
                                        std::to_string(image.getHeight()) +
                                        " pixels, those before are " + std::to_string(width) + "x" +
                                        std::to_string(height));
        bool wasSent;
        if (format == Format::Mp4 && image.hasTransparency()) {
            std::vector<std::uint8_t> bytes(image.getData(), image.getData() + image.getNumBytes());
            layOnWhite(bytes);
            wasSent = coder->send(bytes.data(), bytes.size());
        } else {
            wasSent = coder->send(image.getData(), image.getNumBytes());
        }
        if (!wasSent) {
            coder->finish();
            fail(coder->readMessages());
        }
        ++numFrames;
    }

    void finish() {
        if (isFinished) return;
        if (numFrames == 0)
            throw std::runtime_error("cannot write the video '" + file + "': it has no frames");
        isFinished = true;
        if (!coder->finish()) fail(coder->readMessages());
        if (format == Format::Gif) codeGif();
        unfinished.finish(Durability::ProcessEnd);
    }

    const std::string file;
    int numFrames = 0;

private:
    void start(const Image& first) {
        width = first.getWidth();
        height = first.getHeight();
        std::vector<std::string> arguments = {"-y",
                                              "-xerror",
                                              "-loglevel",
                                              "error",
                                              "-f",
                                              "rawvideo",
                                              "-pixel_format",
                                              "rgba",
                                              "-video_size",
                                              std::to_string(width) + "x" + std::to_string(height),
                                              "-framerate",
                                              formatRate(options.framesPerSecond),
                                              "-i",
                                              "pipe:0"};
        const auto add = [&](const std::vector<std::string>& more) {
            arguments.insert(arguments.end(), more.begin(), more.end());
        };
        if (format == Format::Mp4) {
            // Half the time of the default preset at crf 16; as sharp, with files a sixth larger.
            add({"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-c:v", "libx264", "-crf",
                 "14", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-movflags", "+faststart",
                 "-f", "mp4", url(partial)});
        } else if (format == Format::WebP) {
            add({"-c:v", "libwebp_anim", "-quality", "88", "-compression_level", "3", "-pix_fmt",
                 "yuva420p", "-loop", std::to_string(options.numRepeats), "-f", "webp",
                 url(partial)});
        } else {
            // The palette depends on all frames, so they are stored in a file first.
            lossless.emplace(partial + ".nut");
            add({"-c:v", "huffyuv", "-pix_fmt", "bgra", "-f", "nut", url(lossless->getPath())});
        }
        coder = std::make_unique<Coder>(arguments, true);
    }

    void codeGif() {
        const UnfinishedFile palette(partial + ".png");
        const auto run = [&](const std::vector<std::string>& arguments) {
            coder = std::make_unique<Coder>(arguments, false);
            return coder->finish();
        };
        // GIF counts repetitions: −1 is none.
        const int loop = options.numRepeats == 0   ? 0
                         : options.numRepeats == 1 ? -1
                                                   : options.numRepeats - 1;
        const bool ok =
            run({"-y", "-xerror", "-loglevel", "error", "-f", "nut", "-i", url(lossless->getPath()),
                 "-vf", "palettegen=stats_mode=full", "-c:v", "png", "-f", "image2", "-update", "1",
                 url(palette.getPath())}) &&
            run({"-y", "-xerror", "-loglevel", "error", "-f", "nut", "-i", url(lossless->getPath()),
                 "-f", "png_pipe", "-i", url(palette.getPath()), "-lavfi",
                 "paletteuse=dither=bayer:bayer_scale=3", "-loop", std::to_string(loop), "-f",
                 "gif", url(partial)});
        lossless.reset();
        if (!ok) fail(coder->readMessages());
    }

    [[noreturn]] void fail(std::string text) {
        isFinished = true;
        while (!text.empty() && text.back() == '\n') text.pop_back();
        throw std::runtime_error("ffmpeg could not write '" + file + "': " + text);
    }

    const VideoOptions options;
    const Format format;
    UnfinishedFile unfinished{file};
    const std::string partial = unfinished.getPath();
    std::optional<UnfinishedFile> lossless;
    std::unique_ptr<Coder> coder;
    int width = 0, height = 0;
    bool isFinished = false;
};

VideoWriter::VideoWriter(const std::string& file, const VideoOptions& options)
    : impl(std::make_unique<Impl>(file, options)) {}

VideoWriter::~VideoWriter() = default;

void VideoWriter::write(const Image& image) {
    impl->write(image);
}
void VideoWriter::finish() {
    impl->finish();
}
int VideoWriter::getNumFrames() const {
    return impl->numFrames;
}
const std::string& VideoWriter::getFile() const {
    return impl->file;
}

bool writeVideo(const std::string& folder, const std::string& videoFile,
                const VideoOptions& options) {
    const auto makeName = [&](int number) {
        char name[32];
        std::snprintf(name, sizeof name, "/frame_%05d.png", number);
        return folder + name;
    };
    findFormat(videoFile);
    FrameOutput::waitForFolder(folder);
    if (!std::ifstream(makeName(0)))
        throw std::runtime_error("writeVideo: no frame_00000.png in '" + folder + "'");
    if (!isVideoAvailable()) return false;
    VideoWriter video(videoFile, options);
    for (int i = 0; std::ifstream(makeName(i)); ++i) video.write(Image::readPng(makeName(i)));
    video.finish();
    return true;
}

bool writeVideo(const std::string& folder, const std::string& videoFile, double framesPerSecond) {
    VideoOptions options;
    options.framesPerSecond = framesPerSecond;
    return writeVideo(folder, videoFile, options);
}

}  // namespace simflex
