#pragma once
/** @file
Draws background, ground and the shadow on it. Internal to the renderer. **/

#include <vector>

#include "GlProgram.h"
#include "GlScreen.h"
#include "GlTargets.h"
#include "GlView.h"
#include "simflex/render/scene/GroundShadow.h"
#include "simflex/render/scene/Scene.h"

namespace simflex {

class GlGround {
public:
    GlGround(const GlFunctions& gl, const GlScreen& screen);
    ~GlGround();
    GlGround(const GlGround&) = delete;
    GlGround& operator=(const GlGround&) = delete;

    /** Returns whether there is a ground and the viewer is above it. **/
    static bool isVisible(const Camera& camera, const FrameStyle& style);

    /** Projects opaque objects along the light onto the ground as a soft shadow.
    @return false if the light comes from below the horizon, or nothing casts a shadow. **/
    bool updateShadow(const Scene& scene, const FrameStyle& style);

    /** Draws background and ground into the target's backdrop, unless it is current. **/
    void updateBackdrop(const GlView& view, bool hasGround, PictureTarget& target);

    /** Draws the shadow of updateShadow(), over an opaque picture or a transparent one. **/
    void drawShadow(const GlView& view);

    /** Includes the ground in the depth test if an object reaches below it. **/
    void hideBelow(const GlView& view, const std::vector<SimTK::Vec3>& bounds_G);

private:
    std::array<float, 16> calcProjection(const GlView& view) const;
    void drawGround(const GlView& view);

    const GlFunctions& gl;
    const GlScreen& screen;
    GlProgram backgroundProgram, groundProgram, groundShadowProgram;
    GroundShadow shadow;
    GLuint shadowTexture = 0;
    SimTK::Vec4 shadowRegion{0};  // on the ground: origin x, y, 1 / extent x, y
};

}  // namespace simflex
