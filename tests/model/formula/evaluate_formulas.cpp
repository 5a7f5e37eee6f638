// Evaluates formulas for check_formulas.py. Lines of the standard input are
//
//     table NAME spline|linear constant|linear|refuse N M x_0 … y_0 … z_00 …
//     formula X Y Z TEXT
//
// For each formula, prints its value, its derivatives by x, y and z, and value, first and second
// derivative by x; or `! message`.

#include <cmath>
#include <cstdio>
#include <iostream>
#include <sstream>

#include "simflex/base/NumberText.h"
#include "simflex/model/formula/Formula.h"

using namespace simflex;
using namespace simflex::formula;

namespace {

std::vector<double> readNumbers(std::istream& line, std::size_t count) {
    std::vector<double> numbers(count);
    for (double& number : numbers) line >> number;
    return numbers;
}

void readTable(std::istream& line, Scope& scope) {
    std::string name, interpolation, extrapolation;
    std::size_t n = 0, m = 0;
    line >> name >> interpolation >> extrapolation >> n >> m;
    const std::vector<double> x = readNumbers(line, n), y = readNumbers(line, m);
    std::vector<std::vector<double>> z(n);
    for (auto& row : z) row = readNumbers(line, m);
    scope.surfaces[name] = std::make_shared<SurfaceTable>(
        name, x, y, z,
        interpolation == "linear" ? Table::Interpolation::Linear : Table::Interpolation::Spline,
        extrapolation == "linear"   ? Table::Extrapolation::Linear
        : extrapolation == "refuse" ? Table::Extrapolation::Refuse
                                    : Table::Extrapolation::Constant);
}

void answer(std::istream& line, const Scope& scope) {
    const std::vector<double> at = readNumbers(line, 3);
    std::string text;
    std::getline(line, text);
    const Formula formula(text, scope, {"x", "y", "z"});
    double slopes[3];
    const double value = formula.calcSlopes(at.data(), slopes, 3);
    const Jet<double> inputs[3] = {Jet<double>::makeVariable(at[0]), at[1], at[2]};
    const Jet<double> motion = formula.calc(inputs);
    const double own = formula.calc(at.data());
    if (std::isnan(own) != std::isnan(value) || (own != value && !std::isnan(own)))
        throw std::logic_error("its values differ: " + writeGeneral(own) + ", " +
                               writeGeneral(value));
    std::string result;
    for (double number :
         {value, slopes[0], slopes[1], slopes[2], motion.value, motion.first, motion.second})
        result += writeGeneral(number) + ' ';
    std::puts(result.c_str());
}

}  // namespace

int main() {
    Scope scope;
    scope.constants["pi"] = std::acos(-1.0);
    for (std::string line; std::getline(std::cin, line);) {
        std::istringstream words(line);
        std::string what;
        words >> what;
        try {
            if (what == "table")
                readTable(words, scope);
            else
                answer(words, scope);
        } catch (const std::exception& error) {
            std::printf("! %s\n", error.what());
        }
    }
    return 0;
}
