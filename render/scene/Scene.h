#pragma once
/** @file
One frame's worth of things to draw, in Ground. Internal to the renderer. **/

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

    /** Appends the corners of a box that holds the item. **/
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
    SimTK::Transform X_GT;  ///< text runs along x, letters stand along y
    double height = 1;      ///< of a capital letter [m]
    SimTK::Vec3 color;
    double opacity = 1;
    bool facesCamera = true;
    double widthFactor = 1;  ///< letters are so many times wider than the font's
    int line = 0;            ///< below the first, of a text of several lines

    static constexpr double lineSpacing = 1.7;  ///< in heights of a capital letter
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

    /** Appends points whose convex hull holds everything in the scene. **/
    void appendBounds(std::vector<SimTK::Vec3>& points_G) const;
    /** The same for surfaces and points only: lines are often arrows of forces, which come and go,
    and texts turn with the camera. **/
    void appendSolidBounds(std::vector<SimTK::Vec3>& points_G) const;
};

}  // namespace simflex
