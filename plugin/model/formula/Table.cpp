#include "simflex/model/formula/Table.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace formula {

namespace {

const std::size_t MaxPoints = 5000000;

}  // namespace

std::vector<double> calcSplineCurvature(const std::vector<double>& x,
                                        const std::vector<double>& y) {
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
    // and M_{n-1} eliminated by continuity of the third derivative.
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

Table::Table(std::string name, std::vector<double> x, std::vector<double> y,
             Interpolation interpolation, Extrapolation extrapolation)
    : m_name(std::move(name)),
      m_x(std::move(x)),
      m_y(std::move(y)),
      m_interpolation(interpolation),
      m_extrapolation(extrapolation) {
    if (m_x.size() != m_y.size())
        throw std::invalid_argument("x has " + std::to_string(m_x.size()) + " values and y has " +
                                    std::to_string(m_y.size()) + "; they must be as many");
    if (m_x.size() < 2) throw std::invalid_argument("a table needs at least two points");
    for (std::size_t i = 0; i < m_x.size(); ++i) {
        if (!std::isfinite(m_x[i]) || !std::isfinite(m_y[i]))
            throw std::invalid_argument("point " + std::to_string(i) + " is not finite");
        if (i > 0 && !(m_x[i] > m_x[i - 1]))
            throw std::invalid_argument("x must increase, but " + writeGeneral(m_x[i], 6) +
                                        " follows " + writeGeneral(m_x[i - 1], 6));
    }
    if (m_interpolation == Interpolation::Spline) {
        m_curvature = calcSplineCurvature(m_x, m_y);
        for (double value : m_curvature)
            if (!std::isfinite(value))
                throw std::invalid_argument(
                    "no spline goes through the points: they are too far apart or too close");
    }
}

std::string Table::describeRefusal(double x) const {
    return "table '" + m_name + "' is evaluated at " + writeGeneral(x, 6) +
           ", outside its points from " + writeGeneral(m_x.front(), 6) + " to " +
           writeGeneral(m_x.back(), 6);
}

bool Table::covers(double x) const {
    if (std::isnan(x)) return false;
    return m_extrapolation != Extrapolation::Refuse || (x >= m_x.front() && x <= m_x.back());
}

int Table::findPiece(double x, Side side) const {
    if (x < m_x.front()) return -1;
    const int last = static_cast<int>(m_x.size()) - 2;
    if (x > m_x.back()) return last + 1;
    // The first and last points belong to the first and last pieces.
    const auto next = side == Side::Right ? std::upper_bound(m_x.begin(), m_x.end(), x)
                                          : std::lower_bound(m_x.begin(), m_x.end(), x);
    return std::clamp(static_cast<int>(next - m_x.begin()) - 1, 0, last);
}

double Table::calc(double x, int order, Side side) const {
    if (order == 0 && x == m_x.back()) return m_y.back();
    return calcPiece(findPiece(x, side), x, order);
}

double Table::calcPiece(int piece, double x, int order) const {
    const int count = static_cast<int>(m_x.size()) - 1;
    if (piece < 0 || piece == count) {
        const double end = piece < 0 ? m_x.front() : m_x.back();
        const double value = piece < 0 ? m_y.front() : m_y.back();
        if (m_extrapolation == Extrapolation::Constant) return order == 0 ? value : 0;
        const double slope = calcPiece(piece < 0 ? 0 : count - 1, end, 1);
        return order == 0 ? value + slope * (x - end) : order == 1 ? slope : 0;
    }
    const auto i = static_cast<std::size_t>(piece);
    if (m_interpolation == Interpolation::Step) return order == 0 ? m_y[i] : 0;
    const double h = m_x[i + 1] - m_x[i], slope = (m_y[i + 1] - m_y[i]) / h;
    const double a = m_x[i + 1] - x, b = x - m_x[i];
    double c0 = 0, c1 = 0;
    if (m_interpolation == Interpolation::Spline) {
        c0 = m_curvature[i];
        c1 = m_curvature[i + 1];
    }
    switch (order) {
        case 0:  // this form is exact at the points
            return m_y[i] * (a / h) + m_y[i + 1] * (b / h) + c0 * a * (a * a - h * h) / (6 * h) +
                   c1 * b * (b * b - h * h) / (6 * h);
        case 1:
            return slope + c0 * (h * h - 3 * a * a) / (6 * h) + c1 * (3 * b * b - h * h) / (6 * h);
        default:
            return (c0 * a + c1 * b) / h;
    }
}

/** A function deviates from its secant by at most (b − a)²/8 · max|f''|, and f' likewise. **/
Interval Table::calcPieceBounds(int piece, const Interval& x, int order) const {
    const double a = x.low, b = x.high, width = b - a;
    const Interval ends =
        hull(Interval(calcPiece(piece, a, order)), Interval(calcPiece(piece, b, order)));
    if (order == 2 || width == 0) return ends;
    const double bend0 = calcPiece(piece, a, 2), bend1 = calcPiece(piece, b, 2);
    const double most =
        order == 0 ? std::max(std::abs(bend0), std::abs(bend1)) : std::abs(bend1 - bend0) / width;
    const double distance = most == 0 ? 0 : width * width / 8 * most;
    return {ends.low - distance, ends.high + distance};
}

Interval Table::calcBounds(const Interval& x, int order) const {
    const int first = findPiece(x.low, Side::Right), last = findPiece(x.high, Side::Left);
    const int count = static_cast<int>(m_x.size()) - 1;
    // Across a kink or jump, the next derivative is unbounded.
    const int smooth = m_interpolation == Interpolation::Spline   ? 2
                       : m_interpolation == Interpolation::Linear ? 1
                                                                  : 0;
    if (last > first && (order > smooth || (order > 0 && (first < 0 || last == count))))
        return Interval::makeWhole();
    const auto begin = [&](int piece) {
        return piece <= first ? x.low : m_x[static_cast<std::size_t>(piece)];
    };
    Interval bounds = calc(x.high, order);
    for (int piece = first; piece <= std::max(first, last); ++piece)
        bounds = hull(bounds,
                      calcPieceBounds(
                          piece, {begin(piece), piece >= last ? x.high : begin(piece + 1)}, order));
    return bounds;
}

namespace {

/** Numbers of a line, up to the first unreadable field. **/
struct TableLine {
    std::vector<double> values;
    std::string unread;      ///< text from the first unreadable field on
    std::string separators;  ///< ',', ';' and ' ', each once
};

TableLine readTableLine(const char* at, const char* const lineEnd) {
    TableLine line;
    while (at < lineEnd) {
        double value = 0;
        const char* const first = at[0] == '+' && at[1] != '-' ? at + 1 : at;
        const std::from_chars_result read = std::from_chars(first, lineEnd, value);
        if (read.ec != std::errc() || !std::isfinite(value)) {
            line.unread = std::string(at, std::min<std::ptrdiff_t>(30, lineEnd - at));
            break;
        }
        line.values.push_back(value);
        at = read.ptr;
        const auto skipBlanks = [&] {
            while (at < lineEnd && (*at == ' ' || *at == '\t' || *at == '\r')) ++at;
        };
        skipBlanks();
        if (at == lineEnd) break;
        const char separator = *at == ',' || *at == ';' ? *at++ : ' ';
        if (line.separators.find(separator) == std::string::npos) line.separators += separator;
        skipBlanks();
    }
    return line;
}

}  // namespace

std::vector<std::vector<double>> readTableFile(const std::string& path,
                                               const std::vector<int>& columns) {
    std::vector<std::vector<double>> read(columns.size());
    const int wanted = *std::max_element(columns.begin(), columns.end());
    std::ifstream file = openInputFile(path);
    if (!file.is_open()) throw std::runtime_error("cannot read the file " + path);
    std::vector<char> buffer(100002);  // a file without line ends may exceed memory
    std::string line;
    for (int number = 1;
         file.getline(buffer.data(), std::streamsize(buffer.size())) || file.gcount() > 0;
         ++number) {
        const std::string place = path + ":" + std::to_string(number) + ": ";
        if (file.fail()) throw std::runtime_error(place + "the line is too long");
        line.assign(buffer.data(), std::size_t(file.gcount()) - (file.eof() ? 0 : 1));
        if (line.find('\0') != line.npos)
            throw std::runtime_error(place + "there is a zero byte; a table is a file of text");
        if (number == 1 && line.compare(0, 3, "\xEF\xBB\xBF") == 0) line.erase(0, 3);
        const std::size_t begin = line.find_first_not_of(" \t\r");
        if (begin == std::string::npos || line[begin] == '#') continue;
        const TableLine found = readTableLine(line.c_str() + begin, line.c_str() + line.size());
        const std::vector<double>& values = found.values;
        const bool isText = !found.unread.empty();
        if (isText && read[0].empty() && values.empty()) continue;  // names of the columns
        if (isText)
            throw std::runtime_error(place + "'" + found.unread + "' is not a finite number");
        if (found.separators.size() > 1)
            throw std::runtime_error(
                place +
                "columns are separated in more than one way: use commas, semicolons or blanks "
                "throughout; decimals are written with a point (1.5), not with a comma");
        if (static_cast<int>(values.size()) <= wanted)
            throw std::runtime_error(place + "the line has " + std::to_string(values.size()) +
                                     " columns; column " + std::to_string(wanted) +
                                     " (counted from 0) is wanted");
        for (std::size_t i = 0; i < columns.size(); ++i)
            read[i].push_back(values[static_cast<std::size_t>(columns[i])]);
        if (read[0].size() > MaxPoints)
            throw std::runtime_error(place + "the table has more than " +
                                     std::to_string(MaxPoints) + " points");
    }
    return read;
}

}  // namespace formula
}  // namespace simflex
