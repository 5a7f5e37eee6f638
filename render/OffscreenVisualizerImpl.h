#pragma once
/** @file
Implementation of OffscreenVisualizer. Internal to the renderer. **/

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "WindowSettings.h"
#include "simflex/render/FrameController.h"
#include "simflex/render/OffscreenVisualizer.h"
#include "simflex/render/frame/FrameOutput.h"
#include "simflex/render/frame/FramePainter.h"
#include "simflex/render/motion/MovingScene.h"
#include "simflex/render/overlay/FramePlots.h"
#include "simflex/render/scene/Camera.h"
#include "simflex/render/scene/DrawnPoses.h"
#include "simflex/render/scene/FrameSnapshot.h"
#include "simflex/render/scene/FrameStyle.h"
#include "simflex/render/scene/MechanismMarks.h"
#include "simflex/render/scene/SceneBuilder.h"
#include "simflex/render/scene/View.h"
#include "simflex/render/skin/SurfacePicker.h"

namespace simflex {

class OffscreenVisualizer::Impl : public std::enable_shared_from_this<OffscreenVisualizer::Impl> {
public:
    Impl(const SimTK::System& system, int width, int height);

    /** Access to the States of a motion in order. The State returned may change with the next
    call. **/
    struct Motion {
        int numStates = 0;
        std::function<const SimTK::State&(int)> getState;
    };

    static Motion toMotion(const std::vector<SimTK::State>& states) {
        return {int(states.size()),
                [&states](int i) -> const SimTK::State& { return states[std::size_t(i)]; }};
    }
    static Motion toMotion(const MotionRecorder& recorder) {
        return {recorder.getNumStates(),
                [&recorder](int i) -> const SimTK::State& { return recorder.getState(i); }};
    }
    /** Bounds of a motion, frame by frame. **/
    struct MotionBounds {
        std::vector<std::vector<SimTK::Vec3>> frames;
        std::vector<std::vector<SimTK::Transform>> followedPoses;  // by view
        Extremes values;
        bool hasColorBar = false, hasTitle = false;  // for which the views leave room
    };

    Image drawFrame(const SimTK::State& state);
    void report(const SimTK::State& state);
    int reportAll(const Motion& motion, const FrameProgress& progress);
    void fitToMotion(const Motion& motion);
    /** Captures the complete content of a frame; fits the views first if necessary. **/
    FrameJob captureFrame(const SimTK::State& state, int frameNumber);
    /** Adds the bounds of a motion, for fitting the views. **/
    void appendBounds(const Motion& motion, MotionBounds& bounds);
    void fitViews(const MotionBounds& bounds);
    /** Prevents frames from changing the views, which are fitted to the whole motion. **/
    void keepViews() { isFittedToMotion = true; }
    LargestDisplacement calcLargestDisplacement(const Motion& motion);
    double calcRoundFactor(const LargestDisplacement& largest) const;
    double getDeformationFactor() const {
        return isFactorAutomatic ? automaticFactor : partStyle.deformationFactor;
    }

    const PlotTheme& getPlotTheme() const {
        return theme == Theme::Light ? PlotTheme::light() : PlotTheme::dark();
    }

    /** Makes the next frame fit camera, ground and light again. **/
    void forgetFit() { isFitted = false; }

    struct RubberBand {
        SimTK::MobilizedBodyIndex body1, body2;
        SimTK::Vec3 station1, station2;
        SimTK::DecorativeLine line;
    };
    struct Part {
        DeformableMesh mesh;
        std::shared_ptr<const SkinModes> skin;
        std::shared_ptr<const ContourField> field;  // null: no colours
        FlexibleBodyIndex body;                     // invalid: a user's mesh
        BodyLook look = {};
    };

    /** Returns the contour values of a part, null if it shows none. @throws std::invalid_argument
    if the part lacks the data. **/
    std::shared_ptr<const ContourField> makeField(const Part& part, const BodyLook& look,
                                                  Contour contour) const;
    void setContour(Contour contour);

    const SimTK::System& system;
    const SimTK::SimbodyMatterSubsystem* matter = nullptr;
    int width, height;
    FrameOutput output;

    std::vector<SimTK::DecorativeGeometry> decorations;
    std::vector<std::pair<Attachment, SimTK::DecorativeGeometry>> attachedDecorations;
    std::vector<RubberBand> rubberBands;
    std::vector<std::unique_ptr<SimTK::DecorationGenerator>> generators;
    std::vector<std::unique_ptr<FrameController>> controllers;
    std::vector<std::unique_ptr<InputListener>> listeners;
    WindowSettings window;
    std::vector<Part> parts;
    std::map<int, BodyLook> looks;  // of mobilized bodies
    FramePlots plots;

    std::vector<View> views{View()};  // the first is the visualizer's own camera

    PartStyle partStyle;
    MechanismMarks marks;
    DrawnPoses drawn;
    bool isFactorAutomatic = true;
    double automaticFactor = 1;
    double creaseAngle = 35 * SimTK::Pi / 180;

    Theme theme = Theme::Light;
    Lighting lighting = Lighting::Shaded;
    bool isLightFixed = false;
    SimTK::Vec3 lightDirection{0};
    bool hasGround = true, showShadows = true, showOcclusion = false, showAxes = true;
    bool isBackgroundTransparent = false;
    SimTK::Vec3 solidColor{1};
    SimTK::CoordinateDirection up = SimTK::YAxis;
    bool isGroundHeightFixed = false;
    double groundHeight = 0;
    bool showSimTime = true, showFrameNumber = false;
    bool showColorBar = true, showDeformationFactor = true;
    bool isScaleBarChosen = false, showScaleBar = false;  // by default shown in orthographic views
    std::string title;

    std::vector<ViewSnapshot> lastViews;
    std::map<int, std::string> bodyNames;  // of mobilized bodies

    /** Captures the motion as it is drawn, see MovingScene. **/
    MovingScene captureScene(const Motion& motion);

    /** Stores the data that findNode() and pickNode() need. **/
    void rememberFrame(const FrameSnapshot& snapshot);
    /** @throws std::logic_error before the first frame. **/
    const SurfacePicker& getPicker(const char* caller);

private:
    /** Returns the drawn pose of a body. **/
    SimTK::Transform calcBodyPose(int body) const;
    using Decorations = SimTK::Array_<SimTK::DecorativeGeometry>;

    void realize(const SimTK::State& state) const;
    /** Collects decorations from the system, generators and frame controllers: once per frame,
    since they may count calls, and first of all, since controllers move the camera. **/
    Decorations collectDecorations(const SimTK::State& state);
    /** Captures the complete content of a frame. **/
    FrameSnapshot capture(const SimTK::State& state, const Decorations& geometry, int frameNumber);
    void captureDecorations(const SimTK::State& state, const Decorations& geometry,
                            FrameSnapshot& snapshot);
    /** Appends the geometry of mobilized bodies. @return their indices **/
    std::vector<int> captureShapes(const SimTK::State& state, MovingScene& scene);
    void addDecoration(SimTK::DecorativeGeometry piece, SceneBuilder& builder) const;
    FrameSnapshot captureOf(const Motion& motion, int i);
    void appendBounds(const FrameSnapshot& snapshot, MotionBounds& bounds);
    void captureParts(const SimTK::State& state, std::vector<PartSnapshot>& snapshots) const;
    void captureViews(FrameSnapshot& snapshot) const;
    SimTK::Vector readModalCoordinates(const Part& part, const SimTK::State& state) const;
    void readVelocities(const Part& part, const SimTK::State& state, PartSnapshot& snapshot) const;
    ColorBar describeColorBar() const;
    std::string describeReference() const;
    static std::vector<OverlayContent::PlacedLabel> placeLabels(const std::vector<Label>& labels,
                                                                const ViewSnapshot& view);
    void checkCoordinates(const SimTK::State& state) const;
    double calcAspect(int viewNumber) const;
    bool widenViews(const FrameSnapshot& snapshot);
    Margins calcMargins(int viewNumber) const;
    bool hasColorBar() const {
        return showColorBar && partStyle.contour.contour != Contour::None &&
               std::any_of(parts.begin(), parts.end(),
                           [](const Part& part) { return bool(part.field); });
    }
    FrameStyle calcStyle() const;
    OverlayContent calcOverlay(const FrameSnapshot& snapshot, const ViewSnapshot& view,
                               int viewNumber) const;

    FramePainter painter;  // for measuring motions
    ShapeCache shapes;
    std::unique_ptr<FrameSnapshot> lastFrame;
    std::unique_ptr<SurfacePicker> picker;  // of lastFrame, created on demand

    // Results of fitViews().
    bool isFitted = false, isFittedToMotion = false;
    bool leavesRoomForColorBar = false, leavesRoomForTitle = false;
    std::vector<SimTK::Vec3> seenPoints;  // that the views must show
    SceneExtent extent;
    SimTK::UnitVec3 toLight{SimTK::YAxis};
};

}  // namespace simflex
