#include "simflex/base/DisplayUnit.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/results/CsvLine.h"
#include "simflex/model/results/ProbeChoice.h"

namespace simflex {
namespace model {
namespace {

/** Writes shapes in the format of readModeShapes(). **/
std::string writeModes(const Results::Analysis& analysis) {
    const bool hasShapes = !analysis.outputs.empty();
    bool isComplex = false;
    if (hasShapes)
        for (const auto& row : analysis.matrices.at("shape_imaginary"))
            for (const double value : row) isComplex |= value != 0;
    CsvLine titles;
    titles.add("mode").add("frequency [Hz]").add("damping ratio").addAll(analysis.outputs);
    if (isComplex)
        for (const std::string& output : analysis.outputs) titles.add("imaginary " + output);
    std::string text = titles.end();
    for (size_t k = 0; k < analysis.frequency.at(0).size(); ++k) {
        CsvLine line;
        line.add(std::to_string(k + 1))
            .add(analysis.frequency[0][k])
            .add(analysis.dampingRatio.at(0).at(k));
        if (hasShapes) line.addAll(analysis.matrices.at("shape_real").at(k));
        if (isComplex) line.addAll(analysis.matrices.at("shape_imaginary").at(k));
        text += line.end();
    }
    return text;
}

std::string writeDiagram(const Results::Analysis& analysis) {
    CsvLine titles;
    titles.add("speed");
    const size_t numModes = analysis.frequency.empty() ? 0 : analysis.frequency[0].size();
    for (size_t k = 1; k <= numModes; ++k) titles.add("frequency " + std::to_string(k) + " [Hz]");
    for (size_t k = 1; k <= numModes; ++k) titles.add("damping ratio " + std::to_string(k));
    std::string text = titles.end();
    for (size_t k = 0; k < analysis.speeds.size(); ++k)
        text += CsvLine()
                    .add(analysis.speeds[k])
                    .addAll(analysis.frequency.at(k))
                    .addAll(analysis.dampingRatio.at(k))
                    .end();
    return text;
}

std::string writeMatrices(const Results::Analysis& analysis) {
    std::string text = "matrix,row,column,value\n";
    for (const auto& [name, rows] : analysis.matrices)
        for (size_t i = 0; i < rows.size(); ++i)
            for (size_t j = 0; j < rows[i].size(); ++j)
                if (rows[i][j] != 0)
                    text += CsvLine()
                                .add(name)
                                .add(std::to_string(i + 1))
                                .add(std::to_string(j + 1))
                                .add(rows[i][j])
                                .end();
    return text;
}

std::string writeResponses(const Results::Analysis& analysis) {
    const std::vector<ChosenResponse> responses = chooseResponses(analysis, {});
    CsvLine titles;
    titles.add("frequency [Hz]");
    for (const ChosenResponse& response : responses)
        titles.add(makeAxisLabel(response.name, response.unit));
    for (const ChosenResponse& response : responses)
        titles.add("phase of " + response.name + " [deg]");
    const auto density = analysis.matrices.find("density");
    if (density != analysis.matrices.end())
        for (const std::string& output : analysis.outputs) titles.add("density of " + output);
    std::string text = titles.end();
    for (size_t n = 0; n < analysis.frequency.at(0).size(); ++n) {
        CsvLine line;
        line.add(analysis.frequency[0][n])
            .addAll(analysis.matrices.at("magnitude").at(n))
            .addAll(analysis.matrices.at("phase").at(n));
        if (density != analysis.matrices.end()) line.addAll(density->second.at(n));
        text += line.end();
    }
    return text;
}

std::string writeProbes(const Results::Analysis& analysis) {
    const bool isTransient = analysis.type == "transient";
    CsvLine titles;
    if (isTransient) titles.add("time [s]");
    if (analysis.hasPath()) titles.add("load factor").add("unstable motions").add("kind");
    for (const ChosenColumn& column : chooseColumns(analysis, {}))
        titles.add(makeAxisLabel(column.name, column.unit));
    std::string text = titles.end();
    const size_t numRows = isTransient          ? analysis.time.size()
                           : analysis.hasPath() ? analysis.matrices.at("path").size()
                                                : 1;
    for (size_t k = 0; k < numRows; ++k) {
        CsvLine line;
        if (isTransient) line.add(analysis.time[k]);
        if (analysis.hasPath()) line.addAll(analysis.matrices.at("path")[k]);
        for (const Results::Series& series : analysis.probes) line.addAll(series.rows.at(k));
        text += line.end();
    }
    return text;
}

}  // namespace
}  // namespace model

using namespace model;

void writeResultCsv(const std::string& path, const Results::Analysis& analysis) {
    replaceFile(path,
                analysis.type == "eigen"                ? writeModes(analysis)
                : analysis.type == "campbell"           ? writeDiagram(analysis)
                : analysis.type == "linear"             ? writeMatrices(analysis)
                : analysis.type == "frequency_response" ? writeResponses(analysis)
                                                        : writeProbes(analysis),
                Durability::ProcessEnd);
}

}  // namespace simflex
