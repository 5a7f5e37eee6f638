#include "simflex/cli/model/Table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace simflex {
namespace cli {

namespace {

const std::size_t kMaxPoints = 5000000;

std::string writeNumber(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", value);
    return text;
}

/** Second derivatives at the points of the spline that is not a knot at its ends. **/
std::vector<double> calcCurvature(const std::vector<double>& x, const std::vector<double>& y) {
    const std::size_t n = x.size();
    std::vector<double> curvature(n, 0);
    if (n < 3) return curvature;
    const auto h = [&](std::size_t i) { return x[i + 1] - x[i]; };
    const auto slope = [&](std::size_t i) { return (y[i + 1] - y[i]) / h(i); };
    if (n == 3) {
        const double c = 2 * (slope(1) - slope(0)) / (h(0) + h(1));
        return {c, c, c};
    }
    // h_{i-1} M_{i-1} + 2 (h_{i-1} + h_i) M_i + h_i M_{i+1} = 6 (slope_i - slope_{i-1}), with M_0
    // and M_{n-1} eliminated by continuity of the third derivative
    std::vector<double> lower(n, 0), diagonal(n, 1), upper(n, 0), right(n, 0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
        lower[i] = h(i - 1);
        diagonal[i] = 2 * (h(i - 1) + h(i));
        upper[i] = h(i);
        right[i] = 6 * (slope(i) - slope(i - 1));
    }
    const double first = h(0) / h(1), last = h(n - 2) / h(n - 3);
    diagonal[1] += h(0) * (1 + first);
    upper[1] -= h(0) * first;
    diagonal[n - 2] += h(n - 2) * (1 + last);
    lower[n - 2] -= h(n - 2) * last;
    for (std::size_t i = 2; i + 1 < n; ++i) {
        const double factor = lower[i] / diagonal[i - 1];
        diagonal[i] -= factor * upper[i - 1];
        right[i] -= factor * right[i - 1];
    }
    curvature[n - 2] = right[n - 2] / diagonal[n - 2];
    for (std::size_t i = n - 2; i-- > 1;)
        curvature[i] = (right[i] - upper[i] * curvature[i + 1]) / diagonal[i];
    curvature[0] = (1 + first) * curvature[1] - first * curvature[2];
    curvature[n - 1] = (1 + last) * curvature[n - 2] - last * curvature[n - 3];
    return curvature;
}

}  // namespace

Table::Table(std::string name, std::vector<double> x, std::vector<double> y,
             Interpolation interpolation, Extrapolation extrapolation)
    : _name(std::move(name)),
      _x(std::move(x)),
      _y(std::move(y)),
      _interpolation(interpolation),
      _extrapolation(extrapolation) {
    if (_x.size() != _y.size())
        throw std::invalid_argument("x has " + std::to_string(_x.size()) + " values and y has " +
                                    std::to_string(_y.size()) + "; they must be as many");
    if (_x.size() < 2) throw std::invalid_argument("a table wants at least two points");
    for (std::size_t i = 0; i < _x.size(); ++i) {
        if (!std::isfinite(_x[i]) || !std::isfinite(_y[i]))
            throw std::invalid_argument("point " + std::to_string(i) + " is not finite");
        if (i > 0 && !(_x[i] > _x[i - 1]))
            throw std::invalid_argument("x must increase, but " + writeNumber(_x[i]) + " follows " +
                                        writeNumber(_x[i - 1]));
    }
    if (_interpolation == Interpolation::Spline) {
        _curvature = calcCurvature(_x, _y);
        for (double value : _curvature)
            if (!std::isfinite(value))
                throw std::invalid_argument(
                    "no spline goes through the points: they are too far apart or too close");
    }
}

double Table::calc(double x, int order) const {
    const bool isBelow = x<_x.front(), isAbove = x> _x.back();
    if (isBelow || isAbove) {
        if (_extrapolation == Extrapolation::Refuse)
            throw std::domain_error("table '" + _name + "' is asked for " + writeNumber(x) +
                                    ", outside of its points from " + writeNumber(_x.front()) +
                                    " to " + writeNumber(_x.back()));
        const double end = isBelow ? _x.front() : _x.back();
        const double value = isBelow ? _y.front() : _y.back();
        if (_extrapolation == Extrapolation::Constant) return order == 0 ? value : 0;
        const double slope = calcInside(isBelow ? 0 : _x.size() - 2, end, 1);
        return order == 0 ? value + slope * (x - end) : order == 1 ? slope : 0;
    }
    if (x == _x.back() && _interpolation == Interpolation::Step) return order == 0 ? _y.back() : 0;
    const auto next = std::upper_bound(_x.begin(), _x.end(), x);
    const std::size_t after = static_cast<std::size_t>(next - _x.begin());
    return calcInside(std::min(after, _x.size() - 1) - (after == 0 ? 0 : 1), x, order);
}

double Table::calcInside(std::size_t i, double x, int order) const {
    if (_interpolation == Interpolation::Step) return order == 0 ? _y[i] : 0;
    const double h = _x[i + 1] - _x[i], slope = (_y[i + 1] - _y[i]) / h;
    const double a = _x[i + 1] - x, b = x - _x[i];
    double c0 = 0, c1 = 0;
    if (_interpolation == Interpolation::Spline) {
        c0 = _curvature[i];
        c1 = _curvature[i + 1];
    }
    switch (order) {
        case 0:  // the nearer end first: exact at the points
            return _y[i] * (a / h) + _y[i + 1] * (b / h) + c0 * a * (a * a - h * h) / (6 * h) +
                   c1 * b * (b * b - h * h) / (6 * h);
        case 1:
            return slope + c0 * (h * h - 3 * a * a) / (6 * h) + c1 * (3 * b * b - h * h) / (6 * h);
        default:
            return (c0 * a + c1 * b) / h;
    }
}

void readTableFile(const std::string& path, int columnX, int columnY, std::vector<double>& x,
                   std::vector<double>& y) {
    std::ifstream file(path);
    if (!file) throw std::runtime_error("cannot read the file " + path);
    std::string line;
    for (int number = 1; std::getline(file, line); ++number) {
        const std::string place = path + ":" + std::to_string(number) + ": ";
        if (line.size() > 100000) throw std::runtime_error(place + "the line is too long");
        if (number == 1 && line.compare(0, 3, "\xEF\xBB\xBF") == 0) line.erase(0, 3);
        const std::size_t begin = line.find_first_not_of(" \t\r");
        if (begin == std::string::npos || line[begin] == '#') continue;
        std::vector<double> values;
        bool isText = false;
        const char* at = line.c_str() + begin;
        const char* const lineEnd = line.c_str() + line.size();
        while (at < lineEnd) {
            double value = 0;
            const char* const first = at[0] == '+' && at[1] != '-' ? at + 1 : at;
            const std::from_chars_result read = std::from_chars(first, lineEnd, value);
            if (read.ec != std::errc() || !std::isfinite(value)) {
                isText = true;
                break;
            }
            values.push_back(value);
            at = read.ptr;
            while (*at == ' ' || *at == '\t' || *at == '\r') ++at;
            if (*at == ',' || *at == ';') ++at;
            while (*at == ' ' || *at == '\t' || *at == '\r') ++at;
        }
        if (isText && x.empty() && values.empty()) continue;  // names of the columns
        if (isText)
            throw std::runtime_error(place + "'" + std::string(at).substr(0, 30) +
                                     "' is no finite number");
        const int wanted = std::max(columnX, columnY);
        if (static_cast<int>(values.size()) <= wanted)
            throw std::runtime_error(place + "the line has " + std::to_string(values.size()) +
                                     " columns; column " + std::to_string(wanted) +
                                     " (counted from 0) is wanted");
        x.push_back(values[static_cast<std::size_t>(columnX)]);
        y.push_back(values[static_cast<std::size_t>(columnY)]);
        if (x.size() > kMaxPoints)
            throw std::runtime_error(place + "the table has more than " +
                                     std::to_string(kMaxPoints) + " points");
    }
}

}  // namespace cli
}  // namespace simflex
