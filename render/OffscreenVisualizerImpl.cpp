#include "OffscreenVisualizerImpl.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"

namespace simflex {

using SimTK::State;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

namespace {

constexpr double relativeDeformation = 0.04;  // relative to the scene's size, for an automatic
                                              // factor
constexpr double mostOfPart = 0.25;           // relative to the part's size
constexpr double visibleGap = 1e-3;           // relative to the scene's radius

const Palette lightPalette = {
    Vec3(0.80, 0.85, 0.91),  Vec3(0.975, 0.98, 0.985), Vec3(0.915, 0.925, 0.935),
    Vec3(0.70, 0.73, 0.765), Vec3(0.07, 0.09, 0.12),   Vec3(0.40, 0.46, 0.54),
    {28, 34, 44, 255},       {78, 88, 102, 255},       {255, 255, 255, 60}};
const Palette darkPalette = {
    Vec3(0.09, 0.105, 0.135), Vec3(0.19, 0.215, 0.25), Vec3(0.165, 0.185, 0.215),
    Vec3(0.33, 0.36, 0.40),   Vec3(0.02, 0.02, 0.03),  Vec3(0.72, 0.78, 0.86),
    {236, 240, 245, 255},     {172, 182, 195, 255},    {10, 12, 16, 60}};

std::vector<Vec3> calcBoxCorners(const std::vector<Vec3>& points) {
    Vec3 lower = points.front(), upper = lower;
    for (const Vec3& p : points)
        for (int k = 0; k < 3; ++k) {
            lower[k] = std::min(lower[k], p[k]);
            upper[k] = std::max(upper[k], p[k]);
        }
    std::vector<Vec3> corners;
    for (int i = 0; i < 8; ++i)
        corners.emplace_back(i & 1 ? upper[0] : lower[0], i & 2 ? upper[1] : lower[1],
                             i & 4 ? upper[2] : lower[2]);
    return corners;
}

// Views with their own rectangle take no share of the frame.
SimTK::Vec4 calcRectangle(const std::vector<View>& views, int index) {
    int number = 0, numShares = 0;
    for (int i = 0; i < int(views.size()); ++i) {
        if (views[std::size_t(i)].hasRectangle()) continue;
        if (i < index) ++number;
        ++numShares;
    }
    return views[std::size_t(index)].calcRectangle(number, numShares);
}

// Moves the bar clear of views that cover the right edge of the first one, if there is room.
void avoidInsets(ColorBar& bar, const std::vector<ViewSnapshot>& views) {
    constexpr double usualLength = 0.46, leastLength = 0.15;
    const ViewSnapshot& first = views.front();
    const double left = first.left + first.width - 130 * first.unit;
    std::vector<std::pair<double, double>> covered{{1, 1}};
    for (std::size_t i = 1; i < views.size(); ++i)
        if (views[i].left < first.left + first.width && views[i].left + views[i].width > left)
            covered.emplace_back(double(views[i].top - first.top) / first.height,
                                 double(views[i].top + views[i].height - first.top) / first.height);
    if (covered.size() == 1) return;
    std::sort(covered.begin(), covered.end());
    double from = 0, to = 0, end = 0;  // the largest free section; end of the last covered one
    for (const auto& [top, bottom] : covered) {
        if (top - end > to - from) from = end, to = top;
        end = std::max(end, bottom);
    }
    // The heading is above the bar, the footnote below.
    from += 70 * first.unit / first.height;
    to -= 50 * first.unit / first.height;
    if (to - from < leastLength) return;
    const double middle = 0.5 * (from + to), half = 0.5 * std::min(usualLength, to - from);
    bar.top = middle - half;
    bar.bottom = middle + half;
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
}

Transform OffscreenVisualizer::Impl::calcBodyPose(int body) const {
    if (body == 0 || !matter) return Transform();
    if (body < 0 || body >= matter->getNumBodies())
        throw std::runtime_error("a decoration or camera names mobilized body " +
                                 std::to_string(body) + ", the system has 0 to " +
                                 std::to_string(matter->getNumBodies() - 1));
    const Transform X_GB = matter->getMobilizedBody(SimTK::MobilizedBodyIndex(body))
                               .getBodyTransform(drawn.getState());
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

// Simbody itself would fail on a NaN without naming its origin.
void OffscreenVisualizer::Impl::checkCoordinates(const State& state) const {
    if (!std::isfinite(state.getTime())) throw std::runtime_error("the State's time is not finite");
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
        snapshot.X_GD = part.mesh.getFramePose(drawn.getState());
        if (part.body.isValid()) snapshot.reference = drawn.calcReference(part.body);
        snapshot.look = part.look;
        snapshot.field = part.field;
        snapshot.xi = readModalCoordinates(part, state);
        if (getTraits(partStyle.contour.contour).needsVelocity)
            readVelocities(part, state, snapshot);
        snapshots.push_back(std::move(snapshot));
    }
}

OffscreenVisualizer::Impl::Decorations OffscreenVisualizer::Impl::collectDecorations(
    const State& state) {
    Decorations geometry;
    for (SimTK::Stage stage = SimTK::Stage::Topology; stage <= state.getSystemStage(); ++stage)
        system.calcDecorativeGeometryAndAppend(state, stage, geometry);
    for (const auto& generator : generators) generator->generateDecorations(state, geometry);
    const OffscreenVisualizer self(shared_from_this());
    for (const auto& controller : controllers) controller->generateControls(self, state, geometry);
    return geometry;
}

void OffscreenVisualizer::Impl::captureDecorations(const State& state, const Decorations& geometry,
                                                   FrameSnapshot& snapshot) {
    // Round shapes are as fine as the view that shows them largest requires.
    const auto calcPixelRadius = [&](const Vec3& middle, double ball) {
        double largest = 0;
        for (const ViewSnapshot& view : snapshot.views) {
            const double depth = -view.camera.toCamera(middle)[2];
            if (depth < -ball) continue;  // behind the camera
            const double distance = std::max(depth - ball, 0.05 * ball);
            largest = std::max(largest, ball / view.camera.calcPixelSize(distance, view.height));
        }
        return isFitted ? largest : 100.0;
    };
    SceneBuilder builder(
        snapshot.scene, shapes, [&](int body) { return calcBodyPose(body); }, calcPixelRadius,
        height / 720.0);
    for (const SimTK::DecorativeGeometry& piece : geometry) addDecoration(piece, builder);
    Decorations ofParts;
    marks.append(system, state, drawn, snapshot, ofParts);
    for (const SimTK::DecorativeGeometry& piece : ofParts) builder.add(piece);
    for (const SimTK::DecorativeGeometry& piece : decorations) addDecoration(piece, builder);
    for (const auto& [frame, decoration] : attachedDecorations) {
        SimTK::DecorativeGeometry piece = decoration;
        piece.setBodyId(0).setTransform(drawn.calcPose(frame) * decoration.getTransform());
        builder.add(piece);
    }
    for (const RubberBand& band : rubberBands) {
        SimTK::DecorativeLine line = band.line;
        line.setBodyId(0).setTransform(Transform());
        line.setEndpoints(calcBodyPose(band.body1) * band.station1,
                          calcBodyPose(band.body2) * band.station2);
        builder.add(line);
    }
    builder.addNotices();
    const DrawnPoses::Gap& gap = drawn.getLargestGap();
    if (gap.distance > visibleGap * extent.radius)
        snapshot.scene.screenTexts.push_back("joint '" + gap.joint + "' is drawn apart, by " +
                                             formatLength(gap.distance) +
                                             ": less exaggeration closes it");
    shapes.dropUnused();
}

// Applies the look of the body.
void OffscreenVisualizer::Impl::addDecoration(SimTK::DecorativeGeometry piece,
                                              SceneBuilder& builder) const {
    const auto found = looks.find(piece.getBodyId());
    if (found != looks.end()) {
        const BodyLook& look = found->second;
        if (!look.isVisible) return;
        if (look.hasColor()) piece.setColor(look.color);
        if (look.opacity < 1) piece.setOpacity(look.opacity);
    }
    builder.add(piece);
}

void OffscreenVisualizer::Impl::realize(const State& state) const {
    checkCoordinates(state);
    const bool needsVelocity = !parts.empty() && getTraits(partStyle.contour.contour).needsVelocity;
    system.realize(state, needsVelocity ? SimTK::Stage::Velocity : SimTK::Stage::Position);
    system.realize(state, marks.getStage());
}

FrameSnapshot OffscreenVisualizer::Impl::capture(const State& state, const Decorations& geometry,
                                                 int frameNumber) {
    FrameSnapshot snapshot;
    snapshot.number = frameNumber;
    snapshot.time = state.getTime();
    snapshot.width = width;
    snapshot.height = height;
    snapshot.partStyle = partStyle;
    snapshot.partStyle.deformationFactor = getDeformationFactor();
    snapshot.style = calcStyle();
    snapshot.center_G = extent.center_G;
    snapshot.radius = extent.radius;
    drawn.update(system, state, snapshot.partStyle.deformationFactor);
    captureViews(snapshot);
    captureParts(state, snapshot.parts);
    captureDecorations(state, geometry, snapshot);
    for (std::size_t i = 0; i < views.size(); ++i)
        snapshot.views[i].overlay = calcOverlay(snapshot, snapshot.views[i], int(i));
    return snapshot;
}

void OffscreenVisualizer::Impl::captureViews(FrameSnapshot& snapshot) const {
    for (std::size_t i = 0; i < views.size(); ++i) {
        const View& view = views[i];
        const SimTK::Vec4 part = calcRectangle(views, int(i));
        ViewSnapshot shot;
        shot.left = int(std::lround(part[0] * width));
        shot.top = int(std::lround(part[1] * height));
        shot.width = std::max(1, int(std::lround((part[0] + part[2]) * width)) - shot.left);
        shot.height = std::max(1, int(std::lround((part[1] + part[3]) * height)) - shot.top);
        // Leave a line between neighbours.
        const int gap = std::max(1, height / 480);
        if (shot.left + shot.width < width) shot.width = std::max(1, shot.width - gap);
        if (shot.top + shot.height < height) shot.height = std::max(1, shot.height - gap);
        // Small views have smaller letters, but less than proportionally.
        shot.unit = 0.5 * (1 + part[3]) * height / 720;
        shot.X_GF =
            view.calcFollowedPose([&](int body) { return calcBodyPose(body); },
                                  [&](const Attachment& frame) { return drawn.calcPose(frame); });
        shot.camera = view.calcCamera(snapshot.time, shot.X_GF);
        shot.fitsClippingPlanes = view.fitsClippingPlanes();
        shot.showAxes = showAxes;
        snapshot.views.push_back(std::move(shot));
    }
}

// Rounds down the factor that makes a displacement `relativeDeformation` of the scene, or
// `mostOfPart` of its part if that is less.
double OffscreenVisualizer::Impl::calcRoundFactor(const LargestDisplacement& largest) const {
    double wanted = relativeDeformation * 2 * extent.radius / largest.length;
    if (largest.shareOfPart > 0) wanted = std::min(wanted, mostOfPart / largest.shareOfPart);
    const double above = roundUpToStep(wanted);
    const double mantissa = above / std::pow(10, std::floor(std::log10(above)));
    const double below =
        above <= wanted ? above : above / (std::abs(mantissa - 5) < 1e-6 ? 2.5 : 2);
    return std::max(1.0, below);
}

Margins OffscreenVisualizer::Impl::calcMargins(int viewNumber) const {
    const SimTK::Vec4 part = calcRectangle(views, viewNumber);
    const double viewWidth = part[2] * width * 720.0 / height;  // in text units
    Margins margins;
    margins.right =
        viewNumber == 0 && leavesRoomForColorBar ? std::min(0.4, 145.0 / viewWidth) : 0.06;
    margins.left = 0.06;
    const bool hasTitle =
        viewNumber == 0 ? leavesRoomForTitle : !views[viewNumber].getCaption().empty();
    margins.top = hasTitle ? 0.13 : 0.09;
    margins.bottom = 0.11;
    return margins;
}

double OffscreenVisualizer::Impl::calcAspect(int viewNumber) const {
    const SimTK::Vec4 part = calcRectangle(views, viewNumber);
    return part[2] * width / (part[3] * height);
}

// Motion::getState may return the same State each time: use it before requesting the next.
FrameSnapshot OffscreenVisualizer::Impl::captureOf(const Motion& motion, int i) {
    const State& state = motion.getState(i);
    realize(state);
    return capture(state, collectDecorations(state), 0);
}

void OffscreenVisualizer::Impl::appendBounds(const FrameSnapshot& snapshot, MotionBounds& bounds) {
    bounds.followedPoses.resize(views.size());
    bounds.values.include(painter.deform(snapshot));
    bounds.hasColorBar |= hasColorBar();
    bounds.hasTitle |= !title.empty();
    bounds.frames.emplace_back();
    painter.appendBounds(snapshot, bounds.frames.back());
    for (std::size_t v = 0; v < views.size(); ++v)
        bounds.followedPoses[v].push_back(snapshot.views[v].X_GF);
}

void OffscreenVisualizer::Impl::appendBounds(const Motion& motion, MotionBounds& bounds) {
    for (int i = 0; i < motion.numStates; ++i) appendBounds(captureOf(motion, i), bounds);
}

void OffscreenVisualizer::Impl::fitViews(const MotionBounds& bounds) {
    std::vector<Vec3> all;
    for (const std::vector<Vec3>& frame : bounds.frames)
        all.insert(all.end(), frame.begin(), frame.end());
    leavesRoomForColorBar = bounds.hasColorBar;
    leavesRoomForTitle = bounds.hasTitle;
    extent = calcSceneExtent(all, UnitVec3(up), calcFront(up));
    for (std::size_t i = 0; i < views.size(); ++i)
        views[i].fit(extent, bounds.frames, bounds.followedPoses[i], calcAspect(int(i)),
                     calcMargins(int(i)));
    seenPoints = std::move(all);

    const Camera& camera = views.front().getCamera();
    const Vec3 upward(extent.up), back(camera.X_GC.R().z()), left = -Vec3(camera.X_GC.R().x());
    Vec3 level = back - SimTK::dot(back, upward) * upward;
    if (level.norm() > 1e-3) level = level / level.norm();
    toLight = UnitVec3(1.0 * upward + 0.42 * left + 0.62 * level);
    isFitted = true;
}

LargestDisplacement OffscreenVisualizer::Impl::calcLargestDisplacement(const Motion& motion) {
    LargestDisplacement largest;
    for (int i = 0; i < motion.numStates; ++i)
        largest.include(painter.calcLargestDisplacement(captureOf(motion, i)));
    return largest;
}

namespace {

/** Removes points so far away that the rest would be too small: if some are `far` times the extent
of the central nine tenths, all beyond `kept` times it. **/
void leaveOutFlights(std::vector<std::vector<Vec3>>& frames) {
    constexpr double share = 0.9, far = 5, kept = 2;
    std::vector<double> places[3], distances;
    for (const std::vector<Vec3>& frame : frames)
        for (const Vec3& p : frame)
            for (int k = 0; k < 3; ++k) places[k].push_back(p[k]);
    if (places[0].empty()) return;
    Vec3 middle;
    for (int k = 0; k < 3; ++k) {
        const auto median = places[k].begin() + std::ptrdiff_t(places[k].size() / 2);
        std::nth_element(places[k].begin(), median, places[k].end());
        middle[k] = *median;
    }
    for (const std::vector<Vec3>& frame : frames)
        for (const Vec3& p : frame) distances.push_back((p - middle).norm());
    const double farthest = *std::max_element(distances.begin(), distances.end());
    const auto most = distances.begin() + std::ptrdiff_t(share * double(distances.size() - 1));
    std::nth_element(distances.begin(), most, distances.end());
    const double reach = *most;
    if (!(farthest > far * reach) || !(reach > 0)) return;
    for (std::vector<Vec3>& frame : frames)
        frame.erase(
            std::remove_if(frame.begin(), frame.end(),
                           [&](const Vec3& p) { return (p - middle).norm() > kept * reach; }),
            frame.end());
}

}  // namespace

void OffscreenVisualizer::Impl::fitToMotion(const Motion& motion) {
    if (motion.numStates == 0) return;
    if (isFactorAutomatic) {
        automaticFactor = 1;
        const LargestDisplacement largest = calcLargestDisplacement(motion);
        if (largest.length > 0) {
            MotionBounds first;
            appendBounds(captureOf(motion, 0), first);
            fitViews(first);
            automaticFactor = calcRoundFactor(largest);
        }
    }
    marks.forgetRun();
    MotionBounds bounds;
    appendBounds(motion, bounds);
    leaveOutFlights(bounds.frames);
    fitViews(bounds);
    output.setValuesOfRun(bounds.values);
    isFittedToMotion = true;
}

// Moves the cameras back for objects that would leave the picture, except for those very far away.
bool OffscreenVisualizer::Impl::widenViews(const FrameSnapshot& snapshot) {
    constexpr double reach = 30;  // in radii of the first frame's scene
    constexpr std::size_t manyPoints = 20000;
    std::vector<Vec3> bounds;
    snapshot.scene.appendSolidBounds(bounds);
    Scene skins;
    for (const PartSnapshot& part : snapshot.parts) {
        if (!part.look.isVisible) continue;
        skins.surfaces.emplace_back();
        skins.surfaces.back().geometry = part.skin->undeformed;
        skins.surfaces.back().X_GM = part.X_GD;
    }
    skins.appendBounds(bounds);
    bounds.erase(std::remove_if(bounds.begin(), bounds.end(),
                                [&](const Vec3& p) {
                                    return (p - extent.center_G).norm() > reach * extent.radius;
                                }),
                 bounds.end());
    bool isWider = false;
    for (const Vec3& p : bounds) {
        const double level = SimTK::dot(Vec3(extent.up), p);
        if (level < extent.lowest) {
            extent.lowest = level;
            isWider = true;
        }
    }
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].keepsSceneInPicture()) continue;
        const ViewSnapshot& shot = snapshot.views[i];
        const Margins margins = calcMargins(int(i));
        const double left = margins.left * shot.width, top = margins.top * shot.height;
        const double right = (1 - margins.right) * shot.width;
        const double bottom = (1 - margins.bottom) * shot.height;
        const std::size_t numSeen = seenPoints.size();
        constexpr double tolerance = 0.5;  // pixel
        for (const Vec3& p : bounds) {
            const Vec3 pixel = shot.camera.calcPixel(p, shot.width, shot.height);
            const bool isInside = pixel[2] > 0 && pixel[0] > left - tolerance &&
                                  pixel[0] < right + tolerance && pixel[1] > top - tolerance &&
                                  pixel[1] < bottom + tolerance;
            if (!isInside) seenPoints.push_back(p);
        }
        if (seenPoints.size() == numSeen) continue;
        if (seenPoints.size() > manyPoints) {
            const std::vector<Vec3> points = std::move(seenPoints);
            seenPoints = calcBoxCorners(points);
        }
        views[i].fit(extent, {seenPoints}, {}, calcAspect(int(i)), margins);
        isWider = true;
    }
    return isWider;
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
    style.occlusionRadius = showOcclusion ? 0.2 * extent.radius : 0;
    style.hasTriad = showAxes;
    style.isBackgroundTransparent = isBackgroundTransparent;
    style.colorMap = partStyle.contour.getColorMap();

    GroundStyle& ground = style.ground;
    ground.isShown = hasGround;
    ground.hasShadow = showShadows;
    ground.radius = 7 * extent.radius;
    ground.gridSpacing = roundUpToStep(extent.radius / 8);
    const double groundLevel =
        isGroundHeightFixed ? groundHeight : extent.lowest - 0.01 * extent.radius;
    const UnitVec3 front = calcFront(up);
    const UnitVec3 right(SimTK::cross(upward, front));
    const Vec3 origin =
        extent.center_G + (groundLevel - SimTK::dot(extent.center_G, upward)) * Vec3(upward);
    ground.X_GP =
        Transform(SimTK::Rotation(upward, SimTK::ZAxis, Vec3(right), SimTK::XAxis), origin);
    const Vec3 fromWorld = ~ground.X_GP.R() * origin;
    const double cell = 5 * ground.gridSpacing;
    ground.gridOffset =
        SimTK::Vec2(-std::remainder(fromWorld[0], cell), -std::remainder(fromWorld[1], cell));
    return style;
}

// Text for the whole frame is placed in the first view.
OverlayContent OffscreenVisualizer::Impl::calcOverlay(const FrameSnapshot& snapshot,
                                                      const ViewSnapshot& view,
                                                      int viewNumber) const {
    OverlayContent content;
    content.hasTriad = view.showAxes;
    content.hasBorder = viewNumber > 0 && views[viewNumber].hasRectangle();
    content.R_GC = view.camera.X_GC.R();
    content.hasScaleBar = isScaleBarChosen ? showScaleBar : views[viewNumber].isOrthographic();
    content.pixelSize =
        view.camera.calcPixelSize(-view.camera.toCamera(extent.center_G)[2], view.height);
    if (!(content.pixelSize > 0)) content.hasScaleBar = false;
    content.labels = placeLabels(snapshot.labels, view);
    const std::string& caption = views[viewNumber].getCaption();
    if (viewNumber > 0) {
        if (!caption.empty()) content.captions.push_back(caption);
        return content;
    }

    content.title = title;
    if (showSimTime) content.captions.push_back("t = " + writeFixed(snapshot.time, 4) + " s");
    if (showFrameNumber) content.captions.push_back("frame " + std::to_string(snapshot.number));
    if (showDeformationFactor && !parts.empty())
        content.captions.push_back("deformation ×" +
                                   formatFactor(snapshot.partStyle.deformationFactor));
    if (!caption.empty()) content.captions.push_back(caption);
    content.screenTexts = snapshot.scene.screenTexts;
    if (hasGround && !isBackgroundTransparent)
        content.footnote = "grid " + formatLength(snapshot.style.ground.gridSpacing);
    content.hasColorBar = hasColorBar();
    content.colorBar = describeColorBar();
    avoidInsets(content.colorBar, snapshot.views);
    return content;
}

FrameJob OffscreenVisualizer::Impl::captureFrame(const State& state, int frameNumber) {
    try {
        realize(state);
        const Decorations geometry = collectDecorations(state);
        if (!isFitted) {
            MotionBounds bounds;
            appendBounds(capture(state, geometry, frameNumber), bounds);
            fitViews(bounds);
            isFittedToMotion = false;
        }
        FrameSnapshot snapshot = capture(state, geometry, frameNumber);
        if (!isFittedToMotion && widenViews(snapshot))
            snapshot = capture(state, geometry, frameNumber);
        lastViews = snapshot.views;
        FrameJob job;
        job.pictures.push_back(std::move(snapshot));
        job.plots = plots.place(width, height, getPlotTheme(), height / 720.0);
        rememberFrame(job.pictures.front());
        return job;
    } catch (const std::exception& e) {
        throw std::runtime_error("cannot draw the frame at time " + formatNumber(state.getTime()) +
                                 " s: " + e.what());
    }
}

Image OffscreenVisualizer::Impl::drawFrame(const State& state) {
    const FrameJob job = captureFrame(state, output.getNextNumber());
    try {
        return output.draw(job);
    } catch (const std::exception& e) {
        throw std::runtime_error("cannot draw the frame at time " + formatNumber(state.getTime()) +
                                 " s: " + e.what());
    }
}

void OffscreenVisualizer::Impl::report(const State& state) {
    output.add(captureFrame(state, output.getNextNumber()));
}

int OffscreenVisualizer::Impl::reportAll(const Motion& motion, const FrameProgress& progress) {
    return output.addAll(
        motion.numStates,
        [&](int i) { return captureFrame(motion.getState(i), output.getNextNumber()); }, progress);
}

}  // namespace simflex
