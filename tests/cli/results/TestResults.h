#pragma once
/** @file
Result files of a swinging point, whose every value is known. **/

#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "fe/TestDecks.h"
#include "simflex/model/results/ResultWriter.h"

namespace simflex {
namespace testing {

constexpr double kStep = 0.01;  // [s]

inline ResultHeader makeHeader() {
    return {"Swing",
            "swing.yaml",
            "simflex: 1\n# a swing\n",
            {"speed=3", "solver.threads=1"},
            false,
            "0.1",
            {}};
}

inline std::vector<ResultColumn> makeProbes() {
    return {{"swing", "m", {"x", "y"}}, {"angle", "rad", {""}}};
}

inline std::map<std::string, std::vector<std::string>> makeStates() {
    return {{"q", {"turn"}}, {"u", {"one", "two"}}};
}

/** Row k of a point on a circle of radius 2 m, at 1 rad/s. **/
inline void addCircleRow(model::ResultWriter& writer, int k) {
    const double t = k * kStep;
    writer.addRow(t, {2 * std::cos(t), 2 * std::sin(t), t}, {t, 1, -t});
}

inline void addCircle(model::ResultWriter& writer, int first, int end) {
    for (int k = first; k < end; ++k) addCircleRow(writer, k);
}

/** Whether the first rows are those of addCircle(). **/
inline bool isCircle(const Results::Analysis& analysis) {
    if (analysis.probes.size() != 2) return false;
    for (size_t k = 0; k < analysis.time.size(); ++k) {
        const double t = int(k) * kStep;
        if (analysis.time[k] != t || analysis.probes[1].rows.at(k).at(0) != t) return false;
        if (analysis.probes[0].rows.at(k).at(0) != 2 * std::cos(t)) return false;
        if (analysis.probes[0].rows.at(k).at(1) != 2 * std::sin(t)) return false;
        if (analysis.q.at(k) != std::vector<double>{t}) return false;
        if (analysis.u.at(k) != std::vector<double>{1, -t}) return false;
    }
    return true;
}

/** rest (static), modes (eigen), map (campbell). **/
inline Results::Analysis makeAnalysis(const std::string& type) {
    Results::Analysis analysis;
    analysis.type = type;
    analysis.isComplete = true;
    if (type == "static") {
        analysis.name = "rest";
        analysis.probes = {{makeProbes()[0], {{2, 0}}}, {makeProbes()[1], {{0}}}};
        analysis.q = {{0.5}};
        analysis.stateColumns = {{"q", {"turn"}}};
    } else if (type == "eigen") {
        analysis.name = "modes";
        analysis.frequency = {{1, 2.5, 40}};
        analysis.dampingRatio = {{0.01, 0, -0.02}};
    } else {
        analysis.name = "map";
        analysis.speeds = {0, 100};
        analysis.frequency = {{10, 20}, {8, 23}};
        analysis.dampingRatio = {{0.01, 0.02}, {0.03, -0.01}};
    }
    return analysis;
}

/** A whole run: rest (static), run (numRows of a circle), modes (eigen), map (campbell). **/
inline void writeRun(const std::string& path, int numRows = 100) {
    model::ResultWriter writer(path, makeHeader());
    writer.add(makeAnalysis("static"));
    writer.beginTransient("run", makeProbes(), makeStates());
    addCircle(writer, 0, numRows);
    writer.setStatistics("run", {{"steps", 12}, {"iterations", 30}});
    writer.setComplete("run");
    writer.add(makeAnalysis("eigen"));
    writer.add(makeAnalysis("campbell"));
}

}  // namespace testing
}  // namespace simflex
