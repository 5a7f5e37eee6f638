#pragma once
/** @file
What the prompt's commands change of the model's pictures. **/

#include <map>
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

/** "front", "isometric" … and their directions. **/
struct NamedView {
    const char* name;
    double azimuth, elevation;  ///< [rad]
};
const std::vector<NamedView>& getNamedViews();

/** What `draw` shows or hides; the same names as in `pictures` of a model file. **/
struct Drawing {
    const char* name;
    OffscreenVisualizer& (OffscreenVisualizer::*show)(bool);
};
const std::vector<Drawing>& getDrawings();

struct NamedContour {
    const char* name;
    Contour contour;
};
const std::vector<NamedContour>& getNamedContours();

}  // namespace cli
}  // namespace simflex
