#include "simflex/model/results/Comparison.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/Extremes.h"
#include "simflex/model/results/ModeShapes.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/solver/StateSpace.h"

namespace simflex {
namespace model {
namespace {

constexpr double SameLoadFactor = 1e-9;     // relative, for points of paths
constexpr double ConstantRange = 1e-9;      // relative variation below which a signal is constant
constexpr double LeastDampingRatio = 1e-6;  // least reference for damping ratios
constexpr size_t MostFrequencies = 64;      // for comparing linear models

/** Value at time t of the cubic through the four nearest rows (fewer if there are fewer). **/
template <class Value>
Value interpolate(const std::vector<double>& time, const std::vector<Value>& values, double t) {
    const size_t count = time.size();
    const size_t after = size_t(std::lower_bound(time.begin(), time.end(), t) - time.begin());
    if (after < count && time[after] == t) return values[after];
    const size_t points = std::min<size_t>(4, count);
    const size_t begin = std::min(after > 2 ? after - 2 : 0, count - points);
    Value sum = 0;
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
    const auto [low, high] = findExtremes(values.begin(), values.end());
    return *high - *low;
}

double findSize(const std::vector<double>& values) {
    double size = 0;
    for (const double value : values) size = std::max(size, std::abs(value));
    return size;
}

/** Returns 0 if both are NaN, or the same infinity. **/
template <class Value>
Value subtract(const Value& from, const Value& what) {
    const bool isSame = from == what || (std::isnan(std::abs(from)) && std::isnan(std::abs(what)));
    return isSame ? Value(0) : from - what;
}

/** Sets largest and RMS difference. NaN on one side only counts as infinite. **/
void measure(ColumnDifference& column) {
    double sum = 0;
    for (size_t k = 0; k < column.difference.size(); ++k) {
        double difference = std::abs(column.difference[k]);
        if (std::isnan(difference)) difference = INFINITY;
        sum += difference * difference;
        if (difference <= column.largest) continue;
        column.largest = difference;
        column.time = column.x.empty() ? 0 : column.x[k];
    }
    column.rms = column.first.empty() ? 0 : std::sqrt(sum / double(column.first.size()));
}

void measureReal(ColumnDifference& column) {
    for (size_t k = 0; k < column.first.size(); ++k)
        column.difference.push_back(subtract(column.second[k], column.first[k]));
    measure(column);
}

using Complex = std::complex<double>;

void addComplex(const Complex& first, const Complex& second, ColumnDifference& column) {
    column.first.push_back(std::abs(first));
    column.second.push_back(std::abs(second));
    column.difference.push_back(std::abs(subtract(second, first)));
}

/** Response of an output to an input, or spectral density of an output. **/
struct Response {
    std::string name, unit, output;
    std::string input;  ///< empty for a density
    std::vector<Complex> values;

    std::string getProbe() const { return output.substr(0, output.find('.')); }
};

std::vector<Response> listResponses(const Results::Analysis& analysis) {
    std::vector<Response> responses;
    for (const ChosenResponse& chosen : chooseResponses(analysis, {})) {
        responses.push_back(
            {chosen.output + " by " + chosen.input, chosen.unit, chosen.output, chosen.input, {}});
        for (size_t k = 0; k < chosen.magnitude.size(); ++k)
            responses.back().values.push_back(
                std::polar(chosen.magnitude[k], chosen.phase[k] * SimTK::Pi / 180));
    }
    const auto densities = analysis.matrices.find("density");
    if (densities == analysis.matrices.end()) return responses;
    for (size_t i = 0; i < analysis.outputs.size(); ++i) {
        const std::string &output = analysis.outputs[i], &unit = analysis.outputUnits[i];
        responses.push_back({"density of " + output,
                             unit.empty() ? "1/Hz" : "(" + unit + ")^2/Hz",
                             output,
                             "",
                             {}});
        for (const auto& row : densities->second) responses.back().values.push_back(row.at(i));
    }
    return responses;
}

/** Largest change of a curve if only some of its rows are kept and interpolated. **/
double calcLost(const std::vector<double>& x, const std::vector<Complex>& curve,
                const std::vector<double>& kept) {
    std::vector<double> rows;
    std::vector<Complex> values;
    double lost = 0;
    for (size_t k = 0; k < x.size(); ++k) {
        if (!std::binary_search(kept.begin(), kept.end(), x[k])) continue;
        rows.push_back(x[k]);
        values.push_back(curve[k]);
    }
    for (size_t k = 0; k < x.size(); ++k)
        lost = std::max(
            lost,
            std::abs(curve[k] - (rows.empty() ? Complex(0) : interpolate(rows, values, x[k]))));
    return lost;
}

SimTK::Matrix toMatrix(const Results::Analysis& analysis, const char* name) {
    const auto& rows = analysis.matrices.at(name);
    SimTK::Matrix matrix(int(rows.size()), rows.empty() ? 0 : int(rows[0].size()));
    for (int i = 0; i < matrix.nrow(); ++i)
        for (int j = 0; j < matrix.ncol(); ++j) matrix(i, j) = rows[size_t(i)][size_t(j)];
    return matrix;
}

StateSpace makeStateSpace(const Results::Analysis& analysis) {
    StateSpace space;
    space.A = toMatrix(analysis, "A");
    space.B = toMatrix(analysis, "B");
    space.C = toMatrix(analysis, "C");
    space.D = toMatrix(analysis, "D");
    space.D1 = space.D2 = SimTK::Matrix(space.D.nrow(), space.D.ncol(), 0.0);
    return space;
}

/** Poles by ascending magnitude, of a pair the one with positive imaginary part first. **/
std::vector<Complex> calcPoles(const StateSpace& space) {
    SimTK::Vector_<SimTK::Complex> values;
    SimTK::Eigen(space.A).getAllEigenValues(values);
    std::vector<Complex> poles;
    for (int k = 0; k < values.size(); ++k) poles.push_back(values[k]);
    std::sort(poles.begin(), poles.end(), [](const Complex& a, const Complex& b) {
        return std::pair(std::abs(a), -a.imag()) < std::pair(std::abs(b), -b.imag());
    });
    return poles;
}

/** Frequencies between all poles, half the slowest and twice the fastest [Hz]: at a pole, the
response may be infinite. **/
std::vector<double> chooseFrequencies(const std::vector<Complex>& first,
                                      const std::vector<Complex>& second) {
    constexpr double Zero = 1e-9, Apart = 1.001;
    std::vector<double> sizes;
    for (const auto* poles : {&first, &second})
        for (const Complex& pole : *poles) sizes.push_back(std::abs(pole) / (2 * SimTK::Pi));
    std::sort(sizes.begin(), sizes.end());
    std::vector<double> frequencies;
    double before = 0;
    for (const double size : sizes) {
        if (!(size > Zero * sizes.back())) continue;
        if (size > Apart * before)
            frequencies.push_back(before > 0 ? std::sqrt(before * size) : size / 2);
        before = size;
    }
    frequencies.push_back(before > 0 ? 2 * before : 1);
    const size_t count = frequencies.size();
    if (count <= MostFrequencies) return frequencies;
    std::vector<double> chosen;
    for (size_t k = 0; k < MostFrequencies; ++k)
        chosen.push_back(frequencies[k * (count - 1) / (MostFrequencies - 1)]);
    return chosen;
}

/** Responses in the form of a frequency_response analysis. **/
Results::Analysis calcResponses(const Results::Analysis& analysis, const StateSpace& space,
                                const std::vector<double>& frequencies) {
    Results::Analysis responses;
    responses.name = analysis.name;
    responses.inputs = analysis.inputs;
    responses.outputs = analysis.outputs;
    responses.inputUnits = analysis.inputUnits;
    responses.outputUnits = analysis.outputUnits;
    responses.frequency = {frequencies};
    auto &magnitude = responses.matrices["magnitude"], &phase = responses.matrices["phase"];
    for (const double frequency : frequencies) {
        const auto transfer = space.calcTransfer({0, 2 * SimTK::Pi * frequency});
        magnitude.emplace_back();
        phase.emplace_back();
        for (int i = 0; i < transfer.nrow(); ++i)
            for (int k = 0; k < transfer.ncol(); ++k) {
                magnitude.back().push_back(std::abs(transfer(i, k)));
                phase.back().push_back(std::arg(transfer(i, k)) * 180 / SimTK::Pi);
            }
    }
    return responses;
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
        } else if (a.type == "frequency_response") {
            compareResponses(a, b);
            compareEffectiveValues(a, b);
        } else if (a.type == "linear") {
            compareLinear(a, b);
        } else if (a.type != "eigen" && a.type != "campbell") {
            noteDifferent(a, "analysis '" + a.name + "' is not compared: type " + a.type);
        } else if (m_patterns.empty()) {
            compareModes(a, b);
        }
    }

    /** @param column  of a probe; empty for the whole analysis **/
    void noteMissing(const std::string& analysis, const std::string& column, Reason reason) {
        result.missing.push_back({reason, analysis, column,
                                  (column.empty() ? "" : "probe '" + column + "' of ") +
                                      "analysis '" + analysis + "' is only in " +
                                      (reason == Reason::OnlyInFirst ? m_nameA : m_nameB)});
    }

    ResultComparison result;

private:
    bool isLeftOut(const ChosenColumn& column) const {
        return !m_patterns.empty() &&
               std::none_of(m_patterns.begin(), m_patterns.end(),
                            [&](const std::string& pattern) { return fits(pattern, column); });
    }

    std::vector<ChosenColumn> choose(const Results::Analysis& analysis) const {
        std::vector<ChosenColumn> columns = chooseColumns(analysis, {});
        columns.erase(std::remove_if(columns.begin(), columns.end(),
                                     [&](const auto& column) { return isLeftOut(column); }),
                      columns.end());
        return columns;
    }

    bool isOutputLeftOut(const std::string& output) const {
        return isLeftOut({output, output.substr(0, output.find('.')), "", "", {}});
    }

    std::vector<Response> chooseOutputs(const Results::Analysis& analysis) const {
        std::vector<Response> responses = listResponses(analysis);
        responses.erase(
            std::remove_if(responses.begin(), responses.end(),
                           [&](const auto& one) { return isOutputLeftOut(one.output); }),
            responses.end());
        return responses;
    }

    void noteOneSided(const Results::Analysis& analysis, const std::string& what, Reason reason) {
        result.missing.push_back({reason, analysis.name, what,
                                  "'" + what + "' of analysis '" + analysis.name + "' is only in " +
                                      (reason == Reason::OnlyInFirst ? m_nameA : m_nameB)});
    }

    void compareResponses(const Results::Analysis& a, const Results::Analysis& b) {
        const std::vector<Response> first = chooseOutputs(a), second = chooseOutputs(b);
        for (const Response& response : second)
            if (!seekNamed(first, response.name))
                noteOneSided(a, response.name, Reason::OnlyInSecond);
        const std::vector<double>&f = a.frequency.at(0), &g = b.frequency.at(0);
        const std::vector<double> x = mergeFrequencies(f, g);
        if (x.empty()) {
            if (!first.empty())
                noteDifferent(a,
                              "analysis '" + a.name + "' has no frequency that both files cover");
            return;
        }
        const size_t begin = result.columns.size();
        std::vector<const Response*> compared;
        std::vector<double> uncertain;
        for (const Response& response : first) {
            const Response* other = seekNamed(second, response.name);
            if (!other) {
                noteOneSided(a, response.name, Reason::OnlyInFirst);
                continue;
            }
            ColumnDifference difference;
            difference.analysis = a.name;
            difference.name = response.name;
            difference.unit = response.unit;
            difference.probe = response.getProbe();
            difference.axis = "frequency [Hz]";
            difference.x = x;
            compared.push_back(&response);
            std::vector<Complex> one, two;
            for (const double at : x) {
                one.push_back(interpolate(f, response.values, at));
                two.push_back(interpolate(g, other->values, at));
                addComplex(one.back(), two.back(), difference);
            }
            uncertain.push_back(std::max(calcLost(x, one, g), calcLost(x, two, f)));
            measure(difference);
            result.columns.push_back(std::move(difference));
        }
        // All responses of one probe to one input share one range.
        for (size_t k = 0; k < compared.size(); ++k) {
            double& range = result.columns[begin + k].range;
            for (size_t other = 0; other < compared.size(); ++other)
                if (compared[other]->getProbe() == compared[k]->getProbe() &&
                    compared[other]->input == compared[k]->input)
                    range = std::max({range, findSize(result.columns[begin + other].first),
                                      findSize(result.columns[begin + other].second)});
        }
        if (compared.empty() || f == g) return;
        double share = 0;
        for (size_t k = 0; k < compared.size(); ++k)
            if (uncertain[k] > 0)
                share = std::max(share, uncertain[k] / result.columns[begin + k].range);
        char text[400];
        std::snprintf(text, sizeof text,
                      "frequencies of analysis '%s' differ (%zu in %s, %zu in %s): compared at %zu "
                      "from %g to %g Hz, where a file has no row by cubic interpolation, which "
                      "alone makes differences of up to %.2g of range",
                      a.name.c_str(), f.size(), m_nameA.c_str(), g.size(), m_nameB.c_str(),
                      x.size(), x.front(), x.back(), share);
        result.notes.push_back(text);
    }

    /** All frequencies of either response within the common range. **/
    static std::vector<double> mergeFrequencies(const std::vector<double>& f,
                                                const std::vector<double>& g) {
        if (f == g) return f;
        std::vector<double> all;
        const double from = std::max(f.front(), g.front()), to = std::min(f.back(), g.back());
        for (const auto* frequencies : {&f, &g})
            for (const double frequency : *frequencies)
                if (frequency >= from && frequency <= to) all.push_back(frequency);
        std::sort(all.begin(), all.end());
        all.erase(std::unique(all.begin(), all.end()), all.end());
        return all;
    }

    void compareEffectiveValues(const Results::Analysis& a, const Results::Analysis& b) {
        const std::string prefix = "rms of ";
        const auto isWanted = [&](const std::string& name) {
            return name.compare(0, prefix.size(), prefix) == 0 &&
                   !isOutputLeftOut(name.substr(prefix.size()));
        };
        for (const auto& [name, value] : b.statistics)
            if (isWanted(name) && !a.statistics.count(name))
                noteOneSided(a, name, Reason::OnlyInSecond);
        for (const auto& [name, value] : a.statistics) {
            if (!isWanted(name)) continue;
            const auto other = b.statistics.find(name);
            if (other == b.statistics.end()) {
                noteOneSided(a, name, Reason::OnlyInFirst);
                continue;
            }
            const auto output =
                std::find(a.outputs.begin(), a.outputs.end(), name.substr(prefix.size()));
            ColumnDifference difference;
            difference.analysis = a.name;
            difference.name = name;
            // The von Mises stress has no output of its own.
            difference.unit = output == a.outputs.end()
                                  ? "Pa"
                                  : a.outputUnits.at(size_t(output - a.outputs.begin()));
            difference.first = {value};
            difference.second = {other->second};
            measureReal(difference);
            difference.range = std::max(std::abs(value), std::abs(other->second));
            result.columns.push_back(std::move(difference));
        }
    }

    void compareLinear(const Results::Analysis& a, const Results::Analysis& b) {
        const StateSpace first = makeStateSpace(a), second = makeStateSpace(b);
        const std::vector<Complex> poles = calcPoles(first), others = calcPoles(second);
        if (m_patterns.empty()) comparePoles(a, poles, others);
        const std::vector<double> frequencies = chooseFrequencies(poles, others);
        compareResponses(calcResponses(a, first, frequencies),
                         calcResponses(b, second, frequencies));
    }

    void comparePoles(const Results::Analysis& a, const std::vector<Complex>& first,
                      const std::vector<Complex>& second) {
        if (first.size() != second.size()) {
            noteDifferent(a, "analysis '" + a.name + "' has " + std::to_string(first.size()) +
                                 " states in " + m_nameA + ", " + std::to_string(second.size()) +
                                 " in " + m_nameB + ": its poles are not compared");
            return;
        }
        std::vector<Complex> left = second, partners;
        for (const Complex& pole : first) {
            const auto nearest = std::min_element(
                left.begin(), left.end(), [&](const Complex& one, const Complex& two) {
                    return std::abs(one - pole) < std::abs(two - pole);
                });
            partners.push_back(*nearest);
            left.erase(nearest);
        }
        int number = 0;
        for (size_t k = 0; k < first.size(); ++k) {
            // Skip the conjugate pole.
            if (k > 0 && first[k] == std::conj(first[k - 1]) && first[k].imag() < 0 &&
                partners[k] == std::conj(partners[k - 1]))
                continue;
            ColumnDifference difference;
            difference.analysis = a.name;
            difference.name = "pole " + std::to_string(++number);
            difference.unit = "1/s";
            addComplex(first[k], partners[k], difference);
            measure(difference);
            difference.range = std::max(difference.first[0], difference.second[0]);
            result.columns.push_back(std::move(difference));
        }
    }

    void compareProbes(const Results::Analysis& a, const Results::Analysis& b) {
        const std::vector<ChosenColumn> first = choose(a), second = choose(b);
        const bool isStatic = a.type == "static";
        const std::vector<double> time = isStatic ? std::vector<double>() : findCommonTimes(a, b),
                                  factors = isStatic ? findCommonFactors(a, b) : time;
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
            if (isStatic) {
                // Points of paths may differ in position, except the last.
                if (!factors.empty()) difference.axis = "load factor";
                difference.x = factors;
                const size_t count = std::max<size_t>(1, factors.size());
                for (size_t left = count; left > 0; --left) {
                    difference.first.push_back(column.values[column.values.size() - left]);
                    difference.second.push_back(other->values[other->values.size() - left]);
                }
            } else {
                difference.axis = "time [s]";
                difference.x = time;
                for (const double t : time) {
                    difference.first.push_back(interpolate(a.time, column.values, t));
                    difference.second.push_back(interpolate(b.time, other->values, t));
                }
            }
            measureReal(difference);
            result.columns.push_back(std::move(difference));
        }
        shareRanges(begin);
    }

    /** Gives all columns of a probe the same range, since that of a component near zero has no
    meaning. **/
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

    /** Load factors of all points of two paths of equilibria if they are the same. Nothing is
    interpolated between points: at a turning point, equilibria change without bound with the load
    factor. **/
    std::vector<double> findCommonFactors(const Results::Analysis& a, const Results::Analysis& b) {
        const auto list = [](const Results::Analysis& analysis) {
            std::vector<double> factors;
            if (analysis.hasPath())
                for (const auto& row : analysis.matrices.at("path")) factors.push_back(row.at(0));
            return factors;
        };
        const std::vector<double> first = list(a), second = list(b);
        const auto isNear = [](double one, double two) {
            return std::abs(one - two) <= SameLoadFactor * std::max(1.0, std::abs(one));
        };
        if (first.size() == second.size() &&
            std::equal(first.begin(), first.end(), second.begin(), isNear))
            return first;
        const auto describe = [](const std::vector<double>& factors, const std::string& name) {
            return factors.empty() ? "the equilibrium of " + name
                                   : "at " + writeGeneral(100 * factors.back(), 6) +
                                         " % of the loads in " + name;
        };
        result.notes.push_back("points of analysis '" + a.name +
                               "' lie at other loads: only the last one is compared, " +
                               describe(first, m_nameA) + ", " + describe(second, m_nameB));
        return {};
    }

    /** Times of the first that lie within the range of the second. **/
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
            addModes(a, "damping ratio " + number, "", mode, a.dampingRatio, b.dampingRatio,
                     LeastDampingRatio);
        }
        pairModes(a, b);
    }

    /** Notes the mode of `b` most similar to each mode of `a`, by the modal assurance criterion.
     **/
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
                  const std::vector<std::vector<double>>& second, double leastRange) {
        ColumnDifference difference;
        difference.analysis = a.name;
        difference.name = name;
        difference.unit = unit;
        if (!a.speeds.empty()) difference.axis = "speed";
        difference.x = a.speeds;
        for (size_t k = 0; k < std::min(first.size(), second.size()); ++k) {
            difference.first.push_back(first[k].at(mode));
            difference.second.push_back(second[k].at(mode));
        }
        measureReal(difference);
        difference.range =
            std::max({leastRange, findSize(difference.first), findSize(difference.second)});
        result.columns.push_back(std::move(difference));
    }

    void noteDifferent(const Results::Analysis& analysis, const std::string& text) {
        result.missing.push_back({Reason::Different, analysis.name, "", text});
    }

    const std::vector<std::string>& m_patterns;
    const std::string &m_nameA, &m_nameB;
};

}  // namespace

double findUnitScale(const Results::Analysis& analysis, const std::string& unit) {
    if (unit.empty()) return 0;
    double scale = 0;
    const auto energy = analysis.statistics.find("largest_kinetic_energy");
    if (unit == "J" && energy != analysis.statistics.end()) scale = energy->second;
    for (const Results::Series& series : analysis.probes) {
        if (series.column.unit != unit) continue;
        for (const std::vector<double>& row : series.rows)
            for (const double value : row)
                if (std::isfinite(value)) scale = std::max(scale, std::abs(value));
    }
    return scale;
}

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
