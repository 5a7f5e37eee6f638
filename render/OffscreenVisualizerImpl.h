#pragma once
/** @file
Data and drawing of OffscreenVisualizer. Internal to the renderer. **/

#include <memory>
#include <string>
#include <vector>

#include "Camera.h"
#include "FramePainter.h"
#include "FrameSnapshot.h"
#include "FrameStyle.h"
#include "SceneBuilder.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

class OffscreenVisualizer::Impl {
public:
    Impl(const SimTK::System& system, int width, int height);

    Image drawFrame(const SimTK::State& state);
    void report(const SimTK::State& state);
    void fitToMotion(const std::vector<SimTK::State>& states);
    double getDeformationFactor() const {
        return isFactorAutomatic ? automaticFactor : partStyle.deformationFactor;
    }

    /** Makes the next frame choose camera, ground and light again. **/
    void forgetFit() { isFitted = false; }

    struct RubberBand {
        SimTK::MobilizedBodyIndex body1, body2;
        SimTK::Vec3 station1, station2;
        SimTK::DecorativeLine line;
    };
    struct Part {
        DeformableMesh mesh;
        std::shared_ptr<const SkinModes> skin;
    };
    enum class CameraMode { View, Fixed, FixedRotation };

    const SimTK::System& system;
    const SimTK::SimbodyMatterSubsystem* matter = nullptr;
    int width, height;
    std::string outputFolder = "frames";
    int numFrames = 0;

    std::vector<SimTK::DecorativeGeometry> decorations;
    std::vector<RubberBand> rubberBands;
    std::vector<std::unique_ptr<SimTK::DecorationGenerator>> generators;
    std::vector<Part> parts;

    Camera camera;
    CameraMode cameraMode = CameraMode::View;
    double azimuth = 25 * SimTK::Pi / 180, elevation = 16 * SimTK::Pi / 180;
    double orbitRate = 0;
    bool areClippingPlanesFixed = false;

    PartStyle partStyle;
    bool isFactorAutomatic = false;
    double automaticFactor = 1;
    double creaseAngle = 35 * SimTK::Pi / 180;

    Theme theme = Theme::Light;
    Lighting lighting = Lighting::Shaded;
    bool isLightFixed = false;
    SimTK::Vec3 lightDirection{0};
    bool hasGround = true, showShadows = true, showAxes = true;
    SimTK::Vec3 solidColor{1};
    SimTK::CoordinateDirection up = SimTK::YAxis;
    bool isGroundHeightFixed = false;
    double groundHeight = 0;
    bool showSimTime = true, showFrameNumber = false;
    bool showColorBar = true, showDeformationFactor = true;
    std::string title;

    SimTK::Vec2 lastContourRange{0, 1};
    Camera lastCamera;

private:
    SimTK::Transform calcBodyPose(const SimTK::State& state, int body) const;
    /** All that a frame of this State needs. `detailCamera` decides how fine round things are. **/
    FrameSnapshot capture(const SimTK::State& state, const Camera* detailCamera);
    void captureDecorations(const SimTK::State& state, Scene& scene, const Camera* detailCamera);
    void captureParts(const SimTK::State& state, std::vector<PartSnapshot>& snapshots) const;
    void captureViews(const SimTK::State& state, FrameSnapshot& snapshot) const;
    SimTK::Vector readModalCoordinates(const Part& part, const SimTK::State& state) const;
    void checkCoordinates(const SimTK::State& state) const;
    double calcRoundFactor(double largestDisplacement) const;
    void fitScene(const std::vector<SimTK::Vec3>& bounds_G);
    bool hasColorBar() const {
        return showColorBar && !parts.empty() && partStyle.contour.contour != Contour::None;
    }
    Camera calcCamera(const SimTK::State& state) const;
    FrameStyle calcStyle() const;
    OverlayContent calcOverlay(const FrameSnapshot& snapshot, const Camera& frameCamera) const;

    FramePainter painter;
    ShapeCache shapes;
    Extremes valuesOfRun;

    // Found by fitScene().
    bool isFitted = false;
    SimTK::Vec3 center{0};
    double radius = 1;
    double lowest = 0;
    SimTK::UnitVec3 toLight{SimTK::YAxis};
};

}  // namespace simflex
