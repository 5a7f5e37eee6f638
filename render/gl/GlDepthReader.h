#pragma once
/** @file
Reads the depth of a scene, one value a pixel. Internal to the renderer. **/

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlTargets.h"

namespace simflex {

class GlDepthReader {
public:
    GlDepthReader(const GlFunctions& gl, const GlScreen& screen);

    /** Values of the depth buffer, 0…1, of the lowest rows, lowest first. Changes the target of
    drawing. **/
    void read(const PictureTarget& target, int rows, float* values);

private:
    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram program;
};

}  // namespace simflex
