#pragma once
/** @file
The complete content of a frame, captured from a State: drawing, on any thread, needs neither the
System nor the State. Internal to the renderer. **/

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

struct PartSnapshot {
    std::shared_ptr<const SkinModes> skin;
    std::shared_ptr<const ContourField> field;  ///< null: no colours
    BodyLook look;
    SimTK::Transform X_GB;
    SimTK::Transform X_GD;  ///< drawn pose of B, see DrawnPoses
    SimTK::Vector xi;
    ReferenceMotion reference;                               ///< reference of displacements
    SimTK::SpatialVec V_GB{SimTK::Vec3(0), SimTK::Vec3(0)};  ///< for velocity contours
    SimTK::Vector xiDot;                                     ///< for velocity contours; else empty
};

/** A short text at a point, drawn over the picture unless the point is hidden. **/
struct Label {
    std::string text;
    SimTK::Vec3 point_G;
    SimTK::Vec3 color;
};

struct PartStyle {
    double deformationFactor = 1;
    ContourSettings contour;
    bool showUndeformed = true, showElementEdges = false, showFeatureEdges = true;
};

/** Picture of one camera and its rectangle in the frame [pixel, from the top left corner]. **/
struct ViewSnapshot {
    int left = 0, top = 0, width = 0, height = 0;
    Camera camera;
    SimTK::Transform X_GF;           ///< pose of the followed frame
    bool fitsClippingPlanes = true;  ///< fits them to the drawn objects
    bool showAxes = true;
    double unit = 1;         ///< as in FrameStyle
    OverlayContent overlay;  ///< the painter determines the range of its colour bar
};

struct FrameSnapshot {
    int number = 0;
    double time = 0;
    int width = 0, height = 0;
    Scene scene;  ///< decorations, in Ground
    std::vector<PartSnapshot> parts;
    PartStyle partStyle;
    FrameStyle style;
    SimTK::Vec3 center_G{0};  ///< centre of the whole motion's bounding sphere of radius `radius`
    double radius = 1;
    std::vector<ViewSnapshot> views;
    std::vector<Label> labels;
};

}  // namespace simflex
