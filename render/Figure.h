#pragma once
/** @file
A plot as data: panels with axes, curves, maps and legends; drawn by cairo as PNG, SVG or PDF.

@code
    simflex::Figure figure;
    figure.title = "Swing";
    figure.xLabel = "time [s]";
    figure.panels.push_back({"height [mm]", {{"flexible", time, y1}, {"rigid", time, y2}}});
    simflex::drawFigure("swing.svg", figure);
@endcode **/

#include <array>
#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {

/** Colours of a plot; the curves' can be distinguished by colour-blind readers (Okabe, Ito). **/
struct PlotTheme {
    Image::Pixel background, text, faintText, grid;
    std::array<Image::Pixel, 7> curves;

    static const PlotTheme& light();
    static const PlotTheme& dark();
};

/** Points in the units of the axes. Non-finite points leave a gap. **/
struct FigureCurve {
    std::string name;  ///< in the legend
    std::vector<double> x, y;
    std::vector<double> error = {};  ///< half-width of a band about y; empty: none
    int color = 0;                   ///< index into the theme's colours, cyclic
    int dash = 0;                    ///< 0 solid, 1 dashed, 2 dotted …, cyclic
    /** Points on a line, stems from zero, or circles without a line. **/
    enum class Marks { None, Points, Stems, Circles } marks = Marks::None;
    bool isFaint = false;  ///< thin and grey: a reference curve
};

/** A colour map over two axes. **/
struct FigureMap {
    std::vector<double> x, y;               ///< evenly spaced
    std::vector<std::vector<double>> rows;  ///< rows[i][j] at x[i], y[j]; NaN: not drawn
    std::string label;                      ///< of the colour scale
    /** x, y and value of the original samples, if the rows are resampled. **/
    std::vector<std::array<double, 3>> samples = {};
    /** Colour scale: logarithmic over three decades; angles in degrees from −180 to 180, both of
    one colour; or fractions of 1, above integers. **/
    enum class Scale { Logarithmic, Angles, Fractions } scale = Scale::Logarithmic;
    bool isEmpty() const { return rows.empty(); }
};

struct FigurePanel {
    std::string label;  ///< of the value axis: "height [mm]"
    std::vector<FigureCurve> curves;
    bool startsAtZero = false;
    bool isLogarithmic = false;  ///< value axis
    FigureMap map = {};          ///< drawn below the curves
    double low = 0, high = 0;    ///< ends of the value axis; automatic unless low < high
    bool hasDegrees = false;     ///< ticks at 45°, 90° …
};

struct Figure {
    /** A labelled vertical line through all panels. **/
    struct Mark {
        double x;
        std::string label;
    };
    std::string title;
    std::string xLabel;
    std::vector<FigurePanel> panels;  ///< from top to bottom, with a common x axis
    bool hasWholeNumbers = false;     ///< x axis
    bool isLogarithmic = false;       ///< x axis
    bool hasEqualScales = false;      ///< equal scales of x and y; single panels only
    int width = 0, height = 0;        ///< [pixels, 96 per inch]; 0: automatic
    std::vector<Mark> marks = {};
    double low = 0, high = 0;  ///< ends of the x axis; automatic unless low < high
    bool showsValues = false;  ///< reserves room in the legend for each curve's value at a moving
                               ///< mark
};

/** Draws a figure into a file. A PNG has two pixels per pixel of the figure. An SVG names its
title, axes and curves for programs that read or search it.
@throws std::runtime_error if the file's suffix is not png, svg or pdf, if the file cannot be
written, or if there is nothing to draw or no font. **/
void drawFigure(const std::string& path, const Figure& figure);

}  // namespace simflex
