#include "CurvedSurface.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <unordered_map>

#include "simflex/part/MeshFaces.h"

namespace simflex {

namespace {

using Point = std::array<double, 3>;

constexpr int whole = 64;                      // range of an edge's parameter
constexpr int half = whole / 2, shortest = 2;  // chord lengths

// Position in a face: (ξ, η) from 0 to `whole`, corner 0 at (0, 0), corner 1 at (whole, 0).
struct Place {
    int x, y;
    bool operator==(const Place& other) const { return x == other.x && y == other.y; }
};

Place calcMiddle(Place a, Place b) {
    return {(a.x + b.x) / 2, (a.y + b.y) / 2};
}

struct Weights {
    int count;
    std::array<double, 8> of;  // corners, then middles
};

Weights calcWeights(int numCorners, Place at) {
    if (numCorners == 3) {
        const double x = double(at.x) / whole, y = double(at.y) / whole, z = 1 - x - y;
        return {
            6,
            {z * (2 * z - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * z * x, 4 * x * y, 4 * y * z}};
    }
    const double x = 2.0 * at.x / whole - 1, y = 2.0 * at.y / whole - 1;
    const auto corner = [&](int sx, int sy) {
        return 0.25 * (1 + sx * x) * (1 + sy * y) * (sx * x + sy * y - 1);
    };
    return {
        8,
        {corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1), 0.5 * (1 - x * x) * (1 - y),
         0.5 * (1 + x) * (1 - y * y), 0.5 * (1 - x * x) * (1 + y), 0.5 * (1 - x) * (1 - y * y)}};
}

class Divider {
public:
    Divider(const Mesh& dividedMesh, double chordTolerance, CurvedSurface& result)
        : mesh(dividedMesh), tolerance(chordTolerance), surface(result) {}

    void divide(const MeshFace& meshFace) {
        face = &meshFace;
        numCorners = face->numCorners();
        const auto& c = face->corners;
        if (!face->isQuadratic()) {
            addTriangle(c[0], c[1], c[2]);
            if (numCorners == 4) addTriangle(c[0], c[2], c[3]);
            for (int k = 0; k < numCorners; ++k) addEdge(c[at(k)], c[at(k + 1)]);
            return;
        }

        inner.clear();
        for (int k = 0; k < numCorners; ++k) {
            chord[at(k)] = calcChord(k);
            int previous = c[at(k)];
            for (int t = chord[at(k)]; t <= whole; t += chord[at(k)]) {
                const int next = t == whole ? c[at(k + 1)] : findOnEdge(k, t);
                addEdge(previous, next);
                previous = next;
            }
        }
        if (isFlat()) {
            const auto& m = face->middles;
            for (int k = 0; k < numCorners; ++k)
                addTriangle(c[at(k)], m[at(k)], m[at(k + numCorners - 1)]);
            addTriangle(m[0], m[1], m[2]);
            if (numCorners == 4) addTriangle(m[0], m[2], m[3]);
            return;
        }
        constexpr Place triangleCorners[] = {{0, 0}, {whole, 0}, {0, whole}};
        constexpr Place triangleMiddles[] = {{half, 0}, {half, half}, {0, half}};
        constexpr Place squareCorners[] = {{0, 0}, {whole, 0}, {whole, whole}, {0, whole}};
        constexpr Place squareMiddles[] = {{half, 0}, {whole, half}, {half, whole}, {0, half}};
        const Place* corners = numCorners == 3 ? triangleCorners : squareCorners;
        const Place* m = numCorners == 3 ? triangleMiddles : squareMiddles;
        for (int k = 0; k < numCorners; ++k)
            divide(corners[k], m[k], m[(k + numCorners - 1) % numCorners]);
        divide(m[0], m[1], m[2]);
        if (numCorners == 4) divide(m[0], m[2], m[3]);
    }

private:
    std::size_t at(int corner) const { return std::size_t(corner % numCorners); }

    Point getPosition(int node) const {
        const double* p = &mesh.positions[3 * std::size_t(node)];
        return {p[0], p[1], p[2]};
    }

    // Distance between the middle of edge k and that of its chord: (x_a + x_b)/2 − x_m.
    double calcBend(int k) const {
        const Point a = getPosition(face->corners[at(k)]), m = getPosition(face->middles[at(k)]),
                    b = getPosition(face->corners[at(k + 1)]);
        double sum = 0;
        for (std::size_t i = 0; i < 3; ++i) sum += std::pow(0.5 * (a[i] + b[i]) - m[i], 2);
        return std::sqrt(sum);
    }

    // Length of a chord along edge k. The second derivative is constant along an edge: halving a
    // chord quarters its deviation.
    int calcChord(int k) const {
        const double bend = calcBend(k);
        int length = half;
        while (length > shortest && bend * std::pow(double(length) / whole, 2) > tolerance)
            length /= 2;
        return length;
    }

    // Returns whether chords between middles stay within the tolerance. Those of a triangle run
    // parallel to its edges and bend like them; in a quadrilateral the bends of all edges and the
    // twist add up.
    bool isFlat() const {
        if (numCorners == 3) return chord[0] == half && chord[1] == half && chord[2] == half;
        Point p[4];
        double bound = 0, twist = 0;
        for (int k = 0; k < 4; ++k) {
            p[k] = getPosition(face->corners[at(k)]);
            bound += calcBend(k);
        }
        for (std::size_t i = 0; i < 3; ++i)
            twist += std::pow(0.25 * (p[0][i] - p[1][i] + p[2][i] - p[3][i]), 2);
        return bound + 0.25 * std::sqrt(twist) <= tolerance;
    }

    // Returns the edge that contains both positions, or -1.
    int findEdge(Place a, Place b) const {
        if (a.y == 0 && b.y == 0) return 0;
        if (numCorners == 3) {
            if (a.x + a.y == whole && b.x + b.y == whole) return 1;
            return a.x == 0 && b.x == 0 ? 2 : -1;
        }
        if (a.x == whole && b.x == whole) return 1;
        if (a.y == whole && b.y == whole) return 2;
        return a.x == 0 && b.x == 0 ? 3 : -1;
    }

    // Returns the parameter along edge k, from its first corner.
    int getParameter(int k, Place p) const {
        if (k == 0) return p.x;
        if (k == 1) return p.y;
        return k == 2 && numCorners == 4 ? whole - p.x : whole - p.y;
    }

    Point evaluate(Place p) const {
        const Weights weights = calcWeights(numCorners, p);
        Point x{};
        for (int k = 0; k < weights.count; ++k) {
            const Point node = getPosition(nodeOf(k));
            for (std::size_t i = 0; i < 3; ++i) x[i] += weights.of[std::size_t(k)] * node[i];
        }
        return x;
    }

    int nodeOf(int k) const {
        return k < numCorners ? face->corners[std::size_t(k)]
                              : face->middles[std::size_t(k - numCorners)];
    }

    bool isDivided(Place a, Place b) const {
        const int length = std::max(std::abs(a.x - b.x), std::abs(a.y - b.y));
        const int edge = findEdge(a, b);
        if (edge >= 0) return length > chord[std::size_t(edge)];
        if (length <= shortest || (a.x + b.x) % 2 != 0 || (a.y + b.y) % 2 != 0) return false;
        const Point p = evaluate(a), q = evaluate(b), middle = evaluate(calcMiddle(a, b));
        double distance = 0;
        for (std::size_t i = 0; i < 3; ++i)
            distance += std::pow(middle[i] - 0.5 * (p[i] + q[i]), 2);
        return distance > tolerance * tolerance;
    }

    // Divides sides that deviate too much from the face, recursively.
    void divide(Place a, Place b, Place c) {
        const bool ab = isDivided(a, b), bc = isDivided(b, c), ca = isDivided(c, a);
        const int count = int(ab) + int(bc) + int(ca);
        if (count == 0) {
            addTriangle(find(a), find(b), find(c));
            return;
        }
        const Place mab = calcMiddle(a, b), mbc = calcMiddle(b, c), mca = calcMiddle(c, a);
        if (count == 3) {
            divide(a, mab, mca);
            divide(b, mbc, mab);
            divide(c, mca, mbc);
            divide(mab, mbc, mca);
        } else if (count == 1) {
            if (bc) return divide(b, c, a);
            if (ca) return divide(c, a, b);
            divide(a, mab, c);
            divide(mab, b, c);
        } else {
            if (!bc) return divide(c, a, b);  // rotate until the undivided side is c-a
            if (!ab) return divide(b, c, a);
            divide(mab, b, mbc);
            divide(a, mab, mbc);
            divide(a, mbc, c);
        }
    }

    int find(Place p) {
        const int edge = findEdge(p, p);
        if (edge >= 0) return findOnEdge(edge, getParameter(edge, p));
        const auto [entry, isNew] = inner.try_emplace(p.y * (whole + 1) + p.x, 0);
        if (!isNew) return entry->second;
        const Weights weights = calcWeights(numCorners, p);
        for (int k = 0; k < weights.count; ++k) addWeight(nodeOf(k), weights.of[std::size_t(k)]);
        return entry->second = finishPoint();
    }

    // Returns the point at parameter t of edge k: a node, or a point shared by the edge's faces.
    int findOnEdge(int k, int t) {
        int a = face->corners[at(k)], b = face->corners[at(k + 1)];
        const int m = face->middles[at(k)];
        if (t == 0) return a;
        if (t == whole) return b;
        if (t == half) return m;
        if (a > b) {
            std::swap(a, b);
            t = whole - t;
        }
        // The middle node identifies the edge.
        const auto [entry, isNew] = edgePoints.try_emplace(std::int64_t(m) * whole + t, 0);
        if (!isNew) return entry->second;
        const double x = double(t) / whole;
        addWeight(a, (1 - x) * (1 - 2 * x));
        addWeight(m, 4 * x * (1 - x));
        addWeight(b, x * (2 * x - 1));
        return entry->second = finishPoint();
    }

    void addWeight(int node, double weight) {
        surface.between.nodes.push_back(node);
        surface.between.weights.push_back(float(weight));
    }

    // Points between nodes are numbered after the mesh's nodes.
    int finishPoint() {
        surface.between.starts.push_back(int(surface.between.nodes.size()));
        return mesh.numNodes() + surface.between.size() - 1;
    }

    void addTriangle(int a, int b, int c) { surface.mesh.triangles.push_back({a, b, c}); }
    void addEdge(int a, int b) {
        surface.mesh.elementEdges.push_back({std::min(a, b), std::max(a, b)});
    }

    const Mesh& mesh;
    double tolerance;
    CurvedSurface& surface;
    std::unordered_map<std::int64_t, int> edgePoints;

    // State of the face being divided.
    const MeshFace* face = nullptr;
    int numCorners = 0;
    std::array<int, 4> chord{};  // parameter length of a chord of each edge
    std::map<int, int> inner;    // points by position
};

// Sorts edges and removes duplicates; linear time if no point has many.
void sortEdges(std::vector<std::array<int, 2>>& edges, std::size_t numPoints) {
    std::vector<std::size_t> starts(numPoints + 1, 0);
    for (const auto& edge : edges) ++starts[std::size_t(edge[0]) + 1];
    for (std::size_t i = 1; i < starts.size(); ++i) starts[i] += starts[i - 1];
    std::vector<std::array<int, 2>> sorted(edges.size());
    std::vector<std::size_t> ends(starts.begin(), starts.end() - 1);
    for (const auto& edge : edges) sorted[ends[std::size_t(edge[0])]++] = edge;
    for (std::size_t i = 0; i < numPoints; ++i)
        std::sort(sorted.begin() + std::ptrdiff_t(starts[i]),
                  sorted.begin() + std::ptrdiff_t(starts[i + 1]));
    sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
    edges = std::move(sorted);
}

// Keeps only nodes of the skin, in mesh order, then points between.
void renumber(CurvedSurface& surface, int numMeshNodes) {
    std::vector<int> newIndex(std::size_t(numMeshNodes) + std::size_t(surface.between.size()), -1);
    for (const auto& triangle : surface.mesh.triangles)
        for (const int point : triangle) newIndex[std::size_t(point)] = 0;
    for (const int node : surface.between.nodes) newIndex[std::size_t(node)] = 0;
    for (int node = 0; node < numMeshNodes; ++node)
        if (newIndex[std::size_t(node)] == 0) {
            newIndex[std::size_t(node)] = int(surface.mesh.nodes.size());
            surface.mesh.nodes.push_back(node);
        }
    for (int i = 0; i < surface.between.size(); ++i)
        newIndex[std::size_t(numMeshNodes + i)] = int(surface.mesh.nodes.size()) + i;

    for (auto& triangle : surface.mesh.triangles)
        for (int& point : triangle) point = newIndex[std::size_t(point)];
    for (auto& edge : surface.mesh.elementEdges)
        for (int& point : edge) point = newIndex[std::size_t(point)];
    for (int& node : surface.between.nodes) node = newIndex[std::size_t(node)];
}

}  // namespace

void PointsBetween::interpolate(const float* values, float* out) const {
    for (int i = 0; i < size(); ++i) {
        float sum = 0;
        for (int k = starts[std::size_t(i)]; k < starts[std::size_t(i) + 1]; ++k)
            sum += weights[std::size_t(k)] * values[nodes[std::size_t(k)]];
        out[i] = sum;
    }
}

void PointsBetween::interpolate3(const float* values, float* out) const {
    for (int i = 0; i < size(); ++i) {
        float sum[3] = {0, 0, 0};
        for (int k = starts[std::size_t(i)]; k < starts[std::size_t(i) + 1]; ++k)
            for (int j = 0; j < 3; ++j)
                sum[j] += weights[std::size_t(k)] * values[3 * nodes[std::size_t(k)] + j];
        for (int j = 0; j < 3; ++j) out[3 * i + j] = sum[j];
    }
}

double calcChordTolerance(const Mesh& mesh) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        double low = 0, high = 0;
        for (std::size_t i = k; i < mesh.positions.size(); i += 3) {
            low = i == k ? mesh.positions[i] : std::min(low, mesh.positions[i]);
            high = i == k ? mesh.positions[i] : std::max(high, mesh.positions[i]);
        }
        sum += (high - low) * (high - low);
    }
    return 3e-4 * std::sqrt(sum);
}

CurvedSurface extractCurvedSurface(const Mesh& mesh, double tolerance) {
    CurvedSurface surface;
    const std::vector<MeshFace> faces = extractBoundaryFaces(mesh);
    std::size_t numTriangles = 0, numEdges = 0;
    for (const MeshFace& face : faces) {
        const bool isSquare = face.numCorners() == 4;
        numTriangles += face.isQuadratic() ? (isSquare ? 6 : 4) : (isSquare ? 2 : 1);
        numEdges += std::size_t(face.numCorners()) * (face.isQuadratic() ? 2 : 1);
    }
    surface.mesh.triangles.reserve(numTriangles);
    surface.mesh.elementEdges.reserve(numEdges);
    Divider divider(mesh, tolerance, surface);
    for (const MeshFace& face : faces) divider.divide(face);
    renumber(surface, mesh.numNodes());
    sortEdges(surface.mesh.elementEdges, std::size_t(surface.numPoints()));
    return surface;
}

SurfaceMesh extractSurface(const Mesh& mesh) {
    return extractCurvedSurface(mesh, std::numeric_limits<double>::infinity()).mesh;
}

}  // namespace simflex
