#pragma once
/** @file
Tells whether a frame drawn before shows the same: a number from everything its picture depends on.
Internal to the renderer. **/

#include <string>
#include <vector>

#include "FrameOutput.h"

namespace simflex {

/** As 16 hexadecimal digits. **/
std::string hashFrame(const FrameJob& job, const std::vector<SimTK::Vec2>& ranges);

}  // namespace simflex
