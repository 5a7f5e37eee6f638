#pragma once
/** @file
What is under a pixel: a ray cast against the surfaces of a frame, without OpenGL. Internal.

Opaque surfaces of other parts and of decorations hide what is behind them; ghosts, transparent
things, lines and texts hide nothing. O(triangles) a ray. **/

#include <optional>

#include "simflex/render/frame/FramePainter.h"

namespace simflex {

class SurfacePicker {
public:
    /** Deforms the parts of a frame. **/
    explicit SurfacePicker(const FrameSnapshot& frame);

    struct Hit {
        int part = -1;  ///< −1: a decoration
        SimTK::Vec3 location_G{0};
        double distance = 0;  ///< along the view direction [m]
        double value = SimTK::NaN;
        int skinNode = -1;  ///< nearest
    };

    /** The first opaque surface under a point of the picture [pixel], in whichever view it is. **/
    std::optional<Hit> cast(double x, double y) const;

    /** Location of a skin node as drawn, and its value. **/
    SimTK::Vec3 calcLocation(int part, int skinNode) const;
    double getValue(int part, int skinNode) const;
    /** Location of any mesh node of a part, given by its index. **/
    SimTK::Vec3 calcInnerLocation(int part, int node) const;

    /** Column and row in the frame and distance of a point, in the first view. **/
    SimTK::Vec3 calcPixel(const SimTK::Vec3& point_G) const;
    bool isVisible(const SimTK::Vec3& point_G) const;

private:
    struct Ray {
        SimTK::Vec3 origin, direction;  ///< of length 1 along the view direction
    };
    Ray calcRay(const ViewSnapshot& view, double x, double y) const;
    int findVertex(int part, int skinNode) const;
    void intersect(const Ray& ray_G, const SurfaceItem& item, int part, Hit& nearest) const;

    FrameSnapshot snapshot;
    FramePainter painter;  // never paints
    Scene partScene;       // one item a part
};

}  // namespace simflex
