#pragma once
/** @file
Pictures of any Simbody System on a machine without display or graphics card.

The interface is that of SimTK::Visualizer, but frames are written to PNG files or memory:

@code
    MultibodySystem system;
    // ... build the system; rod is a simflex::FlexibleBody
    matter.setShowDefaultGeometry(false);   // Simbody draws axes of 1 m
    simflex::OffscreenVisualizer viz(system);
    viz.addFlexibleBody(rod);
    viz.setWindowTitle("Slider-crank");
    viz.setOutputFolder("frames");
    // ... simulate, keeping States
    viz.fitToMotion(states);
    viz.addVideo("slider_crank.mp4");
    viz.reportAll(states);   // frames/frame_00000.png, ...
    viz.finish();
@endcode

Copies refer to the same visualizer. Only drawing requires libOSMesa or libEGL and a DejaVu font.
The same States in the same order give the same bytes. Not thread-safe. **/

#include <functional>
#include <iosfwd>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "Simbody.h"
#include "simflex/render/AnimationOptions.h"
#include "simflex/render/BodyLook.h"
#include "simflex/render/CameraView.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/Contour.h"
#include "simflex/render/DeformableMesh.h"
#include "simflex/render/DrawnForces.h"
#include "simflex/render/FrameOptions.h"
#include "simflex/render/Image.h"
#include "simflex/render/MotionRecorder.h"
#include "simflex/render/ProbePlot.h"
#include "simflex/render/SurfacePoint.h"
#include "simflex/render/Video.h"

namespace simflex {

class Attachment;
class FlexibleBody;
class FrameReporter;
struct WindowSettings;
class Joint;

class OffscreenVisualizer {
public:
    /** @name Types named as in SimTK::Visualizer **/
    /**@{**/
    class FrameController;  ///< in FrameController.h
    class BodyFollower;     ///< in FrameController.h
    class InputSilo;        ///< in InputSilo.h
    using InputListener = SimTK::Visualizer::InputListener;
    using Reporter = FrameReporter;  ///< in FrameReporter.h
    using BackgroundType = SimTK::Visualizer::BackgroundType;
    static constexpr BackgroundType GroundAndSky = SimTK::Visualizer::GroundAndSky;
    static constexpr BackgroundType SolidColor = SimTK::Visualizer::SolidColor;
    using Mode = SimTK::Visualizer::Mode;
    static constexpr Mode PassThrough = SimTK::Visualizer::PassThrough;
    static constexpr Mode Sampling = SimTK::Visualizer::Sampling;
    static constexpr Mode RealTime = SimTK::Visualizer::RealTime;
    /**@}**/

    enum class Theme { Light, Dark };
    enum class Lighting { Shaded, Flat };  ///< Flat: colours exactly as given
    using Contour = simflex::Contour;
    using ContourRange = simflex::ContourRange;

    /** @throws std::invalid_argument unless both sizes are positive. **/
    explicit OffscreenVisualizer(const SimTK::System& system, int width = 1280, int height = 720);
    ~OffscreenVisualizer();
    OffscreenVisualizer(const OffscreenVisualizer&) = default;
    OffscreenVisualizer& operator=(const OffscreenVisualizer&) = default;

    /** Returns the context used on this machine: "OSMesa" (always software) or "EGL" (a graphics
    card, or software without one). OSMesa is preferred, because it gives the same picture
    everywhere; the environment variable SIMFLEX_GL ("osmesa", "egl") overrides this.
    @throws std::runtime_error with the reason for each that does not work. **/
    static std::string getContextName();

    int getWidth() const;
    int getHeight() const;

    /** @name Frames
    States are realized to Stage::Position; geometry of later stages is drawn if the State has been
    realized that far.
    @throws std::runtime_error with the reason: no OpenGL context, a pose or a modal coordinate that
    is not finite (naming body and time), an unknown mesh file. **/
    /**@{**/
    /** Captures the State as the next frame. Background threads draw it and write it to the output
    folder while the caller continues; the call blocks while several frames are pending.
    @throws std::runtime_error also for an earlier frame that could not be drawn or written, which
    it names: all frames before it are complete, and the next one gets its number. **/
    void report(const SimTK::State& state) const;
    /** As report(). **/
    void drawFrameNow(const SimTK::State& state) const { report(state); }
    /** Reports all States and waits until their frames are complete, calling `progress`
    (ProgressLine shows a bar). Stops early if that returns false. @return the number of frames
    reported. **/
    int reportAll(const std::vector<SimTK::State>& states,
                  const FrameProgress& progress = {}) const;
    int reportAll(const MotionRecorder& motion, const FrameProgress& progress = {}) const;
    /** Waits for all frames and completes the videos. So does the destructor of the last copy, but
    it prints errors to standard error. @throws std::runtime_error as report() does. **/
    void finish() const;
    /** As finish(). **/
    void flushFrames() const { finish(); }
    /** Draws the State to memory. Waits for all reported frames. **/
    Image drawFrame(const SimTK::State& state) const;

    /** Sets the folder for frame_00000.png and so on, created with the first frame. A file appears
    when it and all earlier ones are complete. Empty: no files. Default: "frames". **/
    OffscreenVisualizer& setOutputFolder(const std::string& folder);
    const std::string& getOutputFolder() const;
    /** Returns the number of complete frames in the output folder. Waits for all reported
    frames. **/
    int getNumFrames() const;
    /** Sets whether frames left by an earlier run are removed (the default) or kept if they are
    identical, so that an interrupted run can be resumed by repeating it. **/
    OffscreenVisualizer& setOldFrames(OldFrames old);
    /** Sets a function that receives every reported frame in memory. **/
    OffscreenVisualizer& setFrameSink(const FrameSink& sink);
    /** Adds frames reported from now on to a video, which finish() completes.
    @throws as VideoWriter does. **/
    OffscreenVisualizer& addVideo(const std::string& file, const VideoOptions& options = {});
    /** Writes the whole motion as an animated scene: a binary glTF 2.0 file for browsers, Blender
    and VTK. Flexible bodies are morph targets with weights over time, accurate to 2e-5 of their
    size and exaggerated as in pictures. Vertices have node numbers (_NODE, −1 between nodes) and
    the colour of the contour's largest value in the motion. Cameras are those of pictures; springs
    and dampers are straight rods; arrows, lines and texts are omitted. Call fitToMotion() first.
    @throws std::invalid_argument without States; std::runtime_error if the file cannot be
    written. **/
    void writeAnimation(const std::string& file, const std::vector<SimTK::State>& states,
                        const AnimationOptions& options = {}) const;
    void writeAnimation(const std::string& file, const MotionRecorder& motion,
                        const AnimationOptions& options = {}) const;
    /** Returns the motion in the format of `simflex report`: JSON, with arrays in base64. It
    contains the bodies' poses for several deformation factors, with joints closed at each. Flexible
    bodies are shapes and weights as in writeAnimation(), accurate to 2e-5 of their size. Leaves the
    deformation factor at the last one. **/
    std::string describeMotion(const MotionRecorder& motion,
                               const std::vector<SimTK::Real>& factors) const;
    /** Sets the name of a mobilized body in these files; flexible bodies have their own names. **/
    OffscreenVisualizer& setBodyName(SimTK::MobilizedBodyIndex body, const std::string& name);
    /** Sets the number of threads that draw and write; 0: report() does it itself. The result is
    the same. Default: half the number of processors, from 2 to 4. @throws
    std::invalid_argument. **/
    OffscreenVisualizer& setNumThreads(int numThreads);
    int getNumThreads() const;

    /** Adds a plot beside the picture, with a mark at the frame's time; the frame grows by `size`
    pixels on that side (0: 42 %). @return its index. @throws std::invalid_argument. **/
    int addPlot(const ProbePlot& plot, PlotSide side = PlotSide::Below, int size = 0);
    /** Returns the plot, so that points can be added; frames show its content at the time of
    report().
    @throws std::out_of_range. **/
    ProbePlot& updPlot(int plot);
    /**@}**/

    /** @name Content beyond the System's own decorations **/
    /**@{**/
    OffscreenVisualizer& addFlexibleBody(const FlexibleBody& body);
    /** @throws std::invalid_argument if part or functions are missing. **/
    OffscreenVisualizer& addDeformableMesh(const DeformableMesh& mesh);
    /** Hides a flexible body, or sets its colour and opacity; joints and forces on it remain
    visible. Bodies that are hidden or have no contour do not affect colour ranges.
    @throws std::invalid_argument if it was not added, unless 0 < opacity <= 1, or as
    setContour(). **/
    OffscreenVisualizer& setBodyLook(const FlexibleBody& body, const BodyLook& look);
    /** As above for a mobilized body's geometry: the System's decorations and those added to the
    body. **/
    OffscreenVisualizer& setBodyLook(SimTK::MobilizedBodyIndex body, const BodyLook& look);
    int addDecoration(SimTK::MobilizedBodyIndex body, const SimTK::Transform& X_BD,
                      const SimTK::DecorativeGeometry& geometry);
    /** As above on a frame of any body; on flexible ones with the drawn deformation.
    @return its index among decorations on frames. **/
    int addDecoration(const Attachment& frame, const SimTK::DecorativeGeometry& geometry);
    int addRubberBandLine(SimTK::MobilizedBodyIndex b1, const SimTK::Vec3& station1,
                          SimTK::MobilizedBodyIndex b2, const SimTK::Vec3& station2,
                          const SimTK::DecorativeLine& line);
    /** Takes ownership of the generator. **/
    int addDecorationGenerator(SimTK::DecorationGenerator* generator);
    /** Takes ownership of the controller, which is called once before each frame. **/
    int addFrameController(FrameController* controller);
    int getNumDecorations() const;
    int getNumRubberBandLines() const;
    int getNumDecorationGenerators() const;
    int getNumFrameControllers() const;
    /** Returns the object added as number i. @throws std::out_of_range **/
    const SimTK::DecorativeGeometry& getDecoration(int i) const;
    SimTK::DecorativeGeometry& updDecoration(int i) const;
    const SimTK::DecorativeLine& getRubberBandLine(int i) const;
    SimTK::DecorativeLine& updRubberBandLine(int i) const;
    const SimTK::DecorationGenerator& getDecorationGenerator(int i) const;
    SimTK::DecorationGenerator& updDecorationGenerator(int i);
    const FrameController& getFrameController(int i) const;
    FrameController& updFrameController(int i);
    /**@}**/

    /** @name Camera
    Frame C: x right, y up, looking along −z. By default the camera is a little to the right and
    above the front of the scene, where the first frame, or the motion given to fitToMotion(), just
    fits into the picture. Without fitToMotion() it moves back when an object would leave the
    picture later, up to thirty times the initial extent. **/
    /**@{**/
    OffscreenVisualizer& setCameraTransform(const SimTK::Transform& X_GC);
    OffscreenVisualizer& pointCameraAt(const SimTK::Vec3& point, const SimTK::Vec3& upDirection);
    OffscreenVisualizer& setCameraFieldOfView(SimTK::Real fov);
    OffscreenVisualizer& setCameraClippingPlanes(SimTK::Real nearPlane, SimTK::Real farPlane);
    /** Moves the camera, without rotating it, so that the whole next frame is visible. **/
    OffscreenVisualizer& zoomCameraToShowAllGeometry();
    /** @name See CameraView for these **/
    /**@{**/
    OffscreenVisualizer& setCameraView(SimTK::Real azimuth, SimTK::Real elevation);
    OffscreenVisualizer& setCameraOrbit(SimTK::Real rate);
    OffscreenVisualizer& setCameraFollow(SimTK::MobilizedBodyIndex body, SimTK::Real size = 0,
                                         CameraView::Follow follow = CameraView::Follow::Position);
    OffscreenVisualizer& setCameraProjection(CameraView::Projection projection);
    OffscreenVisualizer& setCameraZoom(SimTK::Real zoom);
    /**@}**/
    /** Replaces the first camera and all its settings. **/
    OffscreenVisualizer& setCamera(const CameraView& view);
    /** Adds a camera, whose picture is placed beside the first one in every frame. **/
    OffscreenVisualizer& addView(const CameraView& view);
    /** Fits the visualizer to all these States: nothing leaves the picture, the ground is below
    everything, and the contour range and an automatic deformation factor suit the whole motion.
    O(states·(decorations + skin nodes·n_f)). **/
    OffscreenVisualizer& fitToMotion(const std::vector<SimTK::State>& states);
    OffscreenVisualizer& fitToMotion(const MotionRecorder& motion);
    /** Returns column and row of a point in the frame [pixel, from the top left corner] and its
    distance along the view direction [m], for the first or another view of the last frame.
    @throws std::out_of_range if there is no such view, or no frame yet. **/
    SimTK::Vec3 calcPixel(const SimTK::Vec3& point_G, int viewNumber = 0) const;
    /**@}**/

    /** @name Flexible parts **/
    /**@{**/
    /** Exaggerates displacements by this factor, which is printed in the picture. Bodies are moved
    so that they meet the exaggerated parts at their joints; if a loop of joints cannot be closed,
    the picture names the joint and the size of its gap.
    @throws std::invalid_argument if negative or not finite. **/
    OffscreenVisualizer& setDeformationFactor(SimTK::Real factor);
    /** Chooses the factor automatically (default): a round factor that makes the largest
    displacement given to fitToMotion() about 4 % of the scene's size, no more than a quarter of the
    part's, and at least 1. It is 1 until fitToMotion() is called. **/
    OffscreenVisualizer& setAutomaticDeformationFactor();
    SimTK::Real getDeformationFactor() const;
    /** Reference frame of coloured and exaggerated displacements. Joints (default): on each
    flexible body the frame at its first joint with Ground, or else at its first joint, in the
    directions that the joint constrains (not about the axis of a pin, unless it is driven).
    MeanAxes: the body frame, relative to which a part deforms least. **/
    enum class Reference { Joints, MeanAxes };
    OffscreenVisualizer& setReference(Reference reference);
    /** Sets a reference frame for the flexible body it is on.
    @throws std::invalid_argument naming a frame on a rigid body. **/
    OffscreenVisualizer& setReference(const Attachment& frame);
    /** Returns the joint with the largest gap in the last frame and the gap [m]; an empty name and
    0 if all joints are closed as accurately as in the State. **/
    std::pair<std::string, SimTK::Real> getLargestGap() const;
    /** Returns the pose of a frame in the State's picture, in Ground. Realizes the State to
    Stage::Position. **/
    SimTK::Transform calcDrawnPose(const SimTK::State& state, const Attachment& frame) const;
    /** Sets the contour quantity, see Contour.h; default Contour::Displacement, the magnitude |Φξ|.
    Call it before fitToMotion(), which determines the range. Velocities realize States to
    Stage::Velocity.
    @throws std::invalid_argument naming the body if stress is requested and its part was reduced
    without; addFlexibleBody() then throws it, too. The contour is then unchanged. **/
    OffscreenVisualizer& setContour(Contour contour);
    /** Fixes the ends of the colour bar [SI]; pointed ends of the bar indicate values beyond.
    @throws std::invalid_argument unless low < high. **/
    OffscreenVisualizer& setContourRange(SimTK::Real low, SimTK::Real high);
    /** Determines the ends automatically: PerRun (default) covers all States given to fitToMotion()
    and grows if a later frame exceeds it; PerFrame covers each frame separately. The range starts
    at zero, or is symmetric about zero for signed values. **/
    OffscreenVisualizer& setContourRange(ContourRange range);
    /** Returns the ends of the colour bar in the last frame [SI]. **/
    SimTK::Vec2 getContourRange() const;
    /** Default: Viridis, and CoolWarm for signed values. **/
    OffscreenVisualizer& setColorMap(ColorMap map);
    /** Shows the colour bar; default shown. **/
    OffscreenVisualizer& setShowColorBar(bool show);
    /** Shows the caption with the deformation factor; default shown. **/
    OffscreenVisualizer& setShowDeformationFactor(bool show);
    /** Shows a translucent ghost of the undeformed part; default shown. **/
    OffscreenVisualizer& setShowUndeformed(bool show);
    /** Shows the edges of the part's finite elements; default hidden. **/
    OffscreenVisualizer& setShowElementEdges(bool show);
    /** Shows sharp edges of the part; default shown. **/
    OffscreenVisualizer& setShowFeatureEdges(bool show);
    /** Sets the angle above which edges are sharp [rad]; default 35 degrees. For parts added
    later. **/
    OffscreenVisualizer& setCreaseAngle(SimTK::Real angle);
    /**@}**/

    /** @name Joints, connectors, loads and interfaces of flexible parts
    Drawn on the parts with exaggerated deformation, in sizes proportional to the parts'. **/
    /**@{**/
    /** Shows axes at the deformed interfaces, their master points and names; default hidden. **/
    OffscreenVisualizer& setShowInterfaces(bool show);
    /** Shows a symbol for each joint of the System's FlexibleBodySubsystem; default hidden. **/
    OffscreenVisualizer& setShowJoints(bool show);
    /** Adds a symbol for a spring, damper, bushing or stop. **/
    OffscreenVisualizer& addConnector(const DrawnConnector& connector);
    /** Adds arrows for a load; the longest represents the largest load since fitToMotion(). **/
    OffscreenVisualizer& addLoad(const DrawnLoad& load);
    OffscreenVisualizer& addLoad(const DrawnSpreadLoad& load);
    OffscreenVisualizer& setShowConnectors(bool show);  ///< default shown
    OffscreenVisualizer& setShowLoads(bool show);       ///< default shown
    /** Shows arrows for the force and the moment (two tips) of each joint on the body of its frame
    M; the longest represents the largest since fitToMotion(). Default hidden. They are computed
    from Simbody's multipliers, for which States are realized to Stage::Acceleration: exact, but
    slow with many joints. **/
    OffscreenVisualizer& setShowReactions(bool show);
    /** Sets another source of joint multipliers, such as an implicit run:
    @code viz.setShowReactions(true).setMultiplierSource(
        [&](const State&, const Joint& joint) { return integrator.getMultipliers(joint); });
    @endcode States are then realized to Stage::Velocity only.
    @param friction  additional spatial force on M at its origin, in Ground, which Simbody does not
    know: see JointFriction::calcForce() **/
    OffscreenVisualizer& setMultiplierSource(
        std::function<SimTK::Vector(const SimTK::State&, const Joint&)> multipliers,
        std::function<SimTK::SpatialVec(const SimTK::State&, const Joint&)> friction = {});
    /** Shows values at the arrows; default hidden. **/
    OffscreenVisualizer& setShowReactionValues(bool show);
    /**@}**/

    /** @name Nodes in the picture
    For the last frame; determined from its surfaces, not its pixels.
    @throws std::logic_error before the first frame. **/
    /**@{**/
    /** Returns the surface point at a position in the picture [pixel, from the top left corner; a
    pixel's centre is at 0.5], if it is on a flexible part. O(triangles). **/
    std::optional<SurfacePoint> pickNode(SimTK::Real column, SimTK::Real row) const;
    /** Returns position, value and colour of a body's node.
    @throws std::out_of_range naming the bodies that are drawn, or the node asked for. **/
    NodeView findNode(const std::string& body, int nodeNumber) const;
    /**@}**/

    /** @name Look **/
    /**@{**/
    OffscreenVisualizer& setTheme(Theme theme);
    OffscreenVisualizer& setLighting(Lighting lighting);
    /** Sets the direction towards the main light, in Ground; default: above the camera's left
    shoulder. **/
    OffscreenVisualizer& setLightDirection(const SimTK::Vec3& towardsLight_G);
    OffscreenVisualizer& setBackgroundType(SimTK::Visualizer::BackgroundType background);
    /** Sets the colour of the SolidColor background. **/
    OffscreenVisualizer& setBackgroundColor(const SimTK::Vec3& color);
    OffscreenVisualizer& setSystemUpDirection(const SimTK::CoordinateDirection& up);
    /** Sets the height of the ground along the up direction [m]; default: just below the scene. **/
    OffscreenVisualizer& setGroundHeight(SimTK::Real height);
    OffscreenVisualizer& setShowShadows(bool show);
    /** Shows ambient occlusion: opaque surfaces are darker in corners and gaps, where nearby
    surfaces shield them from light. Contours are darkened, too. Default off. **/
    OffscreenVisualizer& setShowAmbientOcclusion(bool show);
    /** Omits background and ground, so that pictures can be laid over others: alpha is the
    coverage; shadows remain as a dark veil. Default off. **/
    OffscreenVisualizer& setTransparentBackground(bool isTransparent);
    OffscreenVisualizer& setShowAxes(bool show);
    /** Shows a bar of a round length, to scale at the distance of the scene's middle. Default:
    shown in orthographic views. **/
    OffscreenVisualizer& setShowScaleBar(bool show);
    OffscreenVisualizer& setShowSimTime(bool show);      ///< default shown
    OffscreenVisualizer& setShowFrameNumber(bool show);  ///< default hidden
    OffscreenVisualizer& setWindowTitle(const std::string& title);
    /** Height of the ground; NaN if automatic. **/
    SimTK::Real getGroundHeight() const;
    SimTK::CoordinateDirection getSystemUpDirection() const;
    const SimTK::System& getSystem() const;
    /**@}**/

    /** @name Window functions
    For source compatibility with SimTK::Visualizer. All modes act as PassThrough: every reported
    frame is drawn as fast as possible, without reference to a clock. Menus and sliders are not
    drawn; listeners receive input only by calls of their methods, see InputSilo. A
    SimTK::Visualizer::FrameController cannot be used, because its argument is a SimTK::Visualizer:
    derive from OffscreenVisualizer::FrameController. **/
    /**@{**/
    OffscreenVisualizer& setMode(Mode mode);
    Mode getMode() const;
    OffscreenVisualizer& setDesiredFrameRate(SimTK::Real framesPerSec);
    SimTK::Real getDesiredFrameRate() const;
    OffscreenVisualizer& setRealTimeScale(SimTK::Real simTimePerRealSecond);
    SimTK::Real getRealTimeScale() const;
    OffscreenVisualizer& setDesiredBufferLengthInSec(SimTK::Real length);
    SimTK::Real getDesiredBufferLengthInSec() const;
    SimTK::Real getActualBufferLengthInSec() const { return 0; }
    int getActualBufferLengthInFrames() const { return 0; }
    const OffscreenVisualizer& setShowFrameRate(bool) const { return *this; }
    OffscreenVisualizer& setShutdownWhenDestructed(bool shouldShutdown);
    bool getShutdownWhenDestructed() const;
    void shutdown() {}

    OffscreenVisualizer& addMenu(const SimTK::String& title, int id,
                                 const SimTK::Array_<std::pair<SimTK::String, int>>& items);
    /** @throws std::invalid_argument unless min <= value <= max. **/
    OffscreenVisualizer& addSlider(const SimTK::String& title, int id, SimTK::Real min,
                                   SimTK::Real max, SimTK::Real value);
    /** Sets the value, clamped to the slider's range. Unknown sliders are ignored. **/
    const OffscreenVisualizer& setSliderValue(int slider, SimTK::Real value) const;
    /** @throws std::invalid_argument unless newMin <= newMax. **/
    const OffscreenVisualizer& setSliderRange(int slider, SimTK::Real newMin,
                                              SimTK::Real newMax) const;
    /** Takes ownership of the listener. **/
    int addInputListener(InputListener* listener);
    int getNumInputListeners() const;
    const InputListener& getInputListener(int i) const;
    InputListener& updInputListener(int i);

    void dumpStats(std::ostream& out) const;
    void clearStats() {}
    /**@}**/

    /** @name For frame controllers
    As the methods without `const`; they change the state shared by all copies. **/
    /**@{**/
    const OffscreenVisualizer& setCameraTransform(const SimTK::Transform& X_GC) const;
    const OffscreenVisualizer& pointCameraAt(const SimTK::Vec3& point,
                                             const SimTK::Vec3& upDirection) const;
    const OffscreenVisualizer& setCameraFieldOfView(SimTK::Real fov) const;
    const OffscreenVisualizer& setCameraClippingPlanes(SimTK::Real nearPlane,
                                                       SimTK::Real farPlane) const;
    const OffscreenVisualizer& zoomCameraToShowAllGeometry() const;
    const OffscreenVisualizer& setBackgroundColor(const SimTK::Vec3& color) const;
    const OffscreenVisualizer& setShowShadows(bool show) const;
    const OffscreenVisualizer& setShowSimTime(bool show) const;
    const OffscreenVisualizer& setShowFrameNumber(bool show) const;
    const OffscreenVisualizer& setWindowTitle(const std::string& title) const;
    /**@}**/

    class Impl;

private:
    friend class RunComparison;
    explicit OffscreenVisualizer(std::shared_ptr<Impl> impl);

    std::shared_ptr<Impl> impl;
};

}  // namespace simflex
