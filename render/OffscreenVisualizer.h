#pragma once
/** @file
Pictures of any Simbody System on a machine without display or graphics card.

The interface is that of SimTK::Visualizer, with frames going to PNG files or to memory:

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

Copies refer to the same visualizer. The first frame needs libOSMesa or libEGL and a DejaVu font;
nothing else does. The same states in the same order give the same bytes. Not for several threads at
once.
**/

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
    /** @name Types under the names that they have in SimTK::Visualizer **/
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
    enum class Lighting { Shaded, Flat };  ///< Flat: every colour exactly as given
    using Contour = simflex::Contour;
    using ContourRange = simflex::ContourRange;

    /** @throws std::invalid_argument unless both sizes are positive. **/
    explicit OffscreenVisualizer(const SimTK::System& system, int width = 1280, int height = 720);
    ~OffscreenVisualizer();
    OffscreenVisualizer(const OffscreenVisualizer&) = default;
    OffscreenVisualizer& operator=(const OffscreenVisualizer&) = default;

    /** What draws pictures on this machine: "OSMesa" (always software) or "EGL" (a graphics card,
    or software where there is none). OSMesa is preferred, for the same picture everywhere; the
    environment variable SIMFLEX_GL ("osmesa", "egl") chooses.
    @throws std::runtime_error with the reason of each that does not work. **/
    static std::string getContextName();

    int getWidth() const;
    int getHeight() const;

    /** @name Frames
    The State is realized to Stage::Position; geometry of later stages is drawn if the State has
    been realized that far.
    @throws std::runtime_error that says what is wrong: no OpenGL context, a pose or a modal
        coordinate that is not finite (and of which body, at which time), an unknown mesh file. **/
    /**@{**/
    /** Takes the State's picture as the next frame, which threads of their own draw and write to
    the output folder while the caller goes on; it waits when a few frames are on their way.
    @throws std::runtime_error also for a frame before that could not be drawn or written, which it
        names: the frames before that one are complete, and the next one takes its number. **/
    void report(const SimTK::State& state) const;
    /** The same as report(). **/
    void drawFrameNow(const SimTK::State& state) const { report(state); }
    /** Reports all States and waits until their frames are complete, telling `progress` of them
    (ProgressLine shows a bar); stops early when that says false. @return how many it reported. **/
    int reportAll(const std::vector<SimTK::State>& states,
                  const FrameProgress& progress = {}) const;
    int reportAll(const MotionRecorder& motion, const FrameProgress& progress = {}) const;
    /** Waits for all frames and completes the videos. The last copy's destructor does so, too, but
    writes an error to standard error. @throws std::runtime_error as report() does. **/
    void finish() const;
    /** The same as finish(). **/
    void flushFrames() const { finish(); }
    /** Draws the State to memory. Waits for frames reported before. **/
    Image drawFrame(const SimTK::State& state) const;

    /** Folder for frame_00000.png and so on, made when the first frame is reported. Each appears
    when it is complete and those before it are. Empty: no files. Default: "frames". **/
    OffscreenVisualizer& setOutputFolder(const std::string& folder);
    const std::string& getOutputFolder() const;
    /** Frames of the output folder that are complete. Waits for all that were reported. **/
    int getNumFrames() const;
    /** Whether frames that an earlier run left in the folder are removed, the default, or kept
    where they show the same, so that an interrupted run can be resumed by doing it again. **/
    OffscreenVisualizer& setOldFrames(OldFrames old);
    /** Takes every frame that is reported, in memory. **/
    OffscreenVisualizer& setFrameSink(const FrameSink& sink);
    /** Frames reported from here on go to a video, too, complete after finish().
    @throws as VideoWriter does. **/
    OffscreenVisualizer& addVideo(const std::string& file, const VideoOptions& options = {});
    /** The whole motion as a moving scene: a binary glTF 2.0 file, which browsers, Blender and
    VTK open. Flexible bodies are morph targets with weights over time, to 2e-5 of their size,
    exaggerated as pictures are; vertices carry the numbers of their nodes (_NODE, −1 between nodes)
    and the colour of the contour's largest value in the motion. Cameras are those of pictures;
    springs and dampers are straight rods; arrows, lines and texts are left out. Call fitToMotion()
    first.
    @throws std::invalid_argument without States; std::runtime_error if it cannot be written. **/
    void writeAnimation(const std::string& file, const std::vector<SimTK::State>& states,
                        const AnimationOptions& options = {}) const;
    void writeAnimation(const std::string& file, const MotionRecorder& motion,
                        const AnimationOptions& options = {}) const;
    /** The motion as the page of `simflex report` reads it: JSON, with arrays in base64. Bodies'
    poses are told for several deformation factors; joints stay together at each. Flexible bodies
    are shapes and weights, as above, true to 2e-5 of their size. Its deformation factor
    is the last of these afterwards. **/
    std::string describeMotion(const MotionRecorder& motion,
                               const std::vector<SimTK::Real>& factors) const;
    /** What a mobilized body is called in such a file; flexible ones have their own names. **/
    OffscreenVisualizer& setBodyName(SimTK::MobilizedBodyIndex body, const std::string& name);
    /** Threads that draw and write; 0: none, report() does it. The bytes are the same. Default:
    half as many as there are processors, from 2 to 4. @throws std::invalid_argument. **/
    OffscreenVisualizer& setNumThreads(int numThreads);
    int getNumThreads() const;

    /** Puts a plot beside the picture, which grows by `size` pixels on that side (0: 42 % of it),
    with a mark at the frame's time. @return its number. @throws std::invalid_argument. **/
    int addPlot(const ProbePlot& plot, PlotSide side = PlotSide::Below, int size = 0);
    /** The plot, to let its curves grow; frames show what it holds when they are reported.
    @throws std::out_of_range. **/
    ProbePlot& updPlot(int plot);
    /**@}**/

    /** @name What is drawn, besides the System's own decorations **/
    /**@{**/
    OffscreenVisualizer& addFlexibleBody(const FlexibleBody& body);
    /** @throws std::invalid_argument when part or functions are missing. **/
    OffscreenVisualizer& addDeformableMesh(const DeformableMesh& mesh);
    /** Hides a flexible body, or gives it colour and opacity; joints and forces at it stay. Bodies
    that are hidden or have no contour count for no range of colours.
    @throws std::invalid_argument if it was not added, unless 0 < opacity <= 1, or as setContour().
    **/
    OffscreenVisualizer& setBodyLook(const FlexibleBody& body, const BodyLook& look);
    /** The same for what is drawn with a mobilized body: the System's decorations and those that
    were added to it. **/
    OffscreenVisualizer& setBodyLook(SimTK::MobilizedBodyIndex body, const BodyLook& look);
    int addDecoration(SimTK::MobilizedBodyIndex body, const SimTK::Transform& X_BD,
                      const SimTK::DecorativeGeometry& geometry);
    /** The same on a frame of any body, flexible ones as they are drawn.
    @return its number, counted from 0 among those on frames. **/
    int addDecoration(const Attachment& frame, const SimTK::DecorativeGeometry& geometry);
    int addRubberBandLine(SimTK::MobilizedBodyIndex b1, const SimTK::Vec3& station1,
                          SimTK::MobilizedBodyIndex b2, const SimTK::Vec3& station2,
                          const SimTK::DecorativeLine& line);
    /** Takes over the generator. **/
    int addDecorationGenerator(SimTK::DecorationGenerator* generator);
    /** Takes over the controller, which is called once before each frame. **/
    int addFrameController(FrameController* controller);
    int getNumDecorations() const;
    int getNumRubberBandLines() const;
    int getNumDecorationGenerators() const;
    int getNumFrameControllers() const;
    /** What was added as number i. @throws std::out_of_range **/
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
    Frame C: x right, y up, looking along −z. Until one of these is called, the camera stands a
    little to the right and above the front of the scene, where all of the first frame, or of the
    motion given to fitToMotion(), just fits into the picture. Without fitToMotion() it steps back
    when something would leave the picture later, until it sees thirty times as far. **/
    /**@{**/
    OffscreenVisualizer& setCameraTransform(const SimTK::Transform& X_GC);
    OffscreenVisualizer& pointCameraAt(const SimTK::Vec3& point, const SimTK::Vec3& upDirection);
    OffscreenVisualizer& setCameraFieldOfView(SimTK::Real fov);
    OffscreenVisualizer& setCameraClippingPlanes(SimTK::Real nearPlane, SimTK::Real farPlane);
    /** Moves the camera, without turning it, to where all of the next frame is visible. **/
    OffscreenVisualizer& zoomCameraToShowAllGeometry();
    /** @name As in CameraView, where they are described **/
    /**@{**/
    OffscreenVisualizer& setCameraView(SimTK::Real azimuth, SimTK::Real elevation);
    OffscreenVisualizer& setCameraOrbit(SimTK::Real rate);
    OffscreenVisualizer& setCameraFollow(SimTK::MobilizedBodyIndex body, SimTK::Real size = 0,
                                         CameraView::Follow follow = CameraView::Follow::Position);
    OffscreenVisualizer& setCameraProjection(CameraView::Projection projection);
    OffscreenVisualizer& setCameraZoom(SimTK::Real zoom);
    /**@}**/
    /** Replaces the camera altogether. **/
    OffscreenVisualizer& setCamera(const CameraView& view);
    /** One more camera, whose picture stands beside the first one's in every frame. **/
    OffscreenVisualizer& addView(const CameraView& view);
    /** Looks at all these States: the camera is placed so that nothing leaves the picture, the
    ground lies below everything, the contour range and an automatic deformation factor are those
    of the whole motion. O(states·(decorations + skin nodes·n_f)). **/
    OffscreenVisualizer& fitToMotion(const std::vector<SimTK::State>& states);
    OffscreenVisualizer& fitToMotion(const MotionRecorder& motion);
    /** Column and row in the frame [pixel, from the top left corner] and distance along the
    view direction [m] of a point, for the first or another view of the frame drawn last.
    @throws std::out_of_range when there is no such view, or no frame yet. **/
    SimTK::Vec3 calcPixel(const SimTK::Vec3& point_G, int viewNumber = 0) const;
    /**@}**/

    /** @name Flexible parts **/
    /**@{**/
    /** Displacements are drawn this many times larger; the factor is printed in the picture.
    Bodies are drawn where their joints meet the parts as they are drawn; where a loop of joints
    cannot close so, the picture says which joint it leaves how far apart.
    @throws std::invalid_argument when negative or not finite. **/
    OffscreenVisualizer& setDeformationFactor(SimTK::Real factor);
    /** The default: a round factor that makes the largest displacement given to fitToMotion() about
    4 % of the scene's size, no more than a quarter of the part's, and at least 1; 1 until
    fitToMotion() is called. **/
    OffscreenVisualizer& setAutomaticDeformationFactor();
    SimTK::Real getDeformationFactor() const;
    /** What displacements in colours, and what is drawn larger, are measured from. Joints
    (default): on each flexible body the frame at its first joint with Ground, or else at its first
    joint, as far as that holds it; pins do not about their axis, unless they are driven. MeanAxes:
    the body frame, in which a part moves least. **/
    enum class Reference { Joints, MeanAxes };
    OffscreenVisualizer& setReference(Reference reference);
    /** A frame, for the flexible body that it is on.
    @throws std::invalid_argument that names a frame on a rigid body. **/
    OffscreenVisualizer& setReference(const Attachment& frame);
    /** The joint whose seats the frame drawn last has farthest apart [m], and how far; an empty
    name and 0 if all joints are closed as exactly as in the State. **/
    std::pair<std::string, SimTK::Real> getLargestGap() const;
    /** Where a frame is in the State's picture, in Ground. Realizes the State to Stage::Position.
     * **/
    SimTK::Transform calcDrawnPose(const SimTK::State& state, const Attachment& frame) const;
    /** What colours show, see Contour.h; default Contour::Displacement, the magnitude |Φξ|. Call it
    before fitToMotion(), which finds the range. Velocities realize States to Stage::Velocity.
    @throws std::invalid_argument naming the body when stress is wanted and its part was reduced
        without, as addFlexibleBody() does then; what is shown stays as it was. **/
    OffscreenVisualizer& setContour(Contour contour);
    /** Fixed ends of the colour bar [SI]; values beyond are shown by a tip of the bar. @throws
     * std::invalid_argument unless low < high. **/
    OffscreenVisualizer& setContourRange(SimTK::Real low, SimTK::Real high);
    /** Ends found from what is drawn: PerRun (default) covers all States given to fitToMotion(),
    growing if a later frame exceeds it; PerFrame covers each frame anew. They are zero and the
    largest value, or even on both sides of zero where values have a sign. **/
    OffscreenVisualizer& setContourRange(ContourRange range);
    /** Ends of the colour bar in the frame drawn last [SI]. **/
    SimTK::Vec2 getContourRange() const;
    /** Default: Viridis, and CoolWarm where values have a sign. **/
    OffscreenVisualizer& setColorMap(ColorMap map);
    /** The bar that says what colours mean; default shown. **/
    OffscreenVisualizer& setShowColorBar(bool show);
    /** The caption with the deformation factor; default shown. **/
    OffscreenVisualizer& setShowDeformationFactor(bool show);
    /** A translucent ghost of the undeformed part; default shown. **/
    OffscreenVisualizer& setShowUndeformed(bool show);
    /** Edges of the part's finite elements; default hidden. **/
    OffscreenVisualizer& setShowElementEdges(bool show);
    /** Sharp edges of the part; default shown. **/
    OffscreenVisualizer& setShowFeatureEdges(bool show);
    /** Edges sharper than this are drawn sharp [rad]; default 35 degrees. For parts added later.
     * **/
    OffscreenVisualizer& setCreaseAngle(SimTK::Real angle);
    /**@}**/

    /** @name Joints, connectors, loads and interfaces of flexible parts
    Drawn on the parts with their deformation exaggerated, in sizes that follow the parts'. **/
    /**@{**/
    /** Axes at the deformed interfaces, their master points and names; default hidden. **/
    OffscreenVisualizer& setShowInterfaces(bool show);
    /** A symbol for each joint of the System's FlexibleBodySubsystem; default hidden. **/
    OffscreenVisualizer& setShowJoints(bool show);
    /** A symbol for a spring, damper, bushing or stop. **/
    OffscreenVisualizer& addConnector(const DrawnConnector& connector);
    /** Arrows for a load, the longest for the largest since fitToMotion(). **/
    OffscreenVisualizer& addLoad(const DrawnLoad& load);
    OffscreenVisualizer& addLoad(const DrawnSpreadLoad& load);
    OffscreenVisualizer& setShowConnectors(bool show);  ///< those added; default shown
    OffscreenVisualizer& setShowLoads(bool show);       ///< those added; default shown
    /** Arrows for the force and the moment (two tips) that each joint puts on the body of its frame
    M, the longest for the largest since fitToMotion(); default hidden. They come from
    Simbody's multipliers, for which States are realized to Stage::Acceleration: exact, and
    slow with many joints. **/
    OffscreenVisualizer& setShowReactions(bool show);
    /** Where the multipliers of joints come from instead, such as an implicit run:
    @code viz.setShowReactions(true).setMultiplierSource(
        [&](const State&, const Joint& joint) { return integrator.getMultipliers(joint); });
    @endcode States are then realized to Stage::Velocity only.
    @param friction  spatial force on M besides, at its origin and in Ground: see
    JointFriction::calcForce(); Simbody knows nothing of it **/
    OffscreenVisualizer& setMultiplierSource(
        std::function<SimTK::Vector(const SimTK::State&, const Joint&)> multipliers,
        std::function<SimTK::SpatialVec(const SimTK::State&, const Joint&)> friction = {});
    /** Values at the arrows; default hidden. **/
    OffscreenVisualizer& setShowReactionValues(bool show);
    /**@}**/

    /** @name Nodes in the picture
    Of the frame drawn last; found on its surfaces, not in its pixels.
    @throws std::logic_error before the first frame. **/
    /**@{**/
    /** What is at a place of the picture [pixel, from the top left corner; a pixel's middle is at
    0.5]: empty unless it is the surface of a flexible part. O(triangles). **/
    std::optional<SurfacePoint> pickNode(SimTK::Real column, SimTK::Real row) const;
    /** Where a node of a body is, what value and colour it has.
    @throws std::out_of_range naming the bodies that are drawn, or the node asked for. **/
    NodeView findNode(const std::string& body, int nodeNumber) const;
    /**@}**/

    /** @name Look **/
    /**@{**/
    OffscreenVisualizer& setTheme(Theme theme);
    OffscreenVisualizer& setLighting(Lighting lighting);
    /** Direction towards the main light, in Ground; default: above the camera's left shoulder. **/
    OffscreenVisualizer& setLightDirection(const SimTK::Vec3& towardsLight_G);
    OffscreenVisualizer& setBackgroundType(SimTK::Visualizer::BackgroundType background);
    /** Colour of the SolidColor background. **/
    OffscreenVisualizer& setBackgroundColor(const SimTK::Vec3& color);
    OffscreenVisualizer& setSystemUpDirection(const SimTK::CoordinateDirection& up);
    /** Height of the ground along the up direction [m]; default: just below the scene. **/
    OffscreenVisualizer& setGroundHeight(SimTK::Real height);
    OffscreenVisualizer& setShowShadows(bool show);
    /** Ambient occlusion: opaque surfaces are darker where others close by keep light from them, in
    corners and gaps. Contours get darker there too. Default off. **/
    OffscreenVisualizer& setShowAmbientOcclusion(bool show);
    /** Pictures without background and ground, to be laid over others: alpha says how much of them
    is covered; a shadow stays as a dark veil. Default off. **/
    OffscreenVisualizer& setTransparentBackground(bool isTransparent);
    OffscreenVisualizer& setShowAxes(bool show);
    /** A bar of a round length, which is true at the distance of the scene's middle; default: in
    orthographic views. **/
    OffscreenVisualizer& setShowScaleBar(bool show);
    OffscreenVisualizer& setShowSimTime(bool show);      ///< default shown
    OffscreenVisualizer& setShowFrameNumber(bool show);  ///< default hidden
    OffscreenVisualizer& setWindowTitle(const std::string& title);
    /** Where the ground lies; NaN while it is left to the scene. **/
    SimTK::Real getGroundHeight() const;
    SimTK::CoordinateDirection getSystemUpDirection() const;
    const SimTK::System& getSystem() const;
    /**@}**/

    /** @name What a window would need
    Taken so that programs written for SimTK::Visualizer compile and run. All modes are
    PassThrough: every frame reported is drawn, as fast as may be, and nothing waits for a clock.
    Menus and sliders are not drawn; input reaches the listeners only through those who call their
    methods, see InputSilo. A SimTK::Visualizer::FrameController cannot be called, because it is
    given a SimTK::Visualizer: derive from OffscreenVisualizer::FrameController. **/
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
    /** The nearest value in the slider's range. A slider that was not added is ignored. **/
    const OffscreenVisualizer& setSliderValue(int slider, SimTK::Real value) const;
    /** @throws std::invalid_argument unless newMin <= newMax. **/
    const OffscreenVisualizer& setSliderRange(int slider, SimTK::Real newMin,
                                              SimTK::Real newMax) const;
    /** Takes over the listener. **/
    int addInputListener(InputListener* listener);
    int getNumInputListeners() const;
    const InputListener& getInputListener(int i) const;
    InputListener& updInputListener(int i);

    void dumpStats(std::ostream& out) const;
    void clearStats() {}
    /**@}**/

    /** @name For frame controllers
    The same as the methods without `const`, which change what all copies refer to. **/
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
