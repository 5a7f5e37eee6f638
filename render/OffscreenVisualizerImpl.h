#pragma once
/** @file
Data and drawing of OffscreenVisualizer. Internal to the renderer. **/

#include <memory>
#include <string>
#include <vector>

#include "Camera.h"
#include "DeformedSurface.h"
#include "FrameStyle.h"
#include "GlRenderer.h"
#include "Overlay.h"
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
        return isFactorAutomatic ? automaticFactor : deformationFactor;
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
        std::unique_ptr<DeformedSurface> surface;
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

    double deformationFactor = 1;
    bool isFactorAutomatic = false;
    double automaticFactor = 1;
    Contour contour = Contour::Displacement;
    bool isContourRangeFixed = false;
    ContourRange contourRange = ContourRange::PerRun;
    double fixedLow = 0, fixedHigh = 1;
    double largestOfRun = 0;
    ColorMap colorMap = ColorMap::Viridis;
    bool showUndeformed = true, showElementEdges = false, showFeatureEdges = true;
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

    FrameStyle lastStyle;
    Camera lastCamera;

private:
    SimTK::Transform calcBodyPose(const SimTK::State& state, int body) const;
    void buildScene(const SimTK::State& state, Scene& scene, const Camera* detailCamera);
    void addParts(const SimTK::State& state, Scene& scene);
    SimTK::Vector readModalCoordinates(const Part& part, const SimTK::State& state) const;
    void checkCoordinates(const SimTK::State& state) const;
    double calcLargestDisplacement(const SimTK::State& state);
    void fitScene(const std::vector<SimTK::Vec3>& bounds_G);
    bool hasColorBar() const { return showColorBar && !parts.empty() && contour != Contour::None; }
    Camera calcFrameCamera(const SimTK::State& state, const Scene& scene) const;
    FrameStyle calcStyle() const;
    OverlayContent calcOverlay(const SimTK::State& state, const Scene& scene,
                               const FrameStyle& style, const Camera& frameCamera) const;

    std::unique_ptr<GlRenderer> renderer;
    ShapeCache shapes;
    Overlay overlay;

    // Found by fitScene().
    bool isFitted = false;
    SimTK::Vec3 center{0};
    double radius = 1;
    double lowest = 0;
    SimTK::UnitVec3 toLight{SimTK::YAxis};
    double largestOfFrame = 0;
};

}  // namespace simflex
