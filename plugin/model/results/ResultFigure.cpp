#include "simflex/model/results/ResultFigure.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"
#include "simflex/model/Spectra.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace model {
namespace {

constexpr size_t MostPanels = 12, MostCurves = 40;
constexpr double MostRatio = 30;  // of the magnitudes of probes in one panel

/** A curve not yet assigned to a panel. **/
struct Candidate {
    ChosenColumn column;
    size_t source;
    std::vector<double> x;
    std::vector<double> error;  ///< empty for runs without error bars
};

bool isErrorOfAnother(const Results::Analysis& analysis, const std::string& probe) {
    return std::any_of(
        analysis.probes.begin(), analysis.probes.end(),
        [&](const Results::Series& series) { return probe == series.column.name + ErrorSuffix; });
}

/** Errors of a column; empty if the run has no error bars. **/
std::vector<double> findErrors(const Results::Analysis& analysis, const ChosenColumn& column) {
    std::vector<double> errors;
    for (const Results::Series& series : analysis.probes) {
        if (series.column.name != column.probe + ErrorSuffix) continue;
        const auto& columns = series.column.columns;
        const auto place = std::find(columns.begin(), columns.end(), column.column);
        if (place == columns.end()) break;
        for (const auto& row : series.rows) errors.push_back(row[size_t(place - columns.begin())]);
    }
    return errors;
}

double findLargest(const std::vector<double>& values, double largest = 0) {
    for (const double value : values)
        if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
    return largest;
}

void scale(std::vector<double>& values, double size) {
    for (double& value : values) value /= size;
}

/** Keeps only the rows within the time range. **/
void cutToTimes(const std::vector<double>& time, const FigureWishes& wishes,
                std::vector<double>& values) {
    std::vector<double> kept;
    for (size_t k = 0; k < values.size(); ++k)
        if (time[k] >= wishes.from && time[k] <= wishes.to) kept.push_back(values[k]);
    values = kept;
}

ChosenColumn chooseX(const FigureSource& source, const std::string& name) {
    auto columns = chooseColumns(*source.analysis, {name});
    if (columns.size() != 1) {
        throw std::runtime_error("--x needs one number, and '" + name + "' has " +
                                 std::to_string(columns.size()) + ": name one of " +
                                 joinNames(getNames(columns)));
    }
    return columns[0];
}

std::vector<Candidate> collect(const std::vector<FigureSource>& sources, const FigureWishes& wishes,
                               std::string& xName, std::string& xUnit) {
    std::vector<Candidate> candidates;
    for (size_t s = 0; s < sources.size(); ++s) {
        const std::vector<double>& time = sources[s].analysis->time;
        std::vector<double> x = time;
        xName = "time";
        xUnit = "s";
        if (!wishes.xProbe.empty()) {
            const ChosenColumn chosen = chooseX(sources[s], wishes.xProbe);
            x = chosen.values;
            xName = chosen.name;
            xUnit = chosen.unit;
        }
        cutToTimes(time, wishes, x);
        for (ChosenColumn& column : chooseColumns(*sources[s].analysis, wishes.probes)) {
            if (wishes.probes.empty() &&
                (column.name == xName || isErrorOfAnother(*sources[s].analysis, column.probe)))
                continue;
            std::vector<double> error = findErrors(*sources[s].analysis, column);
            cutToTimes(time, wishes, error);
            cutToTimes(time, wishes, column.values);
            candidates.push_back({std::move(column), s, x, std::move(error)});
        }
    }
    if (candidates.empty()) throw std::runtime_error("there is no probe to draw");
    if (std::all_of(candidates.begin(), candidates.end(),
                    [](const Candidate& c) { return c.x.empty(); }))
        throw std::runtime_error("there is no output time to draw; is --from beyond the end?");
    return candidates;
}

struct Group {
    std::string key;
    double largest = 0;  ///< largest value in the group
    std::vector<Candidate> candidates;
};

/** True if two magnitudes can share a panel without one being too small to see. **/
bool isOfSize(double largest, double other) {
    return largest == 0 || other == 0 ||
           std::max(largest, other) < MostRatio * std::min(largest, other);
}

/** Groups in the order of their first candidates. **/
std::vector<Group> group(std::vector<Candidate> candidates, FigureWishes::Panels panels) {
    std::map<std::string, double> largest;  // by probe
    for (const Candidate& candidate : candidates) {
        double& value = largest[candidate.column.probe];
        value = findLargest(candidate.column.values, value);
    }
    std::vector<Group> groups;
    for (Candidate& candidate : candidates) {
        const std::string key = panels == FigureWishes::Panels::Together  ? ""
                                : panels == FigureWishes::Panels::Stacked ? candidate.column.probe
                                                                          : candidate.column.unit;
        const double size = largest[candidate.column.probe];
        auto found = std::find_if(groups.begin(), groups.end(), [&](const Group& entry) {
            return entry.key == key &&
                   (panels != FigureWishes::Panels::ByUnit || isOfSize(size, entry.largest));
        });
        if (found == groups.end()) found = groups.insert(groups.end(), Group{key, 0, {}});
        found->largest = std::max(found->largest, size);
        found->candidates.push_back(std::move(candidate));
    }
    return groups;
}

FigurePanel makePanel(std::vector<Candidate>& candidates, const std::vector<FigureSource>& sources,
                      double xSize) {
    std::set<std::string> probes, columns, units;
    std::set<size_t> files;
    double largest = 0;
    for (const Candidate& candidate : candidates) {
        probes.insert(candidate.column.probe);
        columns.insert(candidate.column.name);
        units.insert(candidate.column.unit);
        files.insert(candidate.source);
        largest = findLargest(candidate.column.values, largest);
    }
    if (units.size() > 1)
        throw std::runtime_error("--together needs probes of one unit, not of " +
                                 joinNames({units.begin(), units.end()}));
    if (candidates.size() > MostCurves)
        throw std::runtime_error(std::to_string(candidates.size()) +
                                 " curves in one panel are too many (at most " +
                                 std::to_string(MostCurves) + "): name probes, as in 'tip.x'");
    const DisplayUnit unit = chooseDisplayUnit(*units.begin(), largest);
    FigurePanel panel;
    const bool hasOneColumn = columns.size() == 1;
    panel.label = makeAxisLabel(hasOneColumn         ? *columns.begin()
                                : probes.size() == 1 ? *probes.begin()
                                                     : "",
                                unit.name);
    std::vector<std::string> order;
    for (Candidate& candidate : candidates) {
        const ChosenColumn& column = candidate.column;
        const size_t place =
            size_t(std::find(order.begin(), order.end(), column.name) - order.begin());
        if (place == order.size()) order.push_back(column.name);
        FigureCurve curve;
        curve.name = hasOneColumn ? "" : probes.size() == 1 ? column.column : column.name;
        if (files.size() > 1) {
            const std::string& label = sources[candidate.source].label;
            curve.name = curve.name.empty() ? label : curve.name + " (" + label + ")";
        }
        curve.color = int(hasOneColumn ? candidate.source : place);
        curve.dash = int(hasOneColumn ? candidate.source / 7 : candidate.source + place / 7);
        curve.x = std::move(candidate.x);
        curve.y = std::move(candidate.column.values);
        scale(curve.x, xSize);
        scale(curve.y, unit.size);
        curve.error = std::move(candidate.error);
        scale(curve.error, unit.size);
        panel.curves.push_back(std::move(curve));
    }
    return panel;
}

Figure makeTransientFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    std::string xName, xUnit;
    std::vector<Candidate> candidates = collect(sources, wishes, xName, xUnit);
    double largest = 0;
    for (const Candidate& candidate : candidates) largest = findLargest(candidate.x, largest);
    const DisplayUnit xScale = chooseDisplayUnit(xUnit, largest);
    Figure figure;
    figure.xLabel = makeAxisLabel(xName, xScale.name);
    auto groups = group(std::move(candidates), wishes.panels);
    if (groups.size() > MostPanels)
        throw std::runtime_error(std::to_string(groups.size()) + " panels are too many (at most " +
                                 std::to_string(MostPanels) + "): name some of the probes");
    for (Group& entry : groups)
        figure.panels.push_back(makePanel(entry.candidates, sources, xScale.size));
    if (wishes.hasPoints)
        for (FigurePanel& panel : figure.panels)
            for (FigureCurve& curve : panel.curves) curve.marks = FigureCurve::Marks::Points;
    return figure;
}

/** A speed in rad/s at the rows within the time range. **/
std::vector<double> chooseSpeed(const FigureSource& source, const FigureWishes& wishes) {
    if (wishes.speedProbe.empty()) return {};
    const auto columns = chooseColumns(*source.analysis, {wishes.speedProbe});
    if (columns.size() != 1 || columns[0].unit != "rad/s")
        throw std::runtime_error("--speed needs one number in rad/s, and '" + wishes.speedProbe +
                                 "' " +
                                 (columns.size() == 1 ? "is in '" + columns[0].unit + "'"
                                                      : "has " + std::to_string(columns.size())) +
                                 ": name a probe like {rate: JOINT}");
    std::vector<double> speed = columns[0].values;
    cutToTimes(source.analysis->time, wishes, speed);
    return speed;
}

void addByUnit(Figure& figure, const std::string& what, const std::string& unit,
               const FigureCurve& curve) {
    const std::string label = makeAxisLabel(what, unit);
    auto panel = std::find_if(figure.panels.begin(), figure.panels.end(),
                              [&](const FigurePanel& other) { return other.label == label; });
    if (panel == figure.panels.end())
        panel = figure.panels.insert(figure.panels.end(), FigurePanel{label, {}, true});
    panel->curves.push_back(curve);
}

constexpr const char* AliasAdvice =
    " vibrates up to half the sampling rate: faster vibration appears at lower frequencies "
    "(aliasing); run it with a shorter interval";

Figure makeVibrationFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    constexpr double pi = 3.14159265358979323846;
    const bool isWaterfall = wishes.vibration == FigureWishes::Vibration::Waterfall;
    const bool isSpectrum = wishes.vibration == FigureWishes::Vibration::Spectrum;
    Figure figure;
    figure.xLabel = isSpectrum ? "frequency [Hz]" : "speed [rad/s]";
    int number = 0;
    for (const FigureSource& source : sources) {
        std::vector<double> time = source.analysis->time;
        cutToTimes(source.analysis->time, wishes, time);
        const std::vector<double> speed = chooseSpeed(source, wishes);
        for (ChosenColumn& column : chooseColumns(*source.analysis, wishes.probes)) {
            cutToTimes(source.analysis->time, wishes, column.values);
            const std::string name =
                sources.size() > 1 ? column.name + " (" + source.label + ")" : column.name;
            FigureCurve curve;
            curve.name = name;
            curve.color = number++;
            curve.dash = curve.color / 7;
            const auto countShown = [&](const std::vector<double>& frequency) {
                return wishes.highest > 0
                           ? size_t(std::upper_bound(frequency.begin(), frequency.end(),
                                                     wishes.highest) -
                                    frequency.begin())
                           : frequency.size();
            };
            try {
                if (isAliased(calcSpectrum(time, column.values)))
                    wishes.warnings.push_back(name + AliasAdvice);
                if (isSpectrum) {
                    const AmplitudeSpectrum spectrum = calcSpectrum(time, column.values);
                    const auto shown = std::ptrdiff_t(countShown(spectrum.frequency));
                    const DisplayUnit unit =
                        chooseDisplayUnit(column.unit, findLargest(spectrum.amplitude));
                    curve.x.assign(spectrum.frequency.begin(), spectrum.frequency.begin() + shown);
                    curve.y.assign(spectrum.amplitude.begin(), spectrum.amplitude.begin() + shown);
                    scale(curve.y, unit.size);
                    addByUnit(figure, "amplitude", unit.name, curve);
                    continue;
                }
                if (!isWaterfall) {
                    for (const OrderTrack& track : trackOrders(time, column.values, speed,
                                                               wishes.orders, wishes.revolutions)) {
                        const DisplayUnit unit =
                            chooseDisplayUnit(column.unit, findLargest(column.values));
                        curve.name = name + ", " + writeGeneral(track.order, 6) + "×";
                        curve.color = number++;
                        curve.dash = curve.color / 7;
                        curve.x = track.speed;
                        curve.y = track.amplitude;
                        scale(curve.y, unit.size);
                        addByUnit(figure, "amplitude", unit.name, curve);
                    }
                    continue;
                }
                if (!figure.panels.empty())
                    throw std::runtime_error(
                        "a waterfall shows one number: name one probe, as in 'tip.x'");
                const Waterfall waterfall =
                    calcWaterfall(time, column.values, speed, wishes.numPieces);
                const bool rises = std::is_sorted(waterfall.speed.begin(), waterfall.speed.end()),
                           isOverSpeed = !speed.empty() && rises;
                if (!speed.empty() && !rises)
                    wishes.warnings.push_back(
                        "the speed does not rise all the time: the waterfall "
                        "is over time");
                const std::vector<double>& x = isOverSpeed ? waterfall.speed : waterfall.time;
                figure.xLabel = isOverSpeed ? "speed [rad/s]" : "time [s]";
                FigurePanel panel{"frequency [Hz]", {}};
                const size_t shown = countShown(waterfall.frequency);
                panel.map.label = makeAxisLabel(name, column.unit);
                panel.map.y.assign(waterfall.frequency.begin(),
                                   waterfall.frequency.begin() + std::ptrdiff_t(shown));
                // Resample at even positions.
                for (size_t i = 0; i < x.size(); ++i) {
                    const double share = x.size() > 1 ? double(i) / double(x.size() - 1) : 0;
                    const double at = x.front() + share * (x.back() - x.front());
                    size_t high = size_t(std::lower_bound(x.begin(), x.end(), at) - x.begin());
                    high = std::min(std::max<size_t>(high, 1), x.size() - 1);
                    const size_t low = high > 0 ? high - 1 : 0;
                    const double part = x[high] > x[low] ? (at - x[low]) / (x[high] - x[low]) : 0;
                    panel.map.x.push_back(at);
                    auto& row = panel.map.rows.emplace_back();
                    for (size_t k = 0; k < shown; ++k)
                        row.push_back((1 - part) * waterfall.amplitude[low][k] +
                                      part * waterfall.amplitude[high][k]);
                }
                if (!wishes.orders.empty() && waterfall.speed.empty())
                    throw std::runtime_error("--orders are of a speed: name it by --speed");
                for (const double order : wishes.orders) {
                    FigureCurve line;
                    line.name = writeGeneral(order, 6) + "×";
                    line.isFaint = true;
                    for (size_t i = 0; i < x.size(); ++i) {
                        const double hertz = order * std::abs(waterfall.speed[i]) / (2 * pi);
                        if (hertz > panel.map.y.back()) continue;
                        line.x.push_back(x[i]);
                        line.y.push_back(hertz);
                    }
                    panel.curves.push_back(line);
                }
                figure.panels.push_back(panel);
            } catch (const std::invalid_argument& error) {
                throw std::runtime_error("'" + name + "': " + error.what());
            }
        }
    }
    return figure;
}

/** True if an oscillating mode is damped. **/
bool hasDamping(const std::vector<FigureSource>& sources) {
    for (const FigureSource& source : sources)
        for (const auto& row : source.analysis->dampingRatio)
            for (const double ratio : row)
                if (std::abs(ratio) > 1e-9 && std::abs(ratio) < Eigenmode::Aperiodic) return true;
    return false;
}

Figure makeEigenFigure(const std::vector<FigureSource>& sources) {
    Figure figure;
    figure.xLabel = "mode";
    figure.hasWholeNumbers = true;
    FigurePanel frequencies{"natural frequency [Hz]", {}, true},
        damping{"damping ratio [%]", {}, true};
    for (size_t s = 0; s < sources.size(); ++s) {
        FigureCurve curve;
        curve.name = sources.size() > 1 ? sources[s].label : "";
        curve.color = int(s);
        curve.marks = FigureCurve::Marks::Stems;
        const size_t count = sources[s].analysis->frequency.at(0).size();
        for (size_t k = 0; k < count; ++k)  // side by side, so that none hides another
            curve.x.push_back(double(k + 1) + 0.5 *
                                                  (double(s) + 0.5 - 0.5 * double(sources.size())) /
                                                  double(sources.size()));
        curve.y = sources[s].analysis->frequency[0];
        frequencies.curves.push_back(curve);
        curve.y = sources[s].analysis->dampingRatio.at(0);
        scale(curve.y, 0.01);
        damping.curves.push_back(curve);
    }
    figure.panels.push_back(frequencies);
    if (hasDamping(sources)) figure.panels.push_back(damping);
    return figure;
}

/** Values of a mode over the speeds. **/
FigureCurve makeModeCurve(const FigureSource& source, size_t file, size_t mode, bool isSeveral,
                          const std::vector<std::vector<double>>& table, double unitSize) {
    FigureCurve curve;
    if (isSeveral) {
        curve.name = mode == 0 ? source.label : "";
    } else {
        curve.name = "mode " + std::to_string(mode + 1);
    }
    curve.color = int(isSeveral ? file : mode);
    curve.dash = int(isSeveral ? file : mode / 7);
    curve.marks = FigureCurve::Marks::Points;
    curve.x = source.analysis->speeds;
    for (size_t k = 0; k < table.size(); ++k) {
        const double damping = source.analysis->dampingRatio.at(k).at(mode);
        const bool oscillates = std::abs(damping) < Eigenmode::Aperiodic;
        curve.y.push_back(oscillates ? table[k].at(mode) / unitSize : NAN);
    }
    return curve;
}

/** Draws modes with coincident curves once, with the names of all. **/
void joinAlike(FigurePanel& panel) {
    constexpr double invisible = 2e-3;  // of the largest value
    double largest = 0;
    for (const FigureCurve& curve : panel.curves) largest = findLargest(curve.y, largest);
    std::vector<FigureCurve> drawn;
    for (FigureCurve& curve : panel.curves) {
        const auto alike = std::find_if(drawn.begin(), drawn.end(), [&](const FigureCurve& other) {
            if (other.x != curve.x || other.name.empty() || curve.name.empty()) return false;
            for (size_t k = 0; k < curve.y.size(); ++k)
                if (!(std::abs(curve.y[k] - other.y[k]) <= invisible * largest)) return false;
            return true;
        });
        if (alike == drawn.end())
            drawn.push_back(std::move(curve));
        else
            alike->name += " = " + curve.name;
    }
    panel.curves = std::move(drawn);
}

Figure makeCampbellFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    constexpr double pi = 3.14159265358979323846;
    Figure figure;
    figure.xLabel = wishes.orders.empty() ? "speed" : "speed [rad/s]";
    FigurePanel frequencies{"natural frequency [Hz]", {}, true},
        damping{"damping ratio [%]", {}, false};
    double highest = 0;
    for (size_t s = 0; s < sources.size(); ++s) {
        const Results::Analysis& analysis = *sources[s].analysis;
        const size_t numModes = analysis.frequency.empty() ? 0 : analysis.frequency[0].size();
        for (size_t mode = 0; mode < numModes; ++mode) {
            const bool isSeveral = sources.size() > 1;
            frequencies.curves.push_back(
                makeModeCurve(sources[s], s, mode, isSeveral, analysis.frequency, 1));
            damping.curves.push_back(
                makeModeCurve(sources[s], s, mode, isSeveral, analysis.dampingRatio, 0.01));
            highest = findLargest(frequencies.curves.back().y, highest);
        }
    }
    for (FigurePanel* panel : {&frequencies, &damping}) joinAlike(*panel);
    for (const double order : wishes.orders) {
        FigureCurve line;
        line.name = writeGeneral(order, 6) + "×";
        line.isFaint = true;
        for (const double speed : sources.at(0).analysis->speeds) {
            const double hertz = order * std::abs(speed) / (2 * pi);
            if (hertz > 1.2 * highest) continue;  // lines far above the modes would compress them
            line.x.push_back(speed);
            line.y.push_back(hertz);
        }
        frequencies.curves.push_back(line);
    }
    if (frequencies.curves.empty()) throw std::runtime_error("the Campbell diagram has no modes");
    figure.panels.push_back(frequencies);
    if (hasDamping(sources)) figure.panels.push_back(damping);
    return figure;
}

/** True if the range is wide enough for a logarithmic axis. **/
bool isWide(const std::vector<double>& frequencies) {
    return frequencies.front() > 0 && frequencies.back() > 5 * frequencies.front();
}

/** Bode diagram: magnitudes by unit, then unwrapped phases. **/
Figure makeBodeFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    Figure figure;
    figure.xLabel = "frequency [Hz]";
    figure.isLogarithmic = isWide(sources[0].analysis->frequency.at(0));
    FigurePanel phases{"phase [degrees]", {}};
    phases.hasDegrees = true;
    std::map<std::string, size_t> panelOfUnit;
    for (size_t s = 0; s < sources.size(); ++s) {
        const std::vector<double>& frequencies = sources[s].analysis->frequency.at(0);
        const auto responses = chooseResponses(*sources[s].analysis, wishes.probes);
        for (size_t r = 0; r < responses.size(); ++r) {
            const ChosenResponse& response = responses[r];
            if (findLargest(response.magnitude) == 0) continue;
            FigureCurve curve;
            curve.name =
                sources.size() > 1 ? response.name + ", " + sources[s].label : response.name;
            curve.color = int(r);
            curve.dash = int(s);
            if (wishes.hasPoints) curve.marks = FigureCurve::Marks::Points;
            curve.x = frequencies;
            curve.y = response.magnitude;
            cutToTimes(frequencies, wishes, curve.x);
            cutToTimes(frequencies, wishes, curve.y);
            const auto found = panelOfUnit.emplace(response.unit, figure.panels.size());
            if (found.second)
                figure.panels.push_back(
                    {makeAxisLabel("magnitude", response.unit), {}, false, true});
            figure.panels[found.first->second].curves.push_back(curve);
            curve.y = response.phase;
            for (size_t k = 1; k < curve.y.size(); ++k)
                curve.y[k] -= 360 * std::round((curve.y[k] - curve.y[k - 1]) / 360);
            cutToTimes(frequencies, wishes, curve.y);
            phases.curves.push_back(curve);
        }
    }
    if (phases.curves.empty()) throw std::runtime_error("all of these responses are zero");
    if (phases.curves.size() > MostCurves)
        throw std::runtime_error(std::to_string(phases.curves.size()) +
                                 " responses are too many (at most " + std::to_string(MostCurves) +
                                 "): name some of the outputs");
    figure.panels.push_back(phases);
    return figure;
}

/** Nyquist diagram: the complex response as frequency rises. **/
Figure makeNyquistFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    constexpr double degree = 3.14159265358979323846 / 180;
    Figure figure;
    figure.hasEqualScales = true;
    std::string unit;
    double largest = 0;
    FigurePanel panel;
    for (size_t s = 0; s < sources.size(); ++s) {
        const std::vector<double>& frequencies = sources[s].analysis->frequency.at(0);
        const auto responses = chooseResponses(*sources[s].analysis, wishes.probes);
        for (size_t r = 0; r < responses.size(); ++r) {
            const ChosenResponse& response = responses[r];
            if (findLargest(response.magnitude) == 0) continue;
            if (!panel.curves.empty() && response.unit != unit)
                throw std::runtime_error(
                    "Nyquist's diagram has one scale: name outputs of one "
                    "unit, not of '" +
                    unit + "' and '" + response.unit + "'");
            unit = response.unit;
            FigureCurve curve;
            double top = 0, topFrequency = 0;
            for (size_t k = 0; k < frequencies.size(); ++k) {
                if (frequencies[k] < wishes.from || frequencies[k] > wishes.to) continue;
                curve.x.push_back(response.magnitude[k] * std::cos(response.phase[k] * degree));
                curve.y.push_back(response.magnitude[k] * std::sin(response.phase[k] * degree));
                if (response.magnitude[k] > top)
                    top = response.magnitude[k], topFrequency = frequencies[k];
            }
            if (curve.x.empty()) continue;
            largest = std::max(largest, top);
            curve.name =
                (sources.size() > 1 ? response.name + ", " + sources[s].label : response.name) +
                ", largest at " + writeGeneral(topFrequency, 4) + " Hz";
            curve.color = int(r);
            curve.dash = int(s);
            if (wishes.hasPoints) curve.marks = FigureCurve::Marks::Points;
            panel.curves.push_back(curve);
        }
    }
    if (panel.curves.empty())
        throw std::runtime_error("all of these responses are zero, or have no frequency there");
    if (panel.curves.size() > MostCurves)
        throw std::runtime_error(std::to_string(panel.curves.size()) +
                                 " responses are too many (at most " + std::to_string(MostCurves) +
                                 "): name some of the outputs");
    figure.xLabel = makeAxisLabel("real part", unit);
    panel.label = makeAxisLabel("imaginary part", unit);
    figure.panels.push_back(std::move(panel));
    return figure;
}

/** Interpolates a response: log–log for magnitudes, along the shorter way for phases; NaN outside
the range. **/
std::pair<double, double> interpolateResponse(const std::vector<double>& frequencies,
                                              const ChosenResponse& response, double frequency) {
    const auto upper = std::lower_bound(frequencies.begin(), frequencies.end(), frequency);
    if (upper == frequencies.end() || (upper == frequencies.begin() && *upper > frequency))
        return {NAN, NAN};
    const size_t b = size_t(upper - frequencies.begin());
    if (*upper == frequency) return {response.magnitude[b], response.phase[b]};
    const size_t a = b - 1;
    const double part = (frequency - frequencies[a]) / (frequencies[b] - frequencies[a]),
                 low = response.magnitude[a], high = response.magnitude[b];
    double turn = response.phase[b] - response.phase[a];
    turn -= 360 * std::round(turn / 360);
    double phase = response.phase[a] + part * turn;
    phase -= 360 * std::round(phase / 360);
    return {low > 0 && high > 0 ? low * std::pow(high / low, part) : low + part * (high - low),
            phase};
}

/** Magnitude and phase of one response over frequency and a parameter. **/
Figure makeMapFigure(std::vector<FigureSource> sources, const FigureWishes& wishes) {
    constexpr double pi = 3.14159265358979323846;
    constexpr size_t numFrequencies = 600, numValues = 400;
    std::stable_sort(sources.begin(), sources.end(),
                     [](const auto& a, const auto& b) { return a.value < b.value; });
    std::vector<ChosenResponse> responses;
    double from = INFINITY, to = 0;
    for (size_t k = 0; k < sources.size(); ++k) {
        if (k > 0 && sources[k].value == sources[k - 1].value)
            throw std::runtime_error("several cases have " + wishes.mapOver + " = " +
                                     writeGeneral(sources[k].value, 6) +
                                     ": a map is over one parameter");
        const auto all = chooseResponses(*sources[k].analysis, wishes.probes);
        if (all.size() != 1)
            throw std::runtime_error("a map shows one response, and there are " +
                                     std::to_string(all.size()) + ": name one output" +
                                     (sources[k].analysis->inputs.size() > 1
                                          ? ", and have one input"
                                          : ", such as '" + all.at(0).output + "'"));
        responses.push_back(all[0]);
        const auto& frequencies = sources[k].analysis->frequency.at(0);
        from = std::min(from, frequencies.front());
        to = std::max(to, frequencies.back());
    }
    if (sources.size() < 2)
        throw std::runtime_error("a map wants two values of " + wishes.mapOver + " or more");
    from = std::max(from, wishes.from);
    to = std::min({to, wishes.to, wishes.highest > 0 ? wishes.highest : to});
    if (!(to > from)) throw std::runtime_error("there is no frequency to draw");
    Figure figure;
    figure.xLabel = wishes.mapOver;
    FigurePanel magnitude{"frequency [Hz]", {}}, phase{"frequency [Hz]", {}};
    phase.map.scale = FigureMap::Scale::Angles;
    magnitude.map.label = makeAxisLabel(responses[0].name, responses[0].unit);
    phase.map.label = "phase of " + responses[0].name + " [deg]";
    for (size_t i = 0; i < numFrequencies; ++i)
        magnitude.map.y.push_back(from + (to - from) * double(i) / double(numFrequencies - 1));
    phase.map.y = magnitude.map.y;
    // Resample at even positions by the nearest value, since responses between resonances are
    // unknown.
    const double first = sources.front().value, last = sources.back().value;
    std::vector<std::vector<double>> magnitudes, phases;
    for (size_t k = 0; k < sources.size(); ++k) {
        auto &own = magnitudes.emplace_back(), &ownPhase = phases.emplace_back();
        for (const double frequency : magnitude.map.y) {
            const auto at =
                interpolateResponse(sources[k].analysis->frequency.at(0), responses[k], frequency);
            own.push_back(at.first);
            ownPhase.push_back(at.second);
        }
        const auto& frequencies = sources[k].analysis->frequency.at(0);
        for (size_t i = 0; i < frequencies.size(); ++i) {
            if (frequencies[i] < from || frequencies[i] > to) continue;
            magnitude.map.samples.push_back(
                {sources[k].value, frequencies[i], responses[k].magnitude[i]});
            phase.map.samples.push_back({sources[k].value, frequencies[i], responses[k].phase[i]});
        }
    }
    for (size_t i = 0; i < numValues; ++i) {
        const double value = first + (last - first) * double(i) / double(numValues - 1);
        size_t nearest = 0;
        for (size_t k = 1; k < sources.size(); ++k)
            if (std::abs(sources[k].value - value) < std::abs(sources[nearest].value - value))
                nearest = k;
        magnitude.map.x.push_back(value);
        magnitude.map.rows.push_back(magnitudes[nearest]);
        phase.map.rows.push_back(phases[nearest]);
    }
    phase.map.x = magnitude.map.x;
    for (const double order : wishes.orders) {
        FigureCurve line;
        line.name = writeGeneral(order, 6) + "×";
        line.isFaint = true;
        for (const double value : magnitude.map.x) {
            const double hertz = order * std::abs(value) / (2 * pi);
            if (hertz < from || hertz > to) continue;
            line.x.push_back(value);
            line.y.push_back(hertz);
        }
        magnitude.curves.push_back(line);
    }
    figure.panels.push_back(std::move(magnitude));
    figure.panels.push_back(std::move(phase));
    return figure;
}

}  // namespace

namespace {

/** A path of equilibria over the load factor. The factor is added as a probe, so that any other
probe can be the x axis instead. **/
Figure makePathFigure(const std::vector<FigureSource>& sources, FigureWishes wishes) {
    std::vector<Results::Analysis> paths;
    for (const FigureSource& source : sources) {
        if (!source.analysis->hasPath())
            throw std::runtime_error("analysis '" + source.analysis->name +
                                     "' is static: one number for each probe, which is no curve; "
                                     "with `path` it is one");
        paths.push_back(*source.analysis);
        Results::Analysis& path = paths.back();
        Results::Series factor{{"load factor", "", {""}}, {}};
        for (const auto& row : path.matrices.at("path")) {
            factor.rows.push_back({row[0]});
            path.time.push_back(0);  // all at the same time
        }
        path.probes.push_back(factor);
    }
    std::vector<FigureSource> changed = sources;
    for (size_t k = 0; k < sources.size(); ++k) changed[k].analysis = &paths[k];
    if (wishes.xProbe.empty()) wishes.xProbe = "load factor";
    return makeTransientFigure(changed, wishes);
}

}  // namespace

Figure makeResultFigure(const std::vector<FigureSource>& sources, const FigureWishes& wishes) {
    const std::string& type = sources.at(0).analysis->type;
    for (const FigureSource& source : sources)
        if (source.analysis->type != type)
            throw std::runtime_error("analysis '" + source.analysis->name + "' of " + source.label +
                                     " is " + source.analysis->type + ", the first is " + type +
                                     ": they cannot share a figure; choose by --analysis");
    if (type == "linear")
        throw std::runtime_error("analysis '" + sources[0].analysis->name +
                                 "' is linear: matrices, which are no curves");
    if ((wishes.isNyquist || !wishes.mapOver.empty()) && type != "frequency_response")
        throw std::runtime_error("analysis '" + sources[0].analysis->name + "' is " + type +
                                 ": --nyquist and --map are of frequency_response");
    if (type == "frequency_response")
        return wishes.isNyquist          ? makeNyquistFigure(sources, wishes)
               : !wishes.mapOver.empty() ? makeMapFigure(sources, wishes)
                                         : makeBodeFigure(sources, wishes);
    if (type == "static") return makePathFigure(sources, wishes);
    if (type == "eigen") return makeEigenFigure(sources);
    if (type == "campbell") return makeCampbellFigure(sources, wishes);
    if (!wishes.speedProbe.empty() && wishes.orders.empty() &&
        wishes.vibration != FigureWishes::Vibration::Waterfall)
        throw std::runtime_error("--speed is of --waterfall, or of --orders 1,2 …");
    if (wishes.vibration != FigureWishes::Vibration::None || !wishes.speedProbe.empty())
        return makeVibrationFigure(sources, wishes);
    if (!wishes.orders.empty())
        throw std::runtime_error("--orders are of a speed: name it by --speed");
    return makeTransientFigure(sources, wishes);
}

}  // namespace model
}  // namespace simflex
