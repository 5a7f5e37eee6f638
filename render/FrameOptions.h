#pragma once
/** @file
Types for frame output, shared by all classes that write frames. **/

#include <functional>

#include "simflex/render/Image.h"

namespace simflex {

/** Treatment of frames that an earlier run left in the output folder: all are removed before the
first one is written, or identical ones are kept and not drawn again. **/
enum class OldFrames { Remove, Resume };

/** Position of a plot relative to the picture. **/
enum class PlotSide { Below, Right };

/** Receives frames in memory, in order and one at a time, on any thread. It must not call the
object that draws the frames. An exception ends the run like a file that cannot be written. **/
using FrameSink = std::function<void(int number, const Image& image)>;

/** Receives the number of complete frames and the total; returns false to stop. **/
using FrameProgress = std::function<bool(int numComplete, int numFrames)>;

}  // namespace simflex
