#pragma once
/** @file
Videos from frames, by the program ffmpeg. The suffix determines the format: .mp4 (H.264, for all
players), .gif or .webp (looping animations).

@code
    simflex::writeVideo("frames", "slider_crank.mp4");   // from frame_00000.png, ...

    simflex::VideoWriter video("slider_crank.webp", {25});   // from pictures in memory
    for (const State& state : states) video.write(viz.drawFrame(state));
    video.finish();
@endcode **/

#include <memory>
#include <string>

#include "simflex/render/Image.h"

namespace simflex {

struct VideoOptions {
    double framesPerSecond = 30;
    int numRepeats = 0;  ///< number of times that .gif and .webp are shown; 0: endless
};

/** Returns whether the program ffmpeg is on the PATH. **/
bool isVideoAvailable();

/** Encodes pictures one by one while the caller prepares the next one. The file appears when
finish() returns; without it, nothing remains. Memory does not grow with the number of pictures.
Transparency is kept in .gif and .webp and becomes white in .mp4. Not thread-safe. **/
class VideoWriter {
public:
    /** @throws std::invalid_argument unless the suffix is .mp4, .gif or .webp and the frame rate is
    positive and, for .gif, at most 50, the limit of players.
    @throws std::runtime_error if there is no ffmpeg, or the file's folder cannot be written to. **/
    explicit VideoWriter(const std::string& file, const VideoOptions& options = {});
    ~VideoWriter();
    VideoWriter(const VideoWriter&) = delete;
    VideoWriter& operator=(const VideoWriter&) = delete;

    /** Adds a picture; the first one determines the size.
    @throws std::invalid_argument if the picture is empty or of another size.
    @throws std::runtime_error with ffmpeg's own text if it fails. **/
    void write(const Image& image);

    /** Waits for ffmpeg and moves the file to its final name. Further calls have no effect.
    @throws std::runtime_error if no picture was written, or with ffmpeg's own text. **/
    void finish();

    int getNumFrames() const;
    const std::string& getFile() const;

private:
    class Impl;
    std::unique_ptr<Impl> impl;
};

/** Joins `folder`/frame_00000.png, frame_00001.png, … up to the first missing number.
@return false, with nothing written, if ffmpeg is not installed.
@throws std::runtime_error, std::invalid_argument as VideoWriter does, and if the folder has no
frame. **/
bool writeVideo(const std::string& folder, const std::string& videoFile,
                const VideoOptions& options = {});
bool writeVideo(const std::string& folder, const std::string& videoFile, double framesPerSecond);

}  // namespace simflex
