#pragma once
/** @file
Options of animated scenes, see OffscreenVisualizer::writeAnimation(). **/

namespace simflex {

struct AnimationOptions {
    double slowMotion = 1;  ///< seconds of animation per second of motion
};

}  // namespace simflex
