#pragma once
/** @file
A scene for tests of GlRenderer: the camera is on the z axis, looking along −z; colours are unlit,
the background is white. **/

#include <gtest/gtest.h>

#include "simflex/render/gl/GlRenderer.h"

namespace simflex {
namespace test {

class GlScene : public testing::Test {
protected:
    GlScene() {
        style.isLit = false;
        style.hasTriad = false;
        style.ground.isShown = false;
        style.palette.backgroundTop = style.palette.backgroundBottom = SimTK::Vec3(1);
        camera.X_GC.updP() = SimTK::Vec3(0, 0, 6);
        camera.nearPlane = 2;
        camera.farPlane = 10;
    }

    SurfaceItem& add(const SurfaceGeometryPtr& geometry, const SimTK::Transform& X_GM,
                     const SimTK::Vec3& scale, const SimTK::Vec3& color, double opacity = 1) {
        SurfaceItem item;
        item.geometry = geometry;
        item.X_GM = X_GM;
        item.scale = scale;
        item.color = color;
        item.opacity = opacity;
        scene.surfaces.push_back(item);
        return scene.surfaces.back();
    }

    Scene scene;
    Camera camera;
    FrameStyle style;
};

}  // namespace test
}  // namespace simflex
