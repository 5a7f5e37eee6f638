/** @file
What OffscreenVisualizer shows of flexible bodies. **/

#include "simflex/body/FlexibleBody.h"

#include <cmath>
#include <stdexcept>

#include "OffscreenVisualizerImpl.h"
#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

using SimTK::State;

OffscreenVisualizer& OffscreenVisualizer::addFlexibleBody(const FlexibleBody& body) {
    return addDeformableMesh(
        {body.getPartHandle(), body.getName(),
         [body](const State& state) { return body.getFramePose(state); },
         [body](const State& state) { return body.getModalCoordinates(state); },
         [body](const State& state) { return body.getFrameVelocity(state); },
         [body](const State& state) { return body.getModalSpeeds(state); }});
}

std::shared_ptr<const ContourField> OffscreenVisualizer::Impl::makeField(const Part& part,
                                                                         Contour contour) const {
    if (contour == Contour::None) return nullptr;
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
    for (const Part& part : parts) fields.push_back(makeField(part, contour));
    for (std::size_t i = 0; i < parts.size(); ++i) parts[i].field = fields[i];
    if (contour != partStyle.contour.contour) valuesOfRun = {};
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
    bar.dimension = traits.dimension;
    bar.colorMap = partStyle.contour.getColorMap();
    for (const Part& part : parts) bar.hasGaps |= part.field && !part.field->isComplete();
    return bar;
}

}  // namespace simflex
