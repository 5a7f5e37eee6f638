#pragma once
/** @file
A plot as data: panels with axes, curves, maps and legends; drawn by cairo as PNG, SVG or PDF.

@code
    simflex::Figure figure;
    figure.title = "Swing";
    figure.xLabel = "time [s]";
    figure.panels.push_back({"height [mm]", {{"flexible", time, flexible}, {"rigid", time,
rigid}}}); simflex::drawFigure("swing.svg", figure);
@endcode **/

#include <array>
#include <string>
#include <vector>

#include "simflex/render/Image.h"

namespace simflex {

/** Colours of a plot; those of the curves can be told apart by colour-blind eyes (Okabe, Ito). **/
struct PlotTheme {
    Image::Pixel background, text, faintText, grid;
    std::array<Image::Pixel, 7> curves;

    static const PlotTheme& light();
    static const PlotTheme& dark();
};

/** Points in the units of the axes. A point that is not finite leaves a gap. **/
struct FigureCurve {
    std::string name;  ///< in the legend
    std::vector<double> x, y;
    std::vector<double> error = {};  ///< half the height of a band about y; empty: none
    int color = 0;                   ///< index of the theme's colours, taken round
    int dash = 0;                    ///< 0 solid, 1 dashed, 2 dotted …, taken round
    /** Points on a line, stems from zero, or circles without a line. **/
    enum class Marks { None, Points, Stems, Circles } marks = Marks::None;
    bool isFaint = false;  ///< thin and grey: a line to compare with
};

/** Colours over two axes. **/
struct FigureMap {
    std::vector<double> x, y;               ///< evenly spaced
    std::vector<std::vector<double>> rows;  ///< of each x, at each y; NaN: nothing is drawn
    std::string label;                      ///< of the colours
    /** x, y and value that the rows were made of, where these are but a picture of them. **/
    std::vector<std::array<double, 3>> samples = {};
    /** Of the colours: logarithmic over three decades; angles in degrees from −180 to 180, both of
    one colour; or fractions of 1, over whole numbers. **/
    enum class Scale { Logarithmic, Angles, Fractions } scale = Scale::Logarithmic;
    bool isEmpty() const { return rows.empty(); }
};

struct FigurePanel {
    std::string label;  ///< of the value axis: "height [mm]"
    std::vector<FigureCurve> curves;
    bool startsAtZero = false;
    bool isLogarithmic = false;  ///< along the value axis
    FigureMap map = {};          ///< under the curves
    double low = 0, high = 0;    ///< ends of the value axis; chosen unless low < high
    bool hasDegrees = false;     ///< ticks at 45°, 90° …
};

struct Figure {
    /** A vertical line through all panels, with a word. **/
    struct Mark {
        double x;
        std::string label;
    };
    std::string title;
    std::string xLabel;
    std::vector<FigurePanel> panels;  ///< one below the other, over the same x
    bool hasWholeNumbers = false;     ///< along x
    bool isLogarithmic = false;       ///< along x
    bool hasEqualScales = false;      ///< of one panel: a unit is as long along x as along y
    int width = 0, height = 0;        ///< [pixels, 96 an inch]; 0: what suits
    std::vector<Mark> marks = {};
    double low = 0, high = 0;  ///< ends of the x axis; chosen unless low < high
    bool showsValues = false;  ///< the legend has room for each curve's value at a moving mark
};

/** Draws a figure into a file. A PNG has two pixels for each of the figure's; an SVG names its
title, axes and curves for programs that read or search it.
@throws std::runtime_error if the file's kind is not png, svg or pdf, if it cannot be written, if
there is nothing to draw or no font. **/
void drawFigure(const std::string& path, const Figure& figure);

}  // namespace simflex
