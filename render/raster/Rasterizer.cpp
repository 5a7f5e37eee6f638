#include "Rasterizer.h"

#include <omp.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "LitPoints.h"
#include "Spans.h"

namespace simflex {
namespace raster {

using SimTK::Transform;
using SimTK::Vec3;

namespace {

constexpr std::uint32_t none = 0xffffffffu;
constexpr std::size_t vertexFloats = 7;  // of a mesh's: x, y, z, 1/w, normal in camera frame
constexpr std::size_t trianglesPerChunk = 2048;
constexpr int lanes = 8;            // of spans
constexpr int mostPixels = 16384;   // on a side; larger pictures are OpenGL's to refuse
constexpr double forwardMarks = 1;  // marks on a surface win against it [pixel sizes]

std::uint32_t divide255(std::uint32_t x) {
    return (x + 128 + ((x + 128) >> 8)) >> 8;
}

/** Lays a colour over a sample, whose own is multiplied by its alpha. **/
std::uint32_t layOver(std::uint32_t below, std::uint32_t color, std::uint32_t alpha) {
    const std::uint32_t rest = 255 - alpha;
    std::uint32_t result = 0;
    for (const int shift : {0, 8, 16})
        result |= divide255((color >> shift & 255) * alpha + (below >> shift & 255) * rest)
                  << shift;
    return result | (alpha + divide255((below >> 24) * rest)) << 24;
}

std::uint32_t packColor(const Vec3& color, double alpha) {
    const auto byte = [](double x) {
        return std::uint32_t(std::lround(255 * std::min(std::max(x, 0.0), 1.0)));
    };
    return raster::packColor(byte(color[0]), byte(color[1]), byte(color[2]), byte(alpha));
}

}  // namespace

/** From camera frame to the picture, or to a part of it. **/
struct Projector {
    float p0, p5, p10, p14;
    bool isPerspective;
    float left, top, width, height;  // of the part [pixel]

    explicit Projector(const GlView& view, double partLeft = 0, double partTop = 0)
        : p0(view.projection[0]),
          p5(view.projection[5]),
          p10(view.projection[10]),
          p14(view.projection[14]),
          isPerspective(view.isPerspective),
          left(float(partLeft)),
          top(float(partTop)),
          width(float(view.width)),
          height(float(view.height)) {}

    /** x, y [pixel], depth 0 … 1, 1/w. **/
    void project(float x, float y, float z, float* out) const {
        const float w = isPerspective ? 1 / -z : 1;
        out[0] = left + (0.5f + 0.5f * p0 * x * w) * width;
        out[1] = top + (0.5f - 0.5f * p5 * y * w) * height;
        out[2] = 0.5f + 0.5f * (p10 * z + p14) * w;
        out[3] = w;
    }
};

struct Rasterizer::Mesh {
    const SurfaceGeometry* geometry = nullptr;
    std::vector<float> vertices;
    Projector eye;
    int pass;
    bool isOuter = false, isLit = true, isContour = false;
    float color[3];
    float opacity = 1;
    std::uint32_t first = 0;  ///< number of its first triangle

    explicit Mesh(const Projector& projector) : eye(projector), pass(0) {}

    const std::uint32_t* getTriangle(std::uint32_t number) const {
        return &geometry->triangles[3 * std::size_t(number - first)];
    }
    std::uint32_t countTriangles() const { return std::uint32_t(geometry->triangles.size() / 3); }
};

/** A line or a disc. **/
struct Rasterizer::Stroke {
    float x[4], y[4], z[4];
    std::uint32_t color;  ///< with alpha
    bool isMark;          ///< wins against what is as near
    bool hidesOthers;     ///< writes depth
    float radius;         ///< of a disc about the middle; 0: a line
};

/** Numbers of what each band has to draw. **/
struct Rasterizer::Bins {
    /** Of so many triangles, one after the other; by bands. **/
    std::vector<std::vector<std::vector<std::uint32_t>>> chunks;
    std::vector<std::vector<std::uint32_t>> strokes;
    std::uint32_t ends[numPasses];  ///< of triangles
};

/** Samples of a band's rows. Planes of samples, each row by row. **/
struct Rasterizer::Band {
    Area area;
    std::size_t stride = 0, plane = 0;
    std::vector<float> depth;
    std::vector<std::uint32_t> numbers, colors;
    std::vector<std::uint8_t> isHidden;  ///< of a row's pixels: the backdrop

    void begin(const Area& bandArea, int width) {
        area = bandArea;
        stride = std::size_t(width / lanes + 2) * lanes;
        plane = stride * std::size_t(bandRows);
        if (depth.size() == numSamples * plane) return;
        depth.assign(numSamples * plane, 1);
        numbers.assign(numSamples * plane, none);
        colors.assign(numSamples * plane, 0);
    }
    std::size_t at(int sample, int row) const {
        return std::size_t(sample) * plane + std::size_t(row - area.top) * stride;
    }
    template <class T>
    void fill(std::vector<T>& values, const Area& part, T value) {
        for (int s = 0; s < numSamples; ++s)
            for (int row = part.top; row < part.bottom; ++row)
                std::fill_n(&values[at(s, row) + std::size_t(part.left)], part.right - part.left,
                            value);
    }
};

Rasterizer::Rasterizer() : bins(std::make_unique<Bins>()) {}
Rasterizer::~Rasterizer() = default;

bool Rasterizer::canDraw(const Scene& scene, const Camera& camera, const FrameStyle& style,
                         int width, int height) {
    if (width <= 0 || height <= 0 || width > mostPixels || height > mostPixels ||
        style.isBackgroundTransparent || (style.isLit && style.occlusionRadius > 0) ||
        !scene.texts.empty())
        return false;
    std::vector<Vec3> corners;
    for (const SurfaceItem& item : scene.surfaces) {
        if (item.opacity <= 0) continue;
        if (item.representation != SimTK::DecorativeGeometry::DrawSurface ||
            (item.opacity < 1 && item.style != SurfaceItem::Style::Ghost))
            return false;
        corners.clear();
        item.appendBounds(corners);
        for (const Vec3& corner : corners)
            if (!(-camera.toCamera(corner)[2] > camera.nearPlane)) return false;
    }
    return true;
}

void Rasterizer::addMesh(const SurfaceItem& item, const GlView& view, int pass, double left,
                         double top) {
    const Projector eye(view, left, top);
    if (meshes.size() == numMeshes) meshes.push_back(std::make_unique<Mesh>(eye));
    Mesh& mesh = *meshes[numMeshes++];
    mesh.eye = eye;
    mesh.pass = pass;
    mesh.geometry = item.geometry.get();
    mesh.isOuter = item.geometry->isClosed;
    mesh.isLit = view.style.isLit;
    mesh.isContour = item.style == SurfaceItem::Style::Contour;
    for (int k = 0; k < 3; ++k) mesh.color[k] = float(item.color[k]);
    mesh.opacity = float(item.opacity);

    const Transform X_CM = view.toCamera(item.X_GM);
    const auto toCamera = calcModelView(X_CM, item.scale);
    const auto turn = calcNormalMatrix(X_CM.R(), item.scale);
    // A ghost stands a little behind the deformed part, which wins where both coincide.
    const SimTK::Vec2 shift = view.calcShift(item.style == SurfaceItem::Style::Ghost ? -1.5 : 0);
    const float factor = float(shift[0]), offset = float(shift[1]);
    const long number = item.geometry->numVertices();
    mesh.vertices.resize(vertexFloats * std::size_t(number));
    const float* from = item.geometry->vertices.data();
    float* to = mesh.vertices.data();
#pragma omp parallel for schedule(static) if (number > 4096)
    for (long i = 0; i < number; ++i) {
        const float* v = from + i * SurfaceGeometry::floatsPerVertex;
        float* out = to + i * long(vertexFloats);
        float p[3];
        for (int k = 0; k < 3; ++k)
            p[k] = (toCamera[k] * v[0] + toCamera[4 + k] * v[1] + toCamera[8 + k] * v[2] +
                    toCamera[12 + k]) *
                   factor;
        eye.project(p[0], p[1], p[2] + offset, out);
        for (int k = 0; k < 3; ++k)
            out[4 + k] = turn[k] * v[3] + turn[3 + k] * v[4] + turn[6 + k] * v[5];
    }
}

// Seen by a camera of its own, with the same orientation and no perspective to speak of.
void Rasterizer::addTriad(const GlView& view) {
    const TriadPlace place = calcTriadPlace(view.height, view.style.unit);
    const int half = place.getHalfSize(), left = int(place.x) - half;
    const int top = view.height - (view.height - int(place.y) - half) - 2 * half;
    triad = {std::max(left, 0), std::max(top, 0), std::min(left + 2 * half, view.width),
             std::min(top + 2 * half, view.height)};
    if (triad.isEmpty()) return;
    Camera camera;
    camera.fieldOfView = 2 * std::atan(1.5 / 30);
    camera.X_GC = Transform(view.camera.X_GC.R(), view.camera.X_GC.R() * Vec3(0, 0, 30));
    camera.nearPlane = 20;
    camera.farPlane = 40;
    const GlView triadView(camera, view.style, 2 * half, 2 * half, 0, 2 * half);
    for (const SurfaceItem& item : buildTriad(triadShapes).surfaces)
        addMesh(item, triadView, Axes, left, top);
}

// Edges come forward, by the depth that a line as wide as it is covers on the surface.
void Rasterizer::addEdges(const SurfaceItem& item, const GlView& view) {
    if (!item.showFeatureEdges && !item.showElementEdges) return;
    const Projector eye(view);
    const Transform X_CM = view.toCamera(item.X_GM);
    const auto toCamera = calcModelView(X_CM, item.scale);
    const auto turn = calcNormalMatrix(X_CM.R(), item.scale);
    const float width = float(std::max(1.0, view.style.unit));
    const SimTK::Vec2 pixel = view.calcPixelSize();
    const auto place = [&](std::uint32_t vertex, float* out) {
        const float* v = &item.geometry->vertices[vertex * SurfaceGeometry::floatsPerVertex];
        float p[3], n[3];
        for (int k = 0; k < 3; ++k) {
            p[k] = toCamera[k] * v[0] + toCamera[4 + k] * v[1] + toCamera[8 + k] * v[2] +
                   toCamera[12 + k];
            n[k] = turn[k] * v[3] + turn[3 + k] * v[4] + turn[6 + k] * v[5];
        }
        const float size = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        const float distance = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
        const float facing =
            std::abs(view.isPerspective ? (n[0] * p[0] + n[1] * p[1] + n[2] * p[2]) / distance
                                        : n[2]) /
            std::max(size, 1e-30f);
        const float slope = std::min(
            std::sqrt(std::max(1 - facing * facing, 0.0f)) / std::max(facing, 1e-3f), 8.0f);
        const float forward = 0.3f + 0.8f * slope * width;
        const float factor = 1 - forward * float(pixel[0]);
        eye.project(p[0] * factor, p[1] * factor, p[2] * factor + forward * float(pixel[1]), out);
    };
    const auto add = [&](const std::vector<std::uint32_t>& edges, double opacity) {
        const std::uint32_t color = packColor(view.style.palette.edge, opacity);
        for (std::size_t i = 0; i + 1 < edges.size(); i += 2) {
            float a[4], b[4];
            place(edges[i], a);
            place(edges[i + 1], b);
            const float dx = b[0] - a[0], dy = b[1] - a[1];
            const float length = std::sqrt(dx * dx + dy * dy);
            if (!(length > 0)) continue;
            const float x = -dy / length * 0.5f * width, y = dx / length * 0.5f * width;
            strokes.push_back({{a[0] + x, a[0] - x, b[0] - x, b[0] + x},
                               {a[1] + y, a[1] - y, b[1] - y, b[1] + y},
                               {a[2], a[2], b[2], b[2]},
                               color,
                               false,
                               false,
                               0});
        }
    };
    if (item.showElementEdges) add(item.geometry->elementEdges, 0.22);
    if (item.showFeatureEdges) add(item.geometry->featureEdges, 0.45);
}

void Rasterizer::addMarks(const Scene& scene, const GlView& view, bool isOpaque) {
    const Projector eye(view);
    const SimTK::Vec2 shift = view.calcShift(forwardMarks);
    const auto project = [&](const Vec3& p, float* out) {
        eye.project(float(p[0] * shift[0]), float(p[1] * shift[0]),
                    float(p[2] * shift[0] + shift[1]), out);
    };
    const double limit = -view.camera.nearPlane;
    for (const LineItem& line : scene.lines) {
        if ((line.opacity >= 1) != isOpaque) continue;
        // Ends behind the camera are pulled up to the near plane.
        Vec3 a = view.toCamera(line.start), b = view.toCamera(line.end);
        if (a[2] > limit && b[2] > limit) continue;
        if (a[2] > limit) a += (limit - a[2]) / (b[2] - a[2]) * (b - a);
        if (b[2] > limit) b += (limit - b[2]) / (a[2] - b[2]) * (a - b);
        float p[4], q[4];
        project(a, p);
        project(b, q);
        float dx = q[0] - p[0], dy = q[1] - p[1];
        const float length = std::sqrt(dx * dx + dy * dy);
        dx = length > 0 ? dx / length : 1;
        dy = length > 0 ? dy / length : 0;
        const float half = float(0.5 * line.width * view.style.unit);
        const float x = -dy * half, y = dx * half, ex = 0.5f * dx * half, ey = 0.5f * dy * half;
        strokes.push_back({{p[0] + x - ex, p[0] - x - ex, q[0] - x + ex, q[0] + x + ex},
                           {p[1] + y - ey, p[1] - y - ey, q[1] - y + ey, q[1] + y + ey},
                           {p[2], p[2], q[2], q[2]},
                           packColor(line.color, line.opacity),
                           true,
                           isOpaque,
                           0});
    }
    for (const PointItem& point : scene.points) {
        if ((point.opacity >= 1) != isOpaque) continue;
        const Vec3 center = view.toCamera(point.location);
        if (center[2] > limit) continue;
        float p[4];
        project(center, p);
        const float radius = float(0.5 * point.diameter * view.style.unit), r = radius + 1;
        strokes.push_back({{p[0] - r, p[0] - r, p[0] + r, p[0] + r},
                           {p[1] - r, p[1] + r, p[1] + r, p[1] - r},
                           {p[2], p[2], p[2], p[2]},
                           packColor(point.color, point.opacity),
                           true,
                           isOpaque,
                           radius});
    }
}

void Rasterizer::collect(const Scene& scene, const GlView& view) {
    numMeshes = 0;
    strokes.clear();
    triad = {};
    const auto isGhost = [](const SurfaceItem& item) {
        return item.style == SurfaceItem::Style::Ghost;
    };
    for (const SurfaceItem& item : scene.surfaces)
        if (item.opacity > 0 && !isGhost(item)) addMesh(item, view, Opaque, 0, 0);
    for (const SurfaceItem& item : scene.surfaces)
        if (item.opacity > 0 && isGhost(item)) addMesh(item, view, Ghosts, 0, 0);
    if (view.style.hasTriad) addTriad(view);
    std::uint32_t number = 0;
    for (int pass = 0; pass < numPasses; ++pass) bins->ends[pass] = 0;
    for (std::size_t i = 0; i < numMeshes; ++i) {
        meshes[i]->first = number;
        number += meshes[i]->countTriangles();
        bins->ends[meshes[i]->pass] = number;
    }
    for (int pass = 1; pass < numPasses; ++pass)
        bins->ends[pass] = std::max(bins->ends[pass], bins->ends[pass - 1]);
    for (const SurfaceItem& item : scene.surfaces)
        if (item.opacity > 0 && !isGhost(item)) addEdges(item, view);
    for (const bool isOpaque : {true, false}) addMarks(scene, view, isOpaque);
}

void Rasterizer::sortIntoBands(int height) {
    const std::size_t numBands = std::size_t((height + bandRows - 1) / bandRows);
    const auto findBands = [&](float top, float bottom, std::size_t& first, std::size_t& end) {
        if (!(bottom > 0 && top < float(height))) return false;
        first = std::size_t(std::max(top - 1, 0.0f)) / bandRows;
        end = std::min(numBands, std::size_t(std::min(bottom + 1, 1e6f)) / bandRows + 1);
        return first < end;
    };
    const std::size_t number = bins->ends[numPasses - 1];
    const std::size_t numChunks = (number + trianglesPerChunk - 1) / trianglesPerChunk;
    if (bins->chunks.size() < numChunks) bins->chunks.resize(numChunks);
#pragma omp parallel for schedule(dynamic) if (numChunks > 1)
    for (std::size_t c = 0; c < numChunks; ++c) {
        auto& lists = bins->chunks[c];
        lists.resize(numBands);
        for (auto& list : lists) list.clear();
        std::size_t m = 0;
        for (std::uint32_t t = std::uint32_t(c * trianglesPerChunk),
                           end = std::uint32_t(std::min(number, (c + 1) * trianglesPerChunk));
             t < end; ++t) {
            while (t >= meshes[m]->first + meshes[m]->countTriangles()) ++m;
            const Mesh& mesh = *meshes[m];
            const std::uint32_t* corners = mesh.getTriangle(t);
            const float *a = &mesh.vertices[vertexFloats * corners[0]],
                        *b = &mesh.vertices[vertexFloats * corners[1]],
                        *d = &mesh.vertices[vertexFloats * corners[2]];
            const float area = (b[0] - a[0]) * (d[1] - a[1]) - (d[0] - a[0]) * (b[1] - a[1]);
            // Anticlockwise, y downwards.
            if (mesh.isOuter ? !(area < 0) : !(area != 0)) continue;
            std::size_t first, last;
            if (!findBands(std::min({a[1], b[1], d[1]}), std::max({a[1], b[1], d[1]}), first, last))
                continue;
            for (std::size_t band = first; band < last; ++band) lists[band].push_back(t);
        }
    }
    bins->strokes.resize(numBands);
    for (auto& list : bins->strokes) list.clear();
    for (std::size_t i = 0; i < strokes.size(); ++i) {
        const float* y = strokes[i].y;
        std::size_t first, last;
        if (findBands(*std::min_element(y, y + 4), *std::max_element(y, y + 4), first, last))
            for (std::size_t band = first; band < last; ++band)
                bins->strokes[band].push_back(std::uint32_t(i));
    }
}

void Rasterizer::drawTriangles(int number, int pass, Band& band) const {
    const std::uint32_t begins = pass == 0 ? 0 : bins->ends[pass - 1], end = bins->ends[pass];
    if (begins == end) return;
    Area area = band.area;
    if (pass == Axes)
        area = {triad.left, std::max(area.top, triad.top), triad.right,
                std::min(area.bottom, triad.bottom)};
    std::size_t m = 0;
    for (std::size_t c = begins / trianglesPerChunk; c * trianglesPerChunk < end; ++c)
        for (const std::uint32_t t : bins->chunks[c][std::size_t(number)]) {
            if (t < begins) continue;
            if (t >= end) break;
            while (t >= meshes[m]->first + meshes[m]->countTriangles()) ++m;
            const Mesh& mesh = *meshes[m];
            const std::uint32_t* corners = mesh.getTriangle(t);
            float x[3], y[3], z[3];
            for (int k = 0; k < 3; ++k) {
                const float* v = &mesh.vertices[vertexFloats * corners[k]];
                x[k] = v[0];
                y[k] = v[1];
                z[k] = v[2];
            }
            const LinearField depth(x, y, z, calcArea(x, y));
            const float least = depth.least, most = depth.most, byX = depth.byX;
            Polygon<3>(x, y).forEachSpan(area, [&](int s, int row, int from, int to) {
                float* const nearest = &band.depth[band.at(s, row)];
                std::uint32_t* const numbers = &band.numbers[band.at(s, row)];
                const int begin = from & ~(lanes - 1);
                const float start = depth.at(begin, row, s);
                for (int block = begin; block < to; block += lanes) {
                    // No branches: a processor does all lanes at once.
                    float* const d = nearest + block;
                    std::uint32_t* const n = numbers + block;
                    const int low = from - block, high = to - block;
                    const float first = start + byX * float(block - begin);
#pragma omp simd simdlen(8)
                    for (int k = 0; k < lanes; ++k) {
                        float at = first + byX * float(k);
                        at = at < least ? least : at;
                        at = at > most ? most : at;
                        const bool isSeen = (k >= low) & (k < high) & (at < d[k]);
                        d[k] = isSeen ? at : d[k];
                        n[k] = isSeen ? t : n[k];
                    }
                }
            });
        }
}

namespace {

/** Where a triangle's corners stand in its light. **/
struct Share {
    std::uint32_t number = none;
    const float* corner[3];
    float value[3];
    float x0, y0, oneByX, oneByY, twoByX, twoByY;
    float side;  // −1 seen from inside
    std::size_t mesh;
};

}  // namespace

void Rasterizer::light(int pass, const Area& area, Band& band) const {
    constexpr std::size_t manyShares = 256;
    Share shares[manyShares];
    LitPoints points;
    struct Target {
        std::size_t place;
        unsigned samples;
    };
    Target targets[LitPoints::most];
    int number = 0;
    std::uint32_t below = 0, over = 0, mixed = 0;
    const auto store = [&](const Target& target, std::uint32_t color) {
        for (int s = 0; s < numSamples; ++s) {
            if (!(target.samples >> s & 1)) continue;
            std::uint32_t& sample = band.colors[std::size_t(s) * band.plane + target.place];
            if (pass != Ghosts) {
                sample = color;
                continue;
            }
            // Samples of a pixel are often alike.
            if (sample != below || color != over) {
                below = sample;
                over = color;
                mixed = layOver(below, over, over >> 24);
            }
            sample = mixed;
        }
    };
    const auto flush = [&] {
        if (pass == Ghosts)
            points.lightGhosts(number);
        else
            points.lightSurfaces(*light_C, number);
        for (int i = 0; i < number; ++i) store(targets[i], points.colors[i]);
        number = 0;
    };
    const auto findShare = [&](std::uint32_t t) -> const Share& {
        Share& share = shares[t % manyShares];
        if (share.number == t) return share;
        share.number = t;
        const auto after = std::upper_bound(
            meshes.begin(), meshes.begin() + std::ptrdiff_t(numMeshes), t,
            [](std::uint32_t n, const std::unique_ptr<Mesh>& mesh) { return n < mesh->first; });
        // Empty meshes share their number with the next one.
        share.mesh = std::size_t(after - meshes.begin()) - 1;
        const Mesh& mesh = *meshes[share.mesh];
        const std::uint32_t* corners = mesh.getTriangle(t);
        for (int k = 0; k < 3; ++k) {
            share.corner[k] = &mesh.vertices[vertexFloats * corners[k]];
            share.value[k] =
                mesh.geometry->vertices[SurfaceGeometry::floatsPerVertex * corners[k] + 6];
        }
        const float *a = share.corner[0], *b = share.corner[1], *c = share.corner[2];
        const float bx = b[0] - a[0], by = b[1] - a[1], cx = c[0] - a[0], cy = c[1] - a[1];
        const float twice = bx * cy - cx * by;
        share.x0 = a[0];
        share.y0 = a[1];
        share.oneByX = cy / twice;
        share.oneByY = -cx / twice;
        share.twoByX = -by / twice;
        share.twoByY = bx / twice;
        share.side = twice < 0 ? 1.0f : -1.0f;
        return share;
    };
    // Light does not jump between triangles with a common vertex: one of them is enough.
    const auto areOfOnePatch = [&](std::uint32_t s, std::uint32_t t) {
        const Mesh& mesh = *meshes[findShare(s).mesh];
        if (t < mesh.first || t >= mesh.first + mesh.countTriangles()) return false;
        const std::uint32_t *a = mesh.getTriangle(s), *b = mesh.getTriangle(t);
        for (int i = 0; i < 3; ++i)
            if (a[i] == b[0] || a[i] == b[1] || a[i] == b[2]) return true;
        return false;
    };
    // Pixels of one triangle, side by side: eight at a time.
    const auto add = [&](std::uint32_t t, int column, int row, int count, std::size_t place,
                         unsigned samples) {
        const Share& share = findShare(t);
        const Mesh& mesh = *meshes[share.mesh];
        const float dy = float(row) + 0.5f - share.y0;
        const float *a = share.corner[0], *b = share.corner[1], *c = share.corner[2];
        const float color[3] = {mesh.color[0], mesh.color[1], mesh.color[2]};
        const Projector& eye = mesh.eye;
        const float up = 1 - 2 * (float(row) + 0.5f - eye.top) / eye.height;
        const float viewY = eye.isPerspective ? -up / eye.p5 : 0;
        const float viewBy = eye.isPerspective ? -2 / (eye.width * eye.p0) : 0;
        const float viewX = eye.isPerspective ? (1 + 2 * eye.left / eye.width) / eye.p0 : 0;
        const Share corner = share;
        const float low = contourLow, scale = contourScale;
        const float* const colorTable = baseColors.data();
        while (count > 0) {
            float* out[10];
            for (int k = 0; k < 3; ++k) {
                out[k] = points.normal[k].data() + number;
                out[3 + k] = points.view[k].data() + number;
                out[6 + k] = points.base[k].data() + number;
            }
            out[9] = points.opacity.data() + number;
            const float x = float(column) + 0.5f, opacity = mesh.opacity;
            const bool isContour = mesh.isContour;
#pragma omp simd simdlen(8)
            for (int i = 0; i < lanes; ++i) {
                const float dx = x + float(i) - corner.x0;
                const float one = corner.oneByX * dx + corner.oneByY * dy;
                const float two = corner.twoByX * dx + corner.twoByY * dy;
                const float w0 = corner.side * (1 - one - two) * a[3],
                            w1 = corner.side * one * b[3], w2 = corner.side * two * c[3];
                out[0][i] = w0 * a[4] + w1 * b[4] + w2 * c[4];
                out[1][i] = w0 * a[5] + w1 * b[5] + w2 * c[5];
                out[2][i] = w0 * a[6] + w1 * b[6] + w2 * c[6];
                out[3][i] = viewX + viewBy * (x + float(i));
                out[4][i] = viewY;
                out[5][i] = 1;
                out[6][i] = color[0];
                out[7][i] = color[1];
                out[8][i] = color[2];
                out[9][i] = opacity;
            }
            if (isContour) {
#pragma omp simd simdlen(8)
                for (int i = 0; i < lanes; ++i) {
                    const float dx = x + float(i) - corner.x0;
                    const float one = corner.oneByX * dx + corner.oneByY * dy;
                    const float two = corner.twoByX * dx + corner.twoByY * dy;
                    const float w0 = (1 - one - two) * a[3], w1 = one * b[3], w2 = two * c[3];
                    const float value =
                        (w0 * corner.value[0] + w1 * corner.value[1] + w2 * corner.value[2]) /
                        (w0 + w1 + w2);
                    // Not a number: no value there.
                    const bool isValue = value == value;
                    float f = isValue ? (value - low) * scale : 0;
                    f = f < 0 ? 0 : f;
                    f = f > 1 ? 1 : f;
                    const float at = f * 255;
                    int entry = int(at);
                    entry = entry > 254 ? 254 : entry;
                    const float share1 = at - float(entry), share0 = 1 - share1;
                    const float* const entries = colorTable + 3 * entry;
                    out[6][i] = isValue ? share0 * entries[0] + share1 * entries[3] : 0.62f;
                    out[7][i] = isValue ? share0 * entries[1] + share1 * entries[4] : 0.62f;
                    out[8][i] = isValue ? share0 * entries[2] + share1 * entries[5] : 0.62f;
                }
            }
            const int taken = std::min(count, lanes);
            if (!mesh.isLit) {
                for (int i = 0; i < taken; ++i)
                    store({place + std::size_t(i), samples},
                          packColor(Vec3(out[6][i], out[7][i], out[8][i]), double(opacity)));
            } else {
                for (int i = 0; i < taken; ++i)
                    targets[number + i] = {place + std::size_t(i), samples};
                number += taken;
                if (number > LitPoints::most - lanes) flush();
            }
            column += taken;
            place += std::size_t(taken);
            count -= taken;
        }
    };
    // What all samples of a pixel show, if that is one patch; else none.
    const auto findCommon = [&](const std::uint32_t* const* numbers, int column) {
        const std::uint32_t n = numbers[0][column];
        for (int s = 1; s < numSamples; ++s) {
            const std::uint32_t other = numbers[s][column];
            if (other != n && (n == none || other == none || !areOfOnePatch(n, other))) return none;
        }
        return n;
    };
    for (int row = area.top; row < area.bottom; ++row) {
        const std::uint32_t* numbers[numSamples];
        for (int s = 0; s < numSamples; ++s) numbers[s] = &band.numbers[band.at(s, row)];
        for (int column = area.left; column < area.right; ++column) {
            const std::uint32_t n[numSamples] = {numbers[0][column], numbers[1][column],
                                                 numbers[2][column], numbers[3][column]};
            if ((n[0] & n[1] & n[2] & n[3]) == none) continue;
            const std::size_t place =
                std::size_t(row - band.area.top) * band.stride + std::size_t(column);
            if (findCommon(numbers, column) != none) {
                int end = column + 1;
                while (end < area.right && numbers[0][end] == n[0] &&
                       findCommon(numbers, end) != none)
                    ++end;
                add(n[0], column, row, end - column, place, 15);
                column = end - 1;
                continue;
            }
            unsigned left = 15;
            for (int s = 0; s < numSamples; ++s) {
                if (!(left >> s & 1)) continue;
                unsigned samples = 1u << s;
                for (int i = s + 1; i < numSamples; ++i)
                    if (n[i] == n[s] || (n[i] != none && n[s] != none && areOfOnePatch(n[i], n[s])))
                        samples |= 1u << i;
                samples &= left;
                left &= ~samples;
                if (n[s] != none) add(n[s], column, row, 1, place, samples);
            }
        }
    }
    flush();
}

void Rasterizer::drawStrokes(int number, Band& band) const {
    for (const std::uint32_t i : bins->strokes[std::size_t(number)]) {
        const Stroke& stroke = strokes[i];
        const float area = calcArea(stroke.x, stroke.y);
        if (!(area != 0)) continue;
        LinearField depth(stroke.x, stroke.y, stroke.z, area);
        depth.least = std::min({stroke.z[0], stroke.z[1], stroke.z[2], stroke.z[3]});
        depth.most = std::max({stroke.z[0], stroke.z[1], stroke.z[2], stroke.z[3]});
        const float middleX = 0.5f * (stroke.x[0] + stroke.x[2]),
                    middleY = 0.5f * (stroke.y[0] + stroke.y[2]);
        Polygon<4>(stroke.x, stroke.y)
            .forEachSpan(band.area, [&](int s, int row, int from, int to) {
                float* const nearest = &band.depth[band.at(s, row)];
                std::uint32_t* const colors = &band.colors[band.at(s, row)];
                for (int column = from; column < to; ++column) {
                    const float at = depth.limit(depth.at(column, row, s));
                    if (stroke.isMark ? !(at <= nearest[column]) : !(at < nearest[column]))
                        continue;
                    std::uint32_t alpha = stroke.color >> 24;
                    if (stroke.radius > 0) {
                        const float dx = float(column) + 0.5f - middleX,
                                    dy = float(row) + 0.5f - middleY;
                        const float inside = std::min(
                            std::max(stroke.radius + 0.5f - std::sqrt(dx * dx + dy * dy), 0.0f),
                            1.0f);
                        if (inside <= 0) continue;
                        alpha = std::uint32_t(float(alpha) * inside + 0.5f);
                    }
                    colors[column] = layOver(colors[column], stroke.color, alpha);
                    if (stroke.hidesOthers) nearest[column] = at;
                }
            });
    }
}

void Rasterizer::drawBand(int number, const GlView& view, bool hasGround, bool isBelow,
                          const GroundShadow* shadow, Band& band, Image& image) const {
    const int top = number * bandRows, bottom = std::min(view.height, top + bandRows);
    Area area = {used.left, std::max(top, used.top), used.right, std::min(bottom, used.bottom)};
    const bool hasTriad = !triad.isEmpty() && triad.top < bottom && triad.bottom > top;
    if (area.isEmpty()) area = {0, top, 0, top};
    if (hasTriad) {
        const bool isFirst = area.isEmpty();
        area = {isFirst ? triad.left : std::min(area.left, triad.left), top,
                isFirst ? triad.right : std::max(area.right, triad.right), bottom};
    }
    if (!area.isEmpty()) {
        area.top = top;
        area.bottom = bottom;
        band.begin(area, view.width);
        band.fill(band.depth, area, 1.0f);
        band.fill(band.numbers, area, none);
        band.fill(band.colors, area, std::uint32_t(0));
        if (hasGround && isBelow) {
            const GroundView ground(view);
            for (int s = 0; s < numSamples; ++s)
                for (int row = top; row < bottom; ++row) {
                    float* const depth = &band.depth[band.at(s, row)];
                    for (int column = area.left; column < area.right; ++column)
                        depth[column] = float(std::min(
                            1.0, std::max(0.0, ground.zStart +
                                                   ground.zByColumn * (column + samplePlaces[s].x) +
                                                   ground.zByRow * (row + samplePlaces[s].y))));
                }
        }
        drawTriangles(number, Opaque, band);
        light(Opaque, area, band);
        drawStrokes(number, band);
        if (bins->ends[Ghosts] > bins->ends[Opaque]) {
            band.fill(band.numbers, area, none);
            drawTriangles(number, Ghosts, band);
            light(Ghosts, area, band);
        }
        if (hasTriad) {
            const Area part = {triad.left, std::max(top, triad.top), triad.right,
                               std::min(bottom, triad.bottom)};
            band.fill(band.depth, part, 1.0f);
            band.fill(band.numbers, part, none);
            drawTriangles(number, Axes, band);
            light(Axes, part, band);
        }
    }
    for (int row = top; row < bottom; ++row) {
        std::uint8_t* const to = image.updData() + 4 * std::size_t(row) * std::size_t(view.width);
        backdrop.copy(row, view, to);
        const bool isShaded = shadow && row >= shaded.top && row < shaded.bottom;
        if (area.isEmpty()) {
            if (isShaded) darken(row, shaded, view, *shadow, nullptr, to);
            continue;
        }
        const std::uint32_t* colors[numSamples];
        for (int s = 0; s < numSamples; ++s) colors[s] = &band.colors[band.at(s, row)];
        if (isShaded) {
            band.isHidden.assign(std::size_t(view.width), 0);
            std::uint8_t* const isHidden = band.isHidden.data();
#pragma omp simd
            for (int column = area.left; column < area.right; ++column)
                isHidden[column] = (colors[0][column] & colors[1][column] & colors[2][column] &
                                    colors[3][column]) >= 0xff000000u;
            darken(row, shaded, view, *shadow, isHidden, to);
        }
        for (int column = area.left; column < area.right; ++column) {
            const std::uint32_t c[numSamples] = {colors[0][column], colors[1][column],
                                                 colors[2][column], colors[3][column]};
            std::uint8_t* const pixel = to + 4 * std::size_t(column);
            if (c[0] == c[1] && c[0] == c[2] && c[0] == c[3] && (c[0] == 0 || c[0] >> 24 == 255)) {
                if (c[0] != 0) std::memcpy(pixel, &c[0], 4);
                continue;
            }
            const std::uint32_t alpha = (c[0] >> 24) + (c[1] >> 24) + (c[2] >> 24) + (c[3] >> 24);
            for (int k = 0; k < 3; ++k) {
                const int shift = 8 * k;
                const std::uint32_t sum = (c[0] >> shift & 255) + (c[1] >> shift & 255) +
                                          (c[2] >> shift & 255) + (c[3] >> shift & 255);
                const std::uint32_t mixed = sum + (pixel[k] * (1020 - alpha) + 127) / 255;
                pixel[k] = std::uint8_t(std::min(255u, (mixed + 2) / 4));
            }
        }
    }
}

Image Rasterizer::draw(const Scene& scene, const Camera& camera, const FrameStyle& style, int width,
                       int height) {
    const GlView view(camera, style, width, height, 0, height);
    const bool hasGround = isGroundVisible(camera, style);
    const bool hasShadow = hasGround && style.ground.hasShadow && groundShadow.cast(scene, style);
    collect(scene, view);
    sortIntoBands(height);
    backdrop.update(view, hasGround);
    light_C = std::make_unique<Light>(camera, style);
    if (loadedColors != int(style.colorMap)) {
        loadedColors = int(style.colorMap);
        baseColors.clear();
        for (int i = 0; i < 256; ++i) {
            const Vec3 c = calcColor(style.colorMap, double(i) / 255);
            for (int k = 0; k < 3; ++k) baseColors.push_back(float(std::lround(255 * c[k])) / 255);
        }
    }
    contourLow = float(style.contourLow);
    const double range = style.contourHigh - style.contourLow;
    contourScale = range > 0 ? float(1 / range) : 0;

    std::vector<Vec3> bounds;
    scene.appendBounds(bounds);
    const Transform X_PG = ~style.ground.X_GP;
    const bool isBelow =
        std::any_of(bounds.begin(), bounds.end(), [&](const Vec3& p) { return (X_PG * p)[2] < 0; });
    if (hasShadow) shaded = findShaded(view, groundShadow);
    const int padding = int(24 * std::max(1.0, style.unit));  // for wide lines and points
    const GlRectangle covered = calcCoveredRectangle(view, bounds, padding);
    used = {covered.left, height - covered.top, covered.right, height - covered.bottom};

    Image image(width, height);
    const int numBands = (height + bandRows - 1) / bandRows;
    if (bands.size() < std::size_t(omp_get_max_threads()))
        bands.resize(std::size_t(omp_get_max_threads()));
#pragma omp parallel for schedule(dynamic)
    for (int number = 0; number < numBands; ++number)
        drawBand(number, view, hasGround, isBelow, hasShadow ? &groundShadow : nullptr,
                 bands[std::size_t(omp_get_thread_num())], image);
    return image;
}

}  // namespace raster
}  // namespace simflex
