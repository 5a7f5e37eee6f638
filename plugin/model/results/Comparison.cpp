#include "simflex/model/results/Comparison.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/ModeShapes.h"
#include "simflex/model/results/ProbeChoice.h"

namespace simflex {
namespace model {
namespace {

constexpr double ConstantRange = 1e-9;  // what varies by less of its size is constant

/** Value at time t of the polynomial through the four nearest rows (fewer if there are fewer). **/
double interpolate(const std::vector<double>& time, const std::vector<double>& values, double t) {
    const size_t count = time.size();
    const size_t after = size_t(std::lower_bound(time.begin(), time.end(), t) - time.begin());
    if (after < count && time[after] == t) return values[after];
    const size_t points = std::min<size_t>(4, count);
    const size_t begin = std::min(after > 2 ? after - 2 : 0, count - points);
    double sum = 0;
    for (size_t i = begin; i < begin + points; ++i) {
        double weight = 1;
        for (size_t j = begin; j < begin + points; ++j)
            if (j != i) weight *= (t - time[j]) / (time[i] - time[j]);
        sum += weight * values[i];
    }
    return sum;
}

double findRange(const std::vector<double>& values) {
    if (values.empty()) return 0;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    return *high - *low;
}

double findSize(const std::vector<double>& values) {
    double size = 0;
    for (const double value : values) size = std::max(size, std::abs(value));
    return size;
}

/** Largest and RMS of first - second. What is no number on one side only differs without bound. **/
void measure(ColumnDifference& column) {
    double sum = 0;
    for (size_t k = 0; k < column.first.size(); ++k) {
        double difference = std::abs(column.first[k] - column.second[k]);
        if (std::isnan(column.first[k]) && std::isnan(column.second[k])) difference = 0;
        if (std::isnan(difference)) difference = INFINITY;
        if (column.first[k] == column.second[k]) difference = 0;  // also where both are infinite
        sum += difference * difference;
        if (difference <= column.largest) continue;
        column.largest = difference;
        column.time = column.x.empty() ? 0 : column.x[k];
    }
    column.rms = column.first.empty() ? 0 : std::sqrt(sum / double(column.first.size()));
}

class Comparer {
public:
    using Reason = NotCompared::Reason;

    Comparer(const std::vector<std::string>& patterns, const std::string& nameA,
             const std::string& nameB)
        : m_patterns(patterns), m_nameA(nameA), m_nameB(nameB) {}

    void compare(const Results::Analysis& a, const Results::Analysis& b) {
        if (a.type != b.type) {
            noteDifferent(a, "analysis '" + a.name + "' is " + a.type + " in " + m_nameA + ", " +
                                 b.type + " in " + m_nameB);
        } else if (a.type == "transient" || a.type == "static") {
            compareProbes(a, b);
        } else if (m_patterns.empty()) {
            compareModes(a, b);
        }
    }

    /** @param column  of a probe; empty: the analysis is **/
    void noteMissing(const std::string& analysis, const std::string& column, Reason reason) {
        result.missing.push_back({reason, analysis, column,
                                  (column.empty() ? "" : "probe '" + column + "' of ") +
                                      "analysis '" + analysis + "' is only in " +
                                      (reason == Reason::OnlyInFirst ? m_nameA : m_nameB)});
    }

    ResultComparison result;

private:
    std::vector<ChosenColumn> choose(const Results::Analysis& analysis) {
        std::vector<ChosenColumn> columns = chooseColumns(analysis, {});
        const auto isLeftOut = [&](const ChosenColumn& column) {
            return !m_patterns.empty() &&
                   std::none_of(m_patterns.begin(), m_patterns.end(),
                                [&](const std::string& pattern) { return fits(pattern, column); });
        };
        columns.erase(std::remove_if(columns.begin(), columns.end(), isLeftOut), columns.end());
        return columns;
    }

    void compareProbes(const Results::Analysis& a, const Results::Analysis& b) {
        const std::vector<ChosenColumn> first = choose(a), second = choose(b);
        const std::vector<double> time = findCommonTimes(a, b);
        for (const ChosenColumn& column : second)
            if (!seekNamed(first, column.name))
                noteMissing(a.name, column.name, Reason::OnlyInSecond);
        const size_t begin = result.columns.size();
        for (const ChosenColumn& column : first) {
            const ChosenColumn* other = seekNamed(second, column.name);
            if (!other) {
                noteMissing(a.name, column.name, Reason::OnlyInFirst);
                continue;
            }
            ColumnDifference difference;
            difference.analysis = a.name;
            difference.name = column.name;
            difference.unit = column.unit;
            difference.probe = column.probe;
            if (a.type == "static") {
                // Points of paths lie elsewhere.
                difference.first = {column.values.back()};
                difference.second = {other->values.back()};
            } else {
                difference.x = time;
                for (const double t : time) {
                    difference.first.push_back(interpolate(a.time, column.values, t));
                    difference.second.push_back(interpolate(b.time, other->values, t));
                }
            }
            measure(difference);
            result.columns.push_back(std::move(difference));
        }
        shareRanges(begin);
    }

    /** Columns of one probe have one range: that of a component that stays at zero says nothing.
     * **/
    void shareRanges(size_t begin) {
        for (size_t k = begin; k < result.columns.size(); ++k) {
            double range = 0, size = 0;
            for (size_t other = begin; other < result.columns.size(); ++other) {
                const ColumnDifference& column = result.columns[other];
                if (column.probe != result.columns[k].probe) continue;
                range = std::max({range, findRange(column.first), findRange(column.second)});
                size = std::max({size, findSize(column.first), findSize(column.second)});
            }
            result.columns[k].range = range > ConstantRange * size ? range : size;
        }
    }

    /** Times of the first that the second covers. **/
    std::vector<double> findCommonTimes(const Results::Analysis& a, const Results::Analysis& b) {
        if (a.time == b.time) return a.time;
        std::vector<double> common;
        for (const double t : a.time)
            if (!b.time.empty() && t >= b.time.front() && t <= b.time.back()) common.push_back(t);
        char text[300];
        if (common.empty()) {
            noteDifferent(a, "analysis '" + a.name + "' has no time that both files cover");
        } else {
            std::snprintf(
                text, sizeof text,
                "times of analysis '%s' differ: compared at %zu times of %s from %g to %g s, "
                "between rows of %s by cubic interpolation",
                a.name.c_str(), common.size(), m_nameA.c_str(), common.front(), common.back(),
                m_nameB.c_str());
            result.notes.push_back(text);
        }
        return common;
    }

    void compareModes(const Results::Analysis& a, const Results::Analysis& b) {
        if (a.type == "campbell" && a.speeds != b.speeds) {
            noteDifferent(a, "the speeds of analysis '" + a.name + "' differ");
            return;
        }
        const size_t modesA = a.frequency.empty() ? 0 : a.frequency[0].size(),
                     modesB = b.frequency.empty() ? 0 : b.frequency[0].size();
        if (modesA != modesB)
            noteDifferent(a, "analysis '" + a.name + "' has " + std::to_string(modesA) +
                                 " modes in " + m_nameA + ", " + std::to_string(modesB) + " in " +
                                 m_nameB);
        for (size_t mode = 0; mode < std::min(modesA, modesB); ++mode) {
            const std::string number = std::to_string(mode + 1);
            addModes(a, "frequency " + number, "Hz", mode, a.frequency, b.frequency, 0);
            addModes(a, "damping ratio " + number, "", mode, a.dampingRatio, b.dampingRatio, 1);
        }
        pairModes(a, b);
    }

    /** Notes which mode of `b` has the shape of each of `a`, by the modal assurance criterion. **/
    void pairModes(const Results::Analysis& a, const Results::Analysis& b) {
        if (a.type != "eigen" || a.outputs.empty() || a.outputs != b.outputs) return;
        if (a.frequency.at(0).empty() || b.frequency.at(0).empty()) return;
        const ModeShapes first = getModeShapes(a), second = getModeShapes(b);
        for (size_t i = 0; i < first.shapes.size(); ++i) {
            double best = 0;
            size_t partner = 0;
            for (size_t k = 0; k < second.shapes.size(); ++k) {
                const double assurance = calcModalAssurance(first.shapes[i], second.shapes[k]);
                if (assurance > best) best = assurance, partner = k;
            }
            if (best == 0) continue;
            char text[200];
            std::snprintf(text, sizeof text,
                          "mode %zu of '%s', %.5g Hz, has the shape of mode %zu of %s, %.5g Hz: "
                          "modal assurance %.4f",
                          i + 1, a.name.c_str(), a.frequency[0][i], partner + 1, m_nameB.c_str(),
                          b.frequency[0][partner], best);
            result.notes.push_back(text);
        }
    }

    void addModes(const Results::Analysis& a, const std::string& name, const std::string& unit,
                  size_t mode, const std::vector<std::vector<double>>& first,
                  const std::vector<std::vector<double>>& second, double range) {
        ColumnDifference difference;
        difference.analysis = a.name;
        difference.name = name;
        difference.unit = unit;
        difference.x = a.speeds;
        for (size_t k = 0; k < std::min(first.size(), second.size()); ++k) {
            difference.first.push_back(first[k].at(mode));
            difference.second.push_back(second[k].at(mode));
        }
        measure(difference);
        // A damping ratio is relative already.
        difference.range =
            range > 0 ? range : std::max(findSize(difference.first), findSize(difference.second));
        result.columns.push_back(std::move(difference));
    }

    void noteDifferent(const Results::Analysis& analysis, const std::string& text) {
        result.missing.push_back({Reason::Different, analysis.name, "", text});
    }

    const std::vector<std::string>& m_patterns;
    const std::string &m_nameA, &m_nameB;
};

}  // namespace

double ColumnDifference::getRelative() const {
    if (largest == 0) return 0;
    return range > 0 ? largest / range : INFINITY;
}

ResultComparison compareResults(const Results& a, const Results& b,
                                const std::vector<std::string>& patterns, const std::string& nameA,
                                const std::string& nameB) {
    Comparer comparer(patterns, nameA, nameB);
    for (const auto& analysis : a.analyses) {
        if (const auto* other = seekNamed(b.analyses, analysis.name))
            comparer.compare(analysis, *other);
        else
            comparer.noteMissing(analysis.name, "", NotCompared::Reason::OnlyInFirst);
    }
    for (const auto& analysis : b.analyses)
        if (!seekNamed(a.analyses, analysis.name))
            comparer.noteMissing(analysis.name, "", NotCompared::Reason::OnlyInSecond);
    return comparer.result;
}

}  // namespace model
}  // namespace simflex
