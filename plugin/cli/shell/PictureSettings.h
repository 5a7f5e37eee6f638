#pragma once
/** @file
What the prompt's commands change of the model's pictures. **/

#include <optional>
#include <string>
#include <vector>

#include "simflex/render/OffscreenVisualizer.h"

namespace simflex {
namespace cli {

class PictureSettings {
public:
    /** @name Camera; as soon as one of these is given, it replaces the cameras of the model file.
     * **/
    /**@{**/
    std::optional<SimTK::Vec2> direction;  ///< azimuth and elevation [rad]
    std::optional<double> zoom;
    std::string followedBody;
    double followedSize = 0;  ///< [m]; 0: all of the scene
    std::optional<CameraView::Projection> projection;
    /**@}**/
    std::optional<double> exaggeration;  ///< 0: automatic
    std::optional<Contour> contour;

    bool hasCamera() const {
        return direction || zoom || !followedBody.empty() || projection.has_value();
    }
    void resetCamera();
    /** @param body  that the camera follows, if any **/
    void apply(OffscreenVisualizer& visualizer,
               std::optional<SimTK::MobilizedBodyIndex> body) const;
};

/** "front", "isometric" … and their directions. **/
struct NamedView {
    const char* name;
    double azimuth, elevation;  ///< [rad]
};
const std::vector<NamedView>& getNamedViews();

struct NamedContour {
    const char* name;
    Contour contour;
};
const std::vector<NamedContour>& getNamedContours();

}  // namespace cli
}  // namespace simflex
