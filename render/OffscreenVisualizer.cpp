#include "simflex/render/OffscreenVisualizer.h"

#include <cmath>
#include <stdexcept>

#include "OffscreenVisualizerImpl.h"
#include "simflex/render/gl/GlContext.h"

namespace simflex {

using SimTK::Real;
using SimTK::Transform;
using SimTK::Vec2;
using SimTK::Vec3;

OffscreenVisualizer::OffscreenVisualizer(const SimTK::System& system, int width, int height)
    : impl(std::make_shared<Impl>(system, width, height)) {}

OffscreenVisualizer::~OffscreenVisualizer() = default;

std::string OffscreenVisualizer::getContextName() {
    return GlContext::create()->getName();
}

int OffscreenVisualizer::getWidth() const {
    return impl->width;
}
int OffscreenVisualizer::getHeight() const {
    return impl->height;
}

void OffscreenVisualizer::report(const SimTK::State& state) const {
    impl->report(state);
}

Image OffscreenVisualizer::drawFrame(const SimTK::State& state) const {
    return impl->drawFrame(state);
}

int OffscreenVisualizer::reportAll(const std::vector<SimTK::State>& states,
                                   const FrameProgress& progress) const {
    return impl->reportAll(Impl::toMotion(states), progress);
}

int OffscreenVisualizer::reportAll(const MotionRecorder& motion,
                                   const FrameProgress& progress) const {
    return impl->reportAll(Impl::toMotion(motion), progress);
}

void OffscreenVisualizer::finish() const {
    impl->output.finish();
}

OffscreenVisualizer& OffscreenVisualizer::setOutputFolder(const std::string& folder) {
    impl->output.setFolder(folder);
    return *this;
}

const std::string& OffscreenVisualizer::getOutputFolder() const {
    return impl->output.getFolder();
}

int OffscreenVisualizer::getNumFrames() const {
    impl->output.wait();
    return impl->output.getNumDelivered();
}

OffscreenVisualizer& OffscreenVisualizer::setOldFrames(OldFrames old) {
    impl->output.setOldFrames(old);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setNumThreads(int numThreads) {
    impl->output.setNumThreads(numThreads);
    return *this;
}

int OffscreenVisualizer::getNumThreads() const {
    return impl->output.getNumThreads();
}

OffscreenVisualizer& OffscreenVisualizer::setFrameSink(const FrameSink& sink) {
    impl->output.setSink(sink);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addVideo(const std::string& file,
                                                   const VideoOptions& options) {
    impl->output.addVideo(file, options);
    return *this;
}

int OffscreenVisualizer::addPlot(const ProbePlot& plot, PlotSide side, int size) {
    return impl->plots.add(plot, side, size);
}

ProbePlot& OffscreenVisualizer::updPlot(int plot) {
    return impl->plots.upd(plot);
}

OffscreenVisualizer& OffscreenVisualizer::addDeformableMesh(const DeformableMesh& mesh) {
    if (!mesh.part || !mesh.getFramePose || !mesh.getModalCoordinates)
        throw std::invalid_argument(
            "addDeformableMesh: the part, getFramePose and getModalCoordinates must be given");
    Impl::Part part{mesh, extractSkinModes(mesh.part, impl->creaseAngle), nullptr, {}};
    if (part.mesh.name.empty()) part.mesh.name = mesh.part->name;
    part.field = impl->makeField(part, part.look, impl->partStyle.contour.contour);
    impl->parts.push_back(std::move(part));
    impl->forgetFit();
    return *this;
}

int OffscreenVisualizer::addDecoration(SimTK::MobilizedBodyIndex body, const Transform& X_BD,
                                       const SimTK::DecorativeGeometry& geometry) {
    SimTK::DecorativeGeometry copy = geometry;
    copy.setBodyId(body).setTransform(X_BD * geometry.getTransform());
    impl->decorations.push_back(copy);
    impl->forgetFit();
    return int(impl->decorations.size()) - 1;
}

int OffscreenVisualizer::addRubberBandLine(SimTK::MobilizedBodyIndex b1, const Vec3& station1,
                                           SimTK::MobilizedBodyIndex b2, const Vec3& station2,
                                           const SimTK::DecorativeLine& line) {
    impl->rubberBands.push_back({b1, b2, station1, station2, line});
    impl->forgetFit();
    return int(impl->rubberBands.size()) - 1;
}

int OffscreenVisualizer::addDecorationGenerator(SimTK::DecorationGenerator* generator) {
    if (!generator) throw std::invalid_argument("addDecorationGenerator: null generator");
    impl->generators.emplace_back(generator);
    impl->forgetFit();
    return int(impl->generators.size()) - 1;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraTransform(const Transform& X_GC) {
    impl->views.front().setTransform(X_GC);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::pointCameraAt(const Vec3& point,
                                                        const Vec3& upDirection) {
    impl->views.front().pointAt(point, upDirection);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraFieldOfView(Real fov) {
    impl->views.front().updSettings().setFieldOfView(fov);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraClippingPlanes(Real nearPlane, Real farPlane) {
    impl->views.front().updSettings().setClippingPlanes(nearPlane, farPlane);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::zoomCameraToShowAllGeometry() {
    impl->views.front().keepRotationOnly();
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraView(Real azimuth, Real elevation) {
    impl->views.front().updSettings().setDirection(azimuth, elevation);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraOrbit(Real rate) {
    impl->views.front().updSettings().setOrbit(rate);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraFollow(SimTK::MobilizedBodyIndex body, Real size,
                                                          CameraView::Follow follow) {
    impl->views.front().updSettings().setFollowedBody(body, size, follow);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraProjection(CameraView::Projection projection) {
    impl->views.front().updSettings().setProjection(projection);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCameraZoom(Real zoom) {
    impl->views.front().updSettings().setZoom(zoom);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCamera(const CameraView& view) {
    impl->views.front() = View(view);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addView(const CameraView& view) {
    impl->views.emplace_back(view);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::fitToMotion(const std::vector<SimTK::State>& states) {
    impl->fitToMotion(Impl::toMotion(states));
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::fitToMotion(const MotionRecorder& motion) {
    impl->fitToMotion(Impl::toMotion(motion));
    return *this;
}

Vec3 OffscreenVisualizer::calcPixel(const Vec3& point_G, int viewNumber) const {
    if (viewNumber < 0 || viewNumber >= int(impl->lastViews.size()))
        throw std::out_of_range("calcPixel: the frame drawn last has " +
                                std::to_string(impl->lastViews.size()) + " views, no number " +
                                std::to_string(viewNumber));
    const ViewSnapshot& view = impl->lastViews[viewNumber];
    return view.camera.calcPixel(point_G, view.width, view.height) + Vec3(view.left, view.top, 0);
}

OffscreenVisualizer& OffscreenVisualizer::setDeformationFactor(Real factor) {
    if (!(factor >= 0) || !std::isfinite(factor))
        throw std::invalid_argument("setDeformationFactor: " + std::to_string(factor) +
                                    " is not a finite number >= 0");
    impl->partStyle.deformationFactor = factor;
    impl->isFactorAutomatic = false;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setAutomaticDeformationFactor() {
    impl->isFactorAutomatic = true;
    return *this;
}

Real OffscreenVisualizer::getDeformationFactor() const {
    return impl->getDeformationFactor();
}

OffscreenVisualizer& OffscreenVisualizer::setContour(Contour contour) {
    impl->setContour(contour);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setContourRange(Real low, Real high) {
    if (!(low < high))
        throw std::invalid_argument("setContourRange: " + std::to_string(low) + " is not below " +
                                    std::to_string(high));
    impl->partStyle.contour.fixedLow = low;
    impl->partStyle.contour.fixedHigh = high;
    impl->partStyle.contour.isRangeFixed = true;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setContourRange(ContourRange range) {
    impl->partStyle.contour.range = range;
    impl->partStyle.contour.isRangeFixed = false;
    return *this;
}

Vec2 OffscreenVisualizer::getContourRange() const {
    return impl->output.getLastRange();
}

OffscreenVisualizer& OffscreenVisualizer::setColorMap(ColorMap map) {
    impl->partStyle.contour.colorMap = map;
    impl->partStyle.contour.isColorMapFixed = true;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowUndeformed(bool show) {
    impl->partStyle.showUndeformed = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowElementEdges(bool show) {
    impl->partStyle.showElementEdges = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowFeatureEdges(bool show) {
    impl->partStyle.showFeatureEdges = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setCreaseAngle(Real angle) {
    impl->creaseAngle = angle;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setTheme(Theme theme) {
    impl->theme = theme;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setLighting(Lighting lighting) {
    impl->lighting = lighting;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setLightDirection(const Vec3& towardsLight_G) {
    if (!(towardsLight_G.norm() > 0))
        throw std::invalid_argument("setLightDirection: the direction has no length");
    impl->lightDirection = towardsLight_G;
    impl->isLightFixed = true;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setBackgroundType(
    SimTK::Visualizer::BackgroundType background) {
    impl->hasGround = background == SimTK::Visualizer::GroundAndSky;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setBackgroundColor(const Vec3& color) {
    impl->solidColor = color;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setSystemUpDirection(
    const SimTK::CoordinateDirection& up) {
    impl->up = up;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setGroundHeight(Real height) {
    impl->groundHeight = height;
    impl->isGroundHeightFixed = true;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowAmbientOcclusion(bool show) {
    impl->showOcclusion = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowShadows(bool show) {
    impl->showShadows = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setTransparentBackground(bool isTransparent) {
    impl->isBackgroundTransparent = isTransparent;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowAxes(bool show) {
    impl->showAxes = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowScaleBar(bool show) {
    impl->showScaleBar = show;
    impl->isScaleBarChosen = true;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowSimTime(bool show) {
    impl->showSimTime = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowColorBar(bool show) {
    impl->showColorBar = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowDeformationFactor(bool show) {
    impl->showDeformationFactor = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowFrameNumber(bool show) {
    impl->showFrameNumber = show;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setWindowTitle(const std::string& title) {
    impl->title = title;
    return *this;
}

}  // namespace simflex
