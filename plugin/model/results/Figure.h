#pragma once
/** @file
A figure of curves, drawn by gnuplot to PNG, SVG or PDF. **/

#include <array>
#include <string>
#include <vector>

namespace simflex {
namespace model {

struct FigureCurve {
    std::string name;  ///< in the legend
    std::vector<double> x, y;
    std::vector<double> error = {};  ///< half the height of a band about y; empty: none
    int color = 0;                   ///< index of the theme's colours, taken round
    int dash = 0;                    ///< 0 solid, 1 dashed, 2 dotted …
    enum class Marks { None, Points, Stems } marks = Marks::None;
    bool isFaint = false;  ///< thin and grey: a line to compare with
};

/** Colours over two axes. **/
struct FigureMap {
    std::vector<double> x, y;               ///< evenly spaced
    std::vector<std::vector<double>> rows;  ///< of each x, at each y; NaN: nothing is drawn
    std::string label;                      ///< of the colours
    /** x, y and value that the rows were made of, where these are but a picture of them. **/
    std::vector<std::array<double, 3>> samples = {};
    /** Of the colours: logarithmic; angles in degrees from −180 to 180, both of one colour; or
    fractions of 1, over whole numbers. **/
    enum class Scale { Logarithmic, Angles, Fractions } scale = Scale::Logarithmic;
    bool isEmpty() const { return rows.empty(); }
};

struct FigurePanel {
    std::string label;  ///< of the value axis
    std::vector<FigureCurve> curves;
    bool startsAtZero = false;
    bool isLogarithmic = false;  ///< along the value axis
    FigureMap map = {};          ///< under the curves
};

struct Figure {
    std::string title;
    std::string xLabel;
    std::vector<FigurePanel> panels;  ///< one below the other, over the same x
    bool hasWholeNumbers = false;     ///< along x
    bool isLogarithmic = false;       ///< along x
    bool hasEqualScales = false;      ///< of one panel: a unit is as long along x as along y
    int width = 0, height = 0;        ///< [pixels, 96 an inch]; 0: what suits
};

/** The numbers of a figure as CSV: x and y of each curve side by side; a map's x, y and value line
by line, of its samples if it has such. @throws std::runtime_error. **/
void writeFigureCsv(const std::string& path, const Figure& figure);

/** @throws std::runtime_error if the file's kind is not png, svg or pdf, if gnuplot is missing or
fails, or if there is nothing to draw. **/
void drawFigure(const std::string& path, const Figure& figure);

/** The script that gnuplot is given. Texts are quoted so that nothing in them is a command. **/
std::string makeGnuplotScript(const std::string& kind, const Figure& figure);

}  // namespace model
}  // namespace simflex
