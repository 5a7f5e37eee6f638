#include <algorithm>
#include <ostream>
#include <stdexcept>

#include "OffscreenVisualizerImpl.h"
#include "simflex/render/FrameController.h"
#include "simflex/render/InputSilo.h"
#include "simflex/render/OffscreenVisualizer.h"

// The window-related part of SimTK::Visualizer's interface, and access to added objects.

namespace simflex {

using SimTK::Real;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

template <class Container>
auto& getItem(Container& items, int i, const char* what) {
    if (i < 0 || i >= int(items.size()))
        throw std::out_of_range(std::string("OffscreenVisualizer has ") +
                                std::to_string(items.size()) + " " + what +
                                ", there is no number " + std::to_string(i));
    return items[std::size_t(i)];
}

}  // namespace

OffscreenVisualizer::OffscreenVisualizer(std::shared_ptr<Impl> shared) : impl(std::move(shared)) {}

int OffscreenVisualizer::addFrameController(FrameController* controller) {
    if (!controller) throw std::invalid_argument("addFrameController: null controller");
    impl->controllers.emplace_back(controller);
    return int(impl->controllers.size()) - 1;
}

int OffscreenVisualizer::getNumDecorations() const {
    return int(impl->decorations.size());
}
int OffscreenVisualizer::getNumRubberBandLines() const {
    return int(impl->rubberBands.size());
}
int OffscreenVisualizer::getNumDecorationGenerators() const {
    return int(impl->generators.size());
}
int OffscreenVisualizer::getNumFrameControllers() const {
    return int(impl->controllers.size());
}
int OffscreenVisualizer::getNumInputListeners() const {
    return int(impl->listeners.size());
}

const SimTK::DecorativeGeometry& OffscreenVisualizer::getDecoration(int i) const {
    return getItem(impl->decorations, i, "decorations");
}
SimTK::DecorativeGeometry& OffscreenVisualizer::updDecoration(int i) const {
    return getItem(impl->decorations, i, "decorations");
}
const SimTK::DecorativeLine& OffscreenVisualizer::getRubberBandLine(int i) const {
    return getItem(impl->rubberBands, i, "rubber band lines").line;
}
SimTK::DecorativeLine& OffscreenVisualizer::updRubberBandLine(int i) const {
    return getItem(impl->rubberBands, i, "rubber band lines").line;
}
const SimTK::DecorationGenerator& OffscreenVisualizer::getDecorationGenerator(int i) const {
    return *getItem(impl->generators, i, "decoration generators");
}
SimTK::DecorationGenerator& OffscreenVisualizer::updDecorationGenerator(int i) {
    return *getItem(impl->generators, i, "decoration generators");
}
const OffscreenVisualizer::FrameController& OffscreenVisualizer::getFrameController(int i) const {
    return *getItem(impl->controllers, i, "frame controllers");
}
OffscreenVisualizer::FrameController& OffscreenVisualizer::updFrameController(int i) {
    return *getItem(impl->controllers, i, "frame controllers");
}
const OffscreenVisualizer::InputListener& OffscreenVisualizer::getInputListener(int i) const {
    return *getItem(impl->listeners, i, "input listeners");
}
OffscreenVisualizer::InputListener& OffscreenVisualizer::updInputListener(int i) {
    return *getItem(impl->listeners, i, "input listeners");
}

Real OffscreenVisualizer::getGroundHeight() const {
    return impl->isGroundHeightFixed ? impl->groundHeight : SimTK::NaN;
}
SimTK::CoordinateDirection OffscreenVisualizer::getSystemUpDirection() const {
    return impl->up;
}
const SimTK::System& OffscreenVisualizer::getSystem() const {
    return impl->system;
}

OffscreenVisualizer& OffscreenVisualizer::setMode(Mode mode) {
    impl->window.mode = mode;
    return *this;
}
OffscreenVisualizer::Mode OffscreenVisualizer::getMode() const {
    return impl->window.mode;
}
OffscreenVisualizer& OffscreenVisualizer::setDesiredFrameRate(Real framesPerSec) {
    impl->window.frameRate = std::max(framesPerSec, 0.0);
    return *this;
}
Real OffscreenVisualizer::getDesiredFrameRate() const {
    return impl->window.frameRate;
}
OffscreenVisualizer& OffscreenVisualizer::setRealTimeScale(Real simTimePerRealSecond) {
    impl->window.realTimeScale = simTimePerRealSecond > 0 ? simTimePerRealSecond : 1;
    return *this;
}
Real OffscreenVisualizer::getRealTimeScale() const {
    return impl->window.realTimeScale;
}
OffscreenVisualizer& OffscreenVisualizer::setDesiredBufferLengthInSec(Real length) {
    impl->window.bufferLength = length;
    return *this;
}
Real OffscreenVisualizer::getDesiredBufferLengthInSec() const {
    constexpr Real defaultLength = 0.15;
    return impl->window.bufferLength < 0 ? defaultLength : impl->window.bufferLength;
}
OffscreenVisualizer& OffscreenVisualizer::setShutdownWhenDestructed(bool shouldShutdown) {
    impl->window.shutsDownWhenDestructed = shouldShutdown;
    return *this;
}
bool OffscreenVisualizer::getShutdownWhenDestructed() const {
    return impl->window.shutsDownWhenDestructed;
}

OffscreenVisualizer& OffscreenVisualizer::addMenu(
    const SimTK::String&, int id, const SimTK::Array_<std::pair<SimTK::String, int>>& items) {
    for (const auto& item : items) impl->window.menuItems.emplace_back(id, item.second);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addSlider(const SimTK::String& title, int id, Real min,
                                                    Real max, Real value) {
    if (!(min <= value && value <= max))
        throw std::invalid_argument("addSlider: value " + std::to_string(value) + " of slider '" +
                                    title + "' is not in its range, " + std::to_string(min) +
                                    " to " + std::to_string(max));
    impl->window.sliderOrder.push_back(id);
    impl->window.sliders[id] = {min, max, value};
    return *this;
}

const OffscreenVisualizer& OffscreenVisualizer::setSliderValue(int slider, Real value) const {
    const auto found = impl->window.sliders.find(slider);
    if (found != impl->window.sliders.end())
        found->second.value = SimTK::clamp(found->second.low, value, found->second.high);
    return *this;
}

const OffscreenVisualizer& OffscreenVisualizer::setSliderRange(int slider, Real newMin,
                                                               Real newMax) const {
    if (!(newMin <= newMax))
        throw std::invalid_argument("setSliderRange: " + std::to_string(newMin) + " is above " +
                                    std::to_string(newMax));
    const auto found = impl->window.sliders.find(slider);
    if (found != impl->window.sliders.end())
        found->second = {newMin, newMax, SimTK::clamp(newMin, found->second.value, newMax)};
    return *this;
}

int OffscreenVisualizer::addInputListener(InputListener* listener) {
    if (!listener) throw std::invalid_argument("addInputListener: null listener");
    impl->listeners.emplace_back(listener);
    if (auto* silo = dynamic_cast<InputSilo*>(listener)) silo->window = &impl->window;
    return int(impl->listeners.size()) - 1;
}

void OffscreenVisualizer::dumpStats(std::ostream& out) const {
    out << "OffscreenVisualizer: " << getNumFrames() << " frames of " << getWidth() << "x"
        << getHeight() << " written to " << getOutputFolder() << "\n";
}

const OffscreenVisualizer& OffscreenVisualizer::setCameraTransform(const Transform& X_GC) const {
    OffscreenVisualizer(*this).setCameraTransform(X_GC);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::pointCameraAt(const Vec3& point,
                                                              const Vec3& upDirection) const {
    OffscreenVisualizer(*this).pointCameraAt(point, upDirection);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setCameraFieldOfView(Real fov) const {
    OffscreenVisualizer(*this).setCameraFieldOfView(fov);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setCameraClippingPlanes(Real nearPlane,
                                                                        Real farPlane) const {
    OffscreenVisualizer(*this).setCameraClippingPlanes(nearPlane, farPlane);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::zoomCameraToShowAllGeometry() const {
    OffscreenVisualizer(*this).zoomCameraToShowAllGeometry();
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setBackgroundColor(const Vec3& color) const {
    OffscreenVisualizer(*this).setBackgroundColor(color);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setShowShadows(bool show) const {
    OffscreenVisualizer(*this).setShowShadows(show);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setShowSimTime(bool show) const {
    OffscreenVisualizer(*this).setShowSimTime(show);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setShowFrameNumber(bool show) const {
    OffscreenVisualizer(*this).setShowFrameNumber(show);
    return *this;
}
const OffscreenVisualizer& OffscreenVisualizer::setWindowTitle(const std::string& title) const {
    OffscreenVisualizer(*this).setWindowTitle(title);
    return *this;
}

}  // namespace simflex
