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

const std::vector<Drawing>& getDrawings() {
    using Visualizer = OffscreenVisualizer;
    static const std::vector<Drawing> drawings = {
        {"joints", &Visualizer::setShowJoints},
        {"connectors", &Visualizer::setShowConnectors},
        {"loads", &Visualizer::setShowLoads},
        {"reactions", &Visualizer::setShowReactions},
        {"ghost", &Visualizer::setShowUndeformed},
        {"wireframe", &Visualizer::setShowElementEdges},
        {"axes", &Visualizer::setShowAxes},
        {"shadows", &Visualizer::setShowShadows},
        {"ambient_occlusion", &Visualizer::setShowAmbientOcclusion}};
    return drawings;
}

const std::vector<NamedView>& getNamedViews() {
    constexpr double Pi = 3.14159265358979323846;
    static const std::vector<NamedView> views = {
        {"front", 0, 0},        {"back", Pi, 0},
        {"left", -Pi / 2, 0},   {"right", Pi / 2, 0},
        {"side", Pi / 2, 0},    {"top", 0, Pi / 2},
        {"bottom", 0, -Pi / 2}, {"isometric", Pi / 4, 0.6154797086703873}};
    return views;
}

const std::vector<NamedContour>& getNamedContours() {
    static const std::vector<NamedContour> contours = {
        {"none", Contour::None},
        {"displacement", Contour::Displacement},
        {"displacement_x", Contour::DisplacementX},
        {"displacement_y", Contour::DisplacementY},
        {"displacement_z", Contour::DisplacementZ},
        {"speed", Contour::Speed},
        {"velocity_x", Contour::VelocityX},
        {"velocity_y", Contour::VelocityY},
        {"velocity_z", Contour::VelocityZ},
        {"strain_energy", Contour::StrainEnergyDensity},
        {"von_mises", Contour::VonMises},
        {"signed_von_mises", Contour::SignedVonMises},
        {"principal_1", Contour::LargestPrincipalStress},
        {"principal_3", Contour::SmallestPrincipalStress}};
    return contours;
}

}  // namespace cli
}  // namespace simflex
