#pragma once
/** @file
What becomes of frames: names shared by those who write them. **/

#include <functional>

#include "simflex/render/Image.h"

namespace simflex {

/** What happens to frames that an earlier run left in the output folder: they are removed before
the first one is written, or those that show the same stay and are not drawn again. **/
enum class OldFrames { Remove, Resume };

/** Where a plot stands. **/
enum class PlotSide { Below, Right };

/** Takes frames in memory, in order and one at a time, on any thread. It must not call what draws
the frames. An exception from it ends the run as a file that cannot be written does. **/
using FrameSink = std::function<void(int number, const Image& image)>;

/** Told how many frames of how many are complete; false stops. **/
using FrameProgress = std::function<bool(int numComplete, int numFrames)>;

}  // namespace simflex
