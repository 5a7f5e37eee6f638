#include "simflex/cli/run/RunSummary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace simflex {
namespace cli {

namespace {

double getStatistic(const ResultData::Analysis& analysis, const std::string& name) {
    const auto found = analysis.statistics.find(name);
    return found == analysis.statistics.end() ? 0 : found->second;
}

/** "slider.x [m]" **/
std::string makeLabel(const ResultColumn& column, size_t k) {
    std::string label = column.name;
    if (!column.columns[k].empty()) label += "." + column.columns[k];
    return column.unit.empty() ? label : label + " [" + column.unit + "]";
}

int findLongestLabel(const ResultData::Analysis& analysis) {
    size_t longest = 5;
    for (const ResultData::Series& series : analysis.probes)
        for (size_t k = 0; k < series.column.columns.size(); ++k)
            longest = std::max(longest, makeLabel(series.column, k).size());
    return int(longest);
}

void printTransient(const ResultData::Analysis& analysis) {
    std::printf("%s: transient", analysis.name.c_str());
    if (!analysis.time.empty())
        std::printf(", t = %.6g to %.6g s in %zu rows", analysis.time.front(), analysis.time.back(),
                    analysis.time.size());
    std::printf("%s\n", analysis.isComplete ? "" : "; NOT COMPLETE");
    if (analysis.statistics.count("steps"))
        std::printf(
            "  %.0f steps, %.0f Newton iterations; %.0f tries rejected for their error, "
            "%.0f not converged\n"
            "  energy balance: off by at most %.3g J, largest kinetic energy %.3g J\n",
            getStatistic(analysis, "steps"), getStatistic(analysis, "newton_iterations"),
            getStatistic(analysis, "error_test_failures"),
            getStatistic(analysis, "convergence_failures"),
            getStatistic(analysis, "largest_energy_error"),
            getStatistic(analysis, "largest_kinetic_energy"));
    if (analysis.time.empty() || analysis.probes.empty()) return;
    const int width = findLongestLabel(analysis);
    std::printf("  %-*s %13s %11s %13s %11s %13s\n", width, "probe", "least", "at [s]", "largest",
                "at [s]", "at the end");
    for (const ResultData::Series& series : analysis.probes)
        for (size_t k = 0; k < series.column.columns.size(); ++k) {
            size_t least = 0, largest = 0;
            for (size_t i = 1; i < series.rows.size(); ++i) {
                // What is not a number is less and more than nothing.
                if (!(series.rows[i][k] >= series.rows[least][k]) && !std::isnan(series.rows[i][k]))
                    least = i;
                if (!(series.rows[i][k] <= series.rows[largest][k]) &&
                    !std::isnan(series.rows[i][k]))
                    largest = i;
            }
            std::printf("  %-*s %13.6g %11.5g %13.6g %11.5g %13.6g\n", width,
                        makeLabel(series.column, k).c_str(), series.rows[least][k],
                        analysis.time[least], series.rows[largest][k], analysis.time[largest],
                        series.rows.back()[k]);
        }
}

void printStatic(const ResultData::Analysis& analysis) {
    std::printf("%s: static equilibrium, %.0f iterations\n", analysis.name.c_str(),
                getStatistic(analysis, "iterations"));
    const int width = findLongestLabel(analysis);
    for (const ResultData::Series& series : analysis.probes)
        for (size_t k = 0; k < series.column.columns.size() && !series.rows.empty(); ++k)
            std::printf("  %-*s %13.6g\n", width, makeLabel(series.column, k).c_str(),
                        series.rows[0][k]);
}

void printEigen(const ResultData::Analysis& analysis) {
    const double numRigid = getStatistic(analysis, "rigid_motions");
    std::printf("%s: natural modes", analysis.name.c_str());
    if (numRigid > 0)
        std::printf(", besides %.0f motion%s that nothing restores", numRigid,
                    numRigid == 1 ? "" : "s");
    std::printf("\n  mode  frequency [Hz]  damping ratio\n");
    for (size_t k = 0; !analysis.frequency.empty() && k < analysis.frequency[0].size(); ++k)
        std::printf("  %4zu  %14.7g  %13.3g\n", k + 1, analysis.frequency[0][k],
                    analysis.dampingRatio[0][k]);
}

void printCampbell(const ResultData::Analysis& analysis) {
    std::printf("%s: natural frequencies [Hz] over speed\n", analysis.name.c_str());
    for (size_t i = 0; i < analysis.speeds.size(); ++i) {
        std::printf("  %12.6g:", analysis.speeds[i]);
        for (const double frequency : analysis.frequency[i]) std::printf(" %11.6g", frequency);
        std::printf("\n");
    }
}

}  // namespace

void printAnalysis(const ResultData::Analysis& analysis, const std::vector<std::string>& remarks) {
    if (analysis.type == "transient") printTransient(analysis);
    if (analysis.type == "static") printStatic(analysis);
    if (analysis.type == "eigen") printEigen(analysis);
    if (analysis.type == "campbell") printCampbell(analysis);
    for (const std::string& remark : remarks) std::printf("  %s\n", remark.c_str());
}

void printDifference(const ResultData& flexible, const ResultData& rigid) {
    for (const ResultData::Analysis& a : flexible.analyses) {
        const auto b = std::find_if(rigid.analyses.begin(), rigid.analyses.end(),
                                    [&](const auto& other) { return other.name == a.name; });
        if (b == rigid.analyses.end() || a.probes.empty()) continue;
        const int width = findLongestLabel(a);
        std::printf("%s: flexible against rigid\n  %-*s %13s %13s %13s\n", a.name.c_str(), width,
                    "probe", "largest", "rms", "of range");
        for (size_t p = 0; p < std::min(a.probes.size(), b->probes.size()); ++p) {
            const ResultData::Series &first = a.probes[p], &second = b->probes[p];
            const size_t numRows = std::min(first.rows.size(), second.rows.size());
            for (size_t k = 0; k < first.column.columns.size() && numRows > 0; ++k) {
                double largest = 0, squares = 0, low = first.rows[0][k], high = low;
                for (size_t i = 0; i < numRows; ++i) {
                    const double difference = first.rows[i][k] - second.rows[i][k];
                    largest = std::max(largest, std::abs(difference));
                    squares += difference * difference;
                    low = std::min(low, first.rows[i][k]);
                    high = std::max(high, first.rows[i][k]);
                }
                std::printf("  %-*s %13.6g %13.6g", width, makeLabel(first.column, k).c_str(),
                            largest, std::sqrt(squares / double(numRows)));
                if (high > low)
                    std::printf(" %11.3g %%\n", 100 * largest / (high - low));
                else
                    std::printf(" %13s\n", "-");
            }
        }
    }
}

}  // namespace cli
}  // namespace simflex
