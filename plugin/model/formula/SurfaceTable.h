#pragma once
/** @file
A function of two variables given on a grid.

Linear interpolation is bilinear in each cell. Splines are tensor products of those of Table.h (de
Boor, A Practical Guide to Splines, ch. XVII): bicubic, twice continuously differentiable, exact for
x³y³. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/model/formula/Table.h"

namespace simflex {
namespace formula {

class SurfaceTable {
public:
    /** @param x, y  strictly increasing
    @param z  one row for each x, with one value for each y
    @throws std::invalid_argument. **/
    SurfaceTable(std::string name, std::vector<double> x, std::vector<double> y,
                 const std::vector<std::vector<double>>& z,
                 Table::Interpolation interpolation = Table::Interpolation::Spline,
                 Table::Extrapolation extrapolation = Table::Extrapolation::Constant);

    /** Makes a table from points in any order, one for each combination of x and y.
    @param points  columns x, y and z
    @throws std::invalid_argument naming the point that is missing or given twice **/
    static SurfaceTable fromPoints(
        std::string name, const std::vector<std::vector<double>>& points,
        Table::Interpolation interpolation = Table::Interpolation::Spline,
        Table::Extrapolation extrapolation = Table::Extrapolation::Constant);

    /** False for NaN, and outside the grid if extrapolation is refused. **/
    bool covers(double x, double y) const;

    using Sides = std::array<Table::Side, 2>;
    /** ∂^(i+j) f/∂x^i ∂y^j, i, j ≤ 2. @pre covers(x, y) **/
    double calc(double x, double y, int i = 0, int j = 0,
                const Sides& sides = {Table::Side::Right, Table::Side::Right}) const;
    /** Bounds of calc() for all x and y in the intervals.
    @pre the table covers them **/
    Interval calcBounds(const Interval& x, const Interval& y, int i, int j) const;

    const std::string& getName() const { return m_name; }
    /** Grid points along an axis. **/
    const std::vector<double>& getPoints(int axis) const { return m_points[axis]; }
    bool isAtPoint(double x, double y) const {
        return std::binary_search(m_points[0].begin(), m_points[0].end(), x) ||
               std::binary_search(m_points[1].begin(), m_points[1].end(), y);
    }
    /** "table 'map' is asked for (3, 1), outside of its grid from (0, 0) to (2, 2)". **/
    std::string describeRefusal(double x, double y) const;

private:
    std::string m_name;
    std::array<std::vector<double>, 2> m_points;
    /** z, ∂²z/∂y², ∂²z/∂x² and ∂⁴z/∂x²∂y² at every point. **/
    std::vector<std::array<double, 4>> m_values;
    Table::Interpolation m_interpolation;
    Table::Extrapolation m_extrapolation;

    /** Factors of values and second derivatives at both ends of a piece. **/
    template <class Number>
    struct Weights {
        int piece;
        std::array<Number, 2> values, curvatures;
    };
    int findPiece(int axis, double at, Table::Side side) const;
    template <class Number>
    Weights<Number> weigh(int axis, int piece, const Number& at, int order) const;
    template <class Number>
    Number sum(const Weights<Number>& x, const Weights<Number>& y) const;
    /** Weights of all pieces in an interval; empty: no bounds. **/
    std::vector<Weights<Interval>> weighAll(int axis, const Interval& at, int order) const;
};

}  // namespace formula
}  // namespace simflex
