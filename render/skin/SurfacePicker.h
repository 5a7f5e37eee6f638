#pragma once
/** @file
Finds the surface under a pixel by casting a ray against the surfaces of a frame, without OpenGL.
Internal. Opaque surfaces of other parts and of decorations hide objects behind them; ghosts,
transparent surfaces, lines and texts hide nothing. O(triangles) per ray. **/

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
        int skinNode = -1;  ///< nearest skin node
    };

    /** Returns the first opaque surface at a position in the picture [pixel], in any view. **/
    std::optional<Hit> cast(double x, double y) const;

    /** Drawn location and value of a skin node. **/
    SimTK::Vec3 calcLocation(int part, int skinNode) const;
    double getValue(int part, int skinNode) const;
    /** Returns the location of any mesh node of a part, by mesh index. **/
    SimTK::Vec3 calcInnerLocation(int part, int node) const;

    /** Returns column and row of a point in the frame and its distance, in the first view. **/
    SimTK::Vec3 calcPixel(const SimTK::Vec3& point_G) const;
    bool isVisible(const SimTK::Vec3& point_G) const;

private:
    struct Ray {
        SimTK::Vec3 origin, direction;  ///< of unit length along the view direction
    };
    Ray calcRay(const ViewSnapshot& view, double x, double y) const;
    int findVertex(int part, int skinNode) const;
    void intersect(const Ray& ray_G, const SurfaceItem& item, int part, Hit& nearest) const;

    FrameSnapshot snapshot;
    FramePainter painter;  // used for deformation only
    Scene partScene;       // one item per part
};

}  // namespace simflex
