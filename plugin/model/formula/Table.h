#pragma once
/** @file
A function given by points.

Splines are cubic with not-a-knot end conditions (de Boor, A Practical Guide to Splines, ch. IV):
twice continuously differentiable, and exact for cubics. Two points give a line, three a parabola.
**/

#include <algorithm>
#include <string>
#include <vector>

#include "simflex/model/formula/Interval.h"

namespace simflex {
namespace formula {

class Table {
public:
    enum class Interpolation { Linear, Spline, Step };
    enum class Extrapolation { Constant, Linear, Refuse };

    /** @param x  strictly increasing
    @throws std::invalid_argument. **/
    Table(std::string name, std::vector<double> x, std::vector<double> y,
          Interpolation interpolation = Interpolation::Spline,
          Extrapolation extrapolation = Extrapolation::Constant);

    /** Selects the derivative on one side of a kink. **/
    enum class Side { Left, Right };

    /** False for NaN, and outside the points if extrapolation is refused. **/
    bool covers(double x) const;
    /** @param order  0: value; 1, 2: derivatives
    @pre covers(x) **/
    double calc(double x, int order = 0, Side side = Side::Right) const;
    /** Bounds of calc() for all x in the interval.
    @pre the table covers both ends **/
    Interval calcBounds(const Interval& x, int order) const;

    const std::string& getName() const { return m_name; }
    /** Ends of the pieces. **/
    const std::vector<double>& getPoints() const { return m_x; }
    bool isPoint(double x) const { return std::binary_search(m_x.begin(), m_x.end(), x); }
    /** "table 'engine' is asked for 3, outside of its points from 0 to 2". **/
    std::string describeRefusal(double x) const;

private:
    std::string m_name;
    std::vector<double> m_x, m_y, m_curvature;
    Interpolation m_interpolation;
    Extrapolation m_extrapolation;

    /** Index of the piece that contains x; −1 before the first point, one past the last beyond the
    end. **/
    int findPiece(double x, Side side) const;
    double calcPiece(int piece, double x, int order) const;
    Interval calcPieceBounds(int piece, const Interval& x, int order) const;
};

/** Second derivatives of the not-a-knot spline at its points. **/
std::vector<double> calcSplineCurvature(const std::vector<double>& x, const std::vector<double>& y);

/** Reads columns (from 0) of a CSV file, separated by commas, semicolons, tabs or blanks; skips
lines that begin with # and a first line of names.
@throws std::runtime_error with file and line. **/
std::vector<std::vector<double>> readTableFile(const std::string& path,
                                               const std::vector<int>& columns);

}  // namespace formula
}  // namespace simflex
