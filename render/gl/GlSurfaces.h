#pragma once
/** @file
Draws surfaces with lighting, contour and edges. Internal to the renderer. **/

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

    /** Alpha convention of the shader's output. **/
    enum class Alpha { Straight, Premultiplied };

    /** Visible sides: both, or only the outer side of a closed surface. **/
    enum class Sides { Both, Outer };

    /** Call before the surfaces of a frame. **/
    void setColorMap(ColorMap map);

    void draw(const SurfaceItem& item, const GlView& view, Sides sides,
              Alpha alpha = Alpha::Straight);

    /** As above with the caller's program, which must be in use and consist of surfaceVertex and a
    fragment shader that calls calcShade(). **/
    void draw(const SurfaceItem& item, const GlView& view, Sides sides, GlProgram& program);

    /** Draws triangles, lines or points of an item, with the caller's program, whose vertex shader
    is surfaceVertex. **/
    void drawShape(const SurfaceItem& item, const GlView& view, Sides sides, GlProgram& program);

    void drawEdges(const SurfaceItem& item, const GlView& view);

    /** Opaque items show their outer side only. **/
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
