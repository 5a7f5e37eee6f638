#include "GlView.h"

#include <algorithm>
#include <cmath>

namespace simflex {

using SimTK::Vec3;

GlView::GlView(const Camera& viewCamera, const FrameStyle& viewStyle, int pictureWidth,
               int pictureHeight, int firstRow, int numRows)
    : camera(viewCamera),
      style(viewStyle),
      width(pictureWidth),
      height(pictureHeight),
      bottom(firstRow),
      rows(numRows) {
    const auto whole = camera.calcProjection(getAspect());
    isPerspective = whole[11] != 0;
    projection = cut(whole);
}

std::array<float, 16> GlView::cut(std::array<float, 16> P) const {
    if (bottom == 0 && rows == height) return P;
    const double stretch = double(height) / rows, middle = (2.0 * bottom + rows) / height - 1;
    for (int column = 0; column < 4; ++column)
        P[4 * column + 1] = float(stretch * (P[4 * column + 1] - middle * P[4 * column + 3]));
    return P;
}

SimTK::Vec2 GlView::calcPixelSize() const {
    const double size = camera.calcPixelSize(1, height);
    return isPerspective ? SimTK::Vec2(size, 0) : SimTK::Vec2(0, size);
}

SimTK::Vec2 GlView::calcShift(double numPixels) const {
    const SimTK::Vec2 size = calcPixelSize();
    return SimTK::Vec2(1 - numPixels * size[0], numPixels * size[1]);
}

bool GlRectangle::overlaps(const GlRectangle& other) const {
    return left < other.right && other.left < right && bottom < other.top && other.bottom < top;
}

void GlRectangle::include(const GlRectangle& other) {
    left = std::min(left, other.left);
    bottom = std::min(bottom, other.bottom);
    right = std::max(right, other.right);
    top = std::max(top, other.top);
}

GlRectangle calcCoveredRectangle(const GlView& view, const std::vector<Vec3>& points_G,
                                 int padding) {
    const GlRectangle whole = {0, 0, view.width, view.rows};
    GlRectangle covered = {view.width, view.rows, 0, 0};
    const auto limit = [](double x, int end) {
        return int(std::min(double(end), std::max(0.0, x)));
    };
    for (const Vec3& p : points_G) {
        const Vec3 pixel = view.camera.calcPixel(p, view.width, view.height);
        if (!(pixel[2] > view.camera.nearPlane)) return whole;
        const double x = pixel[0], y = view.height - pixel[1] - view.bottom;
        covered.include({limit(x - padding, view.width), limit(y - padding, view.rows),
                         limit(x + padding + 1, view.width), limit(y + padding + 1, view.rows)});
    }
    return covered;
}

std::array<float, 16> calcModelView(const SimTK::Transform& X, const Vec3& scale) {
    std::array<float, 16> m{};
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            m[4 * column + row] = float(X.R()[row][column] * scale[column]);
    for (int row = 0; row < 3; ++row) m[12 + row] = float(X.p()[row]);
    m[15] = 1;
    return m;
}

std::array<float, 9> calcNormalMatrix(const SimTK::Rotation& R, const Vec3& scale) {
    const double largest =
        std::max({std::abs(scale[0]), std::abs(scale[1]), std::abs(scale[2]), SimTK::TinyReal});
    const Vec3 s = scale / largest;
    Vec3 cofactor(s[1] * s[2], s[2] * s[0], s[0] * s[1]);
    cofactor /= std::max(
        {std::abs(cofactor[0]), std::abs(cofactor[1]), std::abs(cofactor[2]), SimTK::TinyReal});
    std::array<float, 9> m{};
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row)
            m[3 * column + row] = float(R[row][column] * cofactor[column]);
    return m;
}

}  // namespace simflex
