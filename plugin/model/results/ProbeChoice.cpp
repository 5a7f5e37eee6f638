#include "simflex/model/results/ProbeChoice.h"

#include <fnmatch.h>

#include <filesystem>
#include <set>
#include <stdexcept>

#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace model {

bool fits(const std::string& pattern, const ChosenColumn& column) {
    for (const std::string& name : {column.name, column.probe})
        if (pattern == name || fnmatch(pattern.c_str(), name.c_str(), 0) == 0) return true;
    return false;
}

std::vector<ChosenColumn> chooseColumns(const Results::Analysis& analysis,
                                        const std::vector<std::string>& patterns) {
    std::vector<ChosenColumn> chosen;
    std::vector<std::string> probes;
    std::set<std::string> used;
    for (const auto& series : analysis.probes) {
        const ResultColumn& probe = series.column;
        probes.push_back(probe.name);
        for (size_t c = 0; c < probe.columns.size(); ++c) {
            const std::string& part = probe.columns[c];
            ChosenColumn column{part.empty() ? probe.name : probe.name + "." + part,
                                probe.name,
                                part,
                                probe.unit,
                                {}};
            bool isChosen = patterns.empty();
            for (const std::string& pattern : patterns) {
                if (!fits(pattern, column)) continue;
                isChosen = true;
                used.insert(pattern);
            }
            if (!isChosen) continue;
            for (const auto& row : series.rows) column.values.push_back(row.at(c));
            chosen.push_back(std::move(column));
        }
    }
    for (const std::string& pattern : patterns)
        if (!used.count(pattern))
            throw std::runtime_error("in analysis '" + analysis.name + "' " +
                                     describeUnknown("probe", pattern, probes));
    return chosen;
}

std::vector<ChosenResponse> chooseResponses(const Results::Analysis& analysis,
                                            const std::vector<std::string>& patterns) {
    std::vector<ChosenResponse> chosen;
    std::set<std::string> used;
    const size_t numInputs = analysis.inputs.size();
    for (size_t i = 0; i < analysis.outputs.size(); ++i) {
        const std::string& output = analysis.outputs[i];
        const ChosenColumn column{output, output.substr(0, output.find('.')), "", "", {}};
        bool isChosen = patterns.empty();
        for (const std::string& pattern : patterns) {
            if (!fits(pattern, column)) continue;
            isChosen = true;
            used.insert(pattern);
        }
        for (size_t k = 0; isChosen && k < numInputs; ++k) {
            ChosenResponse response;
            response.output = output;
            response.input = analysis.inputs[k];
            response.name = numInputs > 1 ? output + " by " + analysis.inputs[k] : output;
            const auto group = [](const std::string& unit) {
                return unit.find_first_of(" /") == unit.npos ? unit : "(" + unit + ")";
            };
            const std::string &unit = analysis.outputUnits.at(i), by = analysis.inputUnits.at(k);
            response.unit =
                by.empty() ? unit : (unit.empty() ? "1" : group(unit)) + "/" + group(by);
            for (const auto& row : analysis.matrices.at("magnitude"))
                response.magnitude.push_back(row.at(i * numInputs + k));
            for (const auto& row : analysis.matrices.at("phase"))
                response.phase.push_back(row.at(i * numInputs + k));
            chosen.push_back(std::move(response));
        }
    }
    for (const std::string& pattern : patterns)
        if (!used.count(pattern))
            throw std::runtime_error("in analysis '" + analysis.name + "' " +
                                     describeUnknown("output", pattern, analysis.outputs));
    return chosen;
}

const Results::Analysis& chooseAnalysis(const Results& results, const std::string& path,
                                        const std::string& name) {
    if (results.analyses.empty())
        throw std::runtime_error("result file '" + path + "' has no analysis yet");
    if (!name.empty())
        return findNamed(results.analyses, "analysis of '" + path + "' called", name);
    for (const auto& analysis : results.analyses)
        if (analysis.type == "transient") return analysis;
    return results.analyses.front();
}

void requireAnalyses(const Results& results, const std::string& path,
                     const std::vector<std::string>& names) {
    std::vector<std::string> known;
    for (const auto& analysis : results.analyses) known.push_back(analysis.name);
    for (const std::string& name : names)
        if (!seekNamed(results.analyses, name))
            throw std::runtime_error("'" + path + "': " + describeUnknown("analysis", name, known));
}

std::vector<std::string> makeFileLabels(const std::vector<std::string>& paths) {
    std::vector<std::string> labels;
    std::set<std::string> stems;
    for (const std::string& path : paths) stems.insert(std::filesystem::path(path).stem().string());
    const bool isFolderEnough = paths.size() > 1 && stems.size() == 1;
    for (int folders = 0; folders < 5; ++folders) {
        labels.clear();
        for (const std::string& path : paths) {
            std::filesystem::path rest = std::filesystem::path(path).lexically_normal();
            std::string label = rest.stem().string();
            for (int k = 0; k < folders && rest.has_parent_path(); ++k) {
                rest = rest.parent_path();
                const bool isAlone = isFolderEnough && k == 0;
                label = rest.filename().string() + (isAlone ? "" : "/" + label);
            }
            labels.push_back(label);
        }
        if (std::set<std::string>(labels.begin(), labels.end()).size() == labels.size())
            return labels;
    }
    return paths;
}

}  // namespace model
}  // namespace simflex
