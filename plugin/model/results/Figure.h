#pragma once
/** @file
A figure of curves, drawn by gnuplot to PNG, SVG or PDF. **/

#include <string>
#include <vector>

namespace simflex {
namespace model {

struct FigureCurve {
    std::string name;  ///< in the legend
    std::vector<double> x, y;
    std::vector<double> error;  ///< half the height of a band about y; empty: none
    int color = 0;              ///< index of the theme's colours, taken round
    int dash = 0;               ///< 0 solid, 1 dashed, 2 dotted …
    enum class Marks { None, Points, Stems } marks = Marks::None;
    bool isFaint = false;  ///< thin and grey: a line to compare with
};

struct FigurePanel {
    std::string label;  ///< of the value axis
    std::vector<FigureCurve> curves;
    bool startsAtZero = false;
    bool isLogarithmic = false;  ///< along the value axis
};

struct Figure {
    std::string title;
    std::string xLabel;
    std::vector<FigurePanel> panels;  ///< one below the other, over the same x
    bool hasWholeNumbers = false;     ///< along x
    bool isLogarithmic = false;       ///< along x
    int width = 0, height = 0;        ///< [pixels, 96 an inch]; 0: what suits
};

/** @throws std::runtime_error if the file's kind is not png, svg or pdf, if gnuplot is missing or
fails, or if there is nothing to draw. **/
void drawFigure(const std::string& path, const Figure& figure);

/** The script that gnuplot is given. Texts are quoted so that nothing in them is a command. **/
std::string makeGnuplotScript(const std::string& kind, const Figure& figure);

}  // namespace model
}  // namespace simflex
