#pragma once
/** @file
GPU buffers of shapes. Buffers are kept while frames use them; a changed shape is uploaded into its
existing buffers. Internal to the renderer. **/

#include <unordered_map>

#include "GlFunctions.h"
#include "simflex/render/scene/Primitives.h"

namespace simflex {

class GlShapes {
public:
    enum class Edges { Feature, Element };
    enum class Skeleton { Edges, Points };  ///< of the triangles, without duplicates

    explicit GlShapes(const GlFunctions& functions) : gl(functions) {}
    ~GlShapes();
    GlShapes(const GlShapes&) = delete;
    GlShapes& operator=(const GlShapes&) = delete;

    /** @name Draw with the current program **/
    /**@{**/
    void drawTriangles(const SurfaceGeometryPtr& geometry);
    void drawEdges(const SurfaceGeometryPtr& geometry, Edges kind);
    void drawSkeleton(const SurfaceGeometryPtr& geometry, Skeleton kind);
    /**@}**/

    /** Returns whether any straight line meets the surface at most twice, first from outside and
    then from inside. Returns false if the test is too expensive: for shapes with many or changing
    triangles. **/
    bool isConvex(const SurfaceGeometryPtr& geometry);

    /** Call after a frame: deletes buffers unused in the last few frames. **/
    void dropUnused();

private:
    enum class Convexity { Unknown, Convex, Other };
    struct Indices {
        GLuint buffer = 0;
        GLsizei number = 0;
    };
    struct Buffers {
        SurfaceGeometryPtr geometry;
        unsigned version = 0;
        GLuint vertexArray = 0, vertices = 0;
        Indices triangles, featureEdges, elementEdges;
        std::size_t vertexBytes = 0;
        Convexity convexity = Convexity::Unknown;
        Indices skeletons[2];  // created on demand
        int lastUse = 0;
    };

    Buffers& getBuffers(const SurfaceGeometryPtr& geometry);
    Indices upload(const std::vector<std::uint32_t>& indices);
    void draw(GLenum mode, const Buffers& buffers, const Indices& indices);
    void destroy(const Buffers& buffers);

    const GlFunctions& gl;
    std::unordered_map<const SurfaceGeometry*, Buffers> buffersOf;
    int frame = 0;
};

}  // namespace simflex
