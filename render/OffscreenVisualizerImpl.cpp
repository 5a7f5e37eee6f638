#include "OffscreenVisualizerImpl.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace simflex {

using SimTK::State;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

namespace {

constexpr double relativeDeformation = 0.04;  // of an automatic factor, to the scene's size

const Palette lightPalette = {
    Vec3(0.80, 0.85, 0.91),  Vec3(0.975, 0.98, 0.985), Vec3(0.915, 0.925, 0.935),
    Vec3(0.70, 0.73, 0.765), Vec3(0.07, 0.09, 0.12),   Vec3(0.40, 0.46, 0.54),
    {28, 34, 44, 255},       {78, 88, 102, 255},       {255, 255, 255, 60}};
const Palette darkPalette = {
    Vec3(0.09, 0.105, 0.135), Vec3(0.19, 0.215, 0.25), Vec3(0.165, 0.185, 0.215),
    Vec3(0.33, 0.36, 0.40),   Vec3(0.02, 0.02, 0.03),  Vec3(0.72, 0.78, 0.86),
    {236, 240, 245, 255},     {172, 182, 195, 255},    {10, 12, 16, 60}};

std::string formatTime(double time, int decimals) {
    char text[48];
    std::snprintf(text, sizeof text, "%.*f", decimals, time);
    return text;
}

UnitVec3 calcFront(const SimTK::CoordinateDirection& up) {
    if (up.getAxis() == SimTK::ZAxis) return UnitVec3(0, -1, 0);
    return UnitVec3(0, 0, 1);
}

}  // namespace

OffscreenVisualizer::Impl::Impl(const SimTK::System& drawnSystem, int pictureWidth,
                                int pictureHeight)
    : system(drawnSystem), width(pictureWidth), height(pictureHeight) {
    if (width <= 0 || height <= 0)
        throw std::invalid_argument("OffscreenVisualizer: size must be positive, not " +
                                    std::to_string(width) + "x" + std::to_string(height));
    if (SimTK::MultibodySystem::isInstanceOf(system)) {
        const auto& multibody = SimTK::MultibodySystem::downcast(system);
        if (multibody.hasMatterSubsystem()) matter = &multibody.getMatterSubsystem();
    }
    up = system.getUpDirection();
    hasGround = !system.getUseUniformBackground();
    camera.fieldOfView = 30 * SimTK::Pi / 180;
}

Transform OffscreenVisualizer::Impl::calcBodyPose(const State& state, int body) const {
    if (body == 0 || !matter) return Transform();
    if (body < 0 || body >= matter->getNumBodies())
        throw std::runtime_error("a decoration names mobilized body " + std::to_string(body) +
                                 ", the system has 0 to " +
                                 std::to_string(matter->getNumBodies() - 1));
    const Transform X_GB =
        matter->getMobilizedBody(SimTK::MobilizedBodyIndex(body)).getBodyTransform(state);
    if (!X_GB.p().isFinite() || !X_GB.R().isFinite())
        throw std::runtime_error("the pose of mobilized body " + std::to_string(body) +
                                 " is not finite: position " + X_GB.p().toString());
    return X_GB;
}

SimTK::Vector OffscreenVisualizer::Impl::readModalCoordinates(const Part& part,
                                                              const State& state) const {
    SimTK::Vector xi = part.mesh.getModalCoordinates(state);
    for (int i = 0; i < xi.size(); ++i)
        if (!std::isfinite(xi[i]))
            throw std::runtime_error("modal coordinate " + std::to_string(i) + " of body '" +
                                     part.mesh.name + "' is not finite");
    return xi;
}

// Simbody itself would stop at a NaN without saying where it comes from.
void OffscreenVisualizer::Impl::checkCoordinates(const State& state) const {
    for (const Part& part : parts) readModalCoordinates(part, state);
    for (int b = 1; matter && b < matter->getNumBodies(); ++b) {
        const auto& body = matter->getMobilizedBody(SimTK::MobilizedBodyIndex(b));
        for (int i = 0; i < body.getNumQ(state); ++i)
            if (!std::isfinite(body.getOneQ(state, i)))
                throw std::runtime_error("coordinate q" + std::to_string(i) +
                                         " of mobilized body " + std::to_string(b) +
                                         " is not finite");
    }
}

void OffscreenVisualizer::Impl::captureParts(const State& state,
                                             std::vector<PartSnapshot>& snapshots) const {
    for (const Part& part : parts) {
        PartSnapshot snapshot;
        snapshot.skin = part.skin;
        snapshot.X_GB = part.mesh.getFramePose(state);
        if (!snapshot.X_GB.p().isFinite() || !snapshot.X_GB.R().isFinite())
            throw std::runtime_error("the pose of body '" + part.mesh.name +
                                     "' is not finite: position " + snapshot.X_GB.p().toString());
        snapshot.xi = readModalCoordinates(part, state);
        snapshots.push_back(std::move(snapshot));
    }
}

void OffscreenVisualizer::Impl::captureDecorations(const State& state, Scene& scene,
                                                   const Camera* detailCamera) {
    SimTK::Array_<SimTK::DecorativeGeometry> geometry;
    for (SimTK::Stage stage = SimTK::Stage::Topology; stage <= state.getSystemStage(); ++stage)
        system.calcDecorativeGeometryAndAppend(state, stage, geometry);
    for (const auto& generator : generators) generator->generateDecorations(state, geometry);

    SceneBuilder builder(
        scene, shapes, [&](int body) { return calcBodyPose(state, body); },
        [&](const Vec3& middle, double ball) {
            if (!detailCamera) return 100.0;
            const double distance =
                std::max(-detailCamera->toCamera(middle)[2] - ball, detailCamera->nearPlane);
            return 0.5 * height * ball / (distance * std::tan(detailCamera->fieldOfView / 2));
        });
    for (const SimTK::DecorativeGeometry& piece : geometry) builder.add(piece);
    for (const SimTK::DecorativeGeometry& piece : decorations) builder.add(piece);
    for (const RubberBand& band : rubberBands) {
        SimTK::DecorativeLine line = band.line;
        line.setBodyId(0).setTransform(Transform());
        line.setEndpoints(calcBodyPose(state, band.body1) * band.station1,
                          calcBodyPose(state, band.body2) * band.station2);
        builder.add(line);
    }
    shapes.dropUnused();
}

FrameSnapshot OffscreenVisualizer::Impl::capture(const State& state, const Camera* detailCamera) {
    checkCoordinates(state);
    system.realize(state, SimTK::Stage::Position);
    FrameSnapshot snapshot;
    snapshot.number = numFrames;
    snapshot.time = state.getTime();
    snapshot.width = width;
    snapshot.height = height;
    captureDecorations(state, snapshot.scene, detailCamera);
    captureParts(state, snapshot.parts);
    snapshot.partStyle = partStyle;
    snapshot.partStyle.deformationFactor = getDeformationFactor();
    snapshot.style = calcStyle();
    snapshot.center_G = center;
    snapshot.radius = radius;
    captureViews(state, snapshot);
    return snapshot;
}

void OffscreenVisualizer::Impl::captureViews(const State& state, FrameSnapshot& snapshot) const {
    ViewSnapshot view;
    view.width = width;
    view.height = height;
    view.camera = calcCamera(state);
    view.fitsClippingPlanes = !areClippingPlanesFixed;
    view.overlay = calcOverlay(snapshot, view.camera);
    snapshot.views.push_back(view);
}

void OffscreenVisualizer::Impl::fitScene(const std::vector<Vec3>& bounds_G) {
    const UnitVec3 upward(up);
    const UnitVec3 front = calcFront(up);
    Vec3 lower(0), upper(0);
    for (std::size_t i = 0; i < bounds_G.size(); ++i)
        for (int k = 0; k < 3; ++k) {
            lower[k] = i == 0 ? bounds_G[i][k] : std::min(lower[k], bounds_G[i][k]);
            upper[k] = i == 0 ? bounds_G[i][k] : std::max(upper[k], bounds_G[i][k]);
        }
    center = 0.5 * (lower + upper);
    radius = 0.5 * (upper - lower).norm();
    if (!(radius > 0)) radius = bounds_G.empty() ? 1 : std::max(1e-3, 0.1 * center.norm());
    lowest = SimTK::Infinity;
    for (const Vec3& p : bounds_G) lowest = std::min(lowest, SimTK::dot(upward, p));
    if (bounds_G.empty()) lowest = 0;

    // A moving camera must keep the scene in the picture from all sides.
    std::vector<Vec3> points = bounds_G;
    if (points.empty() || orbitRate != 0) {
        const UnitVec3 right(SimTK::cross(upward, front));
        for (int i = 0; i < 24; ++i)
            for (const double level : {-0.7, 0.0, 0.7}) {
                const double angle = 2 * SimTK::Pi * i / 24;
                points.push_back(
                    center + radius * (level * Vec3(upward) + std::sqrt(1 - level * level) *
                                                                  (std::cos(angle) * Vec3(front) +
                                                                   std::sin(angle) * Vec3(right))));
            }
    }
    if (cameraMode == CameraMode::View)
        camera.X_GC.updR() = calcViewRotation(upward, front, azimuth, elevation);
    if (cameraMode != CameraMode::Fixed) {
        Margins margins;
        margins.right = hasColorBar() ? 145.0 / 1280 : 0.06;
        margins.left = 0.06;
        margins.top = title.empty() ? 0.09 : 0.13;
        margins.bottom = 0.11;
        camera.fit(points, double(width) / height, margins);
    }

    const Vec3 back(camera.X_GC.R().z()), left = -Vec3(camera.X_GC.R().x());
    Vec3 level = back - SimTK::dot(back, upward) * upward;
    if (level.norm() > 1e-3) level = level / level.norm();
    toLight = UnitVec3(1.0 * Vec3(upward) + 0.42 * left + 0.62 * level);
    isFitted = true;
}

// The round factor below the one that makes a displacement `relativeDeformation` of the scene.
double OffscreenVisualizer::Impl::calcRoundFactor(double largestDisplacement) const {
    const double wanted = relativeDeformation * 2 * radius / largestDisplacement;
    const double above = roundUpToStep(wanted);
    const double mantissa = above / std::pow(10, std::floor(std::log10(above) + 1e-9));
    const double below =
        above <= wanted ? above : above / (std::abs(mantissa - 5) < 1e-6 ? 2.5 : 2);
    return std::max(1.0, below);
}

void OffscreenVisualizer::Impl::fitToMotion(const std::vector<State>& states) {
    if (states.empty()) return;
    std::vector<Vec3> bounds;
    if (isFactorAutomatic) {
        automaticFactor = 1;
        double largest = 0;
        for (const State& state : states)
            largest = std::max(largest, painter.calcLargestDisplacement(capture(state, nullptr)));
        if (largest > 0) {
            const FrameSnapshot first = capture(states.front(), nullptr);
            painter.deform(first);
            painter.appendBounds(first, bounds);
            fitScene(bounds);
            automaticFactor = calcRoundFactor(largest);
            bounds.clear();
        }
    }
    valuesOfRun = {};
    for (const State& state : states) {
        const FrameSnapshot snapshot = capture(state, nullptr);
        valuesOfRun.include(painter.deform(snapshot));
        painter.appendBounds(snapshot, bounds);
    }
    fitScene(bounds);
}

Camera OffscreenVisualizer::Impl::calcCamera(const State& state) const {
    Camera result = camera;
    if (orbitRate != 0) {
        const SimTK::Rotation turn(orbitRate * state.getTime(), UnitVec3(up));
        result.X_GC.updR() = turn * camera.X_GC.R();
        result.X_GC.updP() = center + turn * (camera.X_GC.p() - center);
    }
    return result;
}

FrameStyle OffscreenVisualizer::Impl::calcStyle() const {
    FrameStyle style;
    style.palette = theme == Theme::Light ? lightPalette : darkPalette;
    if (!hasGround) {
        style.palette.backgroundTop = style.palette.backgroundBottom = solidColor;
        const bool isDark = SimTK::dot(solidColor, Vec3(0.30, 0.59, 0.11)) < 0.45;
        style.palette.text = (isDark ? darkPalette : lightPalette).text;
        style.palette.faintText = (isDark ? darkPalette : lightPalette).faintText;
        style.palette.halo = (isDark ? darkPalette : lightPalette).halo;
    }

    const UnitVec3 upward(up);
    style.up = upward;
    style.toLight = isLightFixed ? UnitVec3(lightDirection) : toLight;
    style.isLit = lighting == Lighting::Shaded;
    style.hasTriad = showAxes;
    style.colorMap = partStyle.contour.colorMap;

    GroundStyle& ground = style.ground;
    ground.isShown = hasGround;
    ground.hasShadow = showShadows;
    ground.radius = 7 * radius;
    ground.gridSpacing = roundUpToStep(radius / 8);
    const double groundLevel = isGroundHeightFixed ? groundHeight : lowest - 0.01 * radius;
    const UnitVec3 front = calcFront(up);
    const UnitVec3 right(SimTK::cross(upward, front));
    const Vec3 origin = center + (groundLevel - SimTK::dot(center, upward)) * Vec3(upward);
    ground.X_GP =
        Transform(SimTK::Rotation(upward, SimTK::ZAxis, Vec3(right), SimTK::XAxis), origin);
    const Vec3 fromWorld = ~ground.X_GP.R() * origin;
    const double cell = 5 * ground.gridSpacing;
    ground.gridOffset =
        SimTK::Vec2(-std::remainder(fromWorld[0], cell), -std::remainder(fromWorld[1], cell));
    return style;
}

OverlayContent OffscreenVisualizer::Impl::calcOverlay(const FrameSnapshot& snapshot,
                                                      const Camera& frameCamera) const {
    OverlayContent content;
    content.title = title;
    if (showSimTime) content.captions.push_back("t = " + formatTime(snapshot.time, 4) + " s");
    if (showFrameNumber) content.captions.push_back("frame " + std::to_string(numFrames));
    if (showDeformationFactor && !parts.empty())
        content.captions.push_back("deformation ×" + formatNumber(getDeformationFactor()));
    content.screenTexts = snapshot.scene.screenTexts;
    if (hasGround) content.footnote = "grid " + formatLength(snapshot.style.ground.gridSpacing);
    content.hasTriad = showAxes;
    content.R_GC = frameCamera.X_GC.R();
    content.hasColorBar = hasColorBar();
    content.colorBar = {"displacement", 0, 1, snapshot.style.colorMap};
    return content;
}

Image OffscreenVisualizer::Impl::drawFrame(const State& state) {
    try {
        if (!isFitted) {
            const FrameSnapshot first = capture(state, nullptr);
            painter.deform(first);
            std::vector<Vec3> bounds;
            painter.appendBounds(first, bounds);
            fitScene(bounds);
        }
        const FrameSnapshot snapshot = capture(state, &camera);
        const Extremes values = painter.deform(snapshot);
        valuesOfRun.include(values);
        lastContourRange = calcContourRange(partStyle.contour, values, valuesOfRun);
        lastCamera = snapshot.views.front().camera;
        return painter.paint(snapshot, lastContourRange);
    } catch (const std::exception& e) {
        throw std::runtime_error("cannot draw the frame at time " + formatNumber(state.getTime()) +
                                 " s: " + e.what());
    }
}

void OffscreenVisualizer::Impl::report(const State& state) {
    const Image image = drawFrame(state);
    namespace fs = std::filesystem;
    if (numFrames == 0) {
        std::error_code error;
        fs::create_directories(outputFolder, error);
        if (error || !fs::is_directory(outputFolder))
            throw std::runtime_error("cannot make the folder '" + outputFolder +
                                     "' for frames: " + error.message());
        for (const auto& entry : fs::directory_iterator(outputFolder)) {
            const std::string name = entry.path().filename().string();
            int number = 0, length = 0;
            if (std::sscanf(name.c_str(), "frame_%5d.png%n", &number, &length) == 1 &&
                length == int(name.size()))
                fs::remove(entry.path(), error);
        }
    }
    char name[32];
    std::snprintf(name, sizeof name, "/frame_%05d.png", numFrames);
    image.writePng(outputFolder + name);
    ++numFrames;
}

}  // namespace simflex
