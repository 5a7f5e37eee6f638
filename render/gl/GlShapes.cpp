#include "GlShapes.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace simflex {

namespace {

const void* offsetOf(std::size_t numFloats) {
    return reinterpret_cast<const void*>(numFloats * sizeof(float));
}

// Every vertex lies behind the plane of every triangle. Of most other shapes, the first planes show
// that it is not so.
bool calcIsConvex(const SurfaceGeometry& geometry) {
    constexpr std::size_t manyPairs = 400'000'000;
    const std::size_t numVertices = geometry.numVertices();
    if (numVertices * (geometry.triangles.size() / 3) > manyPairs) return false;

    constexpr int stride = SurfaceGeometry::floatsPerVertex;
    std::vector<float> x(numVertices), y(numVertices), z(numVertices);
    for (std::size_t i = 0; i < numVertices; ++i) {
        x[i] = geometry.vertices[stride * i];
        y[i] = geometry.vertices[stride * i + 1];
        z[i] = geometry.vertices[stride * i + 2];
    }
    const auto position = [&](std::size_t i) { return SimTK::Vec3(x[i], y[i], z[i]); };
    const double tolerance = 1e-5 * (geometry.upper - geometry.lower).norm();
    for (std::size_t t = 0; t + 2 < geometry.triangles.size(); t += 3) {
        const SimTK::Vec3 a = position(geometry.triangles[t]);
        SimTK::Vec3 normal = SimTK::cross(position(geometry.triangles[t + 1]) - a,
                                          position(geometry.triangles[t + 2]) - a);
        const double area = normal.norm();
        if (!(area > tolerance * tolerance)) continue;
        normal /= area;
        const float nx = float(normal[0]), ny = float(normal[1]), nz = float(normal[2]);
        const float limit = float(SimTK::dot(normal, a) + tolerance);
        int numBefore = 0;
        for (std::size_t i = 0; i < numVertices; ++i)
            numBefore += nx * x[i] + ny * y[i] + nz * z[i] > limit;
        if (numBefore > 0) return false;
    }
    return true;
}

}  // namespace

GlShapes::~GlShapes() {
    for (const auto& entry : buffersOf) destroy(entry.second);
}

void GlShapes::destroy(const Buffers& buffers) {
    gl.DeleteVertexArrays(1, &buffers.vertexArray);
    for (const GLuint buffer :
         {buffers.vertices, buffers.triangles, buffers.featureEdges, buffers.elementEdges})
        gl.DeleteBuffers(1, &buffer);
}

GlShapes::Buffers& GlShapes::getBuffers(const SurfaceGeometryPtr& geometry) {
    Buffers& buffers = buffersOf[geometry.get()];
    buffers.lastUse = frame;
    if (!buffers.geometry) {
        buffers.geometry = geometry;
        gl.GenVertexArrays(1, &buffers.vertexArray);
        gl.BindVertexArray(buffers.vertexArray);
        gl.GenBuffers(1, &buffers.vertices);
        gl.BindBuffer(GL_ARRAY_BUFFER, buffers.vertices);
        constexpr GLsizei stride = SurfaceGeometry::floatsPerVertex * sizeof(float);
        gl.EnableVertexAttribArray(0);
        gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, offsetOf(0));
        gl.EnableVertexAttribArray(1);
        gl.VertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, stride, offsetOf(3));
        gl.EnableVertexAttribArray(2);
        gl.VertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, stride, offsetOf(6));
        const auto upload = [this](GLuint& buffer, const std::vector<std::uint32_t>& indices) {
            gl.GenBuffers(1, &buffer);
            gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffer);
            gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(indices.size() * sizeof indices[0]),
                          indices.data(), GL_STATIC_DRAW);
        };
        upload(buffers.triangles, geometry->triangles);
        upload(buffers.featureEdges, geometry->featureEdges);
        upload(buffers.elementEdges, geometry->elementEdges);
    }
    if (buffers.version != geometry->version) {
        const std::size_t bytes = geometry->vertices.size() * sizeof(float);
        gl.BindBuffer(GL_ARRAY_BUFFER, buffers.vertices);
        if (bytes == buffers.vertexBytes)
            gl.BufferSubData(GL_ARRAY_BUFFER, 0, GLsizeiptr(bytes), geometry->vertices.data());
        else
            gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(bytes), geometry->vertices.data(),
                          GL_DYNAMIC_DRAW);
        if (buffers.version != 0) buffers.convexity = Convexity::Other;
        buffers.vertexBytes = bytes;
        buffers.version = geometry->version;
    }
    return buffers;
}

void GlShapes::drawTriangles(const SurfaceGeometryPtr& geometry) {
    const Buffers& buffers = getBuffers(geometry);
    gl.BindVertexArray(buffers.vertexArray);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers.triangles);
    gl.DrawElements(GL_TRIANGLES, GLsizei(geometry->triangles.size()), GL_UNSIGNED_INT, nullptr);
}

void GlShapes::drawEdges(const SurfaceGeometryPtr& geometry, Edges kind) {
    const Buffers& buffers = getBuffers(geometry);
    const bool isFeature = kind == Edges::Feature;
    gl.BindVertexArray(buffers.vertexArray);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, isFeature ? buffers.featureEdges : buffers.elementEdges);
    gl.DrawElements(
        GL_LINES,
        GLsizei(isFeature ? geometry->featureEdges.size() : geometry->elementEdges.size()),
        GL_UNSIGNED_INT, nullptr);
}

bool GlShapes::isConvex(const SurfaceGeometryPtr& geometry) {
    Buffers& buffers = getBuffers(geometry);
    if (buffers.convexity == Convexity::Unknown)
        buffers.convexity = calcIsConvex(*geometry) ? Convexity::Convex : Convexity::Other;
    return buffers.convexity == Convexity::Convex;
}

void GlShapes::dropUnused() {
    // Not by the number of owners: other renderers may hold the same shape.
    constexpr int patience = 12;
    ++frame;
    for (auto entry = buffersOf.begin(); entry != buffersOf.end();) {
        const bool isUsed = frame - entry->second.lastUse <= patience;
        if (!isUsed) destroy(entry->second);
        entry = isUsed ? std::next(entry) : buffersOf.erase(entry);
    }
}

}  // namespace simflex
