/** @file
Flexible bodies in OffscreenVisualizer. **/

#include "simflex/body/FlexibleBody.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "OffscreenVisualizerImpl.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

using SimTK::State;

OffscreenVisualizer& OffscreenVisualizer::addFlexibleBody(const FlexibleBody& body) {
    addDeformableMesh({body.getPartHandle(), body.getName(),
                       [body](const State& state) { return body.getFramePose(state); },
                       [body](const State& state) { return body.getModalCoordinates(state); },
                       [body](const State& state) { return body.getFrameVelocity(state); },
                       [body](const State& state) { return body.getModalSpeeds(state); }});
    impl->parts.back().body = body.getIndex();
    std::set<FlexibleBodyIndex> bodies;
    for (const Impl::Part& part : impl->parts)
        if (part.body.isValid()) bodies.insert(part.body);
    impl->drawn.setBodies(std::move(bodies));
    return *this;
}

namespace {

void checkLook(const BodyLook& look) {
    if (!(look.opacity > 0 && look.opacity <= 1))
        throw std::invalid_argument("setBodyLook: opacity must be above 0 and at most 1, not " +
                                    std::to_string(look.opacity) +
                                    "; to hide a body set isVisible to false");
}

}  // namespace

OffscreenVisualizer& OffscreenVisualizer::setBodyLook(const FlexibleBody& body,
                                                      const BodyLook& look) {
    checkLook(look);
    const auto part =
        std::find_if(impl->parts.begin(), impl->parts.end(), [&](const Impl::Part& other) {
            return other.body.isValid() && other.body == body.getIndex();
        });
    if (part == impl->parts.end())
        throw std::invalid_argument("setBodyLook: call addFlexibleBody() for body '" +
                                    body.getName() + "' first");
    part->field = impl->makeField(*part, look, impl->partStyle.contour.contour);
    part->look = look;
    impl->output.setValuesOfRun({});
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setBodyLook(SimTK::MobilizedBodyIndex body,
                                                      const BodyLook& look) {
    checkLook(look);
    impl->looks[body] = look;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setBodyName(SimTK::MobilizedBodyIndex body,
                                                      const std::string& name) {
    impl->bodyNames[body] = name;
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setReference(Reference reference) {
    impl->drawn.setMeanAxes(reference == Reference::MeanAxes);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setReference(const Attachment& frame) {
    if (!frame.isFlexible())
        throw std::invalid_argument(
            "setReference: displacements are measured on flexible bodies, '" + frame.getName() +
            "' is on a rigid one");
    impl->drawn.setReference(frame);
    impl->forgetFit();
    return *this;
}

SimTK::Transform OffscreenVisualizer::calcDrawnPose(const State& state,
                                                    const Attachment& frame) const {
    impl->system.realize(state, SimTK::Stage::Position);
    impl->drawn.update(impl->system, state, impl->getDeformationFactor());
    return impl->drawn.calcPose(frame);
}

int OffscreenVisualizer::addDecoration(const Attachment& frame,
                                       const SimTK::DecorativeGeometry& geometry) {
    impl->attachedDecorations.emplace_back(frame, geometry);
    impl->forgetFit();
    return int(impl->attachedDecorations.size()) - 1;
}

std::pair<std::string, SimTK::Real> OffscreenVisualizer::getLargestGap() const {
    return {impl->drawn.getLargestGap().joint, impl->drawn.getLargestGap().distance};
}

std::shared_ptr<const ContourField> OffscreenVisualizer::Impl::makeField(const Part& part,
                                                                         const BodyLook& look,
                                                                         Contour contour) const {
    if (contour == Contour::None || !look.isVisible || !look.hasContour) return nullptr;
    const ContourTraits& traits = getTraits(contour);
    if (traits.needsVelocity && (!part.mesh.getFrameVelocity || !part.mesh.getModalSpeeds))
        throw std::invalid_argument("cannot show " + std::string(traits.name) + " of body '" +
                                    part.mesh.name +
                                    "': its DeformableMesh has no getFrameVelocity or no "
                                    "getModalSpeeds; give both, or use addFlexibleBody()");
    return std::make_shared<const ContourField>(part.skin, contour, part.mesh.name);
}

void OffscreenVisualizer::Impl::setContour(Contour contour) {
    std::vector<std::shared_ptr<const ContourField>> fields;
    for (const Part& part : parts) fields.push_back(makeField(part, part.look, contour));
    for (std::size_t i = 0; i < parts.size(); ++i) parts[i].field = fields[i];
    if (contour != partStyle.contour.contour) output.setValuesOfRun({});
    partStyle.contour.contour = contour;
}

void OffscreenVisualizer::Impl::readVelocities(const Part& part, const State& state,
                                               PartSnapshot& snapshot) const {
    snapshot.V_GB = part.mesh.getFrameVelocity(state);
    snapshot.xiDot = part.mesh.getModalSpeeds(state);
    if (!snapshot.V_GB[0].isFinite() || !snapshot.V_GB[1].isFinite())
        throw std::runtime_error("the velocity of body '" + part.mesh.name + "' is not finite");
    for (int i = 0; i < snapshot.xiDot.size(); ++i)
        if (!std::isfinite(snapshot.xiDot[i]))
            throw std::runtime_error("modal speed " + std::to_string(i) + " of body '" +
                                     part.mesh.name + "' is not finite");
}

ColorBar OffscreenVisualizer::Impl::describeColorBar() const {
    const ContourTraits& traits = getTraits(partStyle.contour.contour);
    ColorBar bar;
    bar.quantity = traits.name;
    bar.reference = describeReference();
    bar.unit = traits.unit;
    bar.colorMap = partStyle.contour.getColorMap();
    for (const Part& part : parts) bar.hasGaps |= part.field && !part.field->isComplete();
    return bar;
}

// Describes the reference of displacements; empty: the mean axes of each part.
std::string OffscreenVisualizer::Impl::describeReference() const {
    const ContourTraits& traits = getTraits(partStyle.contour.contour);
    if (traits.needsStress || traits.needsVelocity) return "";
    std::vector<std::string> names;
    for (const Part& part : parts) {
        if (!part.field) continue;
        const std::string name = part.body.isValid() ? drawn.getReferenceName(part.body) : "";
        if (!name.empty()) names.push_back(name);
    }
    if (names.empty()) return "";
    return "from " + (names.size() == 1 ? names.front() : "each part's joint");
}

// Labels at the same position are placed below each other.
std::vector<OverlayContent::PlacedLabel> OffscreenVisualizer::Impl::placeLabels(
    const std::vector<Label>& labels, const ViewSnapshot& view) {
    const double lineHeight = 17 * view.unit, nearby = 45 * view.unit;
    std::vector<OverlayContent::PlacedLabel> placed;
    for (const Label& label : labels) {
        const SimTK::Vec3 pixel = view.camera.calcPixel(label.point_G, view.width, view.height);
        const bool isInView = pixel[2] > 0 && pixel[0] >= 0 && pixel[0] < view.width &&
                              pixel[1] >= 0 && pixel[1] < view.height;
        if (!isInView) continue;
        double y = pixel[1];
        const auto isTaken = [&](const OverlayContent::PlacedLabel& other) {
            return std::abs(other.x - pixel[0]) < nearby &&
                   std::abs(other.y - y) < 0.95 * lineHeight;
        };
        for (auto other = placed.begin(); other != placed.end();) {
            if (!isTaken(*other)) {
                ++other;
                continue;
            }
            y = other->y + lineHeight;
            other = placed.begin();
        }
        placed.push_back({label.text, pixel[0], y, label.color});
    }
    return placed;
}

OffscreenVisualizer& OffscreenVisualizer::setShowInterfaces(bool show) {
    impl->marks.settings.showInterfaces = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowJoints(bool show) {
    impl->marks.settings.showJoints = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addConnector(const DrawnConnector& connector) {
    impl->marks.forces.connectors.push_back(connector);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addLoad(const DrawnLoad& load) {
    impl->marks.forces.loads.push_back(load);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::addLoad(const DrawnSpreadLoad& load) {
    impl->marks.forces.spreadLoads.push_back(load);
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowConnectors(bool show) {
    impl->marks.forces.showConnectors = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowLoads(bool show) {
    impl->marks.forces.showLoads = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowReactions(bool show) {
    impl->marks.settings.showReactions = show;
    impl->forgetFit();
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setMultiplierSource(
    std::function<SimTK::Vector(const State&, const Joint&)> multipliers,
    std::function<SimTK::SpatialVec(const State&, const Joint&)> friction) {
    impl->marks.settings.multipliers = std::move(multipliers);
    impl->marks.settings.friction = std::move(friction);
    return *this;
}

OffscreenVisualizer& OffscreenVisualizer::setShowReactionValues(bool show) {
    impl->marks.settings.showReactionValues = show;
    return *this;
}

void OffscreenVisualizer::Impl::rememberFrame(const FrameSnapshot& snapshot) {
    lastFrame = std::make_unique<FrameSnapshot>(snapshot);
    picker.reset();
}

const SurfacePicker& OffscreenVisualizer::Impl::getPicker(const char* caller) {
    if (!lastFrame) throw std::logic_error(std::string(caller) + ": no frame has been drawn yet");
    if (!picker) picker = std::make_unique<SurfacePicker>(*lastFrame);
    return *picker;
}

std::optional<SurfacePoint> OffscreenVisualizer::pickNode(SimTK::Real column,
                                                          SimTK::Real row) const {
    const SurfacePicker& picker = impl->getPicker("pickNode");
    const std::optional<SurfacePicker::Hit> hit = picker.cast(column, row);
    if (!hit || hit->part < 0) return std::nullopt;
    const Impl::Part& part = impl->parts[std::size_t(hit->part)];
    SurfacePoint point;
    point.body = part.mesh.name;
    point.location_G = hit->location_G;
    point.distance = hit->distance;
    point.value = part.field ? hit->value : SimTK::NaN;
    const int node = part.skin->nodes[std::size_t(hit->skinNode)];
    point.nodeNumber = part.skin->part->mesh.nodeNumbers[std::size_t(node)];
    point.nodeLocation_G = picker.calcLocation(hit->part, hit->skinNode);
    point.nodeValue = picker.getValue(hit->part, hit->skinNode);
    return point;
}

NodeView OffscreenVisualizer::findNode(const std::string& body, int nodeNumber) const {
    const SurfacePicker& picker = impl->getPicker("findNode");
    const auto part = std::find_if(impl->parts.begin(), impl->parts.end(),
                                   [&](const Impl::Part& p) { return p.mesh.name == body; });
    if (part == impl->parts.end()) {
        std::string names;
        for (const Impl::Part& p : impl->parts)
            names += (names.empty() ? "'" : ", '") + p.mesh.name + "'";
        throw std::out_of_range("findNode: no flexible body '" + body + "' is drawn; there are " +
                                (names.empty() ? "none" : names));
    }
    const SkinModes& skin = *part->skin;
    const std::vector<int>& numbers = skin.part->mesh.nodeNumbers;
    const auto number = std::lower_bound(numbers.begin(), numbers.end(), nodeNumber);
    if (number == numbers.end() || *number != nodeNumber)
        throw std::out_of_range("findNode: body '" + body + "' has no node number " +
                                std::to_string(nodeNumber));
    const int node = int(number - numbers.begin()), index = int(part - impl->parts.begin());
    const auto place = std::lower_bound(skin.nodes.begin(), skin.nodes.end(), node);

    NodeView view;
    if (place == skin.nodes.end() || *place != node) {
        view.location_G = picker.calcInnerLocation(index, node);
        view.pixel = picker.calcPixel(view.location_G);
        return view;
    }
    const int skinNode = int(place - skin.nodes.begin());
    view.location_G = picker.calcLocation(index, skinNode);
    view.pixel = picker.calcPixel(view.location_G);
    view.value = picker.getValue(index, skinNode);
    view.isVisible = picker.isVisible(view.location_G);
    const ContourSettings& contour = impl->partStyle.contour;
    const SimTK::Vec2 range = impl->output.getLastRange();
    view.color =
        std::isnan(view.value)
            ? gapColor
            : calcColor(contour.getColorMap(), (view.value - range[0]) / (range[1] - range[0]));
    return view;
}

}  // namespace simflex
