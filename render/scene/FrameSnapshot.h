#pragma once
/** @file
All that one frame needs, taken from a State: what is drawn of it later, by whichever thread, needs
neither the System nor the State. Internal to the renderer. **/

#include <memory>
#include <string>
#include <vector>

#include "Camera.h"
#include "FrameStyle.h"
#include "ReferenceMotion.h"
#include "Scene.h"
#include "simflex/render/BodyLook.h"
#include "simflex/render/overlay/Overlay.h"
#include "simflex/render/skin/ContourField.h"
#include "simflex/render/skin/ContourScale.h"
#include "simflex/render/skin/SkinModes.h"

namespace simflex {

/** The motion of one flexible part. **/
struct PartSnapshot {
    std::shared_ptr<const SkinModes> skin;
    std::shared_ptr<const ContourField> field;  ///< null: no colours
    BodyLook look;
    SimTK::Transform X_GB;
    SimTK::Transform X_GD;  ///< of B as it is drawn, see DrawnPoses
    SimTK::Vector xi;
    ReferenceMotion reference;  ///< what displacements are measured from
    SimTK::SpatialVec V_GB{SimTK::Vec3(0), SimTK::Vec3(0)};  ///< where velocities are shown
    SimTK::Vector xiDot;                                     ///< likewise; else empty
};

/** A short text at a point, written over the picture where nothing hides it. **/
struct Label {
    std::string text;
    SimTK::Vec3 point_G;
    SimTK::Vec3 color;
};

/** How flexible parts are drawn. **/
struct PartStyle {
    double deformationFactor = 1;
    ContourSettings contour;
    bool showUndeformed = true, showElementEdges = false, showFeatureEdges = true;
};

/** One camera's picture and its place in the frame [pixel, from the top left corner]. **/
struct ViewSnapshot {
    int left = 0, top = 0, width = 0, height = 0;
    Camera camera;
    SimTK::Transform X_GF;           ///< of the frame that the camera follows
    bool fitsClippingPlanes = true;  ///< around what is drawn
    bool showAxes = true;
    double unit = 1;         ///< as in FrameStyle
    OverlayContent overlay;  ///< the range of its colour bar is found by the painter
};

struct FrameSnapshot {
    int number = 0;
    double time = 0;
    int width = 0, height = 0;
    Scene scene;  ///< decorations, in Ground
    std::vector<PartSnapshot> parts;
    PartStyle partStyle;
    FrameStyle style;
    SimTK::Vec3 center_G{0};  ///< of the whole motion's ball, with `radius`
    double radius = 1;
    std::vector<ViewSnapshot> views;
    std::vector<Label> labels;
};

}  // namespace simflex
