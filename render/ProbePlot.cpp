#include "simflex/render/ProbePlot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/DisplayUnit.h"
#include "simflex/render/overlay/PlotPainter.h"

namespace simflex {

namespace {

void checkRange(const std::string& method, double low, double high) {
    if (!(low < high) || !std::isfinite(low) || !std::isfinite(high))
        throw std::invalid_argument("ProbePlot::" + method + ": " + std::to_string(low) +
                                    " is not below " + std::to_string(high) +
                                    " or one of them is not finite");
}

void checkTime(const std::string& curve, double time, double before) {
    if (!std::isfinite(time) || time < before)
        throw std::invalid_argument(
            "ProbePlot: time " + std::to_string(time) + " of curve '" + curve + "' " +
            (std::isfinite(time)
                 ? "is before " + std::to_string(before) + ", that of the point before"
                 : "is not finite"));
}

}  // namespace

ProbePlot& ProbePlot::setTimeUnit(const std::string& name, double seconds) {
    if (!(seconds > 0) || !std::isfinite(seconds))
        throw std::invalid_argument("ProbePlot::setTimeUnit: " + std::to_string(seconds) +
                                    " s is not a positive length of time");
    timeUnit = name;
    timeUnitSize = seconds;
    return *this;
}

ProbePlot& ProbePlot::setTimeRange(double low, double high) {
    checkRange("setTimeRange", low, high);
    timeLow = low;
    timeHigh = high;
    return *this;
}

ProbePlot& ProbePlot::setValueRange(double low, double high) {
    checkRange("setValueRange", low, high);
    if (panels.empty()) throw std::logic_error("ProbePlot::setValueRange: there is no panel yet");
    panels.back().low = low;
    panels.back().high = high;
    return *this;
}

ProbePlot& ProbePlot::addPanel(const std::string& quantity, const std::string& unit,
                               double unitSize) {
    if (!(unitSize > 0) || !std::isfinite(unitSize))
        throw std::invalid_argument("ProbePlot::addPanel: the size of unit '" + unit +
                                    "' must be positive, not " + std::to_string(unitSize));
    Panel panel;
    panel.quantity = quantity;
    panel.unit = unit;
    panel.unitSize = unitSize;
    panels.push_back(panel);
    return *this;
}

int ProbePlot::addCurve(const std::string& name, const std::vector<double>& time,
                        const std::vector<double>& values, Line line) {
    if (time.size() != values.size())
        throw std::invalid_argument("ProbePlot: curve '" + name + "' has " +
                                    std::to_string(time.size()) + " times, but " +
                                    std::to_string(values.size()) + " values");
    for (size_t i = 0; i < time.size(); ++i)
        checkTime(name, time[i], i > 0 ? time[i - 1] : -std::numeric_limits<double>::infinity());
    if (panels.empty()) addPanel("");
    curves.push_back({name, int(panels.size()) - 1, line, time, values});
    return int(curves.size()) - 1;
}

const ProbePlot::Curve& ProbePlot::getCurve(int index) const {
    if (index < 0 || index >= int(curves.size()))
        throw std::out_of_range("ProbePlot: no curve " + std::to_string(index) + ", there are " +
                                std::to_string(curves.size()));
    return curves[size_t(index)];
}

void ProbePlot::append(int index, double time, double value) {
    const Curve& curve = getCurve(index);
    if (!curve.time.empty()) checkTime(curve.name, time, curve.time.back());
    checkTime(curve.name, time, -std::numeric_limits<double>::infinity());
    curves[size_t(index)].time.push_back(time);
    curves[size_t(index)].values.push_back(value);
}

double ProbePlot::calcValue(int index, double time) const {
    const Curve& curve = getCurve(index);
    return interpolateCurve(curve.time, curve.values, time);
}

std::pair<double, double> ProbePlot::calcTimeRange() const {
    if (timeLow < timeHigh) return {timeLow, timeHigh};
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Curve& curve : curves) {
        if (curve.time.empty()) continue;
        low = std::min(low, curve.time.front());
        high = std::max(high, curve.time.back());
    }
    if (!(low <= high)) low = high = 0;
    if (low == high) high = low + std::max(1e-3, 1e-6 * std::abs(low));
    return {low, high};
}

double ProbePlot::calcTimeUnit() const {
    if (!timeUnit.empty()) return timeUnitSize;
    const auto [low, high] = calcTimeRange();
    const double longest = std::max(std::abs(low), std::abs(high));
    return longest >= 1 ? 1 : longest >= 1e-3 ? 1e-3 : 1e-6;
}

Figure ProbePlot::makeFigure() const {
    const double second = calcTimeUnit();
    const auto [low, high] = calcTimeRange();
    Figure figure;
    figure.title = title;
    figure.xLabel = "time [" +
                    (!timeUnit.empty() ? timeUnit
                     : second == 1     ? "s"
                     : second == 1e-3  ? "ms"
                                       : "µs") +
                    "]";
    figure.low = low / second;
    figure.high = high / second;
    figure.showsValues = true;
    for (const Panel& panel : panels) {
        FigurePanel& drawn = figure.panels.emplace_back();
        drawn.label = makeAxisLabel(panel.quantity, panel.unit);
        drawn.low = panel.low / panel.unitSize;
        drawn.high = panel.high / panel.unitSize;
    }
    for (const Curve& curve : curves) {
        FigurePanel& panel = figure.panels[size_t(curve.panel)];
        FigureCurve drawn{curve.name, curve.time, curve.values};
        for (double& time : drawn.x) time /= second;
        for (double& value : drawn.y) value /= panels[size_t(curve.panel)].unitSize;
        drawn.color = int(panel.curves.size());
        drawn.dash = curve.line == Line::Dashed ? 1 : 0;
        panel.curves.push_back(std::move(drawn));
    }
    return figure;
}

Image ProbePlot::draw(int width, int height, double markTime, double scale,
                      const PlotTheme& theme) const {
    constexpr int largest = 32767;  // cairo's limit
    if (width < 1 || height < 1 || width > largest || height > largest)
        throw std::invalid_argument("ProbePlot::draw: size must be between 1 and " +
                                    std::to_string(largest) + ", not " + std::to_string(width) +
                                    "x" + std::to_string(height));
    return PlotPainter(makeFigure(), theme, width, height, scale).paint(markTime / calcTimeUnit());
}

}  // namespace simflex
