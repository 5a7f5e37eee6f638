#include "PlotPainter.h"

#include <cairo-ft.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "Overlay.h"
#include "simflex/base/NumberText.h"

namespace simflex {

namespace {

// Sizes in pixels of a picture of 720 rows.
constexpr double titleSize = 18, headerSize = 15, labelSize = 13.5;
constexpr double outerMargin = 22, panelGap = 16, headerHeight = 28;
constexpr double tickDistanceX = 76, tickDistanceY = 34;
constexpr double curveWidth = 2.2, dotRadius = 4.2;
constexpr double legendGap = 7, legendLine = 25;
constexpr double opacityOfFuture = 0.27;

// Faces are made once and never freed: cairo keeps glyphs by face, for all threads.
cairo_font_face_t* getFace(Font::Weight weight) {
    const auto load = [](Font::Weight wanted) {
        const std::string file = Font::findFile(wanted);
        FT_Library library = nullptr;
        FT_Face face = nullptr;
        if (FT_Init_FreeType(&library) != 0 || FT_New_Face(library, file.c_str(), 0, &face) != 0)
            throw std::runtime_error("FreeType cannot use the font '" + file + "'");
        return cairo_ft_font_face_create_for_ft_face(face, FT_LOAD_TARGET_LIGHT);
    };
    static cairo_font_face_t* const regular = load(Font::Weight::Regular);
    static cairo_font_face_t* const bold = load(Font::Weight::Bold);
    return weight == Font::Weight::Bold ? bold : regular;
}

std::string formatPowerOfTen(int exponent) {
    const char* const digits[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text = exponent < 0 ? "×10⁻" : "×10";
    for (const char c : std::to_string(std::abs(exponent))) text += digits[c - '0'];
    return text;
}

}  // namespace

std::vector<double> PlotPainter::Axis::calcTicks() const {
    std::vector<double> ticks;
    const double slack = 1e-6 * (high - low);
    for (double k = std::ceil((low - slack) / step); k * step <= high + slack; ++k)
        ticks.push_back(k * step);
    return ticks;
}

void PlotPainter::Axis::chooseStep(double distance) {
    const double span = high - low;
    step = roundUpToStep(span / std::max(1.0, std::abs(end - begin) / distance));
    // Fewer than two marks are no scale.
    while (calcTicks().size() < 2) step = roundUpToStep(step / 2.5);
    decimals = std::min(12, std::max(0, -int(std::floor(std::log10(step) + 1e-9))));
}

std::string PlotPainter::Axis::format(double value, int moreDecimals) const {
    std::string result =
        writeFixed(std::abs(value) < 1e-9 * step ? 0.0 : value, decimals + moreDecimals);
    if (result.find_first_of("123456789") == std::string::npos && result[0] == '-')
        result.erase(0, 1);
    if (result[0] == '-') result.replace(0, 1, "−");
    return result;
}

PlotCanvas::PlotCanvas(int canvasWidth, int canvasHeight, double sizeScale)
    : width(canvasWidth), height(canvasHeight), scale(sizeScale) {
    surface = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height);
    pen = cairo_create(surface);
    if (cairo_status(pen) != CAIRO_STATUS_SUCCESS) {
        const std::string reason = cairo_status_to_string(cairo_status(pen));
        cairo_destroy(pen);
        cairo_surface_destroy(surface);
        throw std::runtime_error("cairo cannot make a picture of " + std::to_string(width) + "x" +
                                 std::to_string(height) + ": " + reason);
    }
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(pen, options);
    cairo_font_options_destroy(options);
}

PlotCanvas::~PlotCanvas() {
    cairo_destroy(pen);
    cairo_surface_destroy(surface);
}

void PlotCanvas::fill(const Image::Pixel& color) {
    setColor(color);
    cairo_set_operator(pen, CAIRO_OPERATOR_SOURCE);
    cairo_paint(pen);
    cairo_set_operator(pen, CAIRO_OPERATOR_OVER);
}

void PlotCanvas::setColor(const Image::Pixel& color, double opacity) {
    cairo_set_source_rgba(pen, color[0] / 255.0, color[1] / 255.0, color[2] / 255.0,
                          color[3] / 255.0 * opacity);
}

void PlotCanvas::setFont(Font::Weight weight, double points) {
    cairo_set_font_face(pen, getFace(weight));
    cairo_set_font_size(pen, std::max(6.0, points * scale));
}

void PlotCanvas::setDash(ProbePlot::Line line) {
    const double dashes[] = {7 * scale, 4 * scale};
    cairo_set_dash(pen, dashes, line == ProbePlot::Line::Dashed ? 2 : 0, 0);
}

double PlotCanvas::calcTextWidth(const std::string& text) const {
    cairo_text_extents_t extents;
    cairo_text_extents(pen, text.c_str(), &extents);
    return extents.x_advance;
}

void PlotCanvas::drawText(double x, double y, const std::string& text, Font::Anchor anchor) {
    if (anchor != Font::Anchor::Left)
        x -= calcTextWidth(text) * (anchor == Font::Anchor::Center ? 0.5 : 1);
    cairo_move_to(pen, x, std::round(y));
    cairo_show_text(pen, text.c_str());
}

void PlotCanvas::copyColumns(const PlotCanvas& other, int first, int end) {
    cairo_surface_flush(surface);
    const unsigned char* from = cairo_image_surface_get_data(other.surface);
    unsigned char* to = cairo_image_surface_get_data(surface);
    const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < height; ++y)
        std::copy(from + y * stride + 4 * first, from + y * stride + 4 * end,
                  to + y * stride + 4 * first);
    cairo_surface_mark_dirty(surface);
}

Image PlotCanvas::toImage() const {
    if (cairo_status(pen) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error(std::string("cairo could not draw a plot: ") +
                                 cairo_status_to_string(cairo_status(pen)));
    cairo_surface_flush(surface);
    const unsigned char* data = cairo_image_surface_get_data(surface);
    const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
    Image image(width, height);
    std::uint8_t* out = image.updData();
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x, out += 4) {
            std::uint32_t argb;
            std::memcpy(&argb, data + y * stride + 4 * x, 4);
            const std::uint32_t a = argb >> 24;
            std::uint32_t color[] = {argb >> 16 & 255, argb >> 8 & 255, argb & 255};
            if (a > 0 && a < 255)  // cairo's colours are multiplied by their opacity
                for (std::uint32_t& c : color) c = std::min(255u, (255 * c + a / 2) / a);
            for (int c = 0; c < 3; ++c) out[c] = std::uint8_t(color[c]);
            out[3] = std::uint8_t(a);
        }
    return image;
}

PlotPainter::PlotPainter(const ProbePlot& drawnPlot, const PlotTheme& plotTheme, int imageWidth,
                         int imageHeight, double sizeScale)
    : plot(drawnPlot),
      theme(plotTheme),
      width(imageWidth),
      height(imageHeight),
      scale(std::max(0.25, sizeScale)) {}

const PlotCanvas& PlotPainter::getPast() const {
    std::call_once(isPastMade, [this] {
        past = std::make_unique<PlotCanvas>(width, height, scale);
        layOut(*past);
        drawLayer(*past, 1);
    });
    return *past;
}

const PlotCanvas& PlotPainter::getFuture() const {
    getPast();
    std::call_once(isFutureMade, [this] {
        future = std::make_unique<PlotCanvas>(width, height, scale);
        drawLayer(*future, opacityOfFuture);
    });
    return *future;
}

bool PlotPainter::hasFuture(double markTime) const {
    return std::any_of(plot.curves.begin(), plot.curves.end(), [&](const ProbePlot::Curve& curve) {
        return !curve.time.empty() && curve.time.back() > markTime;
    });
}

void PlotPainter::addTo(Hash& hash) const {
    hash.add(plot.title);
    hash.add(plot.timeUnit);
    for (const double number : {plot.timeUnitSize, plot.timeLow, plot.timeHigh}) hash.add(number);
    hash.add(plot.panels.size());
    for (const ProbePlot::Panel& panel : plot.panels) {
        hash.add(panel.quantity);
        hash.add(panel.unit);
        for (const double number : {panel.unitSize, panel.low, panel.high}) hash.add(number);
    }
    for (const ProbePlot::Curve& curve : plot.curves) {
        hash.add(curve.name);
        hash.add(curve.panel);
        hash.add(curve.line);
        hash.add(curve.time);
        hash.add(curve.values);
    }
    for (const Image::Pixel& color : {theme.background, theme.text, theme.faintText, theme.grid})
        hash.addBytes(color.data(), color.size());
    for (const Image::Pixel& color : theme.curves) hash.addBytes(color.data(), color.size());
    hash.add(width);
    hash.add(height);
    hash.add(scale);
}

const Image::Pixel& PlotPainter::getCurveColor(int curve) const {
    // Colours begin anew in every panel.
    const int panel = plot.curves[size_t(curve)].panel;
    size_t place = 0;
    for (int i = 0; i < curve; ++i) place += plot.curves[size_t(i)].panel == panel;
    return theme.curves[place % theme.curves.size()];
}

PlotPainter::Axis PlotPainter::calcTimeAxis() const {
    double low = plot.timeLow, high = plot.timeHigh;
    if (!(low < high)) {
        low = std::numeric_limits<double>::infinity();
        high = -low;
        for (const ProbePlot::Curve& curve : plot.curves) {
            if (curve.time.empty()) continue;
            low = std::min(low, curve.time.front());
            high = std::max(high, curve.time.back());
        }
        if (!(low <= high)) low = high = 0;
        if (low == high) high = low + std::max(1e-3, 1e-6 * std::abs(low));
    }
    timeUnit = plot.timeUnit;
    timeUnitSize = plot.timeUnitSize;
    if (timeUnit.empty()) {
        const double longest = std::max(std::abs(low), std::abs(high));
        timeUnit = longest >= 1 ? "s" : longest >= 1e-3 ? "ms" : "µs";
        timeUnitSize = longest >= 1 ? 1 : longest >= 1e-3 ? 1e-3 : 1e-6;
    }
    Axis axis;
    axis.low = low / timeUnitSize;
    axis.high = high / timeUnitSize;
    return axis;
}

// Numbers with more than four digits, or with zeros after the point, get a power of ten in front.
double PlotPainter::chooseUnitSize(int panel, std::string& factor) const {
    double largest = 0;
    for (const ProbePlot::Curve& curve : plot.curves)
        if (curve.panel == panel)
            for (const double value : curve.values)
                if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
    const ProbePlot::Panel& p = plot.panels[size_t(panel)];
    if (p.low < p.high) largest = std::max(std::abs(p.low), std::abs(p.high));
    largest /= p.unitSize;
    if (!(largest > 0) || (largest < 1e5 && largest >= 1e-2)) return p.unitSize;
    const int exponent = 3 * int(std::floor(std::log10(largest) / 3));
    factor = formatPowerOfTen(exponent);
    return p.unitSize * std::pow(10, exponent);
}

PlotPainter::Axis PlotPainter::calcValueAxis(int panel, double unitSize) const {
    const ProbePlot::Panel& p = plot.panels[size_t(panel)];
    Axis axis;
    if (p.low < p.high) {
        axis.low = p.low / unitSize;
        axis.high = p.high / unitSize;
        return axis;
    }
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const ProbePlot::Curve& curve : plot.curves)
        if (curve.panel == panel)
            for (const double value : curve.values)
                if (std::isfinite(value)) {
                    low = std::min(low, value / unitSize);
                    high = std::max(high, value / unitSize);
                }
    if (!(low <= high)) {
        low = 0;
        high = 1;
    }
    // A constant is a line in the middle; round-off is no curve.
    const double least = 1e-9 * std::max(std::abs(low), std::abs(high));
    const double span = high - low > least ? high - low : std::max(0.2 * std::abs(high), 1e-12);
    const double margin = high - low > least ? 0.07 * span : 0.5 * span;
    axis.low = low - margin;
    axis.high = high + margin;
    if (low == 0 && high > 0) axis.low = -0.02 * span;
    if (high == 0 && low < 0) axis.high = 0.02 * span;
    return axis;
}

void PlotPainter::layOut(PlotCanvas& canvas) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    const double outer = outerMargin * scale;
    const int count = std::max(1, plot.getNumPanels());

    double top = outer;
    if (!plot.title.empty()) top += 1.5 * titleSize * scale;
    const double bottom = height - outer - 2.6 * labelSize * scale;
    const double panelHeight = (bottom - top - (count - 1) * panelGap * scale) / count;

    double labels = 0;
    for (int i = 0; i < plot.getNumPanels(); ++i) {
        const ProbePlot::Panel& panel = plot.panels[size_t(i)];
        PanelLayout layout;
        std::string factor;
        layout.unitSize = chooseUnitSize(i, factor);
        layout.axis = calcValueAxis(i, layout.unitSize);
        layout.header = panel.quantity;
        std::string unit = factor;
        if (!panel.unit.empty()) unit += (unit.empty() ? "" : " ") + panel.unit;
        if (!unit.empty()) layout.header += " [" + unit + "]";
        for (int c = 0; c < plot.getNumCurves(); ++c)
            if (plot.curves[size_t(c)].panel == i) layout.curves.push_back(c);

        const double upper = top + i * (panelHeight + panelGap * scale);
        layout.headerLine = upper + 0.95 * headerSize * scale;
        Axis& axis = layout.axis;
        axis.begin = upper + panelHeight;
        axis.end = std::min(upper + headerHeight * scale, axis.begin - 1);
        axis.chooseStep(tickDistanceY * scale);
        for (const double tick : axis.calcTicks())
            labels = std::max(labels, canvas.calcTextWidth(axis.format(tick)));
        panels.push_back(layout);
    }

    timeAxis = calcTimeAxis();
    timeAxis.begin = outer + labels + 8 * scale;
    timeAxis.end = std::max(timeAxis.begin + 1, width - 1.15 * outer);
    timeAxis.chooseStep(tickDistanceX * scale);

    // Room for numbers as wide as the widest, so that nothing moves from frame to frame.
    canvas.setFont(Font::Weight::Regular, labelSize);
    for (PanelLayout& panel : panels) {
        panel.valueWidth = std::max(canvas.calcTextWidth(panel.axis.format(panel.axis.low, 1)),
                                    canvas.calcTextWidth(panel.axis.format(panel.axis.high, 1)));
        panel.legendEnds.resize(panel.curves.size());
        double x = timeAxis.end;
        for (size_t i = panel.curves.size(); i-- > 0;) {
            const std::string& name = plot.curves[size_t(panel.curves[i])].name;
            panel.legendEnds[i] = x;
            x -= panel.valueWidth + (3 * legendGap + legendLine) * scale;
            if (!name.empty()) x -= canvas.calcTextWidth(name) + legendGap * scale;
        }
    }
}

// The path of a curve. Where points are denser than pixels, a column shows its least and its
// greatest value, which no thinning would keep.
void PlotPainter::traceCurve(PlotCanvas& canvas, int index, const PanelLayout& panel) const {
    cairo_t* const cairo = canvas.getPen();
    const ProbePlot::Curve& curve = plot.curves[size_t(index)];
    bool isDown = false;
    const auto lineTo = [&](double x, double value) {
        const double y = panel.axis.toPixel(value / panel.unitSize);
        if (isDown)
            cairo_line_to(cairo, x, y);
        else
            cairo_move_to(cairo, x, y);
        isDown = true;
    };
    const double perColumn = double(curve.time.size()) / (timeAxis.end - timeAxis.begin);
    const double column = perColumn > 4 ? 1 : 0;
    cairo_new_path(cairo);
    for (size_t i = 0; i < curve.time.size();) {
        if (!std::isfinite(curve.values[i])) {
            isDown = false;
            ++i;
            continue;
        }
        const double x = timeAxis.toPixel(curve.time[i] / timeUnitSize);
        size_t low = i, high = i, last = i;
        while (last + 1 < curve.time.size() && std::isfinite(curve.values[last + 1]) &&
               timeAxis.toPixel(curve.time[last + 1] / timeUnitSize) < x + column) {
            ++last;
            if (curve.values[last] < curve.values[low]) low = last;
            if (curve.values[last] > curve.values[high]) high = last;
        }
        size_t kept[] = {i, std::min(low, high), std::max(low, high), last};
        for (int k = 0; k < 4; ++k)
            if (k == 0 || kept[k] != kept[k - 1])
                lineTo(timeAxis.toPixel(curve.time[kept[k]] / timeUnitSize), curve.values[kept[k]]);
        i = last + 1;
    }
}

void PlotPainter::drawPanel(PlotCanvas& canvas, const PanelLayout& panel, double opacity) const {
    const Axis& axis = panel.axis;
    const double left = timeAxis.begin, right = timeAxis.end;
    const auto sharp = [](double x) { return std::floor(x) + 0.5; };
    cairo_t* const pen = canvas.getPen();

    cairo_set_line_width(pen, std::max(1.0, std::round(scale)));
    canvas.setDash(ProbePlot::Line::Solid);
    canvas.setColor(theme.grid);
    for (const double tick : axis.calcTicks()) {
        cairo_move_to(pen, left, sharp(axis.toPixel(tick)));
        cairo_line_to(pen, right, sharp(axis.toPixel(tick)));
    }
    for (const double tick : timeAxis.calcTicks()) {
        cairo_move_to(pen, sharp(timeAxis.toPixel(tick)), axis.end);
        cairo_line_to(pen, sharp(timeAxis.toPixel(tick)), axis.begin);
    }
    cairo_stroke(pen);

    // Zero is a line of its own.
    canvas.setColor(theme.faintText, 0.75);
    if (axis.low < 0 && axis.high > 0) {
        cairo_move_to(pen, left, sharp(axis.toPixel(0)));
        cairo_line_to(pen, right, sharp(axis.toPixel(0)));
    }
    cairo_move_to(pen, sharp(left), axis.end);
    cairo_line_to(pen, sharp(left), sharp(axis.begin));
    cairo_line_to(pen, right, sharp(axis.begin));
    cairo_stroke(pen);

    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.faintText);
    for (const double tick : axis.calcTicks())
        canvas.drawText(left - 7 * scale, axis.toPixel(tick) + 0.36 * labelSize * scale,
                        axis.format(tick), Font::Anchor::Right);
    canvas.setFont(Font::Weight::Bold, headerSize);
    canvas.setColor(theme.text);
    canvas.drawText(left, panel.headerLine, panel.header, Font::Anchor::Left);
    drawLegend(canvas, panel);

    cairo_save(pen);
    cairo_rectangle(pen, left - curveWidth * scale, axis.end - 1,
                    right - left + 2 * curveWidth * scale, axis.begin - axis.end + 1);
    cairo_clip(pen);
    cairo_set_line_width(pen, curveWidth * scale);
    cairo_set_line_join(pen, CAIRO_LINE_JOIN_ROUND);
    for (auto c = panel.curves.rbegin(); c != panel.curves.rend(); ++c) {
        traceCurve(canvas, *c, panel);
        canvas.setDash(plot.curves[size_t(*c)].line);
        canvas.setColor(getCurveColor(*c), opacity);
        cairo_stroke(pen);
    }
    cairo_restore(pen);
    canvas.setDash(ProbePlot::Line::Solid);
}

// Names at the right end of the header's line, each before the room for its value at the mark;
// nothing for one curve without a name.
void PlotPainter::drawLegend(PlotCanvas& canvas, const PanelLayout& panel) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    cairo_t* const pen = canvas.getPen();
    for (size_t i = 0; i < panel.curves.size(); ++i) {
        const int c = panel.curves[i];
        const ProbePlot::Curve& curve = plot.curves[size_t(c)];
        double x = panel.legendEnds[i] - panel.valueWidth;
        if (!curve.name.empty()) {
            x -= panel.valueWidth > 0 ? legendGap * scale : 0;
            canvas.setColor(theme.faintText);
            canvas.drawText(x, panel.headerLine, curve.name, Font::Anchor::Right);
            x -= canvas.calcTextWidth(curve.name);
        }
        if (!curve.name.empty() || panel.curves.size() > 1) {
            x -= legendGap * scale;
            const double y = panel.headerLine - 0.35 * labelSize * scale;
            canvas.setColor(getCurveColor(c));
            canvas.setDash(curve.line);
            cairo_set_line_width(pen, (curveWidth + 0.4) * scale);
            cairo_move_to(pen, x - legendLine * scale, y);
            cairo_line_to(pen, x, y);
            cairo_stroke(pen);
        }
    }
    canvas.setDash(ProbePlot::Line::Solid);
}

void PlotPainter::drawMark(PlotCanvas& canvas, double markTime) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.text);
    for (const PanelLayout& panel : panels)
        for (size_t i = 0; i < panel.curves.size(); ++i) {
            const double value = plot.calcValue(panel.curves[i], markTime) / panel.unitSize;
            if (std::isfinite(value))
                canvas.drawText(panel.legendEnds[i], panel.headerLine, panel.axis.format(value, 1),
                                Font::Anchor::Right);
        }

    const double time = markTime / timeUnitSize;
    if (time < timeAxis.low || time > timeAxis.high || panels.empty()) return;
    cairo_t* const pen = canvas.getPen();
    const double x = timeAxis.toPixel(time);
    cairo_set_line_width(pen, 1.4 * scale);
    canvas.setColor(theme.text, 0.8);
    for (const PanelLayout& panel : panels) {
        cairo_move_to(pen, x, panel.axis.end);
        cairo_line_to(pen, x, panel.axis.begin);
    }
    cairo_stroke(pen);
    for (const PanelLayout& panel : panels)
        for (auto c = panel.curves.rbegin(); c != panel.curves.rend(); ++c) {
            const double value = plot.calcValue(*c, markTime) / panel.unitSize;
            if (!(value >= panel.axis.low && value <= panel.axis.high)) continue;
            cairo_arc(pen, x, panel.axis.toPixel(value), dotRadius * scale, 0, 2 * SimTK::Pi);
            canvas.setColor(getCurveColor(*c));
            cairo_fill_preserve(pen);
            canvas.setColor(theme.background);
            cairo_stroke(pen);
        }
}

void PlotPainter::drawLayer(PlotCanvas& canvas, double opacity) const {
    canvas.fill(theme.background);
    if (!plot.title.empty()) {
        canvas.setFont(Font::Weight::Bold, titleSize);
        canvas.setColor(theme.text);
        canvas.drawText(timeAxis.begin, (outerMargin + 0.75 * titleSize) * scale, plot.title,
                        Font::Anchor::Left);
    }
    for (const PanelLayout& panel : panels) drawPanel(canvas, panel, opacity);
    if (panels.empty()) return;

    const double bottom = panels.back().axis.begin;
    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.faintText);
    for (const double tick : timeAxis.calcTicks())
        canvas.drawText(timeAxis.toPixel(tick), bottom + 1.45 * labelSize * scale,
                        timeAxis.format(tick), Font::Anchor::Center);
    canvas.setColor(theme.text);
    canvas.drawText(0.5 * (timeAxis.begin + timeAxis.end), bottom + 2.8 * labelSize * scale,
                    "time [" + timeUnit + "]", Font::Anchor::Center);
}

Image PlotPainter::paint(double markTime) const {
    const PlotCanvas& whole = getPast();
    if (!std::isfinite(markTime)) return whole.toImage();
    const double x = timeAxis.toPixel(markTime / timeUnitSize);
    int mark = width;
    PlotCanvas canvas(width, height, scale);
    if (hasFuture(markTime)) {
        mark = int(std::min(double(width), std::max(0.0, std::round(x))));
        canvas.copyColumns(getFuture(), mark, width);
    }
    canvas.copyColumns(whole, 0, mark);
    drawMark(canvas, markTime);
    return canvas.toImage();
}

}  // namespace simflex
