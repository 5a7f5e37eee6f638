#include "simflex/solver/elimination/NewtonCombination.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace simflex {
namespace {

using Weights = std::complex<double>[3];

/** result ← w₀a + w₁b + w₂c **/
void combineEntries(const std::vector<double>& a, const std::vector<double>& b,
                    const std::vector<double>& c, const Weights& weights,
                    std::vector<std::complex<double>>& result) {
    result.resize(a.size());
    const double w[6] = {weights[0].real(), weights[0].imag(), weights[1].real(),
                         weights[1].imag(), weights[2].real(), weights[2].imag()};
    for (size_t i = 0; i < a.size(); ++i)
        result[i] = {w[0] * a[i] + w[2] * b[i] + w[4] * c[i],
                     w[1] * a[i] + w[3] * b[i] + w[5] * c[i]};
}

/** Copies a's columns, then b's of elements' rows. **/
void combineColumns(const NewtonBlock& a, const NewtonBlock& b, int firstElementRow,
                    NewtonBlock& result) {
    std::copy(a.Gt.begin(), a.Gt.end(), result.Gt.begin());
    std::copy(a.coefficients.begin(), a.coefficients.end(), result.coefficients.begin());
    const auto append = [](const std::vector<double>& from, size_t column, size_t to, size_t height,
                           std::vector<double>& values) {
        std::copy_n(from.data() + column * height, height, values.data() + to * height);
    };
    size_t to = a.rows.size();
    for (size_t column = 0; column < a.rows.size(); ++column) {
        if (a.rows[column] < firstElementRow) continue;
        append(b.Gt, column, to, size_t(a.heightOfGt()), result.Gt);
        if (a.columns == NewtonBlock::Columns::Shared)
            append(b.coefficients, column, to, 6, result.coefficients);
        ++to;
    }
}

}  // namespace

ComplexNewtonSystem makeCombined(const NewtonSystem& real, int firstElementRow) {
    ComplexNewtonSystem made;
    for (const NewtonSystem::Part& part : real.parts)
        made.parts.push_back({part.numModes, part.numFrames, {}, part.shapes});
    for (size_t p = 0; p < real.parts.size(); ++p)
        made.parts[p].diagonal.resize(real.parts[p].diagonal.size());
    for (const NewtonSystem::Block& block : real.blocks) {
        made.blocks.emplace_back();
        ComplexNewtonSystem::Block& doubled = made.blocks.back();
        static_cast<NewtonBlock&>(doubled) = block;
        doubled.head.resize(block.head.size());
        doubled.coupling.resize(block.coupling.size());
        doubled.matrix.resize(block.matrix.size());
        for (int row : block.rows)
            if (row >= firstElementRow)
                doubled.rows.push_back(real.numMultipliers() + row - firstElementRow);
        int column = 0;
        for (const NewtonBlock::Side& side : block.sides) {
            const auto begin = block.rows.begin() + column, end = begin + side.numColumns;
            const auto elements =
                std::count_if(begin, end, [&](int row) { return row >= firstElementRow; });
            if (elements == side.numColumns)
                doubled.sides.push_back(side);
            else if (elements != 0)
                throw std::logic_error("makeCombined: a side of constraints and force elements");
            column += side.numColumns;
        }
        doubled.Gt.resize(size_t(doubled.heightOfGt()) * doubled.rows.size());
        if (block.columns == NewtonBlock::Columns::Shared)
            doubled.coefficients.resize(6 * doubled.rows.size());
    }
    made.r.resize(real.r.size());
    made.c.resize(real.c.size() + real.c.size() - size_t(firstElementRow));
    for (const NewtonSystem::Coupling& coupling : real.couplings)
        made.couplings.push_back({coupling.rows, {coupling.values.begin(), coupling.values.end()}});
    if (real.compliance.empty()) return made;
    made.compliance.assign(real.compliance.begin(), real.compliance.end());
    made.compliance.insert(made.compliance.end(), real.compliance.begin() + firstElementRow,
                           real.compliance.end());
    made.pairs = real.pairs;
    for (int row : real.pairs) made.pairs.push_back(real.numMultipliers() + row - firstElementRow);
    return made;
}

void combine(const NewtonSystem& a, const NewtonSystem& b, const NewtonSystem& c,
             const std::complex<double> (&weights)[3], ComplexNewtonSystem& result) {
    using Form = NewtonBlock::Form;
    const int firstElementRow = 2 * a.numMultipliers() - result.numMultipliers();
    for (size_t p = 0; p < a.parts.size(); ++p)
        combineEntries(a.parts[p].diagonal, b.parts[p].diagonal, c.parts[p].diagonal, weights,
                       result.parts[p].diagonal);
    for (size_t k = 0; k < a.blocks.size(); ++k) {
        const NewtonSystem::Block &from = a.blocks[k], &second = b.blocks[k], &third = c.blocks[k];
        ComplexNewtonSystem::Block& block = result.blocks[k];
        const bool isArrow = from.form == Form::Arrow;
        if (isArrow != (second.form == Form::Arrow) || isArrow != (third.form == Form::Arrow))
            throw std::logic_error("combine: block " + std::to_string(k) +
                                   " is an arrow in one system and not in another");
        const bool isTree = from.form == Form::Tree;
        if (isTree != (second.form == Form::Tree) || isTree != (third.form == Form::Tree))
            throw std::logic_error("combine: block " + std::to_string(k) +
                                   " is a tree in one system and not in another");
        block.form = std::max({from.form, second.form, third.form});
        if (isArrow) {
            combineEntries(from.head, second.head, third.head, weights, block.head);
            combineEntries(from.coupling, second.coupling, third.coupling, weights, block.coupling);
        } else if (isTree) {
            block.tree.nodes = from.tree.nodes;
            block.tree.inertia = from.tree.inertia;
            block.tree.screws = from.tree.screws;
            combineEntries(from.tree.motions, second.tree.motions, third.tree.motions, weights,
                           block.tree.motions);
            combineEntries(from.tree.turned, second.tree.turned, third.tree.turned, weights,
                           block.tree.turned);
            combineEntries(from.tree.own, second.tree.own, third.tree.own, weights, block.tree.own);
        } else {
            combineEntries(from.matrix, second.matrix, third.matrix, weights, block.matrix);
        }
        combineColumns(from, second, firstElementRow, block);
    }
    for (size_t k = 0; k < a.couplings.size(); ++k)
        std::copy(a.couplings[k].values.begin(), a.couplings[k].values.end(),
                  result.couplings[k].values.begin());
    if (a.compliance.empty()) return;
    const size_t first = size_t(firstElementRow), rows = a.compliance.size();
    std::copy_n(a.compliance.begin(), first, result.compliance.begin());
    for (size_t row = first; row < rows; ++row) {
        result.compliance[row] = a.compliance[row] / (weights[0] + weights[2]);
        result.compliance[rows + row - first] = b.compliance[row] / weights[1];
    }
}

}  // namespace simflex
