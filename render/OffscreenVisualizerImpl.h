#pragma once
/** @file
Data and drawing of OffscreenVisualizer. Internal to the renderer. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "Camera.h"
#include "FramePainter.h"
#include "FrameSnapshot.h"
#include "FrameStyle.h"
#include "SceneBuilder.h"
#include "View.h"
#include "WindowSettings.h"
#include "simflex/render/FrameController.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

class OffscreenVisualizer::Impl : public std::enable_shared_from_this<OffscreenVisualizer::Impl> {
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

    const SimTK::System& system;
    const SimTK::SimbodyMatterSubsystem* matter = nullptr;
    int width, height;
    std::string outputFolder = "frames";
    int numFrames = 0;

    std::vector<SimTK::DecorativeGeometry> decorations;
    std::vector<RubberBand> rubberBands;
    std::vector<std::unique_ptr<SimTK::DecorationGenerator>> generators;
    std::vector<std::unique_ptr<FrameController>> controllers;
    std::vector<std::unique_ptr<InputListener>> listeners;
    WindowSettings window;
    std::vector<Part> parts;

    std::vector<View> views{View()};  // the first is the visualizer's own camera

    PartStyle partStyle;
    bool isFactorAutomatic = true;
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
    bool isScaleBarChosen = false, showScaleBar = false;  // else shown in orthographic views
    std::string title;

    SimTK::Vec2 lastContourRange{0, 1};
    std::vector<ViewSnapshot> lastViews;

private:
    SimTK::Transform calcBodyPose(const SimTK::State& state, int body) const;
    using Decorations = SimTK::Array_<SimTK::DecorativeGeometry>;

    void realize(const SimTK::State& state) const;
    /** Asks the system, generators and frame controllers: once for each frame, since they may keep
    account of their calls, and before anything else, since controllers move the camera. **/
    Decorations collectDecorations(const SimTK::State& state);
    /** All that a frame of this State needs. **/
    FrameSnapshot capture(const SimTK::State& state, const Decorations& geometry);
    void captureDecorations(const SimTK::State& state, const Decorations& geometry,
                            FrameSnapshot& snapshot);
    void captureParts(const SimTK::State& state, std::vector<PartSnapshot>& snapshots) const;
    void captureViews(const SimTK::State& state, FrameSnapshot& snapshot) const;
    SimTK::Vector readModalCoordinates(const Part& part, const SimTK::State& state) const;
    void checkCoordinates(const SimTK::State& state) const;
    double calcRoundFactor(double largestDisplacement) const;
    double calcAspect(int viewNumber) const;
    void fitViews(int numStates, const std::function<FrameSnapshot(int)>& captureState);
    bool widenViews(const FrameSnapshot& snapshot);
    Margins calcMargins(int viewNumber) const;
    bool hasColorBar() const {
        return showColorBar && !parts.empty() && partStyle.contour.contour != Contour::None;
    }
    FrameStyle calcStyle() const;
    OverlayContent calcOverlay(const FrameSnapshot& snapshot, const ViewSnapshot& view,
                               int viewNumber) const;

    FramePainter painter;
    ShapeCache shapes;
    Extremes valuesOfRun;

    // Found by fitViews().
    bool isFitted = false, isFittedToMotion = false;
    std::vector<SimTK::Vec3> seenPoints;  // that the views must show
    SceneExtent extent;
    SimTK::UnitVec3 toLight{SimTK::YAxis};
};

}  // namespace simflex
