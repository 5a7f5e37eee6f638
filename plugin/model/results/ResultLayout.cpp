#include "simflex/model/results/ResultLayout.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/part/Hdf5.h"

namespace simflex {
namespace model {
namespace {

constexpr size_t BlockNumbers = size_t(1) << 20;  // numbers of rows read from the journal at once
constexpr size_t LongestText = size_t(1) << 28;   // limit for model files
using Rows = std::vector<std::vector<double>>;

/** Writes a text of any length as a data set. **/
hdf5::Handle writeLongText(hid_t parent, const std::string& name, const std::string& text) {
    const hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "describe '" + name + "'");
    hdf5::check(H5Tset_size(type, text.size() + 1), "describe '" + name + "'");
    hdf5::check(H5Tset_cset(type, H5T_CSET_UTF8), "describe '" + name + "'");
    const hdf5::Handle space(H5Screate(H5S_SCALAR), H5Sclose, "shape '" + name + "'");
    const hdf5::Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "create properties");
    hdf5::check(H5Pset_obj_track_times(properties, false), "turn time stamps off");
    hdf5::Handle data(
        H5Dcreate2(parent, name.c_str(), type, space, H5P_DEFAULT, properties, H5P_DEFAULT),
        H5Dclose, "create '" + name + "'");
    hdf5::check(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.c_str()),
                "write '" + name + "'");
    return data;
}

std::string readLongText(hid_t data, const std::string& name) {
    const hdf5::Handle type(H5Dget_type(data), H5Tclose, "read the type of '" + name + "'");
    const hdf5::Handle space(H5Dget_space(data), H5Sclose, "read the shape of '" + name + "'");
    const size_t size = H5Tget_size(type);
    if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 ||
        H5Sget_simple_extent_npoints(space) != 1 || size > LongestText ||
        H5Dget_storage_size(data) < size)
        throw std::runtime_error("'" + name + "' is not text");
    std::string text(size + 1, '\0');
    hdf5::check(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, text.data()),
                "read '" + name + "'");
    text.resize(text.find('\0'));
    return text;
}

void writeNumber(hid_t object, const std::string& name, double value) {
    const hdf5::Handle space(H5Screate(H5S_SCALAR), H5Sclose, "shape '" + name + "'");
    const hdf5::Handle attribute(
        H5Acreate2(object, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
        "create '" + name + "'");
    hdf5::check(H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value), "write '" + name + "'");
}

std::map<std::string, double> readStatistics(hid_t group) {
    std::map<std::string, double> statistics;
    H5O_info_t info;
#if H5_VERSION_GE(1, 12, 0)
    const herr_t isKnown = H5Oget_info3(group, &info, H5O_INFO_NUM_ATTRS);
#else
    const herr_t isKnown = H5Oget_info2(group, &info, H5O_INFO_NUM_ATTRS);
#endif
    hdf5::check(isKnown, "count the attributes of 'statistics'");
    for (hsize_t k = 0; k < info.num_attrs; ++k) {
        const hdf5::Handle attribute(
            H5Aopen_by_idx(group, ".", H5_INDEX_NAME, H5_ITER_INC, k, H5P_DEFAULT, H5P_DEFAULT),
            H5Aclose, "open an attribute of 'statistics'");
        const hdf5::Handle space(H5Aget_space(attribute), H5Sclose, "read 'statistics'");
        const hdf5::Handle type(H5Aget_type(attribute), H5Tclose, "read 'statistics'");
        std::string name(size_t(std::max<ssize_t>(0, H5Aget_name(attribute, 0, nullptr))) + 1,
                         '\0');
        H5Aget_name(attribute, name.size(), name.data());
        name.resize(name.find('\0'));
        double value = 0;
        if (H5Sget_simple_extent_npoints(space) != 1 || H5Tget_class(type) != H5T_FLOAT ||
            H5Aread(attribute, H5T_NATIVE_DOUBLE, &value) < 0)
            throw std::runtime_error("'statistics." + name + "' is not one number");
        statistics[name] = value;
    }
    return statistics;
}

/** Creates an empty matrix of doubles that is filled row by row. **/
hdf5::Handle createMatrix(hid_t parent, const std::string& name,
                          const std::vector<hsize_t>& shape) {
    const hdf5::Handle space(H5Screate_simple(int(shape.size()), shape.data(), nullptr), H5Sclose,
                             "shape '" + name + "'");
    const hdf5::Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "create properties");
    hdf5::check(H5Pset_obj_track_times(properties, false), "turn time stamps off");
    hdf5::check(H5Pset_fill_time(properties, H5D_FILL_TIME_NEVER), "leave '" + name + "' unfilled");
    return hdf5::Handle(H5Dcreate2(parent, name.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT,
                                   properties, H5P_DEFAULT),
                        H5Dclose, "create '" + name + "'");
}

void writeStateColumns(hid_t states, const Results::Analysis& contents) {
    const auto columns = hdf5::createGroup(states, "columns");
    for (const auto& [name, names] : contents.stateColumns)
        if (!names.empty()) hdf5::writeTexts(columns, name, names);
}

/** Position of a data set within a row of the journal. **/
struct Strip {
    hdf5::Handle data;
    int begin, width;
    bool isVector;
};

void writeStrip(const Strip& strip, const std::vector<double>& rows, int rowSize, int first,
                int count, std::vector<double>& room) {
    const size_t width = size_t(strip.width);
    room.resize(size_t(count) * width);
    for (size_t k = 0; k < size_t(count); ++k)
        std::copy_n(&rows[k * size_t(rowSize) + size_t(strip.begin)], width, &room[k * width]);
    const hsize_t start[2] = {hsize_t(first), 0}, extent[2] = {hsize_t(count), hsize_t(width)};
    const hdf5::Handle stored(H5Dget_space(strip.data), H5Sclose, "read a shape");
    const hdf5::Handle given(H5Screate_simple(strip.isVector ? 1 : 2, extent, nullptr), H5Sclose,
                             "shape rows");
    hdf5::check(H5Sselect_hyperslab(stored, H5S_SELECT_SET, start, nullptr, extent, nullptr),
                "select rows");
    hdf5::check(H5Dwrite(strip.data, H5T_NATIVE_DOUBLE, given, stored, H5P_DEFAULT, room.data()),
                "write rows");
}

void writeTransient(hid_t group, hid_t probes, const ResultJournal::Analysis& analysis,
                    const ResultJournal& journal) {
    const hsize_t n = hsize_t(analysis.numRows);
    std::vector<Strip> strips;
    strips.push_back({createMatrix(group, "time", {n}), 0, 1, true});
    int begin = 1;
    for (const auto& series : analysis.contents.probes) {
        const int width = int(series.column.columns.size());
        strips.push_back(
            {createMatrix(probes, series.column.name, {n, hsize_t(width)}), begin, width, false});
        begin += width;
    }
    if (analysis.numStates > 0) {
        const auto states = hdf5::createGroup(group, "states");
        for (const ResultState& state : ResultStates) {
            const auto found = analysis.contents.stateColumns.find(state.name);
            if (found == analysis.contents.stateColumns.end() || found->second.empty()) continue;
            const int width = int(found->second.size());
            strips.push_back(
                {createMatrix(states, state.name, {n, hsize_t(width)}), begin, width, false});
            begin += width;
        }
        writeStateColumns(states, analysis.contents);
    }
    const int rowSize = analysis.getRowSize();
    const int perBlock = int(std::max<size_t>(1, BlockNumbers / size_t(rowSize)));
    std::vector<double> room;
    for (int first = 0; first < analysis.numRows; first += perBlock) {
        const int count = std::min(perBlock, analysis.numRows - first);
        const std::vector<double> rows = journal.readRows(analysis, first, count);
        for (const Strip& strip : strips)
            if (strip.width > 0) writeStrip(strip, rows, rowSize, first, count, room);
    }
}

void writeMatrix(hid_t parent, const std::string& name, const Rows& rows) {
    const size_t width = rows.empty() ? 0 : rows[0].size();
    std::vector<double> joined;
    for (const auto& row : rows) joined.insert(joined.end(), row.begin(), row.end());
    hdf5::write(parent, name, {rows.size(), width}, joined.data());
}

/** Writes the states of an analysis without time. **/
void writeStates(hid_t group, const Results::Analysis& contents) {
    const auto states = hdf5::createGroup(group, "states");
    for (const ResultState& state : ResultStates) {
        const Rows& rows = contents.*state.rows;
        if (!rows.empty() && !rows[0].empty()) writeMatrix(states, state.name, rows);
    }
    writeStateColumns(states, contents);
}

/** Writes inputs, outputs and their matrices. **/
void writePorts(hid_t group, const Results::Analysis& contents) {
    hdf5::writeTexts(group, "inputs", contents.inputs);
    hdf5::writeTexts(group, "input_units", contents.inputUnits);
    hdf5::writeTexts(group, "outputs", contents.outputs);
    hdf5::writeTexts(group, "output_units", contents.outputUnits);
    if (!contents.frequency.empty())
        hdf5::write(group, "frequency", {contents.frequency[0].size()},
                    contents.frequency[0].data());
    const auto matrices = hdf5::createGroup(group, "matrices");
    for (const auto& [name, rows] : contents.matrices) writeMatrix(matrices, name, rows);
}

void writeAnalysis(hid_t analyses, int index, const ResultJournal::Analysis& analysis,
                   const ResultJournal& journal) {
    const Results::Analysis& contents = analysis.contents;
    const auto group = hdf5::createGroup(analyses, contents.name);
    hdf5::writeText(group, "type", contents.type);
    hdf5::writeInteger(group, "index", index);
    hdf5::writeInteger(group, "complete", contents.isComplete ? 1 : 0);
    const bool isTransient = contents.type == "transient";
    if (isTransient || contents.type == "static") {
        const auto probes = hdf5::createGroup(group, "probes");
        if (isTransient) {
            writeTransient(group, probes, analysis, journal);
        } else {
            for (const auto& series : contents.probes)
                writeMatrix(probes, series.column.name, series.rows);
            for (const auto& [name, rows] : contents.matrices) writeMatrix(group, name, rows);
        }
        int place = 0;
        for (const auto& series : contents.probes) {
            const auto data = hdf5::openData(probes, series.column.name);
            hdf5::writeText(data, "unit", series.column.unit);
            hdf5::writeText(data, "columns", joinNames(series.column.columns, ","));
            hdf5::writeInteger(data, "index", place++);
        }
    } else if (contents.type == "eigen") {
        hdf5::write(group, "frequency", {contents.frequency.at(0).size()},
                    contents.frequency[0].data());
        hdf5::write(group, "damping_ratio", {contents.dampingRatio.at(0).size()},
                    contents.dampingRatio[0].data());
        for (const auto& [name, rows] : contents.matrices) writeMatrix(group, name, rows);
        if (!contents.outputs.empty()) {
            hdf5::writeTexts(group, "outputs", contents.outputs);
            hdf5::writeTexts(group, "output_units", contents.outputUnits);
        }
    } else if (contents.type == "linear" || contents.type == "frequency_response") {
        writePorts(group, contents);
    } else {
        hdf5::write(group, "speeds", {contents.speeds.size()}, contents.speeds.data());
        writeMatrix(group, "frequency", contents.frequency);
        writeMatrix(group, "damping_ratio", contents.dampingRatio);
    }
    if (!isTransient && !contents.q.empty()) writeStates(group, contents);
    if (!contents.statistics.empty()) {
        const auto statistics = hdf5::createGroup(group, "statistics");
        for (const auto& [name, value] : contents.statistics) writeNumber(statistics, name, value);
    }
    if (!contents.events.empty()) {
        std::vector<std::string> names;
        std::vector<double> times;
        for (const Results::Analysis::Event& event : contents.events) {
            names.push_back(event.name);
            times.push_back(event.time);
        }
        const auto events = hdf5::createGroup(group, "events");
        hdf5::writeTexts(events, "name", names);
        hdf5::write(events, "time", {times.size()}, times.data());
    }
    const std::vector<std::string>& warnings = journal.getWarnings(contents.name);
    if (!warnings.empty()) hdf5::writeTexts(group, "warnings", warnings);
}

/** The members of a group, sorted by their attribute `index`. **/
std::vector<std::string> listInOrder(hid_t group) {
    std::vector<std::pair<int, std::string>> members;
    for (const std::string& name : hdf5::listLinks(group)) {
        const hdf5::Handle member(H5Oopen(group, name.c_str(), H5P_DEFAULT), H5Oclose,
                                  "open '" + name + "'");
        members.emplace_back(hdf5::readInteger(member, "index"), name);
    }
    std::sort(members.begin(), members.end());
    std::vector<std::string> names;
    for (const auto& member : members) names.push_back(member.second);
    return names;
}

/** @param numRows  at least 1
@param width  0: any **/
Rows readMatrix(hid_t parent, const std::string& name, hsize_t numRows, hsize_t width) {
    const std::vector<double> numbers = hdf5::readNumbers(parent, name, {numRows, width});
    const std::ptrdiff_t columns = std::ptrdiff_t(numbers.size() / numRows);
    Rows rows;
    for (auto row = numbers.begin(); rows.size() < numRows; row += columns)
        rows.emplace_back(row, row + columns);
    return rows;
}

void readProbes(hid_t group, hsize_t numRows, Results::Analysis& analysis) {
    const auto probes = hdf5::openGroup(group, "probes");
    for (const std::string& name : listInOrder(probes)) {
        Results::Series series;
        const auto data = hdf5::openData(probes, name);
        series.column.name = name;
        series.column.unit = hdf5::readText(data, "unit");
        series.column.columns = splitAt(hdf5::readText(data, "columns"), ',');
        if (numRows > 0)
            series.rows = readMatrix(probes, name, numRows, series.column.columns.size());
        analysis.probes.push_back(std::move(series));
    }
}

void readStates(hid_t group, hsize_t numRows, Results::Analysis& analysis) {
    if (numRows == 0 || !hdf5::hasLink(group, "states")) return;
    const auto states = hdf5::openGroup(group, "states");
    for (const ResultState& state : ResultStates)
        if (hdf5::hasLink(states, state.name))
            analysis.*state.rows = readMatrix(states, state.name, numRows, 0);
    if (!hdf5::hasLink(states, "columns")) return;  // written by an older simflex
    const auto columns = hdf5::openGroup(states, "columns");
    for (const ResultState& state : ResultStates) {
        const auto& rows = analysis.*state.rows;
        if (rows.empty()) continue;
        analysis.stateColumns[state.name] = hdf5::readTexts(columns, state.name);
        if (analysis.stateColumns[state.name].size() != rows[0].size())
            throw std::runtime_error(std::string("'states/") + state.name + "' has " +
                                     std::to_string(rows[0].size()) + " columns, not the " +
                                     std::to_string(analysis.stateColumns[state.name].size()) +
                                     " that are named");
    }
}

void readPorts(hid_t group, Results::Analysis& analysis) {
    analysis.inputs = hdf5::readTexts(group, "inputs");
    analysis.inputUnits = hdf5::readTexts(group, "input_units");
    analysis.outputs = hdf5::readTexts(group, "outputs");
    analysis.outputUnits = hdf5::readTexts(group, "output_units");
    if (analysis.inputUnits.size() != analysis.inputs.size() ||
        analysis.outputUnits.size() != analysis.outputs.size())
        throw std::runtime_error("it has other numbers of units than of inputs or outputs");
    const auto matrices = hdf5::openGroup(group, "matrices");
    const hsize_t numInputs = analysis.inputs.size(), numOutputs = analysis.outputs.size();
    if (numInputs == 0 || numOutputs == 0) throw std::runtime_error("it has no inputs or outputs");
    if (analysis.type == "frequency_response") {
        analysis.frequency = {hdf5::readNumbers(group, "frequency", {0})};
        const hsize_t n = analysis.frequency[0].size();
        if (n == 0) throw std::runtime_error("it has no frequencies");
        for (const char* name : {"magnitude", "phase"})
            analysis.matrices[name] = readMatrix(matrices, name, n, numOutputs * numInputs);
        if (hdf5::hasLink(matrices, "density"))
            analysis.matrices["density"] = readMatrix(matrices, "density", n, numOutputs);
        return;
    }
    analysis.matrices["D"] = readMatrix(matrices, "D", numOutputs, numInputs);
    analysis.matrices["C"] = readMatrix(matrices, "C", numOutputs, 0);
    const hsize_t numStates = analysis.matrices["C"][0].size();
    if (numStates == 0) throw std::runtime_error("it has no states");
    analysis.matrices["A"] = readMatrix(matrices, "A", numStates, numStates);
    analysis.matrices["B"] = readMatrix(matrices, "B", numStates, numInputs);
}

/** Reads optional data of eigen analyses. **/
void readModeMatrices(hid_t group, Results::Analysis& analysis) {
    const hsize_t n = analysis.frequency[0].size();
    if (n > 0 && hdf5::hasLink(group, "effective_mass"))
        analysis.matrices["effective_mass"] = readMatrix(group, "effective_mass", n, 3);
    if (n > 0 && hdf5::hasLink(group, "mode_real")) {
        analysis.matrices["mode_real"] = readMatrix(group, "mode_real", n, 0);
        const hsize_t numSpeeds = analysis.matrices["mode_real"][0].size();
        analysis.matrices["mode_imaginary"] = readMatrix(group, "mode_imaginary", n, numSpeeds);
        for (const char* name : {"M", "D", "K"})
            if (hdf5::hasLink(group, name))
                analysis.matrices[name] = readMatrix(group, name, numSpeeds, numSpeeds);
        if (hdf5::hasLink(group, "G")) {
            const size_t size = hdf5::readNumbers(group, "G", {0, numSpeeds}).size();
            analysis.matrices["G"] = readMatrix(group, "G", size / numSpeeds, numSpeeds);
        }
    }
    if (n == 0 || !hdf5::hasLink(group, "outputs")) return;
    analysis.outputs = hdf5::readTexts(group, "outputs");
    analysis.outputUnits = hdf5::readTexts(group, "output_units");
    for (const char* name : {"shape_real", "shape_imaginary"})
        analysis.matrices[name] = readMatrix(group, name, n, analysis.outputs.size());
}

Results::Analysis readAnalysis(hid_t analyses, const std::string& name, ReadStates states) {
    const auto group = hdf5::openGroup(analyses, name);
    Results::Analysis analysis;
    analysis.name = name;
    analysis.type = hdf5::readText(group, "type");
    analysis.isComplete = hdf5::readInteger(group, "complete") != 0;
    hsize_t numRows = 1;
    if (analysis.type == "transient") {
        analysis.time = hdf5::readNumbers(group, "time", {0});
        checkTimes(analysis.time);
        readProbes(group, analysis.time.size(), analysis);
    } else if (analysis.type == "static") {
        if (hdf5::hasLink(group, "path")) {
            const size_t size = hdf5::readNumbers(group, "path", {0, 3}).size();
            if (size == 0) throw std::runtime_error("its path has no points");
            numRows = size / 3;
            analysis.matrices["path"] = readMatrix(group, "path", numRows, 3);
        }
        readProbes(group, numRows, analysis);
    } else if (analysis.type == "eigen") {
        analysis.frequency = {hdf5::readNumbers(group, "frequency", {0})};
        analysis.dampingRatio = {
            hdf5::readNumbers(group, "damping_ratio", {analysis.frequency[0].size()})};
        readModeMatrices(group, analysis);
    } else if (analysis.type == "campbell") {
        analysis.speeds = hdf5::readNumbers(group, "speeds", {0});
        const hsize_t n = analysis.speeds.size();
        if (n > 0) {
            analysis.frequency = readMatrix(group, "frequency", n, 0);
            analysis.dampingRatio =
                readMatrix(group, "damping_ratio", n, analysis.frequency[0].size());
        }
    } else if (analysis.type == "linear" || analysis.type == "frequency_response") {
        readPorts(group, analysis);
    } else {
        throw std::runtime_error("its type is '" + analysis.type +
                                 "', not transient, static, eigen, campbell, linear or "
                                 "frequency_response");
    }
    if (states == ReadStates::Yes)
        readStates(group, analysis.type == "transient" ? analysis.time.size() : numRows, analysis);
    if (hdf5::hasLink(group, "statistics"))
        analysis.statistics = readStatistics(hdf5::openGroup(group, "statistics"));
    if (hdf5::hasLink(group, "events")) {
        const auto events = hdf5::openGroup(group, "events");
        const std::vector<std::string> names = hdf5::readTexts(events, "name");
        const std::vector<double> times = hdf5::readNumbers(events, "time", {names.size()});
        for (size_t i = 0; i < names.size(); ++i) analysis.events.push_back({names[i], times[i]});
    }
    if (hdf5::hasLink(group, "warnings")) analysis.warnings = hdf5::readTexts(group, "warnings");
    return analysis;
}

}  // namespace

void checkTimes(const std::vector<double>& times) {
    for (size_t k = 0; k < times.size(); ++k) {
        if (!(std::abs(times[k]) <= LargestTime))
            throw std::runtime_error("'time' is out of range at row " + std::to_string(k));
        if (k > 0 && !(times[k] > times[k - 1]))
            throw std::runtime_error("'time' does not increase at row " + std::to_string(k));
    }
}

std::string getJournalPath(const std::string& path) {
    return path + ".rows";
}

void writeResultLayout(const std::string& path, const ResultJournal& journal) {
    const hdf5::Quiet quiet;
    const ResultHeader& header = journal.getHeader();
    const auto file = hdf5::createFile(path);
    hdf5::writeInteger(file, "simflex_results", ResultFormat);
    hdf5::writeText(file, "version", SIMFLEX_VERSION);
    hdf5::writeText(file, "title", header.title);
    {
        const auto model = writeLongText(file, "model", header.modelText);
        hdf5::writeText(model, "path", header.modelPath);
        hdf5::writeText(model, "settings", joinNames(header.settings, "\n"));
        hdf5::writeText(model, "bodies", header.isRigid ? "rigid" : "as_given");
    }
    if (!header.inputs.empty()) {
        std::vector<std::string> inputs, sums;
        for (const auto& [what, sum] : header.inputs) {
            inputs.push_back(what);
            sums.push_back(sum);
        }
        hdf5::writeTexts(file, "inputs", inputs);
        hdf5::writeTexts(file, "input_checksums", sums);
    }
    if (!journal.getWarnings("").empty())
        hdf5::writeTexts(file, "warnings", journal.getWarnings(""));
    const auto analyses = hdf5::createGroup(file, "analyses");
    int index = 0;
    for (const auto& analysis : journal.getAnalyses())
        writeAnalysis(analyses, index++, analysis, journal);
    if (H5Fflush(file, H5F_SCOPE_GLOBAL) < 0)
        throw std::runtime_error("cannot write all of it; is the disk full?");
}

Results readResultLayout(const std::string& path, ReadStates states) {
    const hdf5::Quiet quiet;
    const auto file = hdf5::openFile(path);
    if (H5Aexists(file, "simflex_results") <= 0)
        throw std::runtime_error("it is not a result file of simflex: it has no 'simflex_results'");
    const int format = hdf5::readInteger(file, "simflex_results");
    if (format > ResultFormat)
        throw std::runtime_error("its format is " + std::to_string(format) +
                                 ", this simflex reads up to " + std::to_string(ResultFormat) +
                                 ": it needs a newer simflex");
    if (format < 1)
        throw std::runtime_error("'simflex_results' is " + std::to_string(format) + ", not 1");
    Results data;
    data.header.title = hdf5::readText(file, "title");
    const auto model = hdf5::openData(file, "model");
    data.header.modelText = readLongText(model, "model");
    data.header.modelPath = hdf5::readPath(model, "path");
    const std::string settings = hdf5::readText(model, "settings");
    if (!settings.empty()) data.header.settings = splitAt(settings, '\n');
    data.header.isRigid = hdf5::readText(model, "bodies") == "rigid";
    if (H5Aexists(file, "version") > 0) data.header.version = hdf5::readText(file, "version");
    if (hdf5::hasLink(file, "inputs") && hdf5::hasLink(file, "input_checksums")) {
        const std::vector<std::string> inputs = hdf5::readTexts(file, "inputs"),
                                       sums = hdf5::readTexts(file, "input_checksums");
        for (size_t k = 0; k < std::min(inputs.size(), sums.size()); ++k)
            data.header.inputs[inputs[k]] = sums[k];
    }
    if (hdf5::hasLink(file, "warnings")) data.warnings = hdf5::readTexts(file, "warnings");
    const auto analyses = hdf5::openGroup(file, "analyses");
    for (const std::string& name : listInOrder(analyses)) {
        try {
            data.analyses.push_back(readAnalysis(analyses, name, states));
        } catch (const std::runtime_error& error) {
            throw std::runtime_error("analysis '" + name + "': " + error.what());
        }
    }
    return data;
}

}  // namespace model
}  // namespace simflex
