#include "simflex/model/sweep/SweepTable.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/base/DisplayUnit.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/results/CriticalSpeeds.h"
#include "simflex/model/results/CsvLine.h"
#include "simflex/model/results/Extremes.h"
#include "simflex/model/results/ModeShapes.h"
#include "simflex/model/results/ProbeChoice.h"
#include "simflex/part/FileChecksum.h"
#include "simflex/part/Hdf5.h"
#include "simflex/solver/Eigenmodes.h"

namespace simflex {
namespace model {
namespace {

namespace fs = std::filesystem;
constexpr const char* TableFile = "sweep.csv";
const std::vector<std::string> UsualStatistics = {"maximum", "minimum", "final"};

/** Mean over time, by the trapezoidal rule. **/
double calcMean(const std::vector<double>& time, const std::vector<double>& values) {
    double sum = 0;
    for (size_t k = 1; k < values.size(); ++k)
        sum += 0.5 * (values[k] + values[k - 1]) * (time[k] - time[k - 1]);
    const double span = time.back() - time.front();
    return span > 0 ? sum / span : values.back();
}

double calcStatistic(const std::string& statistic, const std::vector<double>& time,
                     const std::vector<double>& values) {
    if (values.empty()) return NAN;
    const auto [low, high] = findExtremes(values.begin(), values.end());
    if (statistic == "maximum") return *high;
    if (statistic == "minimum") return *low;
    if (statistic == "range") return *high - *low;
    if (statistic == "final") return values.back();
    if (statistic == "mean") return calcMean(time, values);
    std::vector<double> squares;
    for (const double value : values) squares.push_back(value * value);
    return std::sqrt(calcMean(time, squares));
}

struct TableEntry {
    std::string analysis, name, unit;
    double value;
};

/** An entry of `of`: a pattern of probes and a statistic. **/
struct Wish {
    std::string text, probe, statistic;
    bool isUsed = false;
};

std::vector<Wish> parseWishes(const std::vector<std::string>& of) {
    std::vector<Wish> wishes;
    for (const std::string& text : of) {
        const size_t dot = text.rfind('.');
        const std::string last = dot == std::string::npos ? "" : text.substr(dot + 1);
        const auto& statistics = getSweepStatistics();
        if (std::find(statistics.begin(), statistics.end(), last) != statistics.end()) {
            wishes.push_back({text, text.substr(0, dot), last});
        } else {
            for (const std::string& statistic : UsualStatistics)
                wishes.push_back({text, text, statistic});
        }
    }
    return wishes;
}

void addStatistics(const Results::Analysis& analysis, std::vector<Wish>& wishes,
                   std::vector<TableEntry>& entries) {
    const std::vector<ChosenColumn> columns = chooseColumns(analysis, {});
    const auto add = [&](const ChosenColumn& column, const std::string& statistic) {
        entries.push_back({analysis.name, column.name + "." + statistic, column.unit,
                           calcStatistic(statistic, analysis.time, column.values)});
    };
    if (wishes.empty())
        for (const ChosenColumn& column : columns)
            for (const std::string& statistic : UsualStatistics) add(column, statistic);
    for (Wish& wish : wishes)
        for (const ChosenColumn& column : columns) {
            if (!fits(wish.probe, column)) continue;
            wish.isUsed = true;
            add(column, wish.statistic);
        }
}

/** Of a motion that does not oscillate no frequency.
@param where  behind the names of the columns **/
void addModes(const Results::Analysis& analysis, size_t row, const std::string& where,
              std::vector<TableEntry>& entries) {
    for (size_t k = 0; k < analysis.frequency.at(row).size(); ++k) {
        const std::string name = std::to_string(k + 1) + where;
        const double damping = analysis.dampingRatio.at(row).at(k);
        const bool oscillates = std::abs(damping) < Eigenmode::Aperiodic;
        entries.push_back({analysis.name, "frequency " + name, "Hz",
                           oscillates ? analysis.frequency[row][k] : NAN});
        entries.push_back({analysis.name, "damping ratio " + name, "", damping});
    }
}

void addCampbell(const Results::Analysis& analysis, std::vector<TableEntry>& entries) {
    if (analysis.frequency.empty()) return;
    addModes(analysis, 0, " at first speed", entries);
    addModes(analysis, analysis.frequency.size() - 1, " at last speed", entries);
    const std::vector<double> critical = findCriticalSpeeds(analysis);
    for (size_t k = 0; k < critical.size(); ++k)
        entries.push_back(
            {analysis.name, "critical speed " + std::to_string(k + 1), "rad/s", critical[k]});
}

/** Adds each response's largest magnitude and its frequency; for random responses the rms values.
 **/
void addResponses(const Results::Analysis& analysis, std::vector<TableEntry>& entries) {
    for (const ChosenResponse& response : chooseResponses(analysis, {})) {
        const auto largest = std::max_element(response.magnitude.begin(), response.magnitude.end());
        const size_t at = size_t(largest - response.magnitude.begin());
        entries.push_back({analysis.name, response.name + " peak", response.unit, *largest});
        entries.push_back({analysis.name, response.name + " peak frequency", "Hz",
                           analysis.frequency.at(0).at(at)});
    }
    for (const auto& [name, value] : analysis.statistics)
        if (name.rfind("rms of ", 0) == 0) entries.push_back({analysis.name, name, "", value});
}

/** Tracks modes over the complete cases so far by their shapes in the most similar case, so that a
column follows one mode even if frequencies cross. **/
class ModeBranches {
public:
    explicit ModeBranches(const SweepPlan& plan) : m_plan(plan) {}

    /** Sorts an analysis' modes into their columns; NaN where a column has none. **/
    void follow(size_t number, Results::Analysis& analysis) {
        if (analysis.type != "eigen" || analysis.frequency.empty()) return;
        const std::vector<ShapeValues> shapes = listShapes(analysis);
        std::vector<Case>& before = m_cases[analysis.name];
        const Case* nearest = nullptr;
        for (const Case& one : before)
            if (!nearest ||
                countDifferences(one.number, number) <= countDifferences(nearest->number, number))
                nearest = &one;
        if (shapes.empty()) return;
        std::vector<size_t> columns(shapes.size());
        for (size_t k = 0; k < shapes.size(); ++k) columns[k] = k;
        if (nearest) columns = findColumns(nearest->shapes, shapes);
        const size_t count = 1 + *std::max_element(columns.begin(), columns.end());
        Case own{number, std::vector<ShapeValues>(count)};
        std::vector<double> frequency(count, NAN), damping(count, NAN);
        for (size_t k = 0; k < shapes.size(); ++k) {
            own.shapes[columns[k]] = shapes[k];
            frequency[columns[k]] = analysis.frequency[0][k];
            damping[columns[k]] = analysis.dampingRatio.at(0).at(k);
        }
        analysis.frequency[0] = frequency;
        analysis.dampingRatio[0] = damping;
        before.push_back(std::move(own));
    }

private:
    using ShapeValues = std::vector<std::complex<double>>;
    struct Case {
        size_t number;
        std::vector<ShapeValues> shapes;  ///< by column; empty: none
    };

    /** Shapes at the outputs, or else in the model's coordinates. **/
    static std::vector<ShapeValues> listShapes(const Results::Analysis& analysis) {
        for (const std::string kind : {"shape", "mode"}) {
            const auto re = analysis.matrices.find(kind + "_real"),
                       im = analysis.matrices.find(kind + "_imaginary");
            if (re == analysis.matrices.end() || im == analysis.matrices.end()) continue;
            std::vector<ShapeValues> shapes;
            for (size_t k = 0; k < analysis.frequency[0].size(); ++k) {
                shapes.emplace_back();
                for (size_t i = 0; i < re->second.at(k).size(); ++i)
                    shapes.back().emplace_back(re->second[k][i], im->second.at(k).at(i));
            }
            return shapes;
        }
        return {};
    }

    /** Assigns modes to columns, the most similar pairs first; a mode without a similar one gets a
    new column. **/
    static std::vector<size_t> findColumns(const std::vector<ShapeValues>& before,
                                           const std::vector<ShapeValues>& shapes) {
        struct Pair {
            double alike;
            size_t column, mode;
        };
        std::vector<Pair> pairs;
        for (size_t column = 0; column < before.size(); ++column)
            for (size_t mode = 0; mode < shapes.size(); ++mode)
                if (before[column].size() == shapes[mode].size())
                    pairs.push_back(
                        {calcModalAssurance(before[column], shapes[mode]), column, mode});
        std::stable_sort(pairs.begin(), pairs.end(),
                         [](const Pair& a, const Pair& b) { return a.alike > b.alike; });
        const size_t none = before.size() + shapes.size();
        std::vector<size_t> columns(shapes.size(), none);
        std::set<size_t> taken;
        for (const Pair& pair : pairs)
            if (columns[pair.mode] == none && taken.insert(pair.column).second)
                columns[pair.mode] = pair.column;
        size_t next = 0;
        for (size_t& column : columns) {
            if (column != none) continue;
            while (taken.count(next)) ++next;
            taken.insert(column = next);
        }
        return columns;
    }

    int countDifferences(size_t a, size_t b) const {
        int count = 0;
        for (size_t k = 0; k < m_plan.keys.size(); ++k)
            count += m_plan.cases[a].values[k] != m_plan.cases[b].values[k];
        return count;
    }

    const SweepPlan& m_plan;
    std::map<std::string, std::vector<Case>> m_cases;  ///< by analysis
};

std::vector<TableEntry> collectEntries(const Results& results, std::vector<Wish>& wishes) {
    std::vector<TableEntry> entries;
    for (const auto& analysis : results.analyses) {
        if (analysis.type == "transient") addStatistics(analysis, wishes, entries);
        if (analysis.type == "static")
            for (const ChosenColumn& column : chooseColumns(analysis, {}))
                entries.push_back({analysis.name, column.name, column.unit, column.values.back()});
        if (analysis.type == "eigen") addModes(analysis, 0, "", entries);
        if (analysis.type == "campbell") addCampbell(analysis, entries);
        if (analysis.type == "frequency_response") addResponses(analysis, entries);
    }
    return entries;
}

std::string joinWarnings(const Results& results) {
    std::string text;
    const auto add = [&](const std::string& warning) {
        text += (text.empty() ? "" : "; ") + warning;
    };
    for (const std::string& warning : results.warnings) add(warning);
    for (const auto& analysis : results.analyses)
        for (const std::string& warning : analysis.warnings) add(analysis.name + ": " + warning);
    return text;
}

/** First column titles of the table. **/
CsvLine beginTitles(const SweepPlan& plan) {
    CsvLine titles;
    titles.add("case").addAll(getNames(plan.keys)).add("status");
    return titles;
}

std::string makeCsv(const SweepPlan& plan, const std::vector<SweepOutcome>& outcomes,
                    const SweepTable& table) {
    CsvLine titles = beginTitles(plan);
    for (const auto& column : table.columns) titles.add(makeAxisLabel(column.name, column.unit));
    titles.add("error");
    if (table.hasWarnings()) titles.add("warnings");
    std::string text = titles.end();
    for (size_t k = 0; k < plan.cases.size(); ++k) {
        CsvLine line;
        line.add(plan.cases[k].folder).addAll(plan.cases[k].values).add(nameOf(outcomes[k].status));
        for (const auto& column : table.columns)
            line.add(std::isnan(column.values[k]) ? "" : writeGeneral(column.values[k]));
        line.add(outcomes[k].error);
        if (table.hasWarnings()) line.add(table.warnings[k]);
        text += line.end();
    }
    return text;
}

/** Replaces '/', which HDF5 would read as a path. **/
std::string makeLinkName(std::string name) {
    std::replace(name.begin(), name.end(), '/', '|');
    return name == "." ? "_" : name;
}

void writeHdf5(const std::string& path, const SweepPlan& plan,
               const std::vector<SweepOutcome>& outcomes, const SweepTable& table) {
    const hdf5::Quiet quiet;
    const hsize_t n = plan.cases.size();
    const auto file = hdf5::createFile(path);
    hdf5::writeInteger(file, "simflex_sweep", SweepFormat);
    std::vector<std::string> folders;
    for (const SweepCase& one : plan.cases) folders.push_back(one.folder);
    hdf5::writeTexts(file, "folders", folders);
    std::vector<int> status;
    for (const SweepOutcome& outcome : outcomes)
        status.push_back(outcome.status == SweepOutcome::Status::Complete ? 0
                         : outcome.status == SweepOutcome::Status::Failed ? 1
                                                                          : 2);
    hdf5::write(file, "status", {n}, status.data());
    const auto values = hdf5::createGroup(file, "values"), texts = hdf5::createGroup(file, "texts");
    for (size_t k = 0; k < plan.keys.size(); ++k) {
        std::vector<double> numbers;
        std::vector<std::string> asGiven;
        for (const SweepCase& one : plan.cases) {
            asGiven.push_back(one.values[k]);
            double number = NAN;
            numbers.push_back(readNumber(one.values[k], number) ? number : NAN);
        }
        const std::string name = makeLinkName(plan.keys[k].name);
        hdf5::write(values, name, {n}, numbers.data());
        hdf5::writeTexts(texts, name, asGiven);
    }
    if (table.hasWarnings()) hdf5::writeTexts(file, "warnings", table.warnings);
    const auto columns = hdf5::createGroup(file, "columns");
    for (const auto& column : table.columns) {
        hdf5::write(columns, makeLinkName(column.name), {n}, column.values.data());
        const hdf5::Handle data = hdf5::openData(columns, makeLinkName(column.name));
        hdf5::writeText(data, "unit", column.unit);
    }
    if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0)
        throw std::runtime_error("cannot write all of '" + path + "'; is the disk full?");
}

/** Lets only one process at a time write the table of a folder. **/
class TableLock {
public:
    explicit TableLock(const std::string& folder)
        : m_file(open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
        if (m_file >= 0) (void)!flock(m_file, LOCK_EX);
    }
    ~TableLock() {
        if (m_file >= 0) close(m_file);
    }
    TableLock(const TableLock&) = delete;
    TableLock& operator=(const TableLock&) = delete;

private:
    int m_file;
};

[[noreturn]] void failUnused(const Wish& wish, const std::vector<std::string>& names) {
    const std::string proposal = proposeName(wish.probe, names);
    throw std::runtime_error(
        "--of " + wish.text + ": no probe fits it" + (proposal.empty() ? "" : "; " + proposal) +
        "; a column is PROBE.maximum, .minimum, .mean, .rms, .final or .range. The cases are "
        "kept: the same command with another --of only makes the table");
}

}  // namespace

SweepTable makeSweepTable(const SweepPlan& plan, const std::vector<SweepOutcome>& outcomes,
                          const std::string& folder) {
    SweepTable table;
    std::vector<Wish> wishes = parseWishes(plan.of);
    std::vector<std::vector<TableEntry>> all;
    std::set<std::string> analyses;
    bool hasProbes = false;
    ModeBranches branches(plan);
    std::vector<std::string> names;
    for (size_t k = 0; k < plan.cases.size(); ++k) {
        all.emplace_back();
        table.warnings.emplace_back();
        if (outcomes[k].status != SweepOutcome::Status::Complete) continue;
        Results results =
            readResults(folder + "/" + plan.cases[k].folder + "/results.h5", ReadStates::No);
        for (Results::Analysis& analysis : results.analyses) branches.follow(k, analysis);
        all.back() = collectEntries(results, wishes);
        table.warnings.back() = joinWarnings(results);
        for (const TableEntry& entry : all.back()) analyses.insert(entry.analysis);
        for (const auto& analysis : results.analyses) {
            if (analysis.type != "transient") continue;
            hasProbes = true;
            if (!names.empty()) continue;
            for (const ChosenColumn& column : chooseColumns(analysis, {}))
                names.push_back(column.name);
        }
    }
    if (hasProbes)
        for (const Wish& wish : wishes)
            if (!wish.isUsed) failUnused(wish, names);
    std::map<std::string, size_t> places;
    for (size_t k = 0; k < all.size(); ++k)
        for (const TableEntry& entry : all[k]) {
            const std::string name =
                analyses.size() > 1 ? entry.analysis + "." + entry.name : entry.name;
            const auto [place, isNew] = places.emplace(name, table.columns.size());
            if (isNew)
                table.columns.push_back({name, entry.unit, std::vector<double>(all.size(), NAN)});
            table.columns[place->second].values[k] = entry.value;
        }
    return table;
}

bool SweepTable::hasWarnings() const {
    return std::any_of(warnings.begin(), warnings.end(),
                       [](const std::string& text) { return !text.empty(); });
}

void refuseOtherSweep(const SweepPlan& plan, const std::string& folder) {
    std::ifstream in = openInputFile(folder + "/" + TableFile);
    std::string before, own = beginTitles(plan).end();
    if (!in || !std::getline(in, before)) return;
    own.resize(own.find_last_not_of("\r\n") + 1);
    if (before.compare(0, own.size(), own) == 0) return;
    throw std::runtime_error("the folder '" + folder +
                             "' has the table of another sweep, which would be lost (it begins '" +
                             before.substr(0, own.size()) + "', this one would '" + own +
                             "'): choose another folder with -o, or remove that one");
}

std::string writeSweepTable(const SweepPlan& plan, const std::string& folder,
                            const Listener& listener) {
    const TableLock lock(folder);
    const std::vector<SweepOutcome> outcomes = readSweepOutcomes(plan, folder);
    const SweepTable table = makeSweepTable(plan, outcomes, folder);
    const std::string csv = folder + "/" + TableFile, hdf = folder + "/sweep.h5";
    replaceFile(csv, makeCsv(plan, outcomes, table));
    UnfinishedFile file(hdf);
    writeHdf5(file.getPath(), plan, outcomes, table);
    appendChecksum(file.getPath());
    file.finish();
    for (size_t k = 0; k < plan.cases.size(); ++k)
        if (!table.warnings[k].empty())
            listener.tellWarning(plan.cases[k].folder + ": " + table.warnings[k]);
    return csv;
}

}  // namespace model
}  // namespace simflex
