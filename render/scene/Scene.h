#pragma once
/** @file
Objects of one frame, in Ground. Internal to the renderer. **/

#include <string>
#include <vector>

#include "Primitives.h"
#include "SimTKcommon.h"

namespace simflex {

struct SurfaceItem {
    enum class Style { Solid, Contour, Ghost };

    SurfaceGeometryPtr geometry;
    SimTK::Transform X_GM;  ///< pose of the geometry's frame
    SimTK::Vec3 scale{1};   ///< along the geometry's axes
    SimTK::Vec3 color{0.7};
    double opacity = 1;
    Style style = Style::Solid;
    SimTK::DecorativeGeometry::Representation representation =
        SimTK::DecorativeGeometry::DrawSurface;
    bool showFeatureEdges = false;
    bool showElementEdges = false;

    bool isTransparent() const { return opacity < 1 || style == Style::Ghost; }

    /** Appends the corners of the item's bounding box. **/
    void appendBounds(std::vector<SimTK::Vec3>& points_G) const;
};

struct LineItem {
    SimTK::Vec3 start, end;
    SimTK::Vec3 color;
    double opacity = 1;
    double width = 1.5;  ///< pixels
};

struct PointItem {
    SimTK::Vec3 location;
    SimTK::Vec3 color;
    double opacity = 1;
    double diameter = 6;  ///< pixels
};

struct TextItem {
    std::string text;
    SimTK::Transform X_GT;  ///< text runs along x, its height along y
    double height = 1;      ///< of a capital letter [m]
    SimTK::Vec3 color;
    double opacity = 1;
    bool facesCamera = true;
    double widthFactor = 1;  ///< width of letters relative to the font
    int line = 0;            ///< index in a text of several lines

    static constexpr double lineSpacing = 1.7;  ///< relative to the height of a capital letter
};

struct Scene {
    std::vector<SurfaceItem> surfaces;
    std::vector<LineItem> lines;
    std::vector<PointItem> points;
    std::vector<TextItem> texts;
    std::vector<std::string> screenTexts;

    bool isEmpty() const {
        return surfaces.empty() && lines.empty() && points.empty() && texts.empty();
    }
    void clear() { *this = Scene(); }

    /** Appends points whose convex hull contains the whole scene. **/
    void appendBounds(std::vector<SimTK::Vec3>& points_G) const;
    /** As appendBounds(), for surfaces and points only: lines are often force arrows, which appear
    and disappear, and texts turn with the camera. **/
    void appendSolidBounds(std::vector<SimTK::Vec3>& points_G) const;
};

}  // namespace simflex
