#pragma once
/** @file
Reads the depth of a scene, one value per pixel. Internal to the renderer. **/

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlTargets.h"

namespace simflex {

class GlDepthReader {
public:
    GlDepthReader(const GlFunctions& gl, const GlScreen& screen);

    /** Reads depth buffer values, 0…1, of the lowest rows, lowest first. Changes the draw
    target. **/
    void read(const PictureTarget& target, int rows, float* values);

private:
    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram program;
};

}  // namespace simflex
