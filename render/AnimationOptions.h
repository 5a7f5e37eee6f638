#pragma once
/** @file
How a motion becomes a moving scene, see OffscreenVisualizer::writeAnimation(). **/

namespace simflex {

struct AnimationOptions {
    double slowMotion = 1;  ///< seconds of the animation for a second of the motion
};

}  // namespace simflex
