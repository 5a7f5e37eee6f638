#include "simflex/model/pictures/Pictures.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/Progress.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/StateCopy.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/analyses/StateRows.h"
#include "simflex/model/builders/ModelGeometry.h"
#include "simflex/model/builders/RigidBodies.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/pictures/ForcePictures.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/solver/BdfIntegrator.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;
using SimTK::Pi;
using SimTK::SpatialVec;
using SimTK::State;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;
using SimTK::Vector;

namespace {

constexpr int PicturesPerPeriod = 24;  // frames per period of a mode
constexpr double ModeRate = 20;        // frames per second
// Deformations that need more are too small to show; bodies would visibly separate at their joints.
constexpr double LargestFactor = 1000;   // of automatic exaggeration
constexpr size_t MostTimes = 1000;       // of an animation
constexpr size_t MostTimesOfPage = 300;  // of a report
constexpr double BallOfSticks = 0.05;    // at the mass centre, relative to the sticks
constexpr double ModeAmplitude = 0.04;   // largest displacement, relative to the scene's size

CameraView makeCamera(const Model& model, const ModelValue& camera, const UnitVec3& up) {
    CameraView view(camera.get("name").isGiven() ? camera.get("name").getText() : "");
    if (camera.get("view").isGiven()) {
        const NamedView& named = findNamed(getNamedViews(), "view", camera.get("view").getText());
        view.setDirection(named.azimuth, named.elevation);
    }
    if (camera.get("position").isGiven()) {
        const Vec3 place = camera.get("position").getVec3(),
                   back = place - camera.get("look_at").getVec3();
        const UnitVec3 upwards = camera.get("up").isGiven() ? readDirection(camera.get("up")) : up;
        if ((upwards % back).norm() <= 1e-9 * back.norm())
            camera.get("position").fail("must not be at, or straight above or below, 'look_at'");
        SimTK::Rotation R_GC;
        R_GC.setRotationFromTwoAxes(UnitVec3(back), SimTK::ZAxis, upwards, SimTK::YAxis);
        view.setTransform(Transform(R_GC, place));
    }
    if (camera.get("follow").isGiven())
        view.setFollowedFrame(
            model.findFrame(camera.get("follow")),
            camera.get("height").isGiven() ? camera.get("height").getNumber() : 0);
    if (camera.get("orbit").getNumber() != 0) view.setOrbit(camera.get("orbit").getNumber());
    if (camera.get("perspective").isGiven())
        view.setFieldOfView(camera.get("perspective").getNumber());
    if (camera.get("orthographic").getBool()) view.setOrthographic();
    if (camera.get("inset").isGiven()) {
        const std::vector<double> place = camera.get("inset").getNumbers();
        try {
            view.setRectangle(place.at(0), place.at(1), place.at(2), place.at(3));
        } catch (const std::invalid_argument& error) {
            camera.get("inset").fail(error.what());
        }
    }
    return view;
}

void setContour(const ModelValue& pictures, OffscreenVisualizer& viz) {
    const ModelValue contour = pictures.get("contour"), range = pictures.get("range");
    try {
        viz.setContour(findNamed(getNamedContours(), "contour", contour.getText()).contour);
        if (range.isList())
            viz.setContourRange(range.at(0).getNumber(), range.at(1).getNumber());
        else if (range.getText() == "frame")
            viz.setContourRange(ContourRange::PerFrame);
    } catch (const std::invalid_argument& error) {
        (range.isList() ? range : contour).fail(error.what());
    }
}

bool isText(const ModelValue& value, const std::string& text) {
    return !value.isList() && !value.isMap() && value.getText() == text;
}

void setReferences(const Model& model, const ModelValue& frames, OffscreenVisualizer& viz) {
    if (isText(frames, "joints")) return;
    if (isText(frames, "mean")) {
        viz.setReference(OffscreenVisualizer::Reference::MeanAxes);
        return;
    }
    std::set<int> bodies;
    for (int k = 0; k < (frames.isList() ? frames.getSize() : 1); ++k) {
        const ModelValue value = frames.isList() ? frames.at(k) : frames;
        const Attachment frame = model.findFrame(value);
        if (!frame.isFlexible()) value.fail("must be on a flexible body");
        if (!bodies.insert(frame.getFlexibleBodyIndex()).second)
            value.fail("is a second frame on one body; leave one of them out");
        viz.setReference(frame);
    }
}

/** Default colours of bodies; consecutive ones differ. **/
const Vec3 UsualColors[] = {{0.62, 0.67, 0.73}, {0.78, 0.70, 0.56}, {0.60, 0.72, 0.60},
                            {0.70, 0.62, 0.72}, {0.78, 0.60, 0.54}, {0.52, 0.70, 0.71},
                            {0.52, 0.56, 0.66}, {0.78, 0.76, 0.54}};

void setLooks(const Model& model, OffscreenVisualizer& viz) {
    const ModelValue bodies = model.getFile().get("bodies"),
                     pictures = model.getFile().get("pictures"), looks = pictures.get("bodies");
    const bool hasContour = pictures.get("contour").getText() != "none";
    if (looks.isGiven()) {
        std::vector<std::string> names;
        for (const Model::BodyEntry& body : model.getBodies()) names.push_back(body.name);
        for (const std::string& name : looks.getKeys())
            if (std::find(names.begin(), names.end(), name) == names.end())
                looks.get(name).failUnknown("body", name, names);
    }
    size_t numUsual = 0;
    for (const Model::BodyEntry& body : model.getBodies()) {
        BodyLook look;
        if (bodies.get(body.name).has("color"))
            look.color = readColor(bodies.get(body.name).get("color"));
        else if (!body.flexible || !hasContour)
            look.color = UsualColors[numUsual++ % std::size(UsualColors)];
        if (looks.isGiven() && looks.has(body.name)) {
            const ModelValue given = looks.get(body.name);
            look.isVisible = given.get("visible").getBool();
            look.opacity = given.get("opacity").getNumber();
            look.hasContour = !given.has("color");
            if (given.has("color")) look.color = readColor(given.get("color"));
        }
        if (body.flexible)
            viz.setBodyLook(*body.flexible, look);
        else
            viz.setBodyLook(body.mobod.getMobilizedBodyIndex(), look)
                .setBodyName(body.mobod.getMobilizedBodyIndex(), body.name);
    }
}

/** Draws a body without a shape: sticks from its mass centre to its joints, or a ball of the same
inertia.
@param ends  joints in the body's frame **/
void addStandIn(const SimTK::MobilizedBody& body, const State& state, const std::vector<Vec3>& ends,
                OffscreenVisualizer& viz) {
    const SimTK::MassProperties mass = body.getBodyMassProperties(state);
    const Vec3 center = mass.getMassCenter();
    double reach = 0;
    for (const Vec3& end : ends) reach = std::max(reach, (end - center).norm());
    const double largest =
        mass.getMass() > 0 ? SimTK::max(mass.calcCentralInertia().getMoments()) : 0;
    const double radius = reach > 0     ? BallOfSticks * reach
                          : largest > 0 ? std::sqrt(2.5 * largest / mass.getMass())
                                        : 0;
    if (!(radius > 0)) return;
    viz.addDecoration(body, Transform(center), SimTK::DecorativeSphere(radius));
    for (const Vec3& end : ends) {
        const Vec3 along = end - center;
        if (along.norm() <= radius) continue;
        const SimTK::Rotation R(UnitVec3(along), SimTK::YAxis);
        viz.addDecoration(body, Transform(R, center + 0.5 * along),
                          SimTK::DecorativeCylinder(0.4 * radius, 0.5 * along.norm()));
    }
}

void addStandIns(const Model& model, OffscreenVisualizer& viz) {
    const ModelValue bodies = model.getFile().get("bodies");
    std::map<SimTK::MobilizedBodyIndex, std::vector<Vec3>> ends;
    for (const Model::JointEntry& entry : model.getJoints())
        if (entry.joint.getEquations().getNumFrames() == 2)
            for (const Attachment* frame : {&entry.joint.getFrameF(), &entry.joint.getFrameM()})
                if (!frame->isFlexible())
                    ends[frame->getMobilizedBodyIndex()].push_back(frame->getFrame().p());
    const State state = model.makeInitialState();
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (body.flexible || !bodies.get(body.name).has("mobilizer")) continue;
        ends[body.mobod.getMobilizedBodyIndex()].push_back(body.mobod.getOutboardFrame(state).p());
        ends[body.mobod.getParentMobilizedBody().getMobilizedBodyIndex()].push_back(
            body.mobod.getInboardFrame(state).p());
    }
    for (const Model::BodyEntry& body : model.getBodies())
        if (!body.flexible && !bodies.get(body.name).has("shape"))
            addStandIn(body.mobod, state, ends[body.mobod.getMobilizedBodyIndex()], viz);
}

/** Adds the analysis' name to a file's name if several analyses are drawn. **/
std::string makeName(const Model& model, const std::string& file, const std::string& analysis) {
    const ModelValue analyses = model.getFile().get("analyses");
    int numDrawn = 0;
    for (const std::string& name : analyses.getKeys())
        numDrawn += analyses.get(name).get("type").getText() == "transient";
    if (numDrawn < 2) return file;
    const fs::path path(file);
    return (path.parent_path() /
            (path.stem().string() + "_" + analysis + path.extension().string()))
        .string();
}

[[noreturn]] void stopDrawing(const std::string& resumeCommand) {
    throw Cancelled("all results are kept; draw the other pictures with: " + resumeCommand);
}

void checkVideos(const ModelValue& video) {
    for (int k = 0; video.isGiven() && k < video.getSize(); ++k) {
        const std::string suffix = fs::path(video.at(k).getText()).extension().string();
        if (suffix != ".mp4" && suffix != ".gif" && suffix != ".webp")
            video.at(k).fail("'" + video.at(k).getText() +
                             "' is not a video that can be written: name it .mp4, .gif or .webp");
    }
}

/** Curves of one unit, scaled to a suitable display unit. **/
struct PlotPanel {
    std::string heading, lastName, unit;  ///< the heading names all curves
    std::vector<std::string> labels;
    std::vector<std::vector<double>> values;

    void addTo(ProbePlot& figure, const std::vector<double>& time) const {
        double largest = 0;
        for (const std::vector<double>& curve : values)
            for (const double value : curve)
                if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
        const DisplayUnit scale = chooseDisplayUnit(unit, largest);
        figure.addPanel(heading, scale.name, scale.size);
        for (size_t k = 0; k < labels.size(); ++k) figure.addCurve(labels[k], time, values[k]);
    }
};

/** Adds plots beside the pictures, of the analysis' rows up to now. **/
void addPlots(const Model& model, const Results::Analysis& rows, OffscreenVisualizer& viz) {
    const ModelValue plots = model.getFile().get("pictures").get("plots");
    const std::vector<ChosenColumn> columns = chooseColumns(rows, {});
    for (int i = 0; i < plots.getSize(); ++i) {
        const ModelValue plot = plots.at(i), names = plot.get("probes");
        std::vector<PlotPanel> panels;
        for (int k = 0; k < names.getSize(); ++k) {
            const std::string name = names.at(k).getText();
            bool isFound = false;
            for (const ChosenColumn& column : columns) {
                if (name != column.name && name != column.probe) continue;
                if (panels.empty() || panels.back().unit != column.unit)
                    panels.push_back({"", "", column.unit, {}, {}});
                PlotPanel& panel = panels.back();
                if (panel.lastName != name)
                    panel.heading += (panel.heading.empty() ? "" : ", ") + name;
                panel.lastName = name;
                panel.labels.push_back(column.name);
                panel.values.push_back(column.values);
                isFound = true;
            }
            if (!isFound) names.at(k).failUnknown("probe", name, getNames(columns));
        }
        ProbePlot figure(plot.get("title").getText());
        for (const PlotPanel& panel : panels) panel.addTo(figure, rows.time);
        viz.addPlot(figure);
    }
}

}  // namespace

namespace {

/** Multipliers and friction of the State being drawn; Simbody's multipliers lack the friction. **/
class ReactionSource {
public:
    explicit ReactionSource(const Model& model) : m_model(model) {}

    Vector getMultipliers(const State& state, const Joint& joint) {
        const std::lock_guard<std::mutex> lock(m_mutex);
        return find(state).getMultipliers(joint);
    }
    SpatialVec getFriction(const State& state, const Joint& joint) {
        const FlexibleBodySubsystem& subsystem = m_model.getFlexibleBodies();
        if (!JointFriction::exists(subsystem, joint)) return {Vec3(0), Vec3(0)};
        const std::lock_guard<std::mutex> lock(m_mutex);
        return JointFriction(subsystem, joint)
            .calcForce(state, find(state).getFrictionForces(joint), Joint::Side::M);
    }

private:
    const ImplicitIntegrator& find(const State& state) {
        if (m_integrator && m_time == state.getTime() && (m_y - state.getY()).normInf() == 0)
            return *m_integrator;
        m_integrator = std::make_unique<BdfIntegrator>(m_model.getSystem());
        m_integrator->initialize(state);
        m_time = state.getTime();
        m_y = state.getY();
        return *m_integrator;
    }

    const Model& m_model;
    std::mutex m_mutex;
    std::unique_ptr<BdfIntegrator> m_integrator;
    double m_time = 0;
    Vector m_y;
};

void addReactions(const Model& model, OffscreenVisualizer& viz) {
    const std::vector<Model::JointEntry>& joints = model.getJoints();
    if (std::none_of(joints.begin(), joints.end(), [&](const Model::JointEntry& entry) {
            return JointFriction::exists(model.getFlexibleBodies(), entry.joint);
        }))
        return;
    const auto source = std::make_shared<ReactionSource>(model);
    viz.setMultiplierSource(
        [source](const State& state, const Joint& joint) {
            return source->getMultipliers(state, joint);
        },
        [source](const State& state, const Joint& joint) {
            return source->getFriction(state, joint);
        });
}

/** Refuses a folder of the model's choice that is a link, or behind one. **/
void refuseLinks(const fs::path& folder) {
    fs::path way;
    for (const fs::path& step : folder) {
        way /= step;
        if (folder.is_relative() || way == folder) refuseLinkedFolder(way);
    }
}

/** Folder of pictures whose names include their analysis. **/
std::string findFolder(const Model& model, const std::string& usual) {
    const ModelValue folder = model.getFile().get("pictures").get("folder");
    return folder.isGiven() ? folder.getText() : usual;
}

void fitTo(const Model& model, const MotionRecorder& motion, OffscreenVisualizer& viz) {
    viz.fitToMotion(motion);
    if (isText(model.getFile().get("pictures").get("exaggeration"), "auto") &&
        viz.getDeformationFactor() > LargestFactor)
        viz.setDeformationFactor(LargestFactor).fitToMotion(motion);
}

/** Rows as States; above `most` rows only every second, third … one and the last. **/
MotionRecorder collectMotion(const Model& model, const Results::Analysis& rows, size_t most) {
    const StateRows states(model);
    MotionRecorder motion(model.getSystem());
    const size_t last = rows.time.size() - 1, stride = last / most + 1;
    for (size_t row = 0; row <= last; row = row == last ? last + 1 : std::min(row + stride, last)) {
        motion.record(states.unpackState(rows, row));
    }
    return motion;
}

}  // namespace

const std::vector<Drawing>& getDrawings() {
    using Visualizer = OffscreenVisualizer;
    static const std::vector<Drawing> drawings = {
        {"joints", &Visualizer::setShowJoints},
        {"connectors", &Visualizer::setShowConnectors},
        {"loads", &Visualizer::setShowLoads},
        {"reactions", &Visualizer::setShowReactions},
        {"ghost", &Visualizer::setShowUndeformed},
        {"wireframe", &Visualizer::setShowElementEdges},
        {"axes", &Visualizer::setShowAxes},
        {"shadows", &Visualizer::setShowShadows},
        {"ambient_occlusion", &Visualizer::setShowAmbientOcclusion}};
    return drawings;
}

const std::vector<NamedView>& getNamedViews() {
    static const std::vector<NamedView> views = {
        {"front", 0, 0},        {"back", Pi, 0},
        {"left", -Pi / 2, 0},   {"right", Pi / 2, 0},
        {"side", Pi / 2, 0},    {"top", 0, Pi / 2},
        {"bottom", 0, -Pi / 2}, {"isometric", Pi / 4, std::atan(std::sqrt(0.5))}};
    return views;
}

const std::vector<NamedContour>& getNamedContours() {
    static const std::vector<NamedContour> contours = {
        {"none", Contour::None},
        {"displacement", Contour::Displacement},
        {"displacement_x", Contour::DisplacementX},
        {"displacement_y", Contour::DisplacementY},
        {"displacement_z", Contour::DisplacementZ},
        {"speed", Contour::Speed},
        {"velocity_x", Contour::VelocityX},
        {"velocity_y", Contour::VelocityY},
        {"velocity_z", Contour::VelocityZ},
        {"strain_energy", Contour::StrainEnergyDensity},
        {"von_mises", Contour::VonMises},
        {"signed_von_mises", Contour::SignedVonMises},
        {"principal_1", Contour::LargestPrincipalStress},
        {"principal_3", Contour::SmallestPrincipalStress}};
    return contours;
}

std::unique_ptr<OffscreenVisualizer> makeVisualizer(const Model& model) {
    const ModelValue pictures = model.getFile().get("pictures");
    checkVideos(pictures.get("video"));
    const std::vector<double> size = pictures.get("size").getNumbers();
    auto viz =
        std::make_unique<OffscreenVisualizer>(model.getSystem(), int(size.at(0)), int(size.at(1)));
    viz->setOutputFolder("");
    viz->setWindowTitle(getModelTitle(model.getFile()));
    for (const Model::BodyEntry& body : model.getBodies())
        if (body.flexible) viz->addFlexibleBody(*body.flexible);
    setLooks(model, *viz);
    addStandIns(model, *viz);
    addForces(model, *viz);
    addReactions(model, *viz);
    if (pictures.get("contour").getText() != "displacement" || pictures.get("range").isGiven())
        setContour(pictures, *viz);
    if (!isText(pictures.get("exaggeration"), "auto"))
        viz->setDeformationFactor(pictures.get("exaggeration").getNumber());
    setReferences(model, pictures.get("relative_to"), *viz);
    for (const Drawing& drawing : getDrawings())
        ((*viz).*drawing.show)(pictures.get(drawing.name).getBool());
    viz->setTransparentBackground(pictures.get("transparent").getBool());
    const UnitVec3 up = readDirection(pictures.get("up"));
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(up[axis]) == 1)
            viz->setSystemUpDirection(
                SimTK::CoordinateDirection(SimTK::CoordinateAxis(axis), up[axis] > 0 ? 1 : -1));
    const ModelValue ground = pictures.get("ground");
    if (isText(ground, "none"))
        viz->setBackgroundType(SimTK::Visualizer::SolidColor);
    else if (!isText(ground, "auto"))
        viz->setGroundHeight(ground.getNumber());
    if (isText(pictures.get("theme"), "dark")) viz->setTheme(OffscreenVisualizer::Theme::Dark);
    const ModelValue cameras = pictures.get("cameras");
    // Draw insets last, since they cover the other cameras.
    bool isFirst = true;
    for (const bool isInset : {false, true})
        for (int k = 0; cameras.isGiven() && k < cameras.getSize(); ++k) {
            if (cameras.at(k).get("inset").isGiven() != isInset) continue;
            const CameraView view = makeCamera(model, cameras.at(k), up);
            if (isFirst)
                viz->setCamera(view);
            else
                viz->addView(view);
            isFirst = false;
        }
    return viz;
}

void checkPictures(const Model& model) {
    makeVisualizer(model);
}

std::string drawFrames(const Model& model, const std::vector<RunCheckpoint::Frame>& frames,
                       const Results::Analysis& rows, const std::string& usualFolder,
                       const Listener& listener, const std::string& resumeCommand) {
    const ModelValue pictures = model.getFile().get("pictures"), video = pictures.get("video");
    const std::unique_ptr<OffscreenVisualizer> viz = makeVisualizer(model);
    std::string places;
    if (pictures.get("folder").isGiven() || !video.isGiven()) {
        const std::string folder = makeName(
            model,
            pictures.get("folder").isGiven() ? pictures.get("folder").getText() : usualFolder,
            rows.name);
        refuseLinks(folder);
        viz->setOutputFolder(folder);
        places = std::to_string(frames.size()) + " in " + folder;
    }
    viz->setOldFrames(OldFrames::Resume);
    for (int k = 0; video.isGiven() && k < video.getSize(); ++k) {
        try {
            const std::string file = makeName(model, video.at(k).getText(), rows.name);
            addVideo(model, file, *viz);
            places += (places.empty() ? "" : ", ") + file;
        } catch (const std::exception& error) {
            video.at(k).fail(error.what());
        }
    }

    const State pattern = model.makeInitialState();
    MotionRecorder motion(model.getSystem());
    for (const RunCheckpoint::Frame& frame : frames) {
        State state = copyState(pattern);
        const Vector holding = toVector(frame.holding);
        if ((model.getFlexibleBodies().getHolding(state) - holding).normInf() != 0) {
            model.getFlexibleBodies().setHolding(state, holding);
            model.getSystem().realizeModel(state);
        }
        setNumbers(state, frame.time, frame.q, frame.u);
        for (int k = 0; k < state.getNZ(); ++k) state.updZ()[k] = frame.z.at(size_t(k));
        model.getSystem().realize(state, SimTK::Stage::Velocity);
        motion.record(state);
    }
    if (!drawMotion(model, motion, rows, *viz, listener)) stopDrawing(resumeCommand);
    return "pictures: " + places;
}

bool drawsEquilibria(const Model& model) {
    if (!model.getFile().get("pictures").isGiven()) return false;
    const ModelValue analyses = model.getFile().get("analyses");
    const std::vector<std::string> names = analyses.getKeys();
    return std::none_of(names.begin(), names.end(), [&](const std::string& name) {
        return analyses.get(name).get("type").getText() == "transient";
    });
}

std::string drawState(const Model& model, const State& state, const std::string& analysis,
                      const std::string& usualFolder) {
    const std::unique_ptr<OffscreenVisualizer> viz = makeVisualizer(model);
    viz->setShowSimTime(false);
    MotionRecorder motion(model.getSystem());
    motion.record(state);
    fitTo(model, motion, *viz);
    const fs::path folder = findFolder(model, usualFolder);
    refuseLinks(folder);
    fs::create_directories(folder);
    const std::string file = (folder / (analysis + ".png")).string();
    viz->drawFrame(state).writePng(file);
    return "picture: " + file;
}

void checkAnimationName(const std::string& file) {
    if (fs::path(file).extension() != ".glb")
        throw std::runtime_error("'" + file +
                                 "' is not an animation that can be written: name it .glb");
    checkWritable(file);
}

std::string writeAnimation(const Model& model, const Results::Analysis& rows,
                           const std::string& file) {
    const std::unique_ptr<OffscreenVisualizer> viz = makeVisualizer(model);
    // Hide items without results, or that come and go.
    viz->setShowReactions(false).setShowLoads(false).setShowJoints(false);
    const MotionRecorder motion = collectMotion(model, rows, MostTimes);
    fitTo(model, motion, *viz);
    AnimationOptions options;
    options.slowMotion = model.getFile().get("pictures").get("slow_motion").getNumber();
    const std::string path = makeName(model, file, rows.name);
    viz->writeAnimation(path, motion, options);
    return "animation: " + path + ", " + std::to_string(motion.getNumStates()) + " times, " +
           writeFileSize(double(fs::file_size(path)));
}

std::string describeScene(const Model& model, const Results::Analysis& rows,
                          const Listener& listener) {
    const std::unique_ptr<OffscreenVisualizer> viz = makeVisualizer(model);
    viz->setShowReactions(false).setShowLoads(false).setShowJoints(false);
    const MotionRecorder motion = collectMotion(model, rows, MostTimesOfPage);
    if (!listener.tellProgress(rows.name + ": motion", 0)) throw Cancelled("nothing is written");
    fitTo(model, motion, *viz);
    const double usual = viz->getDeformationFactor();
    const auto& bodies = model.getBodies();
    std::vector<double> factors;
    if (std::any_of(bodies.begin(), bodies.end(),
                    [](const Model::BodyEntry& body) { return body.flexible.has_value(); }))
        for (const double factor : {1.0, std::round(usual / 3), 3 * usual})
            if (factor >= 1 && factor <= LargestFactor && factor != usual &&
                (factors.empty() || factor != factors.back()))
                factors.push_back(factor);
    factors.push_back(usual);
    return viz->describeMotion(motion, factors);
}

void addVideo(const Model& model, const std::string& file, OffscreenVisualizer& viz) {
    VideoOptions options;
    options.framesPerSecond = model.getFile().get("pictures").get("rate").getNumber();
    if (fs::path(file).has_parent_path()) fs::create_directories(fs::path(file).parent_path());
    viz.addVideo(file, options);
}

bool drawMotion(const Model& model, const MotionRecorder& motion, const Results::Analysis& rows,
                OffscreenVisualizer& viz, const Listener& listener) {
    addPlots(model, rows, viz);
    fitTo(model, motion, viz);
    listener.tellProgress("pictures", 0);
    const int numDrawn = viz.reportAll(motion, [&](int numComplete, int numFrames) {
        return listener.tellProgress("pictures", double(numComplete) / numFrames);
    });
    if (numDrawn < motion.getNumStates()) return false;
    viz.finish();
    return true;
}

namespace {

/** Draws a period of each mode; `kind` is "mode" or "shape". **/
std::string drawPeriods(const Model& model, const State& about, const std::vector<Eigenmode>& modes,
                        const std::vector<std::string>& titles, const std::string& kind,
                        const std::string& analysis, const std::string& usualFolder,
                        const Listener& listener) {
    const fs::path folder = findFolder(model, usualFolder);
    refuseLinks(folder);
    fs::create_directories(folder);
    Linearization linear;
    copyState(about, linear.state);
    // Largest body size or distance of a body from Ground's origin.
    double size = 0;
    model.getSystem().realize(linear.state, SimTK::Stage::Velocity);
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (body.flexible) size = std::max(size, 2 * double(body.flexible->getPart().calcRadius()));
        size = std::max(size, double(body.mobod.getBodyTransform(linear.state).p().norm()));
    }
    if (size == 0) size = 1;
    const std::string file = analysis + "_" + kind + "_";
    for (size_t k = 0; k < modes.size(); ++k) {
        const std::unique_ptr<OffscreenVisualizer> viz = makeVisualizer(model);
        viz->setWindowTitle(titles[k]).setShowSimTime(false).setShowLoads(false);
        // The amplitude of a mode is arbitrary.
        viz->setDeformationFactor(1).setShowDeformationFactor(false).setShowColorBar(false);
        VideoOptions options;
        options.framesPerSecond = ModeRate;
        viz->addVideo((folder / (file + std::to_string(k + 1) + ".gif")).string(), options);
        const std::vector<State> period = calcModeStates(model.getSystem(), linear, modes[k],
                                                         ModeAmplitude * size, PicturesPerPeriod);
        viz->fitToMotion(period);
        const int numDrawn = viz->reportAll(period, [&](int numComplete, int numFrames) {
            return listener.tellProgress(
                "pictures of " + kind + "s",
                (double(k) + double(numComplete) / numFrames) / double(modes.size()));
        });
        if (numDrawn < int(period.size()))
            throw Cancelled(kind + "s were drawn up to number " + std::to_string(k) + "");
        viz->finish();
    }
    return "pictures: " + std::to_string(modes.size()) + " " + kind +
           (modes.size() == 1 && kind == "shape" ? "" : "s") + ", " +
           (folder / (file + "*.gif")).string();
}

}  // namespace

std::string drawModes(const Model& model, const State& about, const std::vector<Eigenmode>& modes,
                      const std::string& analysis, const std::string& usualFolder,
                      const Listener& listener) {
    std::vector<std::string> titles;
    for (size_t k = 0; k < modes.size(); ++k)
        titles.push_back("mode " + std::to_string(k + 1) + ": " +
                         writeGeneral(double(modes[k].frequency), 5) + " Hz");
    return drawPeriods(model, about, modes, titles, "mode", analysis, usualFolder, listener);
}

std::string drawShapes(const Model& model, const State& state, const std::vector<Eigenmode>& shapes,
                       const std::vector<std::string>& titles, const std::string& analysis,
                       const std::string& usualFolder, const Listener& listener) {
    return drawPeriods(model, state, shapes, titles, "shape", analysis, usualFolder, listener);
}

}  // namespace model
}  // namespace simflex
