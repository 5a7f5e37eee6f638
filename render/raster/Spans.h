#pragma once
/** @file
Which samples of which pixels a convex polygon covers, a row at a time. Internal to the rasterizer.

Pixels are counted from the top left corner, y downwards; each has four samples, where OpenGL's
software rasterizers have them. A sample on an edge belongs to one side only: polygons that share an
edge, from the same two points, cover each sample along it once. **/

#include <algorithm>
#include <cmath>

namespace simflex {
namespace raster {

constexpr int numSamples = 4;
struct SamplePlace {
    float x, y;
};
constexpr SamplePlace samplePlaces[numSamples] = {
    {0.375f, 0.875f}, {0.875f, 0.625f}, {0.125f, 0.375f}, {0.625f, 0.125f}};

/** Pixels, the latter two exclusive. **/
struct Area {
    int left = 0, top = 0, right = 0, bottom = 0;
    bool isEmpty() const { return left >= right || top >= bottom; }
};

template <int n>
class Polygon {
public:
    /** Corners in the picture [pixel]. **/
    Polygon(const float* x, const float* y) {
        top = *std::min_element(y, y + n);
        bottom = *std::max_element(y, y + n);
        for (int i = 0; i < n; ++i) {
            const int a = y[i] <= y[(i + 1) % n] ? i : (i + 1) % n, b = a == i ? (i + 1) % n : i;
            Edge& edge = edges[i];
            edge.x = x[a];
            edge.y = y[a];
            edge.end = y[b];
            edge.slope = y[b] > y[a] ? (x[b] - x[a]) / (y[b] - y[a]) : 0;
        }
    }

    /** Calls span(sample, row, first column, end column) for what is inside of an area. **/
    template <class Span>
    void forEachSpan(const Area& area, const Span& span) const {
        for (int s = 0; s < numSamples; ++s) {
            const int first = std::max(area.top, toIndex(top - samplePlaces[s].y));
            const int end = std::min(area.bottom, toIndex(bottom - samplePlaces[s].y));
            for (int row = first; row < end; ++row) {
                const float y = float(row) + samplePlaces[s].y;
                float left = 1e9f, right = -1e9f;
                for (const Edge& edge : edges) {
                    const bool crosses = edge.y <= y && y < edge.end;
                    const float x = edge.x + (y - edge.y) * edge.slope;
                    left = crosses ? std::min(left, x) : left;
                    right = crosses ? std::max(right, x) : right;
                }
                const int from = std::max(area.left, toIndex(left - samplePlaces[s].x));
                const int to = std::min(area.right, toIndex(right - samplePlaces[s].x));
                if (from < to) span(s, row, from, to);
            }
        }
    }

private:
    /** The next whole number. **/
    static int toIndex(float x) {
        constexpr float most = 1e6f;
        return int(std::ceil(std::min(std::max(x, -most), most)));
    }

    struct Edge {
        float x, y, end, slope;  // from its upper end
    };
    Edge edges[n];
    float top, bottom;
};

/** A quantity that is linear across the picture, as depth is, within its range on a polygon. **/
struct LinearField {
    float x0 = 0, y0 = 0, value = 0, byX = 0, byY = 0, least = 0, most = 0;

    /** Through the values at three corners; `area` is twice that of the triangle, with sign. **/
    LinearField(const float* x, const float* y, const float* v, float area)
        : x0(x[0]),
          y0(y[0]),
          value(v[0]),
          byX(((v[1] - v[0]) * (y[2] - y[0]) - (v[2] - v[0]) * (y[1] - y[0])) / area),
          byY(((v[2] - v[0]) * (x[1] - x[0]) - (v[1] - v[0]) * (x[2] - x[0])) / area),
          least(std::min({v[0], v[1], v[2]})),
          most(std::max({v[0], v[1], v[2]})) {}

    /** At a sample, without the limits. **/
    float at(int column, int row, int sample) const {
        return value + byX * (float(column) + samplePlaces[sample].x - x0) +
               byY * (float(row) + samplePlaces[sample].y - y0);
    }
    float limit(float v) const { return std::min(std::max(v, least), most); }
};

inline float calcArea(const float* x, const float* y) {
    return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
}

}  // namespace raster
}  // namespace simflex
