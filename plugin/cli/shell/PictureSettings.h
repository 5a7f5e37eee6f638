#pragma once
/** @file
What the prompt's commands change of the model's pictures. **/

#include <map>
#include <optional>
#include <string>

#include "simflex/model/pictures/Pictures.h"

namespace simflex {
namespace cli {

using namespace model;

class PictureSettings {
public:
    /** @name Camera; as soon as one of these is given, it replaces the cameras of the model file.
     * **/
    /**@{**/
    std::optional<SimTK::Vec2> direction;  ///< azimuth and elevation [rad]
    std::optional<double> zoom;
    std::string followedFrame;
    double followedSize = 0;  ///< [m]; 0: all of the scene
    std::optional<CameraView::Projection> projection;
    /**@}**/
    std::optional<double> exaggeration;  ///< 0: automatic
    std::optional<Contour> contour;
    std::map<std::string, bool> shown;  ///< what `draw` has changed, by names of getDrawings()

    bool hasCamera() const {
        return direction || zoom || !followedFrame.empty() || projection.has_value();
    }
    void resetCamera();
    /** @param frame  that the camera follows, if any **/
    void apply(OffscreenVisualizer& visualizer, const std::optional<Attachment>& frame) const;
};

}  // namespace cli
}  // namespace simflex
