#include "simflex/cli/model/RunSummary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/NumberText.h"
#include "simflex/body/JointEquations.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/model/file/ModelReader.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/Comparison.h"
#include "simflex/model/results/CriticalSpeeds.h"
#include "simflex/model/results/Extremes.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace cli {

namespace {

double getStatistic(const Results::Analysis& analysis, const std::string& name) {
    const auto found = analysis.statistics.find(name);
    return found == analysis.statistics.end() ? 0 : found->second;
}

constexpr size_t MostEvents = 20;  // events printed at most

template <class Column>
std::string makeLabel(const Column& column) {
    return makeAxisLabel(column.name, column.unit);
}

void print(const TextTable& table) {
    if (!table.isEmpty()) writeOut("%s", table.format("  ").c_str());
}

/** Prints round-off as zero. **/
class RoundOff {
public:
    /** @param accuracy  of displacements [m] **/
    RoundOff(const Results::Analysis& analysis, double accuracy)
        : m_analysis(analysis), m_accuracy(accuracy) {}

    std::string format(double value, const std::string& unit) const {
        return formatNumber(std::abs(value) <= find(unit) ? 0 : value);
    }

private:
    double find(const std::string& unit) const {
        constexpr double Least = 1e-30, OfScale = 1e-13, OfAccuracy = 1e-8;
        const bool isLength = unit == "m" || unit == "rad";
        return std::max({Least, OfScale * findUnitScale(m_analysis, unit),
                         isLength ? OfAccuracy * m_accuracy : 0});
    }

    const Results::Analysis& m_analysis;
    double m_accuracy;
};

void printTransient(const Results::Analysis& analysis, const RoundOff& roundOff) {
    writeOut("%s: transient", analysis.name.c_str());
    if (!analysis.time.empty())
        writeOut(", t = %.6g to %.6g s in %zu rows", analysis.time.front(), analysis.time.back(),
                 analysis.time.size());
    writeOut("%s\n", analysis.isComplete ? "" : "; NOT COMPLETE");
    if (analysis.statistics.count("steps"))
        writeOut(
            "  %.0f steps, %.0f Newton iterations; rejected steps: %.0f for their error, %.0f not "
            "converged\n"
            "  energy balance: off by at most %.3g J, largest kinetic energy %.3g J\n",
            getStatistic(analysis, "steps"), getStatistic(analysis, "newton_iterations"),
            getStatistic(analysis, "error_test_failures"),
            getStatistic(analysis, "convergence_failures"),
            getStatistic(analysis, "largest_energy_error"),
            getStatistic(analysis, "largest_kinetic_energy"));
    if (analysis.time.empty() || analysis.probes.empty()) return;
    TextTable table({"probe", "least", "at [s]", "largest", "at [s]", "at the end"});
    for (const ChosenColumn& column : chooseColumns(analysis, {})) {
        const std::vector<double>& values = column.values;
        const auto [least, largest] = findExtremes(values.begin(), values.end());
        const auto formatTime = [&](auto place) {
            return formatNumber(analysis.time[size_t(place - values.begin())]);
        };
        const auto format = [&](double value) { return roundOff.format(value, column.unit); };
        table.add({makeLabel(column), format(*least), formatTime(least), format(*largest),
                   formatTime(largest), format(values.back())});
    }
    print(table);
}

void printEvents(const Results::Analysis& analysis) {
    for (size_t i = 0; i < std::min(analysis.events.size(), MostEvents); ++i)
        writeOut("  event '%s' at t = %.9g s\n", analysis.events[i].name.c_str(),
                 analysis.events[i].time);
    if (analysis.events.size() > MostEvents)
        writeOut("  and %zu events more, which the result file has\n",
                 analysis.events.size() - MostEvents);
}

/** Prints the notable points of a path: its ends, limit points and bifurcations. **/
void printPath(const Results::Analysis& analysis, const RoundOff& roundOff) {
    constexpr size_t MostColumns = 5;
    const std::vector<std::vector<double>>& path = analysis.matrices.at("path");
    std::vector<ChosenColumn> columns = chooseColumns(analysis, {});
    if (columns.size() > MostColumns) columns.resize(MostColumns);
    std::vector<std::string> titles{"loads [%]", "point", "stable"};
    for (const ChosenColumn& column : columns) titles.push_back(makeLabel(column));
    TextTable table(titles);
    for (size_t k = 0; k < path.size(); ++k) {
        const int kind = int(path[k].at(2));
        const bool isEnd = k == 0 || k + 1 == path.size();
        if (!isEnd && kind == 0) continue;
        std::vector<std::string> cells{formatNumber(100 * path[k][0]),
                                       kind == 1   ? "limit point"
                                       : kind == 2 ? "bifurcation"
                                       : k == 0    ? "first"
                                                   : "last",
                                       kind != 0         ? "-"
                                       : path[k][1] == 0 ? "yes"
                                                         : "no"};
        for (const ChosenColumn& column : columns)
            cells.push_back(roundOff.format(column.values.at(k), column.unit));
        table.add(cells);
    }
    writeOut("  path of %zu equilibria\n", path.size());
    print(table);
}

void printStatic(const Results::Analysis& analysis, const RoundOff& roundOff) {
    writeOut("%s: static equilibrium, %.0f iterations\n", analysis.name.c_str(),
             getStatistic(analysis, "iterations"));
    TextTable table({"probe", "value"});
    for (const ChosenColumn& column : chooseColumns(analysis, {}))
        table.add({makeLabel(column), roundOff.format(column.values.back(), column.unit)});
    print(table);
    if (analysis.hasPath()) printPath(analysis, roundOff);
}

constexpr double Aperiodic = Eigenmode::Aperiodic;

void printEigen(const Results::Analysis& analysis) {
    const double numRigid = getStatistic(analysis, "rigid_motions");
    writeOut("%s: natural modes", analysis.name.c_str());
    if (numRigid > 0)
        writeOut(", besides %.0f motion%s that nothing restores", numRigid,
                 numRigid == 1 ? "" : "s");
    writeOut("\n  mode  frequency [Hz]  damping ratio\n");
    const double free = getStatistic(analysis, "resolution");
    const size_t count = analysis.frequency.empty() ? 0 : analysis.frequency[0].size();
    for (size_t k = 0; k < count; ++k) {
        const double frequency = analysis.frequency[0][k], damping = analysis.dampingRatio[0][k];
        const size_t first = k;
        if (frequency <= free) {
            // A non-oscillating motion has two modes, one decaying and one growing.
            const bool isPair = std::abs(damping) >= Aperiodic && k + 1 < count &&
                                analysis.dampingRatio[0][k + 1] * damping < 0 &&
                                analysis.frequency[0][k + 1] <= free;
            k += isPair;
        }
        std::string number = std::to_string(first + 1);
        if (k > first) number += "-" + std::to_string(k + 1);
        if (frequency <= free)
            writeOut("  %4s  %14.7g  rigid-body mode: nothing restores it but round-off\n",
                     number.c_str(), frequency);
        else if (std::abs(damping) < Aperiodic)
            writeOut("  %4s  %14.7g  %13.3g\n", number.c_str(), frequency, damping);
        else
            writeOut("  %4s  %14s  no oscillation: %s by a factor of e in %.4g s\n", number.c_str(),
                     "-", damping > 0 ? "decays" : "UNSTABLE, grows",
                     1 / (2 * SimTK::Pi * frequency));
    }
}

void printParticipation(const Results::Analysis& analysis) {
    const auto found = analysis.matrices.find("effective_mass");
    if (found == analysis.matrices.end()) return;
    const double mass = getStatistic(analysis, "mass");
    writeOut("  effective mass [%% of %.6g kg] along\n  mode         x         y         z\n",
             mass);
    double sums[3] = {0, 0, 0};
    for (size_t k = 0; k < found->second.size(); ++k) {
        writeOut("  %4zu", k + 1);
        for (size_t a = 0; a < 3; ++a) {
            const double part = 100 * found->second[k][a] / mass;
            sums[a] += part;
            writeOut(" %9.3f", part);
        }
        writeOut("\n");
    }
    writeOut("   all %9.3f %9.3f %9.3f\n", sums[0], sums[1], sums[2]);
}

void printCampbell(const Results::Analysis& analysis) {
    writeOut("%s: natural frequencies [Hz] over speed\n", analysis.name.c_str());
    for (size_t i = 0; i < analysis.speeds.size(); ++i) {
        writeOut("  %12.6g:", analysis.speeds[i]);
        for (size_t k = 0; k < analysis.frequency[i].size(); ++k) {
            const double frequency = analysis.frequency[i][k],
                         damping = analysis.dampingRatio[i][k];
            if (damping <= -Aperiodic)
                writeOut(" %11s", "unstable");
            else if (std::isnan(frequency) || damping >= Aperiodic)
                writeOut(" %11s", "-");
            else
                writeOut(" %11.6g", frequency);
        }
        writeOut("\n");
    }
    const std::vector<double> critical = findCriticalSpeeds(analysis);
    if (std::all_of(critical.begin(), critical.end(), [](double c) { return std::isnan(c); }))
        return;
    writeOut("  critical [rad/s], once a revolution:\n  %12s:", "");
    for (const double speed : critical)
        if (std::isnan(speed))
            writeOut(" %11s", "-");
        else
            writeOut(" %11.6g", speed);
    writeOut("\n");
}

void printLinear(const Results::Analysis& analysis) {
    writeOut("%s: linear model, %s, %s, %s\n", analysis.name.c_str(),
             formatCount(analysis.matrices.at("A").size(), "state", "states").c_str(),
             formatCount(analysis.inputs.size(), "input", "inputs").c_str(),
             formatCount(analysis.outputs.size(), "output", "outputs").c_str());
}

void printResponse(const Results::Analysis& analysis) {
    writeOut("%s: frequency response, %s from %.6g to %.6g Hz\n", analysis.name.c_str(),
             formatCount(analysis.frequency.at(0).size(), "frequency", "frequencies").c_str(),
             analysis.frequency[0].front(), analysis.frequency[0].back());
    TextTable table({"response", "largest", "at [Hz]", "phase [deg]"});
    for (const ChosenResponse& response : chooseResponses(analysis, {})) {
        const auto largest = std::max_element(response.magnitude.begin(), response.magnitude.end());
        const size_t at = size_t(largest - response.magnitude.begin());
        table.add({makeAxisLabel(response.name, response.unit), formatNumber(*largest),
                   formatNumber(analysis.frequency[0][at]), formatNumber(response.phase[at])});
    }
    print(table);
    if (!analysis.matrices.count("density")) return;
    TextTable values({"random output", "effective value"});
    for (size_t i = 0; i < analysis.outputs.size(); ++i)
        values.add({makeAxisLabel(analysis.outputs[i], analysis.outputUnits[i]),
                    formatNumber(getStatistic(analysis, "rms of " + analysis.outputs[i]))});
    // Statistics that belong to no output: von Mises stress, from its components.
    const std::string prefix = "rms of ";
    for (const auto& [statistic, value] : analysis.statistics) {
        if (statistic.compare(0, prefix.size(), prefix) != 0) continue;
        const std::string name = statistic.substr(prefix.size());
        if (std::find(analysis.outputs.begin(), analysis.outputs.end(), name) ==
            analysis.outputs.end())
            values.add({makeAxisLabel(name, "Pa"), formatNumber(value)});
    }
    print(values);
}

void printAnalysis(const Results::Analysis& analysis, const ModelRun& run) {
    const RoundOff roundOff(analysis,
                            run.getModel().getFile().get("solver").get("accuracy").getNumber());
    if (analysis.type == "transient") printTransient(analysis, roundOff);
    if (analysis.type == "static") printStatic(analysis, roundOff);
    if (analysis.type == "eigen") {
        printEigen(analysis);
        printParticipation(analysis);
    }
    if (analysis.type == "campbell") printCampbell(analysis);
    if (analysis.type == "linear") printLinear(analysis);
    if (analysis.type == "frequency_response") printResponse(analysis);
    printEvents(analysis);
    for (const std::string& warning : analysis.warnings)
        if (!isWarningInSight(analysis.name + ": " + warning))
            writeOut("  warning: %s\n", warning.c_str());
    for (const std::string& remark : run.getRemarks(analysis.name))
        writeOut("  %s\n", remark.c_str());
}

}  // namespace

void printAssembly(ModelRun& run) {
    const Model& model = run.getModel();
    const ModelRun::Assembly assembly = run.assemble();
    writeOut("%s: %s, %s, %s\n", run.getText().path.c_str(),
             formatCount(model.getBodies().size(), "body", "bodies").c_str(),
             formatCount(model.getJoints().size(), "joint", "joints").c_str(),
             formatCount(model.getMotions().size(), "motion", "motions").c_str());
    for (const Model::BodyEntry& body : model.getBodies()) {
        if (body.flexible)
            writeOut("  body %s: flexible, %s%s\n", body.name.c_str(),
                     formatCount(size_t(body.flexible->getNumModes()), "mode", "modes").c_str(),
                     body.flexible->isRigid(assembly.state) ? ", held rigid" : "");
        else
            writeOut("  body %s: rigid, %.6g kg\n", body.name.c_str(),
                     double(body.mobod.getBodyMass(assembly.state)));
    }
    for (const Model::JointEntry& entry : model.getJoints())
        writeOut(
            "  joint %s: %s of %s and %s, %s\n", entry.name.c_str(),
            entry.joint.getEquations().getKind(), entry.joint.getFrameF().getName().c_str(),
            entry.joint.getFrameM().getName().c_str(),
            formatCount(size_t(entry.joint.getNumEquations()), "equation", "equations").c_str());
    for (const std::string& line : assembly.moved)
        writeOut("  moved from its place: %s\n", line.c_str());
    for (const std::string& line : assembly.redundant) writeOut("  redundant: %s\n", line.c_str());
    for (const Probe& probe : run.getProbes().getProbes())
        writeOut("  probe %s: %s%s%s\n", probe.name.c_str(),
                 formatCount(probe.columns.size(), "column", "columns").c_str(),
                 probe.unit.empty() ? "" : ", ", probe.unit.c_str());
    const ModelValue analyses = model.getFile().get("analyses");
    for (const std::string& name : analyses.getKeys())
        writeOut("  analysis %s: %s%s\n", name.c_str(),
                 analyses.get(name).get("type").getText().c_str(),
                 run.isWanted(name) ? "" : ", left out");
    for (const std::string& warning : assembly.warnings)
        writeOut("  warning: %s\n", warning.c_str());
    writeOut("assembled: largest error of a joint %.2g; results would go to %s\n",
             assembly.largestError, run.getResultPath().c_str());
}

std::string describeSeconds(const ModelRun& run) {
    double integration = 0, output = 0;
    FmuCost fmus;
    for (const Results::Analysis& analysis :
         readResults(run.getResultPath(), ReadStates::No).analyses) {
        if (!run.isWanted(analysis.name)) continue;
        integration += getStatistic(analysis, "integration_seconds");
        output += getStatistic(analysis, "output_seconds");
        fmus += {getStatistic(analysis, "fmu_exchanges"), getStatistic(analysis, "fmu_seconds"),
                 getStatistic(analysis, "fmu_library_seconds")};
    }
    if (integration == 0) return {};
    std::string text = "integration " + writeGeneral(integration, 3) + " s, output " +
                       writeGeneral(output, 3) + " s";
    if (fmus.exchanges > 0)
        text += ", FMUs " + writeGeneral(fmus.seconds, 3) + " s (" +
                writeGeneral(fmus.exchanges, 9) + " exchanges of " +
                writeGeneral(1e6 * (fmus.seconds - fmus.librarySeconds) / fmus.exchanges, 2) +
                " µs each, and the time in their libraries)";
    return text;
}

void printSummary(const ModelRun& run) {
    const Results results = readResults(run.getResultPath(), ReadStates::No);
    for (const std::string& warning : results.warnings)
        if (!isWarningInSight(warning)) writeOut("warning: %s\n", warning.c_str());
    for (const Results::Analysis& analysis : results.analyses)
        if (run.isWanted(analysis.name)) printAnalysis(analysis, run);
    writeOut("results: %s\n", run.getResultPath().c_str());
}

void printComplete(const ModelRun& run) {
    const Results results = readResults(run.getResultPath(), ReadStates::No);
    bool hasAny = false;
    for (const Results::Analysis& analysis : results.analyses) {
        if (!run.isWanted(analysis.name) || !analysis.isComplete) continue;
        printAnalysis(analysis, run);
        hasAny = true;
    }
    if (hasAny) writeOut("results so far: %s\n", run.getResultPath().c_str());
    std::fflush(stdout);  // the error message comes last, in logs, too
}

namespace {

ModelValue readSection(const ResultHeader& header, const char* section) {
    return readModel({header.modelPath, header.modelText, header.settings}).get(section);
}

ModelValue readSolver(const ResultHeader& header) {
    return readSection(header, "solver");
}

double readAccuracy(const ResultHeader& header) {
    return readSolver(header).get("accuracy").getNumber();
}

std::string describeRelative(const ColumnDifference& column) {
    return writeGeneral(100 * column.getRelative(), 3) + " %";
}

bool hasColumns(const ResultComparison& comparison, const std::string& analysis) {
    return std::any_of(comparison.columns.begin(), comparison.columns.end(),
                       [&](const ColumnDifference& column) { return column.analysis == analysis; });
}

/** @param describe  formats a difference relative to the probe's range **/
template <class Describe>
void printColumns(const std::string& title, const Results::Analysis& of,
                  const ResultComparison& comparison, const Describe& describe) {
    const std::string& analysis = of.name;
    const bool isResponse = of.type == "frequency_response";
    TextTable table({isResponse ? "response" : "probe", "largest",
                     isResponse              ? "at [Hz]"
                     : of.type == "campbell" ? "at speed"
                                             : "at [s]",
                     "rms", "of range"});
    for (const ColumnDifference& column : comparison.columns)
        if (column.analysis == analysis)
            table.add({makeLabel(column), formatNumber(column.largest),
                       column.x.empty() ? "-" : formatNumber(column.time), formatNumber(column.rms),
                       describe(column)});
    writeOut("%s\n", title.c_str());
    print(table);
}

/** For frequency responses: prints the frequencies compared. **/
void printNotes(const ResultComparison& comparison) {
    for (const std::string& note : comparison.notes)
        if (note.compare(0, 11, "frequencies") == 0) writeOut("  %s\n", note.c_str());
}

}  // namespace

void printDifference(const Results& flexible, const Results& rigid) {
    const double accuracy = readAccuracy(flexible.header);
    const ResultComparison comparison = compareResults(flexible, rigid, {}, "flexible", "rigid");
    bool hasSmall = false;
    const auto describe = [&](const ColumnDifference& column) -> std::string {
        if (column.unit != "m" || column.largest > accuracy) return describeRelative(column);
        hasSmall |= column.largest > 0;
        return column.largest > 0 ? "*" : "-";
    };
    bool hasAny = false;
    for (const Results::Analysis& a : flexible.analyses) {
        if (!seekNamed(rigid.analyses, a.name)) continue;
        const bool isResponse = a.type == "frequency_response" && hasColumns(comparison, a.name);
        if (a.probes.empty() && !isResponse) continue;
        printColumns(a.name + ": flexible against rigid", a, comparison, describe);
        hasAny = true;
    }
    printNotes(comparison);
    if (!hasAny)
        writeOut(
            "nothing to compare: no probe, and no frequency response, that both models have was "
            "run\n");
    if (hasSmall)
        writeOut("  * less than the accuracy of the simulation, %g m (solver.accuracy)\n",
                 accuracy);
}

void printErrorBars(const Results& run, const ErrorBars& bars) {
    for (const Results::Analysis& a : run.analyses) {
        if (hasColumns(bars.comparison, a.name))
            printColumns(a.name + ": errors by what the parts have left out", a, bars.comparison,
                         describeRelative);
    }
    printNotes(bars.comparison);
    for (const NotCompared& missing : bars.comparison.missing)
        writeOut("  no error bar: %s\n", missing.text.c_str());
    for (const ModeAdvice& advice : bars.advice)
        if (advice.wanted > 0)
            writeOut("  %s: %d modes instead of %d for %g %% of %s\n", advice.part.c_str(),
                     advice.wanted, advice.modes, 100 * TrustedError, advice.probe.c_str());
        else
            writeOut("  %s: many more modes than %d, or load points, for %g %% of %s\n",
                     advice.part.c_str(), advice.modes, 100 * TrustedError, advice.probe.c_str());
}

namespace {

constexpr double TrustedChange = 0.01;  // change of a probe relative to its range
constexpr double Unresolved = 1e-6;     // change of a probe relative to the largest value of its
                                        // unit

/** Advice based on the difference between a run and one with finer steps. **/
class Remedy {
public:
    Remedy(const Results& run, const Results& fine) {
        const ModelValue solver = readSolver(run.header), finer = readSolver(fine.header);
        const bool isRadau = solver.get("method").getText() == "radau";
        if (isRadau) m_slope = 1;
        if (solver.get("fixed_step").isGiven()) {
            m_key = "fixed_step";
            m_unit = " s";
            m_slope = isRadau ? 5 : 2;
        }
        m_coarse = solver.get(m_key).getNumber();
        m_fine = finer.get(m_key).getNumber();
    }

    /** "between accuracy 1e-6 and 1e-7" **/
    std::string describe() const {
        return std::string("between ") + m_key + " " + writeGeneral(m_coarse, 4) + " and " +
               writeGeneral(m_fine, 4) + m_unit;
    }

    /** Proposes a setting that reduces a relative change to TrustedChange. **/
    std::string propose(double change) const {
        // The phase of a persistent vibration is lost eventually.
        constexpr double Finest = 1e-13;
        const std::string damping =
            "more damping of the parts, if this vibration is of no interest";
        const double wanted =
            std::min(m_fine, m_coarse * std::pow(TrustedChange / change, 1 / m_slope));
        if (!(wanted >= Finest)) return "finer steps do not suffice; try " + damping;
        const double power = std::pow(10, std::floor(std::log10(wanted) + 1e-9));
        return "try solver." + std::string(m_key) + "=" + writeGeneral(power, 4) + ", or " +
               damping;
    }

private:
    const char *m_key = "accuracy", *m_unit = "";
    double m_slope = 2.0 / 3;  ///< error ∝ setting^slope
    double m_coarse = 0, m_fine = 0;
};

}  // namespace

void printVerification(const Results& run, const Results& fine, const std::string& change) {
    const double accuracy = readAccuracy(run.header);
    const Remedy remedy(run, fine);
    const ModelValue probes = readSection(run.header, "probes");
    const ResultComparison comparison = compareResults(run, fine, {}, "the run", "the finer run");
    bool hasAny = false;
    for (const Results::Analysis& a : run.analyses) {
        // Analyses not selected are from an earlier run.
        if (a.type != "transient" || a.probes.empty() || !seekNamed(fine.analyses, a.name))
            continue;
        // For energies and for quantities that are zero except for round-off, such as joint errors,
        // a change relative to their own range is meaningless.
        const auto isSmall = [&](const ColumnDifference& column) {
            if (probes.has(column.probe) && probes.get(column.probe).has("joint_error"))
                return true;
            const bool isLength = column.unit == "m" || column.unit == "rad";
            const double energy =
                column.unit == "J" ? getStatistic(a, "largest_kinetic_energy") : 0;
            return column.largest <= std::max({isLength ? accuracy : 0, TrustedChange * energy,
                                               Unresolved * findUnitScale(a, column.unit)});
        };
        const auto isTrusted = [&](const ColumnDifference& column) {
            return column.getRelative() <= TrustedChange || isSmall(column);
        };
        const auto describe = [&](const ColumnDifference& column) {
            return column.getRelative() > TrustedChange && isSmall(column)
                       ? std::string("small")
                       : describeRelative(column);
        };
        printColumns(a.name + ": changes with " + change, a, comparison, describe);
        hasAny = true;
        for (const ColumnDifference& column : comparison.columns)
            if (column.analysis == a.name && !isTrusted(column))
                writeOut("  warning: probe '%s' changes by %.3g %% of its range %s; %s\n",
                         column.name.c_str(), 100 * column.getRelative(), remedy.describe().c_str(),
                         remedy.propose(column.getRelative()).c_str());
    }
    if (!hasAny) writeOut("nothing to verify: no transient analysis with probes was run\n");
}

}  // namespace cli
}  // namespace simflex
