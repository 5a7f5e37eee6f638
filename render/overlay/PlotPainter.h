#pragma once
/** @file
Draws a ProbePlot by cairo. Internal to the renderer.

What does not move is drawn once, when it is first needed: all curves in full, and all of them
faint. A figure is the former up to its mark and the latter behind. Several threads may paint. **/

#include <cairo.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "Font.h"
#include "simflex/base/Hash.h"
#include "simflex/render/ProbePlot.h"

namespace simflex {

/** A surface of cairo's, with the pen for it. **/
class PlotCanvas {
public:
    /** @throws std::runtime_error when cairo has no room for it. **/
    PlotCanvas(int width, int height, double scale);
    ~PlotCanvas();
    PlotCanvas(const PlotCanvas&) = delete;
    PlotCanvas& operator=(const PlotCanvas&) = delete;

    cairo_t* getPen() const { return pen; }
    void fill(const Image::Pixel& color);
    void setColor(const Image::Pixel& color, double opacity = 1);
    void setFont(Font::Weight weight, double points);
    void setDash(ProbePlot::Line line);
    double calcTextWidth(const std::string& text) const;
    void drawText(double x, double y, const std::string& text, Font::Anchor anchor);

    /** Copies columns first…end−1 from a canvas of the same size. **/
    void copyColumns(const PlotCanvas& other, int first, int end);
    /** @throws std::runtime_error that says what went wrong in any call before. **/
    Image toImage() const;

private:
    int width, height;
    double scale;
    cairo_surface_t* surface = nullptr;
    cairo_t* pen = nullptr;
};

class PlotPainter {
public:
    PlotPainter(const ProbePlot& plot, const PlotTheme& theme, int width, int height, double scale);

    Image paint(double markTime) const;

    int getWidth() const { return width; }
    int getHeight() const { return height; }
    /** Adds all that its picture depends on. **/
    void addTo(Hash& hash) const;

private:
    /** Values in the axis's unit; pixels grow from `begin` to `end`. **/
    struct Axis {
        double low = 0, high = 1, step = 1;
        double begin = 0, end = 1;
        int decimals = 0;

        double toPixel(double value) const {
            return begin + (value - low) / (high - low) * (end - begin);
        }
        /** Marks at least so many pixels apart, but no fewer than two. **/
        void chooseStep(double distance);
        std::vector<double> calcTicks() const;
        std::string format(double value, int moreDecimals = 0) const;
    };
    struct PanelLayout {
        Axis axis;
        double unitSize = 1;
        std::string header;
        std::vector<int> curves;
        double headerLine = 0;           // base line of the header
        std::vector<double> legendEnds;  // right end of each curve's entry
        double valueWidth = 0;           // of the widest number
    };

    const PlotCanvas& getPast() const;
    const PlotCanvas& getFuture() const;
    bool hasFuture(double markTime) const;
    void layOut(PlotCanvas& canvas) const;
    Axis calcTimeAxis() const;
    Axis calcValueAxis(int panel, double unitSize) const;
    double chooseUnitSize(int panel, std::string& factor) const;
    void drawLayer(PlotCanvas& canvas, double opacity) const;
    void drawPanel(PlotCanvas& canvas, const PanelLayout& panel, double opacity) const;
    void drawLegend(PlotCanvas& canvas, const PanelLayout& panel) const;
    void traceCurve(PlotCanvas& canvas, int curve, const PanelLayout& panel) const;
    void drawMark(PlotCanvas& canvas, double markTime) const;
    const Image::Pixel& getCurveColor(int curve) const;

    const ProbePlot plot;
    const PlotTheme theme;
    const int width, height;
    const double scale;

    // Made by the first who needs them.
    mutable std::once_flag isPastMade, isFutureMade;
    mutable std::unique_ptr<PlotCanvas> past, future;
    mutable Axis timeAxis;
    mutable std::string timeUnit;
    mutable double timeUnitSize = 1;
    mutable std::vector<PanelLayout> panels;
};

}  // namespace simflex
