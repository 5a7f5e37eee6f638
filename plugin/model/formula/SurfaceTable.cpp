#include "simflex/model/formula/SurfaceTable.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace formula {

namespace {

const std::size_t MostValues = 5000000;

void checkAxis(const std::string& axis, const std::vector<double>& points) {
    if (points.size() < 2)
        throw std::invalid_argument("a table of two variables needs at least two values of " +
                                    axis);
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!std::isfinite(points[i]))
            throw std::invalid_argument("value " + std::to_string(i) + " of " + axis +
                                        " is not finite");
        if (i > 0 && !(points[i] > points[i - 1]))
            throw std::invalid_argument(axis + " must increase, but " + writeGeneral(points[i], 6) +
                                        " follows " + writeGeneral(points[i - 1], 6));
    }
}

}  // namespace

SurfaceTable::SurfaceTable(std::string name, std::vector<double> x, std::vector<double> y,
                           const std::vector<std::vector<double>>& z,
                           Table::Interpolation interpolation, Table::Extrapolation extrapolation)
    : m_name(std::move(name)),
      m_points{std::move(x), std::move(y)},
      m_interpolation(interpolation),
      m_extrapolation(extrapolation) {
    checkAxis("x", m_points[0]);
    checkAxis("y", m_points[1]);
    if (m_interpolation == Table::Interpolation::Step)
        throw std::invalid_argument(
            "a table of two variables cannot have steps: choose spline or linear");
    const std::size_t n = m_points[0].size(), m = m_points[1].size();
    if (n * m > MostValues)
        throw std::invalid_argument("the table has more than " + std::to_string(MostValues) +
                                    " values");
    if (z.size() != n)
        throw std::invalid_argument("z has " + std::to_string(z.size()) + " rows and x " +
                                    std::to_string(n) + " values; every x has one row");
    m_values.resize(n * m);
    for (std::size_t i = 0; i < n; ++i) {
        if (z[i].size() != m)
            throw std::invalid_argument("row " + std::to_string(i) + " of z has " +
                                        std::to_string(z[i].size()) + " values and y " +
                                        std::to_string(m) + "; every y has one in each row");
        for (std::size_t j = 0; j < m; ++j) {
            if (!std::isfinite(z[i][j]))
                throw std::invalid_argument("value " + std::to_string(j) + " of row " +
                                            std::to_string(i) + " of z is not finite");
            m_values[i * m + j] = {z[i][j], 0, 0, 0};
        }
    }
    if (m_interpolation != Table::Interpolation::Spline) return;
    for (std::size_t i = 0; i < n; ++i) {
        const std::vector<double> curvature = calcSplineCurvature(m_points[1], z[i]);
        for (std::size_t j = 0; j < m; ++j) m_values[i * m + j][1] = curvature[j];
    }
    std::vector<double> column(n);
    for (std::size_t j = 0; j < m; ++j)
        for (std::size_t k : {0, 1}) {
            for (std::size_t i = 0; i < n; ++i) column[i] = m_values[i * m + j][k];
            const std::vector<double> curvature = calcSplineCurvature(m_points[0], column);
            for (std::size_t i = 0; i < n; ++i) m_values[i * m + j][2 + k] = curvature[i];
        }
    for (const auto& value : m_values)
        for (double number : value)
            if (!std::isfinite(number))
                throw std::invalid_argument(
                    "no spline goes through the points: they are too far apart or too close");
}

std::string SurfaceTable::describeRefusal(double x, double y) const {
    const auto write = [](double a, double b) {
        return "(" + writeGeneral(a, 6) + ", " + writeGeneral(b, 6) + ")";
    };
    return "table '" + m_name + "' is evaluated at " + write(x, y) + ", outside its grid from " +
           write(m_points[0].front(), m_points[1].front()) + " to " +
           write(m_points[0].back(), m_points[1].back());
}

SurfaceTable SurfaceTable::fromPoints(std::string name,
                                      const std::vector<std::vector<double>>& points,
                                      Table::Interpolation interpolation,
                                      Table::Extrapolation extrapolation) {
    const std::size_t numPoints = points[0].size();
    std::array<std::vector<double>, 2> axes;
    for (std::size_t a = 0; a < 2; ++a) {
        axes[a] = points[a];
        std::sort(axes[a].begin(), axes[a].end());
        axes[a].erase(std::unique(axes[a].begin(), axes[a].end()), axes[a].end());
    }
    const auto refuse = [&](std::size_t i, std::size_t j, const char* what) {
        throw std::invalid_argument("the point (" + writeGeneral(axes[0][i], 6) + ", " +
                                    writeGeneral(axes[1][j], 6) + ") " + what +
                                    "; there must be one for every x and every y");
    };
    // Check before allocating, since some columns form no grid at all.
    if (axes[0].size() * axes[1].size() > numPoints + MostValues)
        throw std::invalid_argument(std::to_string(numPoints) + " points with " +
                                    std::to_string(axes[0].size()) + " values of x and " +
                                    std::to_string(axes[1].size()) +
                                    " of y are no grid; there must be one for every x and every y");
    constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
    std::vector<std::vector<double>> z(axes[0].size(),
                                       std::vector<double>(axes[1].size(), nothing));
    for (std::size_t k = 0; k < numPoints; ++k) {
        const auto find = [&](std::size_t a) {
            return std::size_t(std::lower_bound(axes[a].begin(), axes[a].end(), points[a][k]) -
                               axes[a].begin());
        };
        const std::size_t i = find(0), j = find(1);
        if (!std::isnan(z[i][j])) refuse(i, j, "stands there twice");
        z[i][j] = points[2][k];
    }
    for (std::size_t i = 0; i < z.size(); ++i)
        for (std::size_t j = 0; j < z[i].size(); ++j)
            if (std::isnan(z[i][j])) refuse(i, j, "is missing");
    return SurfaceTable(std::move(name), axes[0], axes[1], z, interpolation, extrapolation);
}

bool SurfaceTable::covers(double x, double y) const {
    if (std::isnan(x) || std::isnan(y)) return false;
    if (m_extrapolation != Table::Extrapolation::Refuse) return true;
    const auto isIn = [&](int axis, double at) {
        return at >= m_points[axis].front() && at <= m_points[axis].back();
    };
    return isIn(0, x) && isIn(1, y);
}

/** See Table::findPiece(). **/
int SurfaceTable::findPiece(int axis, double at, Table::Side side) const {
    const std::vector<double>& points = m_points[axis];
    const int last = static_cast<int>(points.size()) - 2;
    if (m_extrapolation == Table::Extrapolation::Refuse)
        side = at <= points.front()  ? Table::Side::Right
               : at >= points.back() ? Table::Side::Left
                                     : side;
    if (at < points.front() || (at == points.front() && side == Table::Side::Left)) return -1;
    if (at > points.back() || (at == points.back() && side == Table::Side::Right)) return last + 1;
    const auto next = side == Table::Side::Right
                          ? std::upper_bound(points.begin(), points.end(), at)
                          : std::lower_bound(points.begin(), points.end(), at);
    return std::clamp(static_cast<int>(next - points.begin()) - 1, 0, last);
}

template <class Number>
SurfaceTable::Weights<Number> SurfaceTable::weigh(int axis, int piece, const Number& at,
                                                  int order) const {
    const std::vector<double>& points = m_points[axis];
    const int count = static_cast<int>(points.size()) - 1;
    if (piece < 0 || piece == count) {
        const int inner = piece < 0 ? 0 : count - 1;
        const double end = piece < 0 ? points.front() : points.back();
        const bool isLinear = m_extrapolation == Table::Extrapolation::Linear;
        Weights<Number> weights = weigh(axis, inner, Number(end), order == 0 ? 0 : 1);
        const Weights<Number> slope = weigh(axis, inner, Number(end), 1);
        const Number distance = !isLinear ? Number(0) : at - Number(end);
        const bool isZero = order == 2 || (order == 1 && !isLinear);
        for (std::size_t k : {0, 1}) {
            if (order == 0) {
                weights.values[k] = weights.values[k] + distance * slope.values[k];
                weights.curvatures[k] = weights.curvatures[k] + distance * slope.curvatures[k];
            } else if (isZero) {
                weights.values[k] = weights.curvatures[k] = Number(0);
            }
        }
        return weights;
    }
    const auto i = static_cast<std::size_t>(piece);
    const double h = points[i + 1] - points[i];
    const Number a = Number(points[i + 1]) - at, b = at - Number(points[i]), width(h), H(h * h),
                 six(6 * h), three(3), zero(0);
    if (order == 0)
        return {piece, {a / width, b / width}, {a * (a * a - H) / six, b * (b * b - H) / six}};
    if (order == 1)
        return {piece,
                {Number(-1 / h), Number(1 / h)},
                {(H - three * (a * a)) / six, (three * (b * b) - H) / six}};
    return {piece, {zero, zero}, {a / width, b / width}};
}

template <class Number>
Number SurfaceTable::sum(const Weights<Number>& x, const Weights<Number>& y) const {
    const std::size_t m = m_points[1].size();
    Number total(0);
    for (std::size_t i : {0, 1})
        for (std::size_t j : {0, 1}) {
            const std::array<double, 4>& z = m_values[(static_cast<std::size_t>(x.piece) + i) * m +
                                                      static_cast<std::size_t>(y.piece) + j];
            total = total +
                    x.values[i] * (y.values[j] * Number(z[0]) + y.curvatures[j] * Number(z[1])) +
                    x.curvatures[i] * (y.values[j] * Number(z[2]) + y.curvatures[j] * Number(z[3]));
        }
    return total;
}

double SurfaceTable::calc(double x, double y, int i, int j, const Sides& sides) const {
    return sum(weigh(0, findPiece(0, x, sides[0]), x, i),
               weigh(1, findPiece(1, y, sides[1]), y, j));
}

std::vector<SurfaceTable::Weights<Interval>> SurfaceTable::weighAll(int axis, const Interval& at,
                                                                    int order) const {
    const std::vector<double>& points = m_points[axis];
    const int first = findPiece(axis, at.low, Table::Side::Right),
              last = std::max(first, findPiece(axis, at.high, Table::Side::Left)),
              count = static_cast<int>(points.size()) - 1;
    // Across a kink, the next derivative is unbounded.
    const int smooth = m_interpolation == Table::Interpolation::Spline ? 2 : 1;
    if (last > first && (order > smooth || (order > 0 && (first < 0 || last == count)))) return {};
    std::vector<Weights<Interval>> all;
    for (int piece = first; piece <= last; ++piece) {
        const double begin = piece <= first ? at.low : points[static_cast<std::size_t>(piece)];
        const double end = piece >= last ? at.high : points[static_cast<std::size_t>(piece) + 1];
        all.push_back(weigh(axis, piece, Interval(begin, end), order));
    }
    return all;
}

Interval SurfaceTable::calcBounds(const Interval& x, const Interval& y, int i, int j) const {
    const auto xs = weighAll(0, x, i), ys = weighAll(1, y, j);
    if (xs.empty() || ys.empty()) return Interval::makeWhole();
    Interval bounds = Interval::makeEmpty();
    for (const auto& wx : xs)
        for (const auto& wy : ys) bounds = hull(bounds, sum(wx, wy));
    return bounds;
}

}  // namespace formula
}  // namespace simflex
