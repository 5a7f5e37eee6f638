#pragma once
/** @file
A video from numbered frames, by the program ffmpeg. **/

#include <string>

namespace simflex {

/** Whether a program ffmpeg is on the PATH. **/
bool isVideoAvailable();

/** Joins `folder`/frame_00000.png, frame_00001.png, … to one H.264 file that every player shows,
or, when the file's suffix is .gif, to an animated picture that repeats without end. The file
appears only when it is complete.
@return false, with nothing written, when there is no ffmpeg on this machine.
@throws std::runtime_error with ffmpeg's own text when it fails, or when the folder holds no frame.
**/
bool writeVideo(const std::string& folder, const std::string& videoFile,
                double framesPerSecond = 30);

}  // namespace simflex
