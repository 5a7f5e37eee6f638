#pragma once
/** @file
Screen-space ambient occlusion: darkens opaque surfaces where nearby surfaces shield them from
light, at half the resolution of the picture. Internal to the renderer.

For a point with normal n and neighbours at v from it, within a radius r,

    light = 1 − 1.6 r Σ (1 − v²/r²)³ max(v·n − 0.02 r, 0) / (v² + 0.01 r²) / number of neighbours

which gives one half in the corner of two planes at right angles, as the integral over the sky does,
and one on flat and convex surfaces. After M. McGuire, M. Mara, D. Luebke, Scalable Ambient
Obscurance, High Performance Graphics 2012. **/

#include <vector>

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlTargets.h"
#include "GlView.h"

namespace simflex {

class GlOcclusion {
public:
    GlOcclusion(const GlFunctions& gl, const GlScreen& screen);
    ~GlOcclusion();
    GlOcclusion(const GlOcclusion&) = delete;
    GlOcclusion& operator=(const GlOcclusion&) = delete;

    /** Darkens the target's scene, based on its depth. Leaves the scene bound; depth test and
    blending are unchanged.
    @pre the view is a whole picture: occluders beside a band are unknown **/
    void darken(const GlView& view, const std::vector<SimTK::Vec3>& bounds_G,
                PictureTarget& target);

private:
    void prepare(int width, int height);
    void drop();

    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram distanceProgram, occlusionProgram, blurProgram, darkenProgram;
    int width = 0, height = 0;  // of the half-size textures
    GLuint sceneBuffer = 0;     // the scene's colours without its depth
    GLuint buffers[3] = {0, 0, 0}, textures[3] = {0, 0, 0};  // distance, light, blurred light
};

}  // namespace simflex
