#include "simflex/cli/part/PartView.h"

#include <algorithm>

namespace simflex {
namespace cli {

SimTK::CoordinateAxis choosePartView(OffscreenVisualizer& visualizer, const ReducedBody& part) {
    SimTK::Vec3 lower(0), upper(0);  // include the centre of mass
    for (int node = 0; node < part.mesh.numNodes(); ++node) {
        const auto x = part.mesh.position(node);
        for (int axis = 0; axis < 3; ++axis) {
            lower[axis] = std::min(lower[axis], x[size_t(axis)]);
            upper[axis] = std::max(upper[axis], x[size_t(axis)]);
        }
    }
    const SimTK::Vec3 size = upper - lower;
    const int longest = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;

    // With y up, x runs across the picture and z towards the viewer; with z up, y runs away from
    // the viewer.
    const bool isAlongY = longest == 1;
    const SimTK::CoordinateAxis up =
        isAlongY ? SimTK::CoordinateAxis(SimTK::ZAxis) : SimTK::CoordinateAxis(SimTK::YAxis);
    visualizer.setSystemUpDirection(up);
    const double azimuth = longest == 0 ? 28 : 62, elevation = 26;
    visualizer.setCameraFieldOfView(18 * SimTK::Pi / 180);  // weak perspective
    visualizer.setCameraView(azimuth * SimTK::Pi / 180, elevation * SimTK::Pi / 180);
    return up;
}

}  // namespace cli
}  // namespace simflex
