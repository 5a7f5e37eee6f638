#pragma once
/** @file
Draws a Figure by cairo. Internal to the renderer.

The static content is drawn only once, on demand: all curves in full colour, and all of them faint.
A frame combines the former before its mark with the latter after it. Thread-safe. **/

#include <cairo.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "Font.h"
#include "simflex/base/Hash.h"
#include "simflex/render/Figure.h"

namespace simflex {

/** A cairo surface and its drawing context. **/
class PlotCanvas {
public:
    /** Takes ownership of the surface. @throws std::runtime_error if cairo lacks memory for it. **/
    PlotCanvas(cairo_surface_t* surface, double scale);
    PlotCanvas(int width, int height, double scale);
    ~PlotCanvas();
    PlotCanvas(const PlotCanvas&) = delete;
    PlotCanvas& operator=(const PlotCanvas&) = delete;

    cairo_t* getPen() const { return pen; }
    double getScale() const { return scale; }
    bool isImage() const { return cairo_surface_get_type(surface) == CAIRO_SURFACE_TYPE_IMAGE; }
    void fill(const Image::Pixel& color);
    void setColor(const Image::Pixel& color, double opacity = 1);
    void setFont(Font::Weight weight, double points);
    void setDash(int dash);
    double calcTextWidth(const std::string& text) const;
    void drawText(double x, double y, const std::string& text, Font::Anchor anchor);
    /** Draws a line of text upwards, centred at y or starting there. **/
    void drawUpwards(double x, double y, const std::string& text, Font::Anchor anchor);
    void drawLine(double x0, double y0, double x1, double y1);

    /** Copies columns first…end−1 from an image of the same size. **/
    void copyColumns(const PlotCanvas& other, int first, int end);
    /** @throws std::runtime_error describing an error of any previous call. **/
    void check() const;
    /** Returns the content of an image. @throws as check(). **/
    Image toImage() const;

private:
    double scale;
    cairo_surface_t* surface;
    cairo_t* pen;
};

/** Interpolates linearly between points of ascending x; NaN outside. **/
double interpolateCurve(const std::vector<double>& x, const std::vector<double>& y, double at);

class PlotPainter {
public:
    PlotPainter(Figure figure, const PlotTheme& theme, int width, int height, double scale);

    /** Draws the figure with the mark at x; NaN: no mark. **/
    Image paint(double mark) const;
    /** Draws the complete figure on any surface; call only once. **/
    void paintOn(PlotCanvas& canvas) const;

    int getWidth() const { return width; }
    int getHeight() const { return height; }
    /** Adds everything that the picture depends on. **/
    void addTo(Hash& hash) const;

private:
    struct Tick {
        double value;
        std::string text;
    };
    /** An axis; values are in data units, pixels run from `begin` to `end`. **/
    struct Axis {
        double low = 0, high = 1, step = 1;
        double begin = 0, end = 1;
        bool isLogarithmic = false;
        double factor = 1;  ///< displayed numbers are divided by it
        int decimals = 0;

        double toPixel(double value) const;
        /** Chooses a step of at least this many pixels, but at least two ticks. **/
        void chooseStep(double distance, double leastStep = 0);
        void chooseDegrees(double distance);
        /** Chooses a power of ten, placed before the unit, for numbers with more than five digits
        or with leading zeros after the point. @return the label with it **/
        std::string chooseFactor(const std::string& label, double largest);
        std::vector<Tick> calcTicks() const;
        std::string format(double value, int moreDecimals = 0) const;

    private:
        std::vector<Tick> calcLogarithmicTicks() const;
    };
    struct LegendEntry {
        const FigureCurve* curve;
        double left = 0, right = 0, line = 0;  // [pixel]
    };
    struct PanelLayout {
        const FigurePanel* panel = nullptr;
        Axis axis, colors;
        std::string header, colorLabel;
        double headerLine = 0;  // base line of the header
        std::vector<LegendEntry> legend;
        double valueWidth = 0;  // width of the widest number
    };

    const PlotCanvas& getPast() const;
    const PlotCanvas& getFuture() const;
    void layOut(PlotCanvas& canvas) const;
    Axis calcXAxis() const;
    Axis calcValueAxis(const FigurePanel& panel, double& largest) const;
    void makeScalesEqual(Axis& y) const;
    int layOutLegend(PlotCanvas& canvas, PanelLayout& layout) const;
    void drawLayer(PlotCanvas& canvas, double opacity) const;
    void drawPanel(PlotCanvas& canvas, const PanelLayout& layout, double opacity) const;
    void drawMap(PlotCanvas& canvas, const PanelLayout& layout) const;
    void drawColorBar(PlotCanvas& canvas, const PanelLayout& layout) const;
    void drawCurve(PlotCanvas& canvas, const FigureCurve& curve, const PanelLayout& layout,
                   double opacity) const;
    void drawLegend(PlotCanvas& canvas, const PanelLayout& layout) const;
    void traceCurve(PlotCanvas& canvas, const FigureCurve& curve, const Axis& axis) const;
    void drawMark(PlotCanvas& canvas, double mark) const;
    Image::Pixel getColor(const FigureCurve& curve) const;

    const Figure figure;
    const PlotTheme theme;
    const int width, height;
    const double scale;

    // Created on demand.
    mutable std::once_flag isPastMade, isFutureMade;
    mutable std::unique_ptr<PlotCanvas> past, future;
    mutable Axis xAxis;
    mutable std::string xLabel;
    mutable std::vector<PanelLayout> layouts;
};

}  // namespace simflex
