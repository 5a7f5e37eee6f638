/** @file
simflex compare: compares two result files. **/

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/model/results/Comparison.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/render/Figure.h"

namespace simflex {
namespace cli {

using namespace model;
namespace {

constexpr size_t MostPlotted = 3;  // columns in a figure: those with the largest differences

struct CompareArguments {
    std::string first, second, plot, analysis;
    std::vector<std::string> probes;
    double tolerance = 1e-6;
};

void print(const ResultComparison& comparison) {
    for (const std::string& note : comparison.notes) writeOut("%s\n", note.c_str());
    size_t numIdentical = 0;
    std::vector<std::string> analyses;
    for (const auto& column : comparison.columns) {
        numIdentical += column.largest == 0;
        if (analyses.empty() || analyses.back() != column.analysis)
            analyses.push_back(column.analysis);
    }
    const size_t count = comparison.columns.size();
    for (const std::string& analysis : analyses) {
        TextTable table({"probe", "largest", "at", "rms", "of range"});
        for (const auto& column : comparison.columns)
            if (column.analysis == analysis && column.largest > 0)
                table.add({makeAxisLabel(column.name, column.unit), formatNumber(column.largest),
                           column.x.empty() ? "" : formatNumber(column.time),
                           formatNumber(column.rms), writeGeneral(column.getRelative(), 3)});
        if (!table.isEmpty()) writeOut("%s:\n%s", analysis.c_str(), table.format("  ").c_str());
    }
    for (const NotCompared& missing : comparison.missing) writeOut("%s\n", missing.text.c_str());
    if (numIdentical > 0)
        writeOut("%s%zu of %zu columns are identical\n",
                 numIdentical == count && comparison.missing.empty() ? "no difference: " : "",
                 numIdentical, count);
}

FigureCurve makeCurve(const std::string& name, const ColumnDifference& column,
                      const std::vector<double>& values, double unitSize, int color) {
    FigureCurve curve;
    curve.name = name;
    curve.x = column.x;
    for (const double value : values) curve.y.push_back(value / unitSize);
    curve.color = color;
    curve.dash = color;
    return curve;
}

/** Draws the columns with the largest differences over time, with the difference below. **/
void drawDifference(const std::string& path, const ResultComparison& comparison,
                    const std::vector<std::string>& labels) {
    std::vector<const ColumnDifference*> worst;
    for (const ColumnDifference& column : comparison.columns)
        if (column.x.size() > 1) worst.push_back(&column);
    if (worst.empty())
        throw std::runtime_error("cannot draw '" + path + "': nothing was compared over time");
    std::stable_sort(worst.begin(), worst.end(), [](const auto* a, const auto* b) {
        return a->getRelative() > b->getRelative();
    });
    // A figure has one horizontal axis: that of the largest difference.
    const ColumnDifference& first = *worst[0];
    worst.erase(
        std::remove_if(worst.begin(), worst.end(),
                       [&](const auto* column) { return column->analysis != first.analysis; }),
        worst.end());
    worst.resize(std::min(worst.size(), MostPlotted));
    Figure figure;
    figure.title = "Difference of " + labels[0] + " and " + labels[1];
    figure.xLabel = first.axis;
    for (const ColumnDifference* column : worst) {
        const DisplayUnit unit = chooseDisplayUnit(column->unit, column->range);
        const DisplayUnit small = chooseDisplayUnit(column->unit, column->largest);
        FigurePanel both{makeAxisLabel(column->name, unit.name), {}, false};
        both.curves.push_back(makeCurve(labels[0], *column, column->first, unit.size, 0));
        both.curves.push_back(makeCurve(labels[1], *column, column->second, unit.size, 1));
        FigurePanel below{makeAxisLabel("difference", small.name), {}, false};
        below.curves.push_back(makeCurve("", *column, column->difference, small.size, 0));
        below.curves[0].color = 2;
        figure.panels.push_back(both);
        figure.panels.push_back(below);
    }
    drawFigure(path, figure);
}

void keepAnalysis(Results& data, const std::string& path, const std::string& name) {
    if (!name.empty()) data.analyses = {Results::Analysis(chooseAnalysis(data, path, name))};
}

void runCompare(const CompareArguments& arguments) {
    const std::vector<std::string> labels = makeFileLabels({arguments.first, arguments.second});
    Results first = readResults(arguments.first, ReadStates::No),
            second = readResults(arguments.second, ReadStates::No);
    keepAnalysis(first, arguments.first, arguments.analysis);
    keepAnalysis(second, arguments.second, arguments.analysis);
    const ResultComparison comparison =
        compareResults(first, second, arguments.probes, labels[0], labels[1]);
    print(comparison);
    std::fflush(stdout);
    if (!arguments.plot.empty()) drawDifference(arguments.plot, comparison, labels);
    if (!comparison.missing.empty())
        throw std::runtime_error("the results do not have the same contents: " +
                                 comparison.missing[0].text);
    if (comparison.columns.empty())
        throw std::runtime_error(
            "nothing was compared: no probe fits" +
            (arguments.probes.empty() ? "" : " '" + arguments.probes[0] + "'"));
    const auto worst = std::max_element(
        comparison.columns.begin(), comparison.columns.end(),
        [](const auto& a, const auto& b) { return a.getRelative() < b.getRelative(); });
    if (worst->getRelative() <= arguments.tolerance) return;
    char text[400];
    std::snprintf(text, sizeof text,
                  "the results differ: '%s' of analysis '%s' by %.3g of its range, tolerance %g",
                  worst->name.c_str(), worst->analysis.c_str(), worst->getRelative(),
                  arguments.tolerance);
    throw std::runtime_error(text);
}

}  // namespace

void addCompareCommand(CLI::App& app) {
    const auto arguments = std::make_shared<CompareArguments>();
    CLI::App* compare = app.add_subcommand("compare", "Compare two result files");
    compare->footer(
        "Exit status 0 if both have the same analyses and probes and no probe differs by more "
        "than\n"
        "--tolerance of its range (over all components and the whole run), else 1. Frequency\n"
        "responses are compared as complex numbers, relative to their largest size; linear models\n"
        "by their poles and by their responses between these.\n\n"
        "  simflex compare before.h5 after.h5 --tolerance 1e-4 --plot difference.png");
    compare->add_option("A.h5", arguments->first, "First result file")->required();
    compare->add_option("B.h5", arguments->second, "Second result file")->required();
    compare->add_option("PROBE", arguments->probes, "Probes or patterns (default: all)");
    compare->add_option("--analysis", arguments->analysis,
                        "Compare only this analysis (default: all)");
    compare
        ->add_option("--tolerance", arguments->tolerance,
                     "Largest difference allowed, relative to the range of the probe")
        ->capture_default_str()
        ->check(makeNonNegativeCheck());
    compare->add_option("--plot", arguments->plot,
                        "Draw the probes that differ most (.png, .svg or .pdf)");
    compare->callback([arguments] { runCompare(*arguments); });
}

}  // namespace cli
}  // namespace simflex
