#include "simflex/render/ProbePlot.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

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

const PlotTheme& PlotTheme::light() {
    static const PlotTheme theme = {{255, 255, 255, 255},
                                    {28, 34, 44, 255},
                                    {88, 97, 110, 255},
                                    {224, 228, 233, 255},
                                    {{{0, 114, 178, 255},
                                      {213, 94, 0, 255},
                                      {0, 158, 115, 255},
                                      {204, 121, 167, 255},
                                      {230, 159, 0, 255},
                                      {86, 180, 233, 255},
                                      {90, 96, 104, 255}}}};
    return theme;
}

const PlotTheme& PlotTheme::dark() {
    static const PlotTheme theme = {{27, 31, 38, 255},
                                    {236, 240, 245, 255},
                                    {160, 171, 184, 255},
                                    {58, 65, 75, 255},
                                    {{{86, 180, 233, 255},
                                      {240, 134, 60, 255},
                                      {40, 195, 150, 255},
                                      {221, 150, 190, 255},
                                      {240, 195, 60, 255},
                                      {60, 140, 210, 255},
                                      {170, 178, 188, 255}}}};
    return theme;
}

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
    const double none = std::numeric_limits<double>::quiet_NaN();
    if (curve.time.empty() || !(time >= curve.time.front() && time <= curve.time.back()))
        return none;
    const size_t i =
        size_t(std::lower_bound(curve.time.begin(), curve.time.end(), time) - curve.time.begin());
    if (curve.time[i] == time) return curve.values[i];
    const double part = (time - curve.time[i - 1]) / (curve.time[i] - curve.time[i - 1]);
    return curve.values[i - 1] + part * (curve.values[i] - curve.values[i - 1]);
}

Image ProbePlot::draw(int width, int height, double markTime, double scale,
                      const PlotTheme& theme) const {
    constexpr int largest = 32767;  // of cairo
    if (width < 1 || height < 1 || width > largest || height > largest)
        throw std::invalid_argument("ProbePlot::draw: size must be between 1 and " +
                                    std::to_string(largest) + ", not " + std::to_string(width) +
                                    "x" + std::to_string(height));
    return PlotPainter(*this, theme, width, height, scale).paint(markTime);
}

}  // namespace simflex
