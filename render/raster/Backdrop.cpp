#include "Backdrop.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace simflex {
namespace raster {

using SimTK::dot;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

double smoothStep(double low, double high, double x) {
    const double t = std::min(std::max((x - low) / (high - low), 0.0), 1.0);
    return t * t * (3 - 2 * t);
}

double fract(double x) {
    return x - std::floor(x);
}

double fade(double x, double y, double size) {
    return 1 - smoothStep(0.25, 1, std::sqrt(x * x + y * y) / size);
}

/** Coverage of a pixel by lines one `period` apart that are `width` pixels wide. **/
double cover(const double* place, const double* pixel, double period, double width) {
    double most = 0;
    for (int k = 0; k < 2; ++k) {
        const double size = pixel[k] / period;
        const double distance =
            std::abs(fract(place[k] / period - 0.5) - 0.5) / std::max(size, 1e-6);
        const double c = std::min(std::max(0.5 + 0.5 * width - distance, 0.0), 1.0);
        most = std::max(most, c * std::min(std::max(1.5 - 4 * size, 0.0), 1.0));
    }
    return most;
}

std::uint8_t toByte(double x) {
    return std::uint8_t(std::lround(255 * std::min(std::max(x, 0.0), 1.0)));
}

}  // namespace

GroundView::GroundView(const GlView& view) {
    const Transform X_CP = view.toCamera(view.style.ground.X_GP);
    const Vec3 origin = X_CP.p(), normal(X_CP.R().z());
    const auto& P = view.projection;
    const double height = dot(normal, origin);
    const auto find = [&](double column, double row, double& z) {
        const double x = (2 * column / view.width - 1) / P[0];
        const double y = (1 - 2 * row / view.height) / P[5];
        if (view.isPerspective) {
            const Vec3 ray(x, y, -1);
            const double depth = dot(normal, ray) / height;
            z = 0.5 + 0.5 * (-double(P[10]) + double(P[14]) * depth);
            return Place{dot(Vec3(X_CP.R().x()), ray) - dot(Vec3(X_CP.R().x()), origin) * depth,
                         dot(Vec3(X_CP.R().y()), ray) - dot(Vec3(X_CP.R().y()), origin) * depth,
                         depth};
        }
        const Vec3 p(x, y, (height - normal[0] * x - normal[1] * y) / normal[2]);
        z = 0.5 + 0.5 * (double(P[10]) * p[2] + double(P[14]));
        return Place{dot(Vec3(X_CP.R().x()), p - origin), dot(Vec3(X_CP.R().y()), p - origin), 1};
    };
    double z = 0;
    start = find(0, 0, zStart);
    const Place right = find(1, 0, z);
    zByColumn = z - zStart;
    const Place below = find(0, 1, z);
    zByRow = z - zStart;
    byColumn = {right.x - start.x, right.y - start.y, right.depth - start.depth};
    byRow = {below.x - start.x, below.y - start.y, below.depth - start.depth};
}

GroundView::Place GroundView::at(double column, double row) const {
    return {start.x + column * byColumn.x + row * byRow.x,
            start.y + column * byColumn.y + row * byRow.y,
            start.depth + column * byColumn.depth + row * byRow.depth};
}

void Backdrop::update(const GlView& view, bool hasGround) {
    const FrameStyle& style = view.style;
    const GroundStyle& ground = style.ground;
    std::vector<double> wanted = {
        double(hasGround),    ground.radius,      ground.gridSpacing,  ground.gridOffset[0],
        ground.gridOffset[1], double(view.width), double(view.height), style.unit};
    for (const Vec3& color : {style.palette.backgroundTop, style.palette.backgroundBottom,
                              style.palette.ground, style.palette.grid})
        wanted.insert(wanted.end(), {color[0], color[1], color[2]});
    const GroundView onGround(view);
    if (hasGround)
        for (const GroundView::Place& place : {onGround.start, onGround.byColumn, onGround.byRow})
            wanted.insert(wanted.end(), {place.x, place.y, place.depth});
    if (wanted == key) return;
    key = wanted;
    image = Image(view.width, view.height);

    const Vec3 &top = style.palette.backgroundTop, &bottom = style.palette.backgroundBottom;
    const double amplitude = top == bottom ? 0 : 1.0 / 255;
    const double lineWidth = std::max(1.0, style.unit);
    const int width = view.width, height = view.height;
#pragma omp parallel for schedule(static)
    for (int row = 0; row < height; ++row) {
        std::uint8_t* to = image.updData() + 4 * std::size_t(row) * std::size_t(width);
        const double up = height - row - 0.5;
        const Vec3 background = bottom + smoothStep(0, 1, up / height) * (top - bottom);
        for (int column = 0; column < width; ++column, to += 4) {
            // Half a level of ordered noise hides the steps of the gradient.
            const double noise =
                amplitude *
                (fract(52.9829189 * fract((column + 0.5) * 0.06711056 + up * 0.00583715)) - 0.5);
            for (int k = 0; k < 3; ++k) to[k] = toByte(background[k] + noise);
            to[3] = 255;
            if (!hasGround) continue;
            const GroundView::Place h = onGround.at(column + 0.5, row + 0.5);
            if (!(h.depth > 0)) continue;
            const double p[2] = {h.x / h.depth, h.y / h.depth};
            const double share = fade(p[0], p[1], ground.radius);
            if (share <= 0) continue;
            const double pixel[2] = {
                (std::abs(onGround.byColumn.x - p[0] * onGround.byColumn.depth) +
                 std::abs(onGround.byRow.x - p[0] * onGround.byRow.depth)) /
                    h.depth,
                (std::abs(onGround.byColumn.y - p[1] * onGround.byColumn.depth) +
                 std::abs(onGround.byRow.y - p[1] * onGround.byRow.depth)) /
                    h.depth};
            const double q[2] = {p[0] - ground.gridOffset[0], p[1] - ground.gridOffset[1]};
            const double grid =
                std::max(0.45 * cover(q, pixel, ground.gridSpacing, lineWidth),
                         0.9 * cover(q, pixel, 5 * ground.gridSpacing, 1.2 * lineWidth));
            for (int k = 0; k < 3; ++k) {
                const double shade = style.palette.ground[k] +
                                     grid * (style.palette.grid[k] - style.palette.ground[k]);
                to[k] = toByte(share * shade + (1 - share) * to[k] / 255.0);
            }
        }
    }
}

void Backdrop::copy(int row, const GlView& view, std::uint8_t* to) const {
    const std::size_t rowBytes = 4 * std::size_t(view.width);
    std::memcpy(to, image.getData() + std::size_t(row) * rowBytes, rowBytes);
}

namespace {

/** Texels of the shadow as a homogeneous function of the pixel, from their middles. **/
GroundView::Place toTexels(const GroundView::Place& place, const SimTK::Vec4& region, double half) {
    constexpr double size = GroundShadow::size;
    return {size * region[2] * (place.x - region[0] * place.depth) - half * place.depth,
            size * region[3] * (place.y - region[1] * place.depth) - half * place.depth,
            place.depth};
}

}  // namespace

Area findShaded(const GlView& view, const GroundShadow& shadow) {
    const Area whole = {0, 0, view.width, view.height};
    const GroundShadow::Box& box = shadow.getBox();
    const SimTK::Vec4& region = shadow.getRegion();
    const Transform X_CP = view.toCamera(view.style.ground.X_GP);
    Area area = {view.width, view.height, 0, 0};
    const auto& P = view.projection;
    for (const double u : {box.left - 1.0, box.right + 1.0})
        for (const double v : {box.bottom - 1.0, box.top + 1.0}) {
            const Vec3 p = X_CP * Vec3(region[0] + u / (GroundShadow::size * region[2]),
                                       region[1] + v / (GroundShadow::size * region[3]), 0);
            if (view.isPerspective && !(-p[2] > view.camera.nearPlane)) return whole;
            const double w = view.isPerspective ? -1 / p[2] : 1;
            const double x = (0.5 + 0.5 * P[0] * p[0] * w) * view.width;
            const double y = (0.5 - 0.5 * P[5] * p[1] * w) * view.height;
            const auto limit = [](double at, int most) {
                return int(std::min(std::max(at, 0.0), double(most)));
            };
            area.left = std::min(area.left, limit(x - 1, view.width));
            area.right = std::max(area.right, limit(x + 2, view.width));
            area.top = std::min(area.top, limit(y - 1, view.height));
            area.bottom = std::max(area.bottom, limit(y + 2, view.height));
        }
    return area;
}

void darken(int row, const Area& area, const GlView& view, const GroundShadow& shadow,
            const std::uint8_t* isHidden, std::uint8_t* pixels) {
    constexpr float absorption[3] = {0.42f, 0.40f, 0.36f};
    constexpr int size = GroundShadow::size;
    const GroundView onGround(view);
    const GroundShadow::Box& box = shadow.getBox();
    const SimTK::Vec4& region = shadow.getRegion();
    const std::uint8_t* const texels = shadow.getTexels().data();
    const GroundView::Place first = onGround.at(area.left + 0.5, row + 0.5);
    const GroundView::Place start = toTexels(first, region, 0.5),
                            step = toTexels(onGround.byColumn, region, 0.5);
    for (int column = area.left; column < area.right; ++column) {
        if (isHidden && isHidden[column]) continue;
        const double n = column - area.left, depth = start.depth + n * step.depth;
        if (!(depth > 0)) continue;
        const float u = float((start.x + n * step.x) / depth),
                    v = float((start.y + n * step.y) / depth);
        if (!(u > float(box.left - 1) && u < float(box.right) && v > float(box.bottom - 1) &&
              v < float(box.top)))
            continue;
        const int i = int(std::floor(u)), j = int(std::floor(v));
        const auto texel = [&](int x, int y) {
            return float(texels[std::size_t(std::min(std::max(y, 0), size - 1)) * size +
                                std::size_t(std::min(std::max(x, 0), size - 1))]);
        };
        const float a = u - float(i), b = v - float(j);
        const float value = (1 - b) * ((1 - a) * texel(i, j) + a * texel(i + 1, j)) +
                            b * ((1 - a) * texel(i, j + 1) + a * texel(i + 1, j + 1));
        if (value == 0) continue;
        const double x = (first.x + n * onGround.byColumn.x) / depth,
                     y = (first.y + n * onGround.byColumn.y) / depth;
        const float dark = value / 255 * float(fade(x, y, view.style.ground.radius));
        std::uint8_t* const to = pixels + 4 * std::size_t(column);
        for (int k = 0; k < 3; ++k)
            to[k] = std::uint8_t(float(to[k]) * (1 - dark * absorption[k]) + 0.5f);
    }
}

}  // namespace raster
}  // namespace simflex
