#pragma once
/** @file
Appearance of a frame: colours, ground, light, contour. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/Image.h"

namespace simflex {

/** Colours of a light or a dark picture. **/
struct Palette {
    SimTK::Vec3 backgroundTop, backgroundBottom;
    SimTK::Vec3 ground, grid;
    SimTK::Vec3 edge, ghost;
    Image::Pixel text, faintText, halo;
};

struct GroundStyle {
    bool isShown = true;
    bool hasShadow = true;
    SimTK::Transform X_GP;      ///< origin below the scene, z along the normal
    SimTK::Vec2 gridOffset{0};  ///< of a grid intersection from P's origin
    double gridSpacing = 0.1;   ///< [m]
    double radius = 10;         ///< where the ground has faded out [m]
};

struct FrameStyle {
    Palette palette;
    GroundStyle ground;
    SimTK::UnitVec3 up{SimTK::YAxis};
    SimTK::UnitVec3 toLight{SimTK::Vec3(0.5, 1, 0.6)};
    bool isLit = true;
    double occlusionRadius = 0;  ///< range of ambient occlusion [m]
    ColorMap colorMap = ColorMap::Viridis;
    double contourLow = 0, contourHigh = 1;
    bool hasTriad = true;
    bool isBackgroundTransparent = false;  ///< draws only the shadow on the ground
    double unit = 1;                       ///< pixels per pixel of a picture 720 pixels high
};

/** Position of the axes in the picture: centre [pixel, from top left] and length of an axis. **/
struct TriadPlace {
    double x, y, length;

    int getHalfSize() const { return int(1.5 * length); }
};

inline TriadPlace calcTriadPlace(int height, double unit) {
    return {64 * unit, height - 62 * unit, 36 * unit};
}

}  // namespace simflex
