#include "simflex/cli/shell/PictureSettings.h"

namespace simflex {
namespace cli {

void PictureSettings::resetCamera() {
    direction.reset();
    zoom.reset();
    followedFrame.clear();
    followedSize = 0;
    projection.reset();
}

void PictureSettings::apply(OffscreenVisualizer& visualizer,
                            const std::optional<Attachment>& frame) const {
    if (hasCamera()) {
        CameraView view;
        if (direction) view.setDirection((*direction)[0], (*direction)[1]);
        if (zoom) view.setZoom(*zoom);
        if (frame) view.setFollowedFrame(*frame, followedSize);
        if (projection) view.setProjection(*projection);
        visualizer.setCamera(view);
    }
    if (exaggeration && *exaggeration > 0) visualizer.setDeformationFactor(*exaggeration);
    if (exaggeration && *exaggeration == 0) visualizer.setAutomaticDeformationFactor();
    if (contour) visualizer.setContour(*contour);
    for (const Drawing& drawing : getDrawings()) {
        const auto found = shown.find(drawing.name);
        if (found != shown.end()) (visualizer.*drawing.show)(found->second);
    }
}

}  // namespace cli
}  // namespace simflex
