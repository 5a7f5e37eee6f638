#pragma once
/** @file
Identifies identical frames: a hash of everything that a picture depends on. Internal to the
renderer. **/

#include <string>
#include <vector>

#include "FrameOutput.h"

namespace simflex {

/** Returns 16 hexadecimal digits. **/
std::string hashFrame(const FrameJob& job, const std::vector<SimTK::Vec2>& ranges);

}  // namespace simflex
