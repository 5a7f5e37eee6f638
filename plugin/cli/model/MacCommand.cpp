/** @file
simflex mac: matches the modes of two results, or of a result and a test. **/

#include <algorithm>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/model/results/CsvLine.h"
#include "simflex/model/results/ModeShapes.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/render/Figure.h"

namespace simflex {
namespace cli {

using namespace model;
namespace {

struct MacArguments {
    std::string first, second, analysis, output, csv;
    std::vector<std::string> points;
};

std::vector<std::pair<std::string, std::string>> parsePoints(
    const std::vector<std::string>& texts) {
    std::vector<std::pair<std::string, std::string>> points;
    for (const std::string& text : texts) {
        const size_t at = text.find('=');
        if (at == text.npos || at == 0 || at + 1 == text.size())
            throw std::runtime_error("--point '" + text + "': write NODE=PROBE, as 12=tip");
        points.emplace_back(text.substr(0, at), text.substr(at + 1));
    }
    return points;
}

void printPartners(const ModeShapes& a, const ModeShapes& b, const ModalAssurance& alike,
                   const std::string& nameB) {
    TextTable table(
        {"mode", "frequency [Hz]", "of " + nameB, "frequency [Hz]", "difference", "assurance"});
    bool isAlone = false;
    for (size_t i = 0; i < alike.values.size(); ++i) {
        const auto& row = alike.values[i];
        char assurance[40];
        const auto partner = alike.findPartner(i, a.frequency, b.frequency);
        std::snprintf(assurance, sizeof assurance, "%.4f",
                      partner ? row[*partner] : *std::max_element(row.begin(), row.end()));
        if (!partner) {
            isAlone = true;
            table.add(
                {std::to_string(i + 1), formatNumber(a.frequency[i]), "-", "-", "-", assurance});
            continue;
        }
        char difference[40] = "";
        if (a.frequency[i] > 0)
            std::snprintf(difference, sizeof difference, "%+.2f %%",
                          100 * (b.frequency[*partner] / a.frequency[i] - 1));
        table.add({std::to_string(i + 1), formatNumber(a.frequency[i]),
                   std::to_string(*partner + 1), formatNumber(b.frequency[*partner]), difference,
                   assurance});
    }
    writeOut("modal assurance at %zu outputs:\n%s", alike.outputs.size(),
             table.format("  ").c_str());
    if (isAlone)
        writeOut("-: no shape of %s is alike (the best assurance is less than %g)\n", nameB.c_str(),
                 ModalAssurance::LeastAlike);
}

void writeMatrix(const std::string& path, const ModalAssurance& alike) {
    CsvLine titles;
    titles.add("mode");
    for (size_t k = 0; k < alike.values.at(0).size(); ++k)
        titles.add("mode " + std::to_string(k + 1) + " of the second");
    std::string text = titles.end();
    for (size_t i = 0; i < alike.values.size(); ++i)
        text += CsvLine().add(std::to_string(i + 1)).addAll(alike.values[i]).end();
    replaceFile(path, text, Durability::ProcessEnd);
}

void drawMatrix(const std::string& path, const ModalAssurance& alike,
                const std::vector<std::string>& labels) {
    Figure figure;
    figure.xLabel = "mode of " + labels[0];
    figure.hasWholeNumbers = true;
    FigurePanel panel{"mode of " + labels[1], {}};
    panel.map.scale = FigureMap::Scale::Fractions;
    panel.map.label = "modal assurance";
    panel.map.rows = alike.values;
    for (size_t i = 0; i < alike.values.size(); ++i) panel.map.x.push_back(double(i + 1));
    for (size_t k = 0; k < alike.values.at(0).size(); ++k) panel.map.y.push_back(double(k + 1));
    figure.panels.push_back(std::move(panel));
    drawFigure(path, figure);
}

void runMac(const MacArguments& arguments) {
    const auto points = parsePoints(arguments.points);
    ModeShapes first = readModeShapes(arguments.first, arguments.analysis),
               second = readModeShapes(arguments.second, arguments.analysis);
    for (const auto& [node, name] : points) {
        const bool isInFirst = first.nameNode(node, name), isInSecond = second.nameNode(node, name);
        if (!isInFirst && !isInSecond)
            throw std::runtime_error("--point " + node + "=" + name +
                                     ": neither file has shapes at a node '" + node + "'");
    }
    const ModeShapes &a = first, &b = second;
    const ModalAssurance alike = calcModalAssurance(a, b);
    const std::vector<std::string> labels = makeFileLabels({arguments.first, arguments.second});
    printPartners(a, b, alike, labels[1]);
    for (const auto* notes : {&a.notes, &b.notes, &alike.notes})
        for (const std::string& note : *notes) writeOut("%s\n", note.c_str());
    if (!arguments.csv.empty()) writeMatrix(arguments.csv, alike);
    if (!arguments.output.empty()) drawMatrix(arguments.output, alike, labels);
    for (const std::string& path : {arguments.csv, arguments.output})
        if (!path.empty()) writeOut("%s\n", path.c_str());
}

}  // namespace

void addMacCommand(CLI::App& app) {
    const auto arguments = std::make_shared<MacArguments>();
    CLI::App* mac = app.add_subcommand(
        "mac", "Which modes of two results, or of a result and a test, have the same shape");
    mac->footer(
        "Shapes are those at the outputs of an analysis of type eigen (outputs: [tip, middle]), "
        "or\n"
        "those of a test: a universal file (datasets 55 or 58) or a table with a line for each "
        "mode\n"
        "(columns 'frequency [Hz]', 'tip.x', 'tip.y' …, and 'imaginary tip.x' … if they are "
        "complex).\n"
        "The modal assurance is 1 where two shapes are the same but for size and phase.\n\n"
        "  simflex mac before.h5 after.h5 -o mac.png\n"
        "  simflex mac run.h5 test.unv --point 12=tip --point 4=middle --csv mac.csv");
    mac->add_option("FIRST", arguments->first, "Result, or file of a test")
        ->required()
        ->check(CLI::ExistingFile);
    mac->add_option("SECOND", arguments->second, "Result, or file of a test")
        ->required()
        ->check(CLI::ExistingFile);
    mac->add_option("--point", arguments->points, "Which probe a node of the test is: 12=tip")
        ->type_name("NODE=PROBE");
    mac->add_option("--analysis", arguments->analysis,
                    "Of results (default: the first of type eigen with outputs)");
    mac->add_option("-o,--output", arguments->output, "Picture of all pairs, .png, .svg or .pdf");
    mac->add_option("--csv", arguments->csv, "Table of all pairs")->type_name("FILE.csv");
    mac->callback([arguments] { runMac(*arguments); });
}

}  // namespace cli
}  // namespace simflex
