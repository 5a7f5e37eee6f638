#pragma once
/** @file
Videos from frames, by the program ffmpeg. The suffix of the file says what it becomes: .mp4 (H.264,
what every player shows), .gif or .webp (animated pictures that repeat).

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
    int numRepeats = 0;  ///< how often .gif and .webp are shown; 0: without end
};

/** Whether a program ffmpeg is on the PATH. **/
bool isVideoAvailable();

/** Takes pictures one by one and codes them while the caller prepares the next one. The file
appears when finish() has returned; without it, nothing is left. Memory does not grow with the
number of pictures. What is transparent stays so in .gif and .webp and becomes white in .mp4. Not
for several threads at once. **/
class VideoWriter {
public:
    /** @throws std::invalid_argument unless the suffix is .mp4, .gif or .webp and the frames per
        second are positive and, for .gif, not above 50, which no player shows.
    @throws std::runtime_error when there is no ffmpeg, or the file's folder cannot be written to.
    **/
    explicit VideoWriter(const std::string& file, const VideoOptions& options = {});
    ~VideoWriter();
    VideoWriter(const VideoWriter&) = delete;
    VideoWriter& operator=(const VideoWriter&) = delete;

    /** Adds a picture; the first one sets the size.
    @throws std::invalid_argument when the picture is empty or of another size.
    @throws std::runtime_error with ffmpeg's own text when it fails. **/
    void write(const Image& image);

    /** Waits for ffmpeg and gives the file its name. Nothing happens when it was called before.
    @throws std::runtime_error when no picture was written, or with ffmpeg's own text. **/
    void finish();

    int getNumFrames() const;
    const std::string& getFile() const;

private:
    class Impl;
    std::unique_ptr<Impl> impl;
};

/** Joins `folder`/frame_00000.png, frame_00001.png, … up to the first number that is missing.
@return false, with nothing written, when there is no ffmpeg on this machine.
@throws std::runtime_error, std::invalid_argument as VideoWriter does, and when the folder holds no
frame. **/
bool writeVideo(const std::string& folder, const std::string& videoFile,
                const VideoOptions& options = {});
bool writeVideo(const std::string& folder, const std::string& videoFile, double framesPerSecond);

}  // namespace simflex
