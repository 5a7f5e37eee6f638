#include "simflex/model/results/Figure.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <stdexcept>

#include "simflex/base/ChildProcess.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/ProgramOutput.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/results/CsvLine.h"
#include "simflex/model/results/Extremes.h"
#include "simflex/render/ColorMap.h"
#include "simflex/render/ProbePlot.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;
using File = std::unique_ptr<FILE, int (*)(FILE*)>;
constexpr size_t MostPoints = 20000;  // of a curve; more are thinned to their extremes
constexpr int FigureWidth = 1000, PanelHeight = 340, LonePanelHeight = 560, TitleHeight = 60;

std::string hex(const Image::Pixel& color) {
    char text[16];
    std::snprintf(text, sizeof text, "#%02x%02x%02x", color[0], color[1], color[2]);
    return text;
}

/** A text in gnuplot's single quotes, where only a quoteForGnuplot means something: it is doubled.
Control characters and backquotes, which elsewhere run commands, are left out altogether. **/
std::string quoteForGnuplot(const std::string& text) {
    std::string quoted = "'";
    for (const char c : text) {
        if (c == '`' || c == 127 || (c >= 0 && c < ' ')) {
            quoted += ' ';
        } else {
            quoted += c == '\'' ? std::string("''") : std::string(1, c);
        }
    }
    return quoted + "'";
}

std::string number(double value) {
    return writeGeneral(value, 9);
}

/** Smallest and largest, of finite numbers. **/
struct Range {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    void add(const std::vector<double>& values, bool onlyPositive = false) {
        for (const double value : values)
            if (std::isfinite(value) && (value > 0 || !onlyPositive))
                low = std::min(low, value), high = std::max(high, value);
    }
    bool isEmpty() const { return low > high; }
    double getSpan() const { return high - low; }
};

/** The points that are drawn: all of them, or the extremes of equal pieces of a long curve. **/
std::vector<size_t> choosePoints(const FigureCurve& curve) {
    std::vector<size_t> chosen;
    const size_t count = curve.x.size();
    if (count <= MostPoints || !std::is_sorted(curve.x.begin(), curve.x.end())) {
        for (size_t k = 0; k < count; ++k) chosen.push_back(k);
        return chosen;
    }
    const size_t piece = (2 * count + MostPoints - 1) / MostPoints;
    for (size_t begin = 0; begin < count; begin += piece) {
        const auto first = curve.y.begin() + std::ptrdiff_t(begin),
                   last = curve.y.begin() + std::ptrdiff_t(std::min(count, begin + piece));
        const auto [low, high] = findExtremes(first, last);
        const size_t a = size_t(low - curve.y.begin()), b = size_t(high - curve.y.begin());
        chosen.push_back(std::min(a, b));
        if (a != b) chosen.push_back(std::max(a, b));
    }
    return chosen;
}

void addData(std::string& script, const std::string& name, const FigureCurve& curve) {
    script += "$" + name + " << END_OF_CURVE\n";
    for (const size_t k : choosePoints(curve)) {
        const bool isKnown = std::isfinite(curve.x[k]) && std::isfinite(curve.y[k]);
        script += isKnown ? number(curve.x[k]) + " " + number(curve.y[k]) : "";
        if (isKnown && !curve.error.empty() && std::isfinite(curve.error[k]))
            for (const double side : {-1, 1})
                script += " " + number(curve.y[k] + side * std::abs(curve.error[k]));
        script += "\n";
    }
    script += "END_OF_CURVE\n";
}

std::string makeCurveCommand(const std::string& data, const FigureCurve& curve, bool hasLegend,
                             bool isOnMap) {
    const PlotTheme& theme = PlotTheme::light();
    const auto& color =
        curve.isFaint ? theme.faintText : theme.curves[size_t(curve.color) % theme.curves.size()];
    std::string command;
    if (!curve.error.empty())
        command = "$" + data + " using 1:3:4 with filledcurves fillstyle transparent solid 0.25 " +
                  "noborder linecolor rgb '" + hex(color) + "' notitle, ";
    command += "$" + data + " using 1:2 ";
    const std::string rgb = " linecolor rgb '" + (isOnMap ? "#ff8c69" : hex(color)) + "'";
    const std::string width = curve.isFaint && !isOnMap ? "0.8" : "1.8";
    const int dash = curve.isFaint ? 3 : 1 + curve.dash % 5;
    switch (curve.marks) {
        case FigureCurve::Marks::None:
            command += "with lines linewidth " + width + " dashtype " + std::to_string(dash) + rgb;
            break;
        case FigureCurve::Marks::Points:
            command += "with linespoints pointtype 7 pointsize 0.6 linewidth " + width +
                       " dashtype " + std::to_string(dash) + rgb;
            break;
        case FigureCurve::Marks::Stems:
            command += "with impulses linewidth 3" + rgb + " notitle, $" + data +
                       " using 1:2 with points pointtype 7 pointsize 0.9" + rgb;
            break;
    }
    return command + (hasLegend && !curve.name.empty() ? " title " + quoteForGnuplot(curve.name)
                                                       : " notitle");
}

std::string makeRange(const Range& range, double margin, bool startsAtZero) {
    if (range.isEmpty()) return "[0:1]";
    double low = range.low, high = range.high;
    if (startsAtZero && low > 0) low = 0;
    double span = high - low;
    // What varies by its last digits only is drawn as the constant that it is.
    const double least = 1e-9 * std::max(std::abs(low), std::abs(high));
    if (!(span > least)) span = std::max(2 * std::abs(high), 1.0), margin = 0.5;
    if (!(startsAtZero && low == 0)) low -= margin * span;
    high += margin * span;
    return "[" + number(low) + ":" + number(high) + "]";
}

/** Of positive numbers; a decade or more is shown in whole. **/
std::string makeLogarithmicRange(const Range& range, double margin) {
    if (range.isEmpty()) return "[1:10]";
    const double factor =
        range.high > range.low ? std::pow(range.high / range.low, margin) : std::sqrt(10.0);
    return "[" + number(range.low / factor) + ":" + number(range.high * factor) + "]";
}

/** Columns of a legend above a panel, so that it fits. **/
int countLegendColumns(const FigurePanel& panel, int width) {
    size_t longest = 1;
    for (const FigureCurve& curve : panel.curves) longest = std::max(longest, curve.name.size());
    return std::clamp(int((width - 140) / (8.0 * double(longest) + 60)), 1, 5);
}

bool hasLegend(const FigurePanel& panel) {
    return panel.curves.size() > 1;
}

int countLegendLines(const FigurePanel& panel, int width) {
    if (!hasLegend(panel)) return 0;
    int names = 0;
    for (const FigureCurve& curve : panel.curves) names += !curve.name.empty();
    const int columns = countLegendColumns(panel, width);
    return (names + columns - 1) / columns;
}

std::string makeTerminal(const std::string& kind, int width, int height) {
    const std::string size = std::to_string(width) + "," + std::to_string(height);
    if (kind == "png")  // twice the pixels: sharp on paper and on fine screens
        return "set terminal pngcairo noenhanced size " + std::to_string(2 * width) + "," +
               std::to_string(2 * height) + " font 'DejaVu Sans,11' fontscale 2 linewidth 2\n";
    if (kind == "svg")
        return "set terminal svg noenhanced size " + size +
               " font 'DejaVu Sans,14' background '#ffffff'\n";
    return "set terminal pdfcairo noenhanced size " + number(width / 96.0) + "in," +
           number(height / 96.0) + "in font 'DejaVu Sans,10' linewidth 1.2\n";
}

/** Where panels stand, in pixels from the picture's top. **/
constexpr double RightOfPanels = 28, RightOfMap = 150;
struct Layout {
    int width = 0, height = 0;
    double panelHeight = 0, right = RightOfPanels;

    std::string screenX(double x) const { return number(x / width); }
    std::string screenY(double y) const { return number(std::clamp(1 - y / height, 0.0, 1.0)); }
};

constexpr double LegendLine = 24, PanelGap = 30, BelowPanels = 64;
constexpr double LeftOfPanels = 100;

constexpr double ToldApart = 3;  // decades of a map's logarithmic colours

Range calcColorRange(const FigureMap& map) {
    if (map.scale == FigureMap::Scale::Angles) return {-180, 180};
    if (map.scale == FigureMap::Scale::Fractions) return {0, 1};
    double largest = 0;
    for (const std::vector<double>& row : map.rows)
        for (const double value : row)
            if (std::isfinite(value)) largest = std::max(largest, value);
    if (!(largest > 0)) largest = 1;
    return {largest * std::pow(10, -ToldApart), largest};
}

std::string makeMapData(const FigureMap& map, const std::string& name) {
    const bool isLogarithmic = map.scale == FigureMap::Scale::Logarithmic;
    const double least = calcColorRange(map).low;
    std::string script = "$" + name + " << END_OF_MAP\n";
    for (size_t i = 0; i < map.rows.size(); ++i) {
        for (size_t k = 0; k < map.y.size(); ++k) {
            const double value = map.rows[i][k];
            script += number(map.x[i]) + " " + number(map.y[k]) + " " +
                      (!std::isfinite(value) ? std::string("NaN")
                       : isLogarithmic       ? number(std::max(value, least))
                                             : number(value)) +
                      "\n";
        }
        script += "\n";
    }
    return script + "END_OF_MAP\n";
}

/** Of a part of a turn: all the way round each angle has a colour of its own. **/
SimTK::Vec3 calcAngleColor(double part) {
    static const SimTK::Vec3 colors[] = {
        SimTK::Vec3(0.27, 0.00, 0.33), SimTK::Vec3(0.13, 0.57, 0.55), SimTK::Vec3(0.99, 0.91, 0.14),
        SimTK::Vec3(0.84, 0.37, 0.00)};
    const int quarter = std::min(3, int(4 * part));
    const double rest = 4 * part - quarter;
    return (1 - rest) * colors[quarter] + rest * colors[(quarter + 1) % 4];
}

std::string makeMapColors(const FigureMap& map, const std::string& text) {
    constexpr int stops = 16;
    const bool isAngle = map.scale == FigureMap::Scale::Angles;
    std::string script = "set palette defined (";
    for (int k = 0; k <= stops; ++k) {
        const double place = double(k) / stops;
        const SimTK::Vec3 color =
            isAngle ? calcAngleColor(place) : calcColor(ColorMap::Viridis, place);
        script += (k ? ", " : "") + number(place);
        for (int i = 0; i < 3; ++i) script += " " + number(color[i]);
    }
    const Range range = calcColorRange(map);
    return script +
           (map.scale == FigureMap::Scale::Logarithmic
                ? ")\nset logscale cb\nset cbtics auto\nset format cb '%.0e'"
                : ")\nunset logscale cb\nset format cb '%g'\nset cbtics " +
                      std::string(isAngle ? "90" : "0.2")) +
           "\nset cbrange [" + number(range.low) + ":" + number(range.high) + "]\nset cblabel " +
           quoteForGnuplot(map.label) + text;
}

/** Ranges along x and y in which a unit is as long either way. **/
std::string makeEqualRanges(const FigurePanel& panel, const Layout& layout) {
    constexpr double margin = 1.1;
    Range x, y;
    for (const FigureCurve& curve : panel.curves) x.add(curve.x), y.add(curve.y);
    if (x.isEmpty() || y.isEmpty()) return "set xrange [0:1]\nset yrange [0:1]\n";
    const double width = layout.width - LeftOfPanels - layout.right, height = layout.panelHeight,
                 size = std::max({x.getSpan() / width, y.getSpan() / height,
                                  1e-9 * std::max(std::abs(x.low), std::abs(x.high)) / width,
                                  std::numeric_limits<double>::min()}) *
                        margin;
    const auto make = [&](const char* axis, const Range& range, double pixels) {
        const double middle = 0.5 * (range.low + range.high), half = 0.5 * size * pixels;
        return std::string("set ") + axis + "range [" + number(middle - half) + ":" +
               number(middle + half) + "]\n";
    };
    return make("x", x, width) + make("y", y, height);
}

/** One panel whose upper edge is `upper` below the picture's. **/
std::string makePanelScript(const Figure& figure, int p, const Layout& layout, double upper) {
    const FigurePanel& panel = figure.panels[size_t(p)];
    const bool isLast = p + 1 == int(figure.panels.size());
    const std::string text = " textcolor rgb '" + hex(PlotTheme::light().text) + "'\n";
    std::string script = "set tmargin at screen " + layout.screenY(upper) + "\n";
    script += "set bmargin at screen " + layout.screenY(upper + layout.panelHeight) + "\n";
    script += "set lmargin at screen " + layout.screenX(LeftOfPanels) + "\n";
    script += "set rmargin at screen " + layout.screenX(layout.width - layout.right) + "\n";
    if (p == 0 && !figure.title.empty())
        script += "set label 1 " + quoteForGnuplot(figure.title) + " at screen 0.5, screen " +
                  layout.screenY(24) + " center font ',13'" + text;
    if (p == 1) script += "unset label 1\n";
    script += isLast ? "set xlabel " + quoteForGnuplot(figure.xLabel) + text + "set format x '%g'\n"
                     : std::string("unset xlabel\nset format x ''\n");
    script += "set label 2 " + quoteForGnuplot(panel.label) + " at screen " + layout.screenX(20) +
              ", screen " + layout.screenY(upper + 0.5 * layout.panelHeight) +
              " center rotate by 90" + text;
    Range y;
    for (const FigureCurve& curve : panel.curves) {
        if (!panel.map.isEmpty()) continue;
        y.add(curve.y, panel.isLogarithmic);
        for (const double side : {-1, 1}) {
            std::vector<double> edge = curve.error;
            for (size_t k = 0; k < edge.size(); ++k)
                edge[k] = curve.y[k] + side * std::abs(edge[k]);
            y.add(edge, panel.isLogarithmic);
        }
    }
    y.add(panel.map.y);
    script += panel.isLogarithmic
                  ? "set logscale y\nset yrange " + makeLogarithmicRange(y, 0.05)
                  : "unset logscale y\nset yrange " +
                        makeRange(y, panel.map.isEmpty() ? 0.05 : 0, panel.startsAtZero);
    script += "\n";
    if (figure.hasEqualScales) script += makeEqualRanges(panel, layout);
    if (!panel.map.isEmpty()) script += makeMapColors(panel.map, text);
    if (panel.map.scale == FigureMap::Scale::Fractions)  // whole fields
        script += "set xrange [0.5:" + number(double(panel.map.x.size()) + 0.5) +
                  "]\nset yrange [0.5:" + number(double(panel.map.y.size()) + 0.5) +
                  "]\nset ytics 1\n";
    if (hasLegend(panel)) {
        script += "set key at screen " + layout.screenX(LeftOfPanels) + ", screen " +
                  layout.screenY(upper - 2) + " left bottom horizontal Left reverse maxcols " +
                  std::to_string(countLegendColumns(panel, layout.width)) + " samplen 2" + text;
    } else {
        script += "unset key\n";
    }
    script += "plot ";
    if (!panel.map.isEmpty())
        script += "$map_" + std::to_string(p) +
                  (panel.map.scale == FigureMap::Scale::Fractions
                       ? " using 1:2:($1-0.5):($1+0.5):($2-0.5):($2+0.5):3 with boxxyerror "
                         "fillstyle solid linecolor palette notitle"
                       : " using 1:2:3 with image notitle") +
                  (panel.curves.empty() ? "" : ", ");
    for (size_t c = 0; c < panel.curves.size(); ++c)
        script += (c ? ", " : "") +
                  makeCurveCommand("curve_" + std::to_string(p) + "_" + std::to_string(c),
                                   panel.curves[c], hasLegend(panel), !panel.map.isEmpty());
    return script + "\n";
}

}  // namespace

std::string makeGnuplotScript(const std::string& kind, const Figure& figure) {
    const PlotTheme& theme = PlotTheme::light();
    const int numPanels = int(figure.panels.size());
    Layout layout;
    layout.width = figure.width > 0 ? figure.width : FigureWidth;
    layout.height =
        figure.height > 0
            ? figure.height
            : (numPanels == 1 ? LonePanelHeight : numPanels * PanelHeight) + TitleHeight;
    std::string script = makeTerminal(kind, layout.width, layout.height);
    const std::string text = " textcolor rgb '" + hex(theme.text) + "'\n";
    Range x;
    for (int p = 0; p < numPanels; ++p)
        for (size_t c = 0; c < figure.panels[size_t(p)].curves.size(); ++c) {
            const FigureCurve& curve = figure.panels[size_t(p)].curves[c];
            addData(script, "curve_" + std::to_string(p) + "_" + std::to_string(c), curve);
            x.add(curve.x, figure.isLogarithmic);
        }
    for (int p = 0; p < numPanels; ++p) {
        const FigureMap& map = figure.panels[size_t(p)].map;
        if (map.isEmpty()) continue;
        x.add(map.x);
        script += makeMapData(map, "map_" + std::to_string(p));
        layout.right = RightOfMap;
    }
    script += "set border 3 linewidth 0.9 linecolor rgb '" + hex(theme.text) + "'\n";
    script += "set tics nomirror out scale 0.6 textcolor rgb '" + hex(theme.text) + "'\n";
    script += "set grid linetype 1 linewidth 0.7 linecolor rgb '" + hex(theme.grid) + "'\n";
    script += "set format '%g'\n";
    if (figure.hasWholeNumbers && x.getSpan() < 25) script += "set xtics 1\n";
    script += figure.isLogarithmic
                  ? "set logscale x\nset xrange " + makeLogarithmicRange(x, 0)
                  : "set xrange " + makeRange(x, figure.hasWholeNumbers ? 0.1 : 0, false);
    script += "\n";
    script += "set multiplot\n";

    // Panels of one height, and above each the lines of its legend.
    const double top = figure.title.empty() ? 16 : 48;
    double rest = layout.height - top - BelowPanels - PanelGap * (numPanels - 1);
    for (const FigurePanel& panel : figure.panels)
        rest -= LegendLine * countLegendLines(panel, layout.width);
    layout.panelHeight = std::max(40.0, rest / numPanels);
    double upper = top;
    for (int p = 0; p < numPanels; ++p) {
        upper += LegendLine * countLegendLines(figure.panels[size_t(p)], layout.width);
        script += makePanelScript(figure, p, layout, upper);
        upper += layout.panelHeight + PanelGap;
    }
    return script + "unset multiplot\n";
}

void writeFigureCsv(const std::string& path, const Figure& figure) {
    std::string text;
    for (const FigurePanel& panel : figure.panels) {
        CsvLine head;
        size_t count = 0;
        for (const FigureCurve& curve : panel.curves) {
            head.add(figure.xLabel)
                .add(curve.name.empty() ? panel.label : curve.name + ": " + panel.label);
            count = std::max(count, curve.x.size());
        }
        if (count > 0) text += head.end();
        for (size_t k = 0; k < count; ++k) {
            CsvLine line;
            for (const FigureCurve& curve : panel.curves)
                if (k < curve.x.size())
                    line.add(curve.x[k]).add(curve.y[k]);
                else
                    line.add("").add("");
            text += line.end();
        }
        if (panel.map.isEmpty()) continue;
        text += CsvLine().add(figure.xLabel).add(panel.label).add(panel.map.label).end();
        for (const auto& [x, y, value] : panel.map.samples)
            text += CsvLine().add(x).add(y).add(value).end();
        if (!panel.map.samples.empty()) continue;
        for (size_t i = 0; i < panel.map.rows.size(); ++i)
            for (size_t k = 0; k < panel.map.y.size(); ++k)
                text += CsvLine()
                            .add(panel.map.x[i])
                            .add(panel.map.y[k])
                            .add(panel.map.rows[i][k])
                            .end();
    }
    replaceFile(path, text);
}

void drawFigure(const std::string& path, const Figure& figure) {
    const std::string kind =
        fs::path(path).extension() == "" ? "" : fs::path(path).extension().string().substr(1);
    if (kind != "png" && kind != "svg" && kind != "pdf")
        throw std::runtime_error("cannot draw '" + path +
                                 "': its name must end in .png, .svg or .pdf");
    if (figure.panels.empty())
        throw std::runtime_error("cannot draw '" + path + "': there is nothing to draw");
    UnfinishedFile unfinished(path);
    const File script(std::tmpfile(), std::fclose);
    const ProgramOutput errors;
    const File picture(std::fopen(unfinished.getPath().c_str(), "wb"), std::fclose);
    if (!script || !picture)
        throw std::runtime_error("cannot write '" + path + "': " + std::strerror(errno));
    const std::string text = makeGnuplotScript(kind, figure);
    std::fwrite(text.data(), 1, text.size(), script.get());
    std::rewind(script.get());
    ChildSetup setup;
    setup.arguments = {"gnuplot", "--default-settings", "-"};
    setup.input = fileno(script.get());
    setup.output = fileno(picture.get());
    setup.error = errors.getDescriptor();
    ChildEnd end;
    try {
        end = ChildProcess(setup).wait();
    } catch (const std::runtime_error& error) {
        throw std::runtime_error(std::string(error.what()) +
                                 " (plots are drawn by gnuplot: package gnuplot-nox)");
    }
    if (!end.isSuccess() || fs::file_size(unfinished.getPath()) == 0)
        throw std::runtime_error("gnuplot failed to draw '" + path + "': " + errors.read(2000));
    unfinished.finish(Durability::ProcessEnd);
}

}  // namespace model
}  // namespace simflex
