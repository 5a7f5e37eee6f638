#include "simflex/model/sweep/SweepResults.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <stdexcept>

#include "simflex/model/file/NearestName.h"
#include "simflex/model/sweep/SweepTable.h"
#include "simflex/part/FileChecksum.h"
#include "simflex/part/Hdf5.h"

namespace simflex {
namespace model {
namespace {

struct Table {
    std::vector<std::string> keys, columns, units;
    std::vector<std::vector<double>> values, numbers;  // by key, by column
    std::vector<std::vector<std::string>> texts;       // by key
    std::vector<int> status;
    std::vector<std::string> folders;
};

Table readTable(const std::string& path) {
    const hdf5::Quiet quiet;
    checkChecksum(path);
    const auto file = hdf5::openFile(path);
    const int format = hdf5::readInteger(file, "simflex_sweep");
    if (format != SweepFormat)
        throw std::runtime_error("its format is " + std::to_string(format) + ", not " +
                                 std::to_string(SweepFormat));
    Table table;
    table.status = hdf5::readIndices(file, "status", {0});
    const hsize_t count = table.status.size();
    table.folders = hdf5::readTexts(file, "folders");
    if (table.folders.size() != count)
        throw std::runtime_error("it has another number of folders than of cases");
    const auto values = hdf5::openGroup(file, "values"), texts = hdf5::openGroup(file, "texts");
    table.keys = hdf5::listLinks(values);
    for (const std::string& key : table.keys) {
        table.values.push_back(hdf5::readNumbers(values, key, {count}));
        table.texts.push_back(hdf5::readTexts(texts, key));
        if (table.texts.back().size() != count)
            throw std::runtime_error("'" + key + "' has another number of texts than of values");
    }
    const auto columns = hdf5::openGroup(file, "columns");
    table.columns = hdf5::listLinks(columns);
    for (const std::string& column : table.columns) {
        table.numbers.push_back(hdf5::readNumbers(columns, column, {count}));
        table.units.push_back(hdf5::readText(hdf5::openData(columns, column), "unit"));
    }
    return table;
}

/** Like readTable(), but errors name the file. **/
Table openTable(const std::string& path) {
    try {
        return readTable(path);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("the table of a sweep '" + path +
                                 "' cannot be used: " + error.what());
    }
}

size_t chooseKey(const Table& table, const std::string& key, const std::string& path) {
    size_t chosen = table.keys.size(), most = 0;
    for (size_t k = 0; k < table.keys.size(); ++k) {
        std::set<double> different;
        for (const double value : table.values[k])
            if (!std::isnan(value)) different.insert(value);
        if (key.empty() ? different.size() > most : table.keys[k] == key) chosen = k;
        most = std::max(most, different.size());
        if (chosen == k && different.empty())
            throw std::runtime_error("the values of '" + table.keys[k] + "' in '" + path +
                                     "' are no numbers: they make no axis");
    }
    if (chosen == table.keys.size())
        throw std::runtime_error("the sweep '" + path + "' varies " +
                                 (key.empty() ? "no number" : "no '" + key + "'") + "; it has " +
                                 joinNames(table.keys));
    return chosen;
}

/** "a=1, c=3": the values of a case except that of one key. **/
std::string makeLabel(const Table& table, size_t without, size_t index) {
    std::string label;
    for (size_t k = 0; k < table.keys.size(); ++k)
        if (k != without)
            label += (label.empty() ? "" : ", ") + table.keys[k] + "=" + table.texts[k].at(index);
    return label;
}

}  // namespace

bool isSweepTable(const std::string& path) {
    try {
        const hdf5::Quiet quiet;
        checkChecksum(path);
        return H5Aexists(hdf5::openFile(path), "simflex_sweep") > 0;
    } catch (const std::runtime_error&) {
        return false;
    }
}

SweepCases listSweepCases(const std::string& path, const std::string& key) {
    const Table table = openTable(path);
    const size_t chosen = chooseKey(table, key, path);
    SweepCases cases;
    cases.key = table.keys[chosen];
    std::set<std::string> others;
    for (size_t k = 0; k < table.status.size(); ++k) {
        const double value = table.values[chosen][k];
        if (table.status[k] != 0 || std::isnan(value)) continue;
        others.insert(makeLabel(table, chosen, k));
        cases.values.push_back(value);
        cases.paths.push_back(
            (std::filesystem::path(path).parent_path() / table.folders[k] / "results.h5").string());
    }
    if (cases.paths.empty())
        throw std::runtime_error("no case of the sweep '" + path + "' is complete");
    if (others.size() > 1)
        throw std::runtime_error("the sweep '" + path + "' varies more than '" + cases.key +
                                 "': a map is over one parameter");
    return cases;
}

SweepResults readSweepTable(const std::string& path, const std::string& key) {
    const Table table = openTable(path);
    const size_t chosen = chooseKey(table, key, path);
    SweepResults sweep;
    sweep.key = table.keys[chosen];
    std::map<std::string, std::vector<size_t>> groups;
    const std::vector<double>& x = table.values[chosen];
    for (size_t k = 0; k < table.status.size(); ++k)
        if (table.status[k] == 0 && !std::isnan(x[k])) {
            const std::string label = makeLabel(table, chosen, k);
            if (groups.find(label) == groups.end()) sweep.labels.push_back(label);
            groups[label].push_back(k);
        }
    if (groups.empty()) throw std::runtime_error("no case of the sweep '" + path + "' is complete");
    for (const std::string& label : sweep.labels) {
        std::vector<size_t>& cases = groups[label];
        std::stable_sort(cases.begin(), cases.end(),
                         [&](size_t a, size_t b) { return x[a] < x[b]; });
        sweep.results.emplace_back();
        sweep.results.back().analyses.emplace_back();
        Results::Analysis& analysis = sweep.results.back().analyses[0];
        analysis.name = "sweep";
        analysis.type = "transient";
        const auto add = [&](const std::string& name, const std::string& unit,
                             const std::vector<double>& values) {
            analysis.probes.push_back({{name, unit, {""}}, {}});
            for (const size_t k : cases) analysis.probes.back().rows.push_back({values[k]});
        };
        for (const size_t k : cases) analysis.time.push_back(x[k]);
        add(sweep.key, "", x);
        for (size_t c = 0; c < table.columns.size(); ++c)
            if (std::any_of(cases.begin(), cases.end(),
                            [&](size_t k) { return !std::isnan(table.numbers[c][k]); }))
                add(table.columns[c], table.units[c], table.numbers[c]);
    }
    return sweep;
}

}  // namespace model
}  // namespace simflex
