#include "GlMarks.h"

#include <numeric>

#include "Shaders.h"

namespace simflex {

using SimTK::Vec3;

namespace {

// Moves marks in front of coincident surfaces [pixel sizes].
constexpr double forward = 1;

void append(std::vector<float>& out, const Vec3& v) {
    for (int k = 0; k < 3; ++k) out.push_back(float(v[k]));
}

}  // namespace

GlMarks::GlMarks(const GlFunctions& functions)
    : gl(functions),
      lineProgram(gl, shaders::lineVertex, shaders::colorFragment),
      pointProgram(gl, shaders::pointVertex, shaders::pointFragment) {
    gl.GenVertexArrays(1, &array);
    gl.GenBuffers(1, &buffer);
}

GlMarks::~GlMarks() {
    gl.DeleteVertexArrays(1, &array);
    gl.DeleteBuffers(1, &buffer);
}

void GlMarks::draw(const Scene& scene, const GlView& view) {
    gl.DepthFunc(GL_LEQUAL);
    gl.DepthMask(GL_TRUE);
    drawLines(scene, view, true);
    drawPoints(scene, view, true);
    gl.DepthMask(GL_FALSE);
    drawLines(scene, view, false);
    drawPoints(scene, view, false);
    gl.DepthFunc(GL_LESS);
}

void GlMarks::drawLines(const Scene& scene, const GlView& view, bool isOpaque) {
    data.clear();
    for (const LineItem& line : scene.lines) {
        if ((line.opacity >= 1) != isOpaque) continue;
        // Clip ends behind the camera at the near plane.
        Vec3 a = view.toCamera(line.start), b = view.toCamera(line.end);
        const double limit = -view.camera.nearPlane;
        if (a[2] > limit && b[2] > limit) continue;
        if (a[2] > limit) a += (limit - a[2]) / (b[2] - a[2]) * (b - a);
        if (b[2] > limit) b += (limit - b[2]) / (a[2] - b[2]) * (a - b);
        append(data, a);
        append(data, b);
        append(data, line.color);
        data.push_back(float(line.opacity));
        data.push_back(float(line.width * view.style.unit));
    }
    if (data.empty()) return;
    lineProgram.use();
    lineProgram.set("projection", view.projection);
    lineProgram.set("viewport", double(view.width), double(view.rows));
    lineProgram.set("shift", view.calcShift(forward));
    drawInstances({3, 3, 4, 1});
}

void GlMarks::drawPoints(const Scene& scene, const GlView& view, bool isOpaque) {
    data.clear();
    for (const PointItem& point : scene.points) {
        if ((point.opacity >= 1) != isOpaque) continue;
        append(data, view.toCamera(point.location));
        append(data, point.color);
        data.push_back(float(point.opacity));
        data.push_back(float(point.diameter * view.style.unit));
    }
    if (data.empty()) return;
    pointProgram.use();
    pointProgram.set("projection", view.projection);
    pointProgram.set("viewport", double(view.width), double(view.rows));
    pointProgram.set("shift", view.calcShift(forward));
    drawInstances({3, 4, 1});
}

// Draws a strip of four vertices for each group of floats in `data`.
void GlMarks::drawInstances(const std::vector<int>& sizes) {
    const int stride = std::accumulate(sizes.begin(), sizes.end(), 0);
    gl.BindVertexArray(array);
    gl.BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl.BufferData(GL_ARRAY_BUFFER, GLsizeiptr(data.size() * sizeof(float)), data.data(),
                  GL_STREAM_DRAW);
    std::size_t start = 0;
    for (GLuint i = 0; i < sizes.size(); ++i) {
        gl.EnableVertexAttribArray(i);
        gl.VertexAttribPointer(i, sizes[i], GL_FLOAT, GL_FALSE, GLsizei(stride * sizeof(float)),
                               reinterpret_cast<const void*>(start * sizeof(float)));
        gl.VertexAttribDivisor(i, 1);
        start += sizes[i];
    }
    gl.DrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, GLsizei(data.size() / stride));
}

}  // namespace simflex
