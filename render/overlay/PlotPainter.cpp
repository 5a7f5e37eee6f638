#include "PlotPainter.h"

#include <cairo-ft.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "Overlay.h"
#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"
#include "simflex/render/ColorMap.h"

namespace simflex {

namespace {

// Sizes in pixels for a picture of 720 rows.
constexpr double titleSize = 18, headerSize = 15, labelSize = 13.5;
constexpr double outerMargin = 22, panelGap = 16, headerHeight = 28;
constexpr double tickDistanceX = 76, tickDistanceY = 34;
constexpr double curveWidth = 2.2, faintWidth = 1.2, dotRadius = 4.2, pointRadius = 2.6;
constexpr double legendGap = 7, legendLine = 25, legendRow = 21;
constexpr double colorBarGap = 18, colorBarWidth = 24, colorBarRoom = 76;
constexpr double opacityOfFuture = 0.27, opacityOfBand = 0.25;
constexpr double decadesOfMap = 3;
constexpr Image::Pixel lineOnMap = {255, 140, 105, 255};

// Faces are created once and never freed: cairo caches glyphs by face for all threads.
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

/** A range that grows to include values. **/
struct Span {
    double low = std::numeric_limits<double>::infinity(), high = -low;

    void add(double value, bool onlyPositive = false) {
        if (!std::isfinite(value) || (onlyPositive && !(value > 0))) return;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    void add(const std::vector<double>& values, bool onlyPositive = false) {
        for (const double value : values) add(value, onlyPositive);
    }
    bool isEmpty() const { return !(low <= high); }
    double getLargest() const { return std::max(std::abs(low), std::abs(high)); }
};

/** Range of positive numbers with a margin; a single value is centred in a decade. **/
Span widenByFactor(const Span& span, double margin) {
    if (span.isEmpty()) return {1, 10};
    const double factor =
        span.high > span.low ? std::pow(span.high / span.low, margin) : std::sqrt(10.0);
    return {span.low / factor, span.high * factor};
}

/** Colour of a fraction of a turn; cyclic, and different for all angles. **/
SimTK::Vec3 calcAngleColor(double part) {
    static const SimTK::Vec3 colors[] = {
        SimTK::Vec3(0.27, 0.00, 0.33), SimTK::Vec3(0.13, 0.57, 0.55), SimTK::Vec3(0.99, 0.91, 0.14),
        SimTK::Vec3(0.84, 0.37, 0.00)};
    const int quarter = std::clamp(int(4 * part), 0, 3);
    const double rest = 4 * part - quarter;
    return (1 - rest) * colors[quarter] + rest * colors[(quarter + 1) % 4];
}

SimTK::Vec3 calcMapColor(const FigureMap& map, double part) {
    return map.scale == FigureMap::Scale::Angles
               ? calcAngleColor(part)
               : calcColor(ColorMap::Viridis, std::clamp(part, 0.0, 1.0));
}

double snap(double x) {
    return std::floor(x) + 0.5;
}

}  // namespace

double interpolateCurve(const std::vector<double>& x, const std::vector<double>& y, double at) {
    if (x.empty() || !(at >= x.front() && at <= x.back()))
        return std::numeric_limits<double>::quiet_NaN();
    const size_t i = size_t(std::lower_bound(x.begin(), x.end(), at) - x.begin());
    if (x[i] == at) return y[i];
    const double part = (at - x[i - 1]) / (x[i] - x[i - 1]);
    return y[i - 1] + part * (y[i] - y[i - 1]);
}

double PlotPainter::Axis::toPixel(double value) const {
    const double part =
        isLogarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return begin + part * (end - begin);
}

void PlotPainter::Axis::chooseStep(double distance, double leastStep) {
    const double numMarks = std::max(1.0, std::abs(end - begin) / distance);
    if (isLogarithmic && high >= 10 * low) {
        step = std::max(1.0, std::ceil(std::log10(high / low) / numMarks));
        return;
    }
    step = std::max(leastStep, roundUpToStep((high - low) / factor / numMarks) * factor);
    // A scale needs at least two ticks.
    while (step > leastStep && calcTicks().size() < 2)
        step = std::max(leastStep, roundUpToStep(step / factor / 2.5) * factor);
    decimals = std::min(12, std::max(0, -int(std::floor(std::log10(step / factor) + 1e-9))));
}

void PlotPainter::Axis::chooseDegrees(double distance) {
    const double least = (high - low) * distance / std::abs(end - begin);
    chooseStep(distance);
    if (step < 15) return;
    for (const double degrees : {15., 30., 45., 90., 180., 360.}) {
        step = degrees;
        if (step >= least) return;
    }
    step = 360 * std::ceil(least / 360);
}

std::string PlotPainter::Axis::chooseFactor(const std::string& label, double largest) {
    if (isLogarithmic || !(largest > 0) || (largest < 1e5 && largest >= 1e-2)) return label;
    const int exponent = 3 * int(std::floor(std::log10(largest) / 3));
    factor = std::pow(10, exponent);
    const std::string text = "×" + formatPowerOfTen(exponent);
    const size_t unit = label.rfind('[');
    if (unit == std::string::npos) return label + (label.empty() ? "[" : " [") + text + "]";
    return label.substr(0, unit + 1) + text + " " + label.substr(unit + 1);
}

std::vector<PlotPainter::Tick> PlotPainter::Axis::calcTicks() const {
    if (isLogarithmic && high >= 10 * low) return calcLogarithmicTicks();
    std::vector<Tick> ticks;
    const double slack = 1e-6 * (high - low);
    for (double k = std::ceil((low - slack) / step); k * step <= high + slack; ++k)
        ticks.push_back({k * step, format(k * step)});
    return ticks;
}

// Every `step`-th power of ten has a number; the other multiples are unlabelled.
std::vector<PlotPainter::Tick> PlotPainter::Axis::calcLogarithmicTicks() const {
    std::vector<Tick> ticks;
    const bool isPlain = low >= 0.9e-3 && high <= 1.1e5;
    const double numDecades = std::log10(high / low);
    const int every = int(step), multiples = numDecades < 4 ? 9 : 1;
    for (int k = int(std::floor(std::log10(low))); k <= int(std::ceil(std::log10(high))); ++k)
        for (int m = 1; m <= multiples; ++m) {
            const double value = m * std::pow(10, k);
            if (value < low * (1 - 1e-9) || value > high * (1 + 1e-9)) continue;
            const bool hasNumber =
                m == 1 ? k % every == 0 : (m == 2 || m == 5) && numDecades < 2.5 && isPlain;
            ticks.push_back({value, !hasNumber ? ""
                                    : isPlain  ? writeGeneral(value, 6)
                                               : formatPowerOfTen(k)});
        }
    return ticks;
}

std::string PlotPainter::Axis::format(double value, int moreDecimals) const {
    std::string result =
        writeFixed(std::abs(value) < 1e-9 * step ? 0.0 : value / factor, decimals + moreDecimals);
    if (result.find_first_of("123456789") == std::string::npos && result[0] == '-')
        result.erase(0, 1);
    if (result[0] == '-') result.replace(0, 1, "−");
    return result;
}

PlotCanvas::PlotCanvas(cairo_surface_t* newSurface, double sizeScale)
    : scale(sizeScale), surface(newSurface), pen(cairo_create(newSurface)) {
    if (cairo_status(pen) != CAIRO_STATUS_SUCCESS) {
        const std::string reason = cairo_status_to_string(cairo_status(pen));
        cairo_destroy(pen);
        cairo_surface_destroy(surface);
        throw std::runtime_error("cairo cannot make a picture: " + reason);
    }
    cairo_font_options_t* options = cairo_font_options_create();
    cairo_font_options_set_antialias(options, CAIRO_ANTIALIAS_GRAY);
    cairo_font_options_set_hint_style(options, CAIRO_HINT_STYLE_SLIGHT);
    cairo_font_options_set_hint_metrics(options, CAIRO_HINT_METRICS_OFF);
    cairo_set_font_options(pen, options);
    cairo_font_options_destroy(options);
}

PlotCanvas::PlotCanvas(int width, int height, double sizeScale)
    : PlotCanvas(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, width, height), sizeScale) {}

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

void PlotCanvas::setDash(int dash) {
    static const std::vector<double> patterns[] = {
        {}, {7, 4}, {1.6, 3}, {7, 3, 1.6, 3}, {7, 3, 1.6, 3, 1.6, 3}};
    std::vector<double> dashes = patterns[size_t(dash) % std::size(patterns)];
    for (double& length : dashes) length *= scale;
    cairo_set_dash(pen, dashes.data(), int(dashes.size()), 0);
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

void PlotCanvas::drawUpwards(double x, double y, const std::string& text, Font::Anchor anchor) {
    cairo_save(pen);
    cairo_translate(pen, x, y);
    cairo_rotate(pen, -0.5 * SimTK::Pi);
    drawText(0, 0, text, anchor);
    cairo_restore(pen);
}

void PlotCanvas::drawLine(double x0, double y0, double x1, double y1) {
    cairo_move_to(pen, x0, y0);
    cairo_line_to(pen, x1, y1);
}

void PlotCanvas::copyColumns(const PlotCanvas& other, int first, int end) {
    cairo_surface_flush(surface);
    const unsigned char* from = cairo_image_surface_get_data(other.surface);
    unsigned char* to = cairo_image_surface_get_data(surface);
    const std::ptrdiff_t stride = cairo_image_surface_get_stride(surface);
    for (int y = 0; y < cairo_image_surface_get_height(surface); ++y)
        std::copy(from + y * stride + 4 * first, from + y * stride + 4 * end,
                  to + y * stride + 4 * first);
    cairo_surface_mark_dirty(surface);
}

void PlotCanvas::check() const {
    if (cairo_status(pen) != CAIRO_STATUS_SUCCESS)
        throw std::runtime_error(std::string("cairo could not draw a plot: ") +
                                 cairo_status_to_string(cairo_status(pen)));
}

Image PlotCanvas::toImage() const {
    check();
    const int width = cairo_image_surface_get_width(surface),
              height = cairo_image_surface_get_height(surface);
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
            if (a > 0 && a < 255)  // cairo's colours are premultiplied
                for (std::uint32_t& c : color) c = std::min(255u, (255 * c + a / 2) / a);
            for (int c = 0; c < 3; ++c) out[c] = std::uint8_t(color[c]);
            out[3] = std::uint8_t(a);
        }
    return image;
}

PlotPainter::PlotPainter(Figure drawnFigure, const PlotTheme& plotTheme, int imageWidth,
                         int imageHeight, double sizeScale)
    : figure(std::move(drawnFigure)),
      theme(plotTheme),
      width(imageWidth),
      height(imageHeight),
      scale(std::max(0.25, sizeScale)) {}

void PlotPainter::paintOn(PlotCanvas& canvas) const {
    layOut(canvas);
    drawLayer(canvas, 1);
}

const PlotCanvas& PlotPainter::getPast() const {
    std::call_once(isPastMade, [this] {
        past = std::make_unique<PlotCanvas>(width, height, scale);
        paintOn(*past);
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

void PlotPainter::addTo(Hash& hash) const {
    for (const std::string& text : {figure.title, figure.xLabel}) hash.add(text);
    for (const double number : {figure.low, figure.high}) hash.add(number);
    hash.add(figure.panels.size());
    for (const FigurePanel& panel : figure.panels) {
        hash.add(panel.label);
        for (const double number : {panel.low, panel.high}) hash.add(number);
        for (const FigureCurve& curve : panel.curves) {
            hash.add(curve.name);
            for (const int choice : {curve.color, curve.dash, int(curve.marks)}) hash.add(choice);
            for (const auto* values : {&curve.x, &curve.y, &curve.error}) hash.add(*values);
        }
    }
    for (const Image::Pixel& color : {theme.background, theme.text, theme.faintText, theme.grid})
        hash.addBytes(color.data(), color.size());
    for (const Image::Pixel& color : theme.curves) hash.addBytes(color.data(), color.size());
    hash.add(width);
    hash.add(height);
    hash.add(scale);
}

Image::Pixel PlotPainter::getColor(const FigureCurve& curve) const {
    return curve.isFaint ? theme.faintText
                         : theme.curves[size_t(curve.color) % theme.curves.size()];
}

PlotPainter::Axis PlotPainter::calcXAxis() const {
    Span x;
    bool hasFields = false;
    for (const FigurePanel& panel : figure.panels) {
        for (const FigureCurve& curve : panel.curves) x.add(curve.x, figure.isLogarithmic);
        x.add(panel.map.x);
        hasFields |= panel.map.scale == FigureMap::Scale::Fractions && !panel.map.isEmpty();
    }
    if (figure.low < figure.high) x = {figure.low, figure.high};
    Axis axis;
    axis.isLogarithmic = figure.isLogarithmic;
    if (axis.isLogarithmic) {
        x = widenByFactor(x, 0);
    } else {
        if (x.isEmpty()) x = {0, 0};
        if (hasFields)
            x = {x.low - 0.5, x.high + 0.5};
        else if (figure.hasWholeNumbers) {
            const double margin = std::max(0.1 * (x.high - x.low), 0.5);
            x = {x.low - margin, x.high + margin};
        }
        if (!(x.high - x.low > 1e-9 * x.getLargest()))
            x.high = x.low + std::max(1e-3, 1e-6 * std::abs(x.low));
        if (!figure.hasWholeNumbers) xLabel = axis.chooseFactor(figure.xLabel, x.getLargest());
    }
    axis.low = x.low;
    axis.high = x.high;
    return axis;
}

PlotPainter::Axis PlotPainter::calcValueAxis(const FigurePanel& panel, double& largest) const {
    Axis axis;
    axis.isLogarithmic = panel.isLogarithmic;
    Span y;
    for (const FigureCurve& curve : panel.curves) {
        if (!panel.map.isEmpty()) continue;
        y.add(curve.y, panel.isLogarithmic);
        for (size_t k = 0; k < curve.error.size(); ++k)
            for (const double side : {-1, 1})
                y.add(curve.y[k] + side * std::abs(curve.error[k]), panel.isLogarithmic);
    }
    y.add(panel.map.y);
    const bool isFixed = panel.low < panel.high;
    if (isFixed) y = {panel.low, panel.high};
    largest = y.isEmpty() ? 0 : y.getLargest();
    const bool hasFields = panel.map.scale == FigureMap::Scale::Fractions && !panel.map.isEmpty();
    if (hasFields) {
        y = {y.low - 0.5, y.high + 0.5};
    } else if (axis.isLogarithmic && !isFixed) {
        y = widenByFactor(y, 0.05);
    } else if (!isFixed && panel.map.isEmpty()) {
        if (y.isEmpty()) y = {0, 1};
        if (panel.startsAtZero) y.low = std::min(y.low, 0.0);
        // A constant is drawn in the middle; round-off does not make a curve.
        const double least = 1e-9 * y.getLargest();
        const bool isConstant = !(y.high - y.low > least);
        const double span = isConstant ? std::max(0.2 * std::abs(y.high), 1e-12) : y.high - y.low,
                     margin = (isConstant ? 0.5 : 0.07) * span, low = y.low, high = y.high;
        y = {low - margin, high + margin};
        if (low == 0 && high > 0) y.low = panel.startsAtZero ? 0 : -0.02 * span;
        if (high == 0 && low < 0) y.high = 0.02 * span;
    }
    axis.low = y.low;
    axis.high = y.high;
    return axis;
}

/** Widens the axis with the larger scale. **/
void PlotPainter::makeScalesEqual(Axis& y) const {
    const auto calcUnit = [](const Axis& axis) {
        return (axis.high - axis.low) / std::abs(axis.end - axis.begin);
    };
    const double unit = 1.02 * std::max(calcUnit(xAxis), calcUnit(y));
    for (Axis* axis : {&xAxis, &y}) {
        const double middle = 0.5 * (axis->low + axis->high),
                     half = 0.5 * unit * std::abs(axis->end - axis->begin);
        axis->low = middle - half;
        axis->high = middle + half;
    }
}

// Places the legend on the header's line at its right end, if there is room or values are
// displayed; else in columns below. Returns the number of lines below.
int PlotPainter::layOutLegend(PlotCanvas& canvas, PanelLayout& layout) const {
    const double line = legendLine * scale, gap = legendGap * scale;
    canvas.setFont(Font::Weight::Bold, headerSize);
    const double header = canvas.calcTextWidth(layout.header);
    canvas.setFont(Font::Weight::Regular, labelSize);
    double all = 0, widest = 0;
    for (const FigureCurve& curve : layout.panel->curves) {
        if (curve.name.empty() && !figure.showsValues) continue;
        const double name = curve.name.empty() ? 0 : canvas.calcTextWidth(curve.name) + gap;
        const double size = layout.valueWidth + 3 * gap + line + name;
        layout.legend.push_back({&curve, 0, size, layout.headerLine});
        all += size;
        widest = std::max(widest, size);
    }
    if (figure.showsValues || header + all < xAxis.end - xAxis.begin) {
        double x = xAxis.end;
        for (auto entry = layout.legend.rbegin(); entry != layout.legend.rend(); ++entry) {
            const double size = entry->right;
            entry->right = x;
            x -= size;
            entry->left = x;
        }
        return 0;
    }
    const int columns = std::max(1, int((xAxis.end - xAxis.begin) / widest));
    for (size_t k = 0; k < layout.legend.size(); ++k) {
        LegendEntry& entry = layout.legend[k];
        const double size = entry.right;
        entry.left = xAxis.begin + double(int(k) % columns) * widest;
        entry.right = entry.left + size;
        entry.left -= 2 * gap;
        entry.right -= 2 * gap;
        entry.line += (1 + int(k) / columns) * legendRow * scale;
    }
    return (int(layout.legend.size()) + columns - 1) / columns;
}

void PlotPainter::layOut(PlotCanvas& canvas) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    const double outer = outerMargin * scale;
    const int count = std::max(1, int(figure.panels.size()));

    double top = outer;
    if (!figure.title.empty()) top += 1.5 * titleSize * scale;
    const double bottom = height - outer - 2.6 * labelSize * scale;

    // The lines of a legend depend on the width of the axis numbers, which depends on the height.
    double labels = 0;
    bool hasColors = false;
    std::vector<int> lines(figure.panels.size(), 0);
    constexpr int mostPasses = 5;
    for (int pass = 0; pass < mostPasses; ++pass) {
        const std::vector<int> linesBefore = lines;
        const double labelsBefore = labels;
        xLabel = figure.xLabel;
        xAxis = calcXAxis();
        xAxis.begin = outer + labels + 8 * scale;
        const double right =
            1.15 * outer + (hasColors ? (colorBarGap + colorBarWidth + colorBarRoom) * scale : 0);
        xAxis.end = std::max(xAxis.begin + 1, width - right);
        double rest = bottom - top - (count - 1) * panelGap * scale;
        for (const int more : lines) rest -= more * legendRow * scale;
        const double panelHeight = std::max(rest / count, headerHeight * scale);
        double upper = top;
        layouts.clear();
        for (size_t i = 0; i < figure.panels.size(); ++i) {
            const FigurePanel& panel = figure.panels[i];
            PanelLayout layout;
            layout.panel = &panel;
            double largest = 0;
            Axis& axis = layout.axis = calcValueAxis(panel, largest);
            if (figure.hasEqualScales) {
                largest = std::max({largest, std::abs(xAxis.low), std::abs(xAxis.high)});
                xAxis.factor = 1;
                xLabel = xAxis.chooseFactor(figure.xLabel, largest);
            }
            layout.header = axis.chooseFactor(panel.label, largest);
            layout.headerLine = upper + 0.95 * headerSize * scale;
            const double more = lines[i] * legendRow * scale;
            axis.begin = upper + panelHeight + more;
            axis.end = std::min(upper + headerHeight * scale + more, axis.begin - 1);
            if (figure.hasEqualScales) makeScalesEqual(axis);
            const bool hasFields =
                panel.map.scale == FigureMap::Scale::Fractions && !panel.map.isEmpty();
            if (panel.hasDegrees)
                axis.chooseDegrees(tickDistanceY * scale);
            else
                axis.chooseStep(tickDistanceY * scale, hasFields ? 1 : 0);
            canvas.setFont(Font::Weight::Regular, labelSize);
            for (const Tick& tick : axis.calcTicks())
                labels = std::max(labels, canvas.calcTextWidth(tick.text));
            // Room for the widest number, so that nothing moves between frames.
            if (figure.showsValues)
                layout.valueWidth = std::max(canvas.calcTextWidth(axis.format(axis.low, 1)),
                                             canvas.calcTextWidth(axis.format(axis.high, 1)));
            hasColors |= !panel.map.isEmpty();
            lines[i] = layOutLegend(canvas, layout);
            upper = axis.begin + panelGap * scale;
            layouts.push_back(std::move(layout));
        }
        xAxis.chooseStep(tickDistanceX * scale, figure.hasWholeNumbers ? 1 : 0);
        if (pass > 0 && lines == linesBefore && labels == labelsBefore) break;
    }
    for (PanelLayout& layout : layouts) {
        const FigureMap& map = layout.panel->map;
        if (map.isEmpty()) continue;
        Axis& colors = layout.colors;
        colors.begin = layout.axis.begin;
        colors.end = layout.axis.end;
        layout.colorLabel = map.label;
        if (map.scale == FigureMap::Scale::Angles) {
            colors.low = -180;
            colors.high = 180;
            colors.chooseDegrees(tickDistanceY * scale);
        } else {
            colors.isLogarithmic = map.scale == FigureMap::Scale::Logarithmic;
            if (colors.isLogarithmic) {
                Span values;
                for (const std::vector<double>& row : map.rows) values.add(row, true);
                colors.high = values.isEmpty() ? 1 : values.high;
                colors.low = colors.high * std::pow(10, -decadesOfMap);
            }
            colors.chooseStep(tickDistanceY * scale);
        }
    }
}

// Path of a curve. If points are denser than pixels, each column shows its minimum and maximum,
// which thinning would lose.
void PlotPainter::traceCurve(PlotCanvas& canvas, const FigureCurve& curve, const Axis& axis) const {
    cairo_t* const cairo = canvas.getPen();
    bool isDown = false;
    const auto isDrawn = [&](size_t i) {
        return std::isfinite(xAxis.toPixel(curve.x[i])) && std::isfinite(axis.toPixel(curve.y[i]));
    };
    const auto lineTo = [&](size_t i) {
        const double x = xAxis.toPixel(curve.x[i]), y = axis.toPixel(curve.y[i]);
        if (isDown)
            cairo_line_to(cairo, x, y);
        else
            cairo_move_to(cairo, x, y);
        isDown = true;
    };
    const double pixel = canvas.isImage() ? 1 : 0.25;
    const double perColumn = pixel * double(curve.x.size()) / (xAxis.end - xAxis.begin);
    const bool isDense = perColumn > 4 && std::is_sorted(curve.x.begin(), curve.x.end());
    cairo_new_path(cairo);
    for (size_t i = 0; i < curve.x.size();) {
        if (!isDrawn(i)) {
            isDown = false;
            ++i;
            continue;
        }
        const double x = xAxis.toPixel(curve.x[i]);
        size_t low = i, high = i, last = i;
        while (isDense && last + 1 < curve.x.size() && isDrawn(last + 1) &&
               xAxis.toPixel(curve.x[last + 1]) < x + pixel) {
            ++last;
            if (curve.y[last] < curve.y[low]) low = last;
            if (curve.y[last] > curve.y[high]) high = last;
        }
        const size_t kept[] = {i, std::min(low, high), std::max(low, high), last};
        for (int k = 0; k < 4; ++k)
            if (k == 0 || kept[k] != kept[k - 1]) lineTo(kept[k]);
        i = last + 1;
    }
}

void PlotPainter::drawCurve(PlotCanvas& canvas, const FigureCurve& curve, const PanelLayout& layout,
                            double opacity) const {
    using Marks = FigureCurve::Marks;
    cairo_t* const pen = canvas.getPen();
    const Axis& axis = layout.axis;
    const bool isOnMap = !layout.panel->map.isEmpty();
    const Image::Pixel color = isOnMap ? lineOnMap : getColor(curve);
    if (!curve.error.empty()) {
        FigureCurve edge;
        for (const double side : {-1, 1})
            for (size_t k = 0; k < curve.x.size(); ++k) {
                const size_t i = side < 0 ? k : curve.x.size() - 1 - k;
                const double y = curve.y[i] + side * std::abs(curve.error[i]);
                if (!std::isfinite(y)) continue;
                edge.x.push_back(curve.x[i]);
                edge.y.push_back(y);
            }
        traceCurve(canvas, edge, axis);
        canvas.setColor(color, opacityOfBand * opacity);
        cairo_fill(pen);
    }
    canvas.setColor(color, opacity);
    cairo_set_line_width(pen, (curve.isFaint && !isOnMap ? faintWidth : curveWidth) * scale);
    canvas.setDash(curve.isFaint ? 2 : curve.dash);
    if (curve.marks == Marks::None || curve.marks == Marks::Points) {
        traceCurve(canvas, curve, axis);
        cairo_stroke(pen);
    }
    canvas.setDash(0);
    if (curve.marks == Marks::None) return;
    const double zero =
        axis.toPixel(axis.isLogarithmic ? axis.low : std::clamp(0.0, axis.low, axis.high));
    const double radius = (curve.marks == Marks::Points ? pointRadius : dotRadius) * scale;
    cairo_set_line_width(pen, (curve.marks == Marks::Stems ? 3 : 1.6) * scale);
    for (size_t k = 0; k < curve.x.size(); ++k) {
        const double x = xAxis.toPixel(curve.x[k]), y = axis.toPixel(curve.y[k]);
        if (!std::isfinite(x) || !std::isfinite(y)) continue;
        if (curve.marks == Marks::Stems) {
            canvas.drawLine(x, zero, x, y);
            cairo_stroke(pen);
        }
        cairo_new_sub_path(pen);
        cairo_arc(pen, x, y, radius, 0, 2 * SimTK::Pi);
        if (curve.marks == Marks::Circles)
            cairo_stroke(pen);
        else
            cairo_fill(pen);
    }
}

void PlotPainter::drawMap(PlotCanvas& canvas, const PanelLayout& layout) const {
    const FigureMap& map = layout.panel->map;
    const int columns = int(map.x.size()), rows = int(map.y.size());
    if (columns == 0 || rows == 0) return;
    cairo_surface_t* cells = cairo_image_surface_create(CAIRO_FORMAT_ARGB32, columns, rows);
    if (cairo_surface_status(cells) != CAIRO_STATUS_SUCCESS) {
        cairo_surface_destroy(cells);
        throw std::runtime_error("a map of " + std::to_string(columns) + " by " +
                                 std::to_string(rows) + " fields is too large to be drawn");
    }
    cairo_surface_flush(cells);
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            const double value = map.rows[size_t(i)][size_t(rows - 1 - j)];
            std::uint32_t argb = 0;
            if (std::isfinite(value)) {
                const Axis& scaleOfColors = layout.colors;
                const double part = (scaleOfColors.toPixel(
                                         std::clamp(value, scaleOfColors.low, scaleOfColors.high)) -
                                     scaleOfColors.begin) /
                                    (scaleOfColors.end - scaleOfColors.begin);
                const SimTK::Vec3 color = calcMapColor(map, part);
                argb = 0xff000000u;
                for (int c = 0; c < 3; ++c)
                    argb |= std::uint32_t(std::lround(255 * color[c])) << (16 - 8 * c);
            }
            std::memcpy(cairo_image_surface_get_data(cells) +
                            j * cairo_image_surface_get_stride(cells) + 4 * i,
                        &argb, 4);
        }
    cairo_surface_mark_dirty(cells);
    const auto calcEdges = [](const Axis& axis, const std::vector<double>& places) {
        const double half = places.size() > 1
                                ? 0.5 * (places.back() - places.front()) / double(places.size() - 1)
                                : 0.5;
        return std::pair<double, double>(axis.toPixel(places.front() - half),
                                         axis.toPixel(places.back() + half));
    };
    const auto [left, right] = calcEdges(xAxis, map.x);
    const auto [bottom, top] = calcEdges(layout.axis, map.y);
    cairo_t* const pen = canvas.getPen();
    cairo_save(pen);
    cairo_rectangle(pen, xAxis.begin, layout.axis.end, xAxis.end - xAxis.begin,
                    layout.axis.begin - layout.axis.end);
    cairo_clip(pen);
    cairo_translate(pen, left, top);
    cairo_scale(pen, (right - left) / columns, (bottom - top) / rows);
    cairo_set_source_surface(pen, cells, 0, 0);
    cairo_pattern_set_filter(cairo_get_source(pen), CAIRO_FILTER_NEAREST);
    cairo_paint(pen);
    cairo_restore(pen);
    cairo_surface_destroy(cells);
}

void PlotPainter::drawColorBar(PlotCanvas& canvas, const PanelLayout& layout) const {
    const Axis& colors = layout.colors;
    cairo_t* const pen = canvas.getPen();
    const double left = xAxis.end + colorBarGap * scale, right = left + colorBarWidth * scale;
    cairo_pattern_t* const gradient = cairo_pattern_create_linear(0, colors.begin, 0, colors.end);
    constexpr int stops = 32;
    for (int k = 0; k <= stops; ++k) {
        const SimTK::Vec3 c = calcMapColor(layout.panel->map, double(k) / stops);
        cairo_pattern_add_color_stop_rgb(gradient, double(k) / stops, c[0], c[1], c[2]);
    }
    cairo_rectangle(pen, left, colors.end, right - left, colors.begin - colors.end);
    cairo_set_source(pen, gradient);
    cairo_fill(pen);
    cairo_pattern_destroy(gradient);
    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.faintText);
    cairo_set_line_width(pen, std::max(1.0, std::round(scale)));
    for (const Tick& tick : colors.calcTicks()) {
        const double y = colors.toPixel(tick.value);
        canvas.drawLine(right, snap(y), right + (tick.text.empty() ? 2 : 4) * scale, snap(y));
        cairo_stroke(pen);
        canvas.drawText(right + 7 * scale, y + 0.36 * labelSize * scale, tick.text,
                        Font::Anchor::Left);
    }
    canvas.setColor(theme.text);
    canvas.drawUpwards(width - 0.6 * outerMargin * scale, 0.5 * (colors.begin + colors.end),
                       layout.colorLabel, Font::Anchor::Center);
}

void PlotPainter::drawPanel(PlotCanvas& canvas, const PanelLayout& layout, double opacity) const {
    const Axis& axis = layout.axis;
    const double left = xAxis.begin, right = xAxis.end;
    cairo_t* const pen = canvas.getPen();
    const std::vector<Tick> ticks = axis.calcTicks(), xTicks = xAxis.calcTicks();
    const bool hasMap = !layout.panel->map.isEmpty();

    cairo_set_line_width(pen, std::max(1.0, std::round(scale)));
    canvas.setDash(0);
    for (const bool hasNumber : {false, true}) {
        canvas.setColor(theme.grid, hasNumber ? 1 : 0.5);
        for (const Tick& tick : ticks)
            if (tick.text.empty() != hasNumber)
                canvas.drawLine(left, snap(axis.toPixel(tick.value)), right,
                                snap(axis.toPixel(tick.value)));
        for (const Tick& tick : xTicks)
            if (tick.text.empty() != hasNumber)
                canvas.drawLine(snap(xAxis.toPixel(tick.value)), axis.end,
                                snap(xAxis.toPixel(tick.value)), axis.begin);
        cairo_stroke(pen);
    }
    if (hasMap) drawMap(canvas, layout);
    cairo_set_line_width(pen, std::max(1.0, std::round(scale)));

    // Draw a line at zero.
    canvas.setColor(theme.faintText, 0.75);
    if (!axis.isLogarithmic && axis.low < 0 && axis.high > 0)
        canvas.drawLine(left, snap(axis.toPixel(0)), right, snap(axis.toPixel(0)));
    canvas.drawLine(snap(left), axis.end, snap(left), snap(axis.begin));
    cairo_line_to(pen, right, snap(axis.begin));
    cairo_stroke(pen);

    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.faintText);
    for (const Tick& tick : ticks)
        canvas.drawText(left - 7 * scale, axis.toPixel(tick.value) + 0.36 * labelSize * scale,
                        tick.text, Font::Anchor::Right);
    canvas.setFont(Font::Weight::Bold, headerSize);
    canvas.setColor(theme.text);
    canvas.drawText(left, layout.headerLine, layout.header, Font::Anchor::Left);
    drawLegend(canvas, layout);
    if (hasMap) drawColorBar(canvas, layout);

    cairo_save(pen);
    cairo_rectangle(pen, left - curveWidth * scale, axis.end - 1,
                    right - left + 2 * curveWidth * scale, axis.begin - axis.end + 1);
    cairo_clip(pen);
    for (const Figure::Mark& mark : figure.marks) {
        const double x = xAxis.toPixel(mark.x);
        canvas.setColor(theme.faintText, 0.6);
        canvas.setDash(1);
        cairo_set_line_width(pen, scale);
        canvas.drawLine(x, axis.begin, x, axis.end);
        cairo_stroke(pen);
        canvas.setFont(Font::Weight::Regular, 0.85 * labelSize);
        canvas.drawUpwards(x - 4 * scale, axis.begin - 6 * scale, mark.label, Font::Anchor::Left);
    }
    cairo_set_line_join(pen, CAIRO_LINE_JOIN_ROUND);
    const std::vector<FigureCurve>& curves = layout.panel->curves;
    for (auto curve = curves.rbegin(); curve != curves.rend(); ++curve)
        drawCurve(canvas, *curve, layout, opacity);
    cairo_restore(pen);
    canvas.setDash(0);
}

// Each name is followed by room for its curve's value at the mark.
void PlotPainter::drawLegend(PlotCanvas& canvas, const PanelLayout& layout) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    cairo_t* const pen = canvas.getPen();
    for (const LegendEntry& entry : layout.legend) {
        const FigureCurve& curve = *entry.curve;
        double x = entry.right - layout.valueWidth;
        if (!curve.name.empty()) {
            x -= layout.valueWidth > 0 ? legendGap * scale : 0;
            canvas.setColor(theme.faintText);
            canvas.drawText(x, entry.line, curve.name, Font::Anchor::Right);
            x -= canvas.calcTextWidth(curve.name);
        } else if (layout.legend.size() == 1) {
            continue;  // a single curve without a name
        }
        x -= legendGap * scale;
        const double y = entry.line - 0.35 * labelSize * scale;
        canvas.setColor(layout.panel->map.isEmpty() ? getColor(curve) : lineOnMap);
        if (curve.marks == FigureCurve::Marks::Circles) {
            cairo_set_line_width(pen, 1.6 * scale);
            cairo_new_sub_path(pen);
            cairo_arc(pen, x - 0.5 * legendLine * scale, y, dotRadius * scale, 0, 2 * SimTK::Pi);
        } else {
            canvas.setDash(curve.isFaint ? 2 : curve.dash);
            cairo_set_line_width(pen, (curveWidth + 0.4) * scale);
            canvas.drawLine(x - legendLine * scale, y, x, y);
        }
        cairo_stroke(pen);
        canvas.setDash(0);
    }
}

void PlotPainter::drawMark(PlotCanvas& canvas, double mark) const {
    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.text);
    for (const PanelLayout& layout : layouts)
        for (const LegendEntry& entry : layout.legend) {
            const double value = interpolateCurve(entry.curve->x, entry.curve->y, mark);
            if (std::isfinite(value))
                canvas.drawText(entry.right, entry.line, layout.axis.format(value, 1),
                                Font::Anchor::Right);
        }

    if (mark < xAxis.low || mark > xAxis.high || layouts.empty()) return;
    cairo_t* const pen = canvas.getPen();
    const double x = xAxis.toPixel(mark);
    cairo_set_line_width(pen, 1.4 * scale);
    canvas.setColor(theme.text, 0.8);
    for (const PanelLayout& layout : layouts)
        canvas.drawLine(x, layout.axis.end, x, layout.axis.begin);
    cairo_stroke(pen);
    for (const PanelLayout& layout : layouts)
        for (auto entry = layout.legend.rbegin(); entry != layout.legend.rend(); ++entry) {
            const double value = interpolateCurve(entry->curve->x, entry->curve->y, mark);
            if (!(value >= layout.axis.low && value <= layout.axis.high)) continue;
            cairo_arc(pen, x, layout.axis.toPixel(value), dotRadius * scale, 0, 2 * SimTK::Pi);
            canvas.setColor(getColor(*entry->curve));
            cairo_fill_preserve(pen);
            canvas.setColor(theme.background);
            cairo_stroke(pen);
        }
}

void PlotPainter::drawLayer(PlotCanvas& canvas, double opacity) const {
    canvas.fill(theme.background);
    if (!figure.title.empty()) {
        canvas.setFont(Font::Weight::Bold, titleSize);
        canvas.setColor(theme.text);
        canvas.drawText(xAxis.begin, (outerMargin + 0.75 * titleSize) * scale, figure.title,
                        Font::Anchor::Left);
    }
    for (const PanelLayout& layout : layouts) drawPanel(canvas, layout, opacity);
    if (layouts.empty()) return;

    const double bottom = layouts.back().axis.begin;
    canvas.setFont(Font::Weight::Regular, labelSize);
    canvas.setColor(theme.faintText);
    for (const Tick& tick : xAxis.calcTicks())
        canvas.drawText(xAxis.toPixel(tick.value), bottom + 1.45 * labelSize * scale, tick.text,
                        Font::Anchor::Center);
    canvas.setColor(theme.text);
    canvas.drawText(0.5 * (xAxis.begin + xAxis.end), bottom + 2.8 * labelSize * scale, xLabel,
                    Font::Anchor::Center);
}

Image PlotPainter::paint(double mark) const {
    const PlotCanvas& whole = getPast();
    if (!std::isfinite(mark)) return whole.toImage();
    bool hasFuture = false;
    for (const FigurePanel& panel : figure.panels)
        for (const FigureCurve& curve : panel.curves)
            hasFuture |= !curve.x.empty() && curve.x.back() > mark;
    int end = width;
    PlotCanvas canvas(width, height, scale);
    if (hasFuture) {
        end = int(std::clamp(std::round(xAxis.toPixel(mark)), 0.0, double(width)));
        canvas.copyColumns(getFuture(), end, width);
    }
    canvas.copyColumns(whole, 0, end);
    drawMark(canvas, mark);
    return canvas.toImage();
}

}  // namespace simflex
