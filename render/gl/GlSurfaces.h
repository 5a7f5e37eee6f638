#pragma once
/** @file
Draws surfaces with light, contour and edges. Internal to the renderer. **/

#include "GlProgram.h"
#include "GlShapes.h"
#include "GlView.h"
#include "simflex/render/scene/Scene.h"

namespace simflex {

class GlSurfaces {
public:
    explicit GlSurfaces(const GlFunctions& gl);
    ~GlSurfaces();
    GlSurfaces(const GlSurfaces&) = delete;
    GlSurfaces& operator=(const GlSurfaces&) = delete;

    /** How a colour leaves the shader. **/
    enum class Alpha { Straight, Premultiplied };

    /** Both sides of the surface, or only the outer side of a closed one. **/
    enum class Sides { Both, Outer };

    /** Call before the surfaces of a frame. **/
    void setColorMap(ColorMap map);

    void draw(const SurfaceItem& item, const GlView& view, Sides sides,
              Alpha alpha = Alpha::Straight);

    /** The same with a program of the caller's, which is in use: surfaceVertex and what calls
    calcShade(). **/
    void draw(const SurfaceItem& item, const GlView& view, Sides sides, GlProgram& program);

    /** Triangles, lines or points of an item, with a program of the caller's whose
    vertex shader is surfaceVertex. **/
    void drawShape(const SurfaceItem& item, const GlView& view, Sides sides, GlProgram& program);

    void drawEdges(const SurfaceItem& item, const GlView& view);

    /** What is opaque shows only its outer side. **/
    static Sides chooseSides(const SurfaceItem& item);

    GlShapes& updShapes() { return shapes; }

private:
    void drawRepresentation(const SurfaceItem& item, Sides sides);

    const GlFunctions& gl;
    GlShapes shapes;
    GlProgram surfaceProgram, fineSurfaceProgram, edgeProgram;
    GLuint colorMapTexture = 0;
    double maxLineWidth = 1;
    int loadedColorMap = -1;
};

}  // namespace simflex
