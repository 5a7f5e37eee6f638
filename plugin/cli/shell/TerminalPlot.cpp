#include "simflex/cli/shell/TerminalPlot.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/render/overlay/Overlay.h"

namespace simflex {
namespace cli {
namespace {

constexpr int CurveColors[] = {34, 31, 32, 35, 36, 33};  // ECMA-48 codes
constexpr int SmallestPanel = 6;

struct PlotRange {
    double low = std::numeric_limits<double>::infinity();
    double high = -std::numeric_limits<double>::infinity();

    void include(double value) {
        low = std::min(low, value);
        high = std::max(high, value);
    }
    bool isEmpty() const { return low > high; }
};

/** Equally spaced round values; the first and last are not inside the range. **/
struct Scale {
    double low, step;
    int numSteps;

    Scale(PlotRange range, int mostSteps) {
        if (range.high - range.low <= 1e-12 * std::max(std::abs(range.low), std::abs(range.high)) ||
            range.high == range.low) {
            const double margin = range.low == 0 ? 1 : 0.1 * std::abs(range.low);
            range = {range.low - margin, range.high + margin};
        }
        for (step = roundUpToStep((range.high - range.low) / mostSteps);;
             step = roundUpToStep(1.5 * step)) {
            const double first = std::floor(range.low / step + 1e-9);
            const double last = std::ceil(range.high / step - 1e-9);
            low = first * step;
            numSteps = int(last - first);
            if (numSteps <= mostSteps) return;
        }
    }

    double getHigh() const { return low + numSteps * step; }
    double getValue(int i) const {
        const double value = std::round(low / step + i) * step;
        return value == 0 ? 0 : value;
    }
};

std::string padLeft(const std::string& text, int width) {
    return std::string(size_t(std::max(0, width - int(text.size()))), ' ') + text;
}

std::string encodeUtf8(unsigned code) {  // braille characters: three bytes
    return {char(0xe0 | (code >> 12)), char(0x80 | ((code >> 6) & 0x3f)),
            char(0x80 | (code & 0x3f))};
}

/** Dots in cells: 2×4 with braille, one with ASCII. **/
class Canvas {
public:
    Canvas(int columns, int rows, bool isBraille)
        : m_columns(columns),
          m_rows(rows),
          m_isBraille(isBraille),
          m_dots(size_t(columns * rows), 0),
          m_colors(size_t(columns * rows), 0) {}

    int getWidth() const { return m_isBraille ? 2 * m_columns : m_columns; }
    int getHeight() const { return m_isBraille ? 4 * m_rows : m_rows; }

    /** Draws a dot, y from the bottom. **/
    void draw(int x, int y, int color) {
        if (x < 0 || y < 0 || x >= getWidth() || y >= getHeight()) return;
        y = getHeight() - 1 - y;
        static const unsigned bits[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
        const int column = m_isBraille ? x / 2 : x, row = m_isBraille ? y / 4 : y;
        const auto cell = size_t(row * m_columns + column);
        m_dots[cell] |= m_isBraille ? bits[y % 4][x % 2] : 1;
        m_colors[cell] = color;
    }

    /** Draws a line between two points in dot coordinates. **/
    void drawLine(double x0, double y0, double x1, double y1, int color) {
        const int n = int(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))) + 1;
        for (int i = 0; i <= n; ++i) {
            const double s = double(i) / n;
            draw(int(std::lround(x0 + s * (x1 - x0))), int(std::lround(y0 + s * (y1 - y0))), color);
        }
    }

    std::string formatRow(int row) const {
        std::string text;
        int color = 0;
        for (int column = 0; column < m_columns; ++column) {
            const auto cell = size_t(row * m_columns + column);
            if (m_dots[cell] && m_colors[cell] != color) {
                color = m_colors[cell];
                text += "\033[" + std::to_string(color) + "m";
            }
            text += !m_dots[cell] ? " "
                    : m_isBraille ? encodeUtf8(0x2800 + m_dots[cell])
                                  : std::string("*");
        }
        text.erase(text.find_last_not_of(' ') + 1);
        return color ? text + "\033[0m" : text;
    }

private:
    int m_columns, m_rows;
    bool m_isBraille;
    std::vector<unsigned> m_dots;
    std::vector<int> m_colors;
};

struct Panel {
    std::string unit;
    std::vector<const TerminalCurve*> curves;
    PlotRange range;
};

std::vector<Panel> makePanels(const std::vector<TerminalCurve>& curves, bool isShared) {
    std::vector<Panel> panels;
    for (const TerminalCurve& curve : curves) {
        auto panel = panels.end();
        if (isShared)
            panel = std::find_if(panels.begin(), panels.end(),
                                 [&](const Panel& p) { return p.unit == curve.unit; });
        if (panel == panels.end()) panel = panels.insert(panel, {curve.unit, {}, {}});
        panel->curves.push_back(&curve);
        for (const double value : curve.values)
            if (std::isfinite(value)) panel->range.include(value);
    }
    return panels;
}

class Painter {
public:
    Painter(const Terminal& terminal, const PlotRange& time, int rows)
        : m_terminal(terminal), m_time(time), m_rows(rows) {}

    std::string draw(const Panel& panel, bool isLast) const {
        const Scale scale(panel.range, std::max(1, (m_rows - 1) / 3));
        int labelWidth = 0;
        for (int i = 0; i <= scale.numSteps; ++i)
            labelWidth = std::max(labelWidth, int(writeGeneral(scale.getValue(i), 6).size()));
        Canvas canvas(std::max(10, m_terminal.columns - labelWidth - 2), m_rows,
                      m_terminal.hasUnicode);
        for (size_t i = 0; i < panel.curves.size(); ++i)
            drawCurve(*panel.curves[i], scale, getColor(i), canvas);

        std::string text = formatTitle(panel);
        std::vector<std::string> labels(static_cast<size_t>(m_rows));
        for (int i = 0; i <= scale.numSteps; ++i)
            labels[size_t(m_rows - 1 - std::lround(double(i) / scale.numSteps * (m_rows - 1)))] =
                writeGeneral(scale.getValue(i), 6);
        for (int row = 0; row < m_rows; ++row) {
            const std::string& label = labels[size_t(row)];
            text += padLeft(label, labelWidth) + ' ' + getAxis(!label.empty()) +
                    canvas.formatRow(row) + '\n';
        }
        return isLast ? text + formatTimeAxis(labelWidth + 2) : text;
    }

private:
    int getColor(size_t curve) const {
        return m_terminal.hasColor ? CurveColors[curve % std::size(CurveColors)] : 0;
    }

    std::string getAxis(bool isTick) const {
        if (!m_terminal.hasUnicode) return isTick ? "+" : "|";
        return isTick ? "\u2524" : "\u2502";
    }

    std::string formatTitle(const Panel& panel) const {
        std::string text;
        for (size_t i = 0; i < panel.curves.size(); ++i) {
            const int color = getColor(i);
            if (i) text += "  ";
            if (color) text += "\033[" + std::to_string(color) + "m";
            text += panel.curves[i]->name;
            if (color) text += "\033[0m";
        }
        return text + (panel.unit.empty() ? "" : " [" + panel.unit + "]") + '\n';
    }

    void drawCurve(const TerminalCurve& curve, const Scale& scale, int color,
                   Canvas& canvas) const {
        const double span = m_time.high > m_time.low ? m_time.high - m_time.low : 1;
        double lastX = 0, lastY = 0;
        bool hasLast = false;
        for (size_t i = 0; i < curve.values.size(); ++i) {
            if (!std::isfinite(curve.values[i])) {
                hasLast = false;
                continue;
            }
            const double x = (curve.time[i] - m_time.low) / span * (canvas.getWidth() - 1);
            const double y = (curve.values[i] - scale.low) / (scale.getHigh() - scale.low) *
                             (canvas.getHeight() - 1);
            canvas.drawLine(hasLast ? lastX : x, hasLast ? lastY : y, x, y, color);
            lastX = x, lastY = y, hasLast = true;
        }
    }

    std::string formatTimeAxis(int indent) const {
        const int width = std::max(10, m_terminal.columns - indent);
        std::string line;
        for (int i = 0; i < width; ++i) line += m_terminal.hasUnicode ? "\u2500" : "-";
        const std::string low = writeGeneral(m_time.low, 6),
                          high = writeGeneral(m_time.high, 6) + " s";
        return std::string(size_t(indent - 1), ' ') + (m_terminal.hasUnicode ? "\u2514" : "+") +
               line + '\n' + std::string(size_t(indent), ' ') + low +
               padLeft(high, width - int(low.size())) + '\n';
    }

    const Terminal& m_terminal;
    PlotRange m_time;
    int m_rows;
};

}  // namespace

std::string drawTerminalPlot(const std::vector<TerminalCurve>& curves, const Terminal& terminal) {
    const std::vector<Panel> panels = makePanels(curves, terminal.hasColor);
    PlotRange time;
    for (const TerminalCurve& curve : curves)
        for (const double t : curve.time) time.include(t);
    for (const Panel& panel : panels)
        if (panel.range.isEmpty())
            throw std::invalid_argument("'" + panel.curves[0]->name + "' has no values to plot");
    if (panels.empty()) throw std::invalid_argument("there is nothing to plot");

    const int available = terminal.rows - 2 - 2;  // the prompt; the time axis
    const int rows = std::max(SmallestPanel - 1, available / int(panels.size()) - 1);
    const Painter painter(terminal, time, rows);
    std::string text;
    for (size_t i = 0; i < panels.size(); ++i)
        text += painter.draw(panels[i], i + 1 == panels.size());
    return text;
}

}  // namespace cli
}  // namespace simflex
