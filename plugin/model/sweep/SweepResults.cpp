#include "simflex/model/sweep/SweepResults.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/part/FileChecksum.h"
#include "simflex/part/Hdf5.h"

namespace simflex {
namespace model {
namespace {

std::vector<std::string> listLinks(hid_t group) {
    std::vector<std::string> names;
    for (hsize_t k = 0; k < hdf5::countLinks(group); ++k) {
        char name[1000];
        if (H5Lget_name_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, k, name, sizeof name,
                               H5P_DEFAULT) < 0)
            throw std::runtime_error("the names of its columns cannot be read");
        names.push_back(name);
    }
    return names;
}

struct Table {
    std::vector<std::string> keys, columns, units;
    std::vector<std::vector<double>> values, numbers;  // of each key, each column
    std::vector<std::vector<std::string>> texts;       // of each key
    std::vector<int> status;
};

/** The values of a key as they were given. **/
std::vector<std::string> readGiven(hid_t file, const std::string& key,
                                   const std::vector<double>& values) {
    if (hdf5::hasLink(file, "texts")) {
        const std::vector<std::string> texts = hdf5::readTexts(hdf5::openGroup(file, "texts"), key);
        if (texts.size() != values.size())
            throw std::runtime_error("'" + key + "' has another number of texts than of values");
        return texts;
    }
    // Format 1 had them as an attribute, where they were not too long for one.
    const hdf5::Handle data(H5Dopen2(hdf5::openGroup(file, "values"), key.c_str(), H5P_DEFAULT),
                            H5Dclose, "open '" + key + "'");
    std::vector<std::string> texts;
    if (H5Aexists(data, "texts") > 0) {
        std::istringstream lines(hdf5::readText(data, "texts"));
        for (std::string line; std::getline(lines, line);) texts.push_back(line);
    }
    for (size_t k = texts.size(); k < values.size(); ++k)
        texts.push_back(writeGeneral(values[k], 10));
    return texts;
}

Table readTable(const std::string& path) {
    const hdf5::Quiet quiet;
    checkChecksum(path);
    const auto file = hdf5::openFile(path);
    const int format = hdf5::readInteger(file, "simflex_sweep");
    if (format > 2) throw std::runtime_error("it needs a newer simflex");
    Table table;
    table.status = hdf5::readIndices(file, "status", {0});
    const hsize_t count = table.status.size();
    const auto values = hdf5::openGroup(file, "values");
    table.keys = listLinks(values);
    for (const std::string& key : table.keys) {
        table.values.push_back(hdf5::readNumbers(values, key, {count}));
        table.texts.push_back(readGiven(file, key, table.values.back()));
    }
    const auto columns = hdf5::openGroup(file, "columns");
    table.columns = listLinks(columns);
    for (const std::string& column : table.columns) {
        table.numbers.push_back(hdf5::readNumbers(columns, column, {count}));
        const hdf5::Handle data(H5Dopen2(columns, column.c_str(), H5P_DEFAULT), H5Dclose,
                                "open '" + column + "'");
        table.units.push_back(hdf5::readText(data, "unit"));
    }
    return table;
}

/** As readTable(); errors name the file. **/
Table openTable(const std::string& path) {
    try {
        return readTable(path);
    } catch (const std::runtime_error& error) {
        throw std::runtime_error("the table of a sweep '" + path +
                                 "' cannot be used: " + error.what());
    }
}

/** Its place among the keys. **/
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

/** "a=1, c=3": the values of a case but that of one key. **/
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
