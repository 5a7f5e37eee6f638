#pragma once
/** @file
A function given by points.

Splines are cubic and "not a knot" at their ends (de Boor, A Practical Guide to Splines, ch. IV):
twice continuously differentiable, and exact for cubics. Two points make a line, three a parabola.
**/

#include <string>
#include <vector>

namespace simflex {
namespace cli {

class Table {
public:
    enum class Interpolation { Linear, Spline, Step };
    enum class Extrapolation { Constant, Linear, Refuse };

    /** @param x  strictly increasing @throws std::invalid_argument. **/
    Table(std::string name, std::vector<double> x, std::vector<double> y,
          Interpolation interpolation = Interpolation::Spline,
          Extrapolation extrapolation = Extrapolation::Constant);

    /** @param order  0: the value; 1, 2: derivatives (at kinks from the right)
    @throws std::domain_error outside of the points if extrapolation is refused. **/
    double calc(double x, int order = 0) const;

    const std::string& getName() const { return _name; }

private:
    std::string _name;
    std::vector<double> _x, _y, _curvature;
    Interpolation _interpolation;
    Extrapolation _extrapolation;

    double calcInside(std::size_t interval, double x, int order) const;
};

/** Two columns (from 0) of a CSV file: separated by commas, semicolons, tabs or blanks; lines that
begin with # and a first line of names are passed over. @throws std::runtime_error with file and
line. **/
void readTableFile(const std::string& path, int columnX, int columnY, std::vector<double>& x,
                   std::vector<double>& y);

}  // namespace cli
}  // namespace simflex
