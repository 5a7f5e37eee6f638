#include "simflex/body/FlexibleBody.h"

#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {

OffscreenVisualizer& OffscreenVisualizer::addFlexibleBody(const FlexibleBody& body) {
    return addDeformableMesh(
        {body.getPartHandle(), body.getName(),
         [body](const SimTK::State& state) { return body.getFramePose(state); },
         [body](const SimTK::State& state) { return body.getModalCoordinates(state); }});
}

}  // namespace simflex
