#include "GlShapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <utility>

namespace simflex {

namespace {

const void* offsetOf(std::size_t numFloats) {
    return reinterpret_cast<const void*>(numFloats * sizeof(float));
}

// Tests whether every vertex lies behind the plane of every triangle. For most non-convex shapes
// the first planes fail.
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

// Maps each vertex to the first one at the same position.
std::vector<std::uint32_t> findFirstVertices(const SurfaceGeometry& geometry) {
    std::map<std::array<float, 3>, std::uint32_t> places;
    std::vector<std::uint32_t> first;
    for (int i = 0; i < geometry.numVertices(); ++i) {
        const float* p = &geometry.vertices[std::size_t(i) * SurfaceGeometry::floatsPerVertex];
        first.push_back(places.emplace(std::array<float, 3>{p[0], p[1], p[2]}, i).first->second);
    }
    return first;
}

std::vector<std::uint32_t> findEdges(const SurfaceGeometry& geometry) {
    const std::vector<std::uint32_t> first = findFirstVertices(geometry);
    std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (std::size_t i = 0; i < geometry.triangles.size(); ++i) {
        const std::uint32_t a = first[geometry.triangles[i]];
        const std::uint32_t b = first[geometry.triangles[i % 3 == 2 ? i - 2 : i + 1]];
        if (a != b) edges.insert(std::minmax(a, b));
    }
    std::vector<std::uint32_t> ends;
    for (const auto& [a, b] : edges) ends.insert(ends.end(), {a, b});
    return ends;
}

std::vector<std::uint32_t> findPoints(const SurfaceGeometry& geometry) {
    const std::vector<std::uint32_t> first = findFirstVertices(geometry);
    std::set<std::uint32_t> points;
    for (const std::uint32_t vertex : geometry.triangles) points.insert(first[vertex]);
    return {points.begin(), points.end()};
}

}  // namespace

GlShapes::~GlShapes() {
    for (const auto& entry : buffersOf) destroy(entry.second);
}

void GlShapes::destroy(const Buffers& buffers) {
    gl.DeleteVertexArrays(1, &buffers.vertexArray);
    gl.DeleteBuffers(1, &buffers.vertices);
    for (const Indices& indices : {buffers.triangles, buffers.featureEdges, buffers.elementEdges,
                                   buffers.skeletons[0], buffers.skeletons[1]})
        gl.DeleteBuffers(1, &indices.buffer);
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
        buffers.triangles = upload(geometry->triangles);
        buffers.featureEdges = upload(geometry->featureEdges);
        buffers.elementEdges = upload(geometry->elementEdges);
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

GlShapes::Indices GlShapes::upload(const std::vector<std::uint32_t>& indices) {
    Indices result;
    result.number = GLsizei(indices.size());
    gl.GenBuffers(1, &result.buffer);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, result.buffer);
    gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, GLsizeiptr(indices.size() * sizeof indices[0]),
                  indices.data(), GL_STATIC_DRAW);
    return result;
}

void GlShapes::draw(GLenum mode, const Buffers& buffers, const Indices& indices) {
    gl.BindVertexArray(buffers.vertexArray);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, indices.buffer);
    gl.DrawElements(mode, indices.number, GL_UNSIGNED_INT, nullptr);
}

void GlShapes::drawTriangles(const SurfaceGeometryPtr& geometry) {
    const Buffers& buffers = getBuffers(geometry);
    draw(GL_TRIANGLES, buffers, buffers.triangles);
}

void GlShapes::drawEdges(const SurfaceGeometryPtr& geometry, Edges kind) {
    const Buffers& buffers = getBuffers(geometry);
    draw(GL_LINES, buffers, kind == Edges::Feature ? buffers.featureEdges : buffers.elementEdges);
}

void GlShapes::drawSkeleton(const SurfaceGeometryPtr& geometry, Skeleton kind) {
    Buffers& buffers = getBuffers(geometry);
    Indices& indices = buffers.skeletons[int(kind)];
    if (!indices.buffer) {
        gl.BindVertexArray(buffers.vertexArray);
        indices = upload(kind == Skeleton::Edges ? findEdges(*geometry) : findPoints(*geometry));
    }
    draw(kind == Skeleton::Edges ? GL_LINES : GL_POINTS, buffers, indices);
}

bool GlShapes::isConvex(const SurfaceGeometryPtr& geometry) {
    Buffers& buffers = getBuffers(geometry);
    if (buffers.convexity == Convexity::Unknown)
        buffers.convexity = calcIsConvex(*geometry) ? Convexity::Convex : Convexity::Other;
    return buffers.convexity == Convexity::Convex;
}

void GlShapes::dropUnused() {
    // Not by reference count: other renderers may hold the same shape.
    constexpr int patience = 12;
    ++frame;
    for (auto entry = buffersOf.begin(); entry != buffersOf.end();) {
        const bool isUsed = frame - entry->second.lastUse <= patience;
        if (!isUsed) destroy(entry->second);
        entry = isUsed ? std::next(entry) : buffersOf.erase(entry);
    }
}

}  // namespace simflex
