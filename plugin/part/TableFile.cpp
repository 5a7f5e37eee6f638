#include "simflex/part/TableFile.h"

#include <algorithm>
#include <charconv>
#include <iostream>
#include <sstream>
#include <stdexcept>

#include "Hdf5.h"

#include "simflex/base/InputFile.h"

namespace simflex {
namespace {

constexpr auto WriteInterval = std::chrono::seconds(1);
constexpr size_t MostKept = 1 << 17;  // numbers buffered at most
constexpr hsize_t ChunkNumbers = 1 << 13;

bool endsIn(const std::string& path, const std::string& ending) {
    return path.size() > ending.size() &&
           path.compare(path.size() - ending.size(), ending.size(), ending) == 0;
}

/** Returns true for CSV, false for HDF5. **/
bool isCsvName(const std::string& path) {
    if (endsIn(path, ".csv")) return true;
    if (endsIn(path, ".h5") || endsIn(path, ".hdf5")) return false;
    throw std::invalid_argument("'" + path +
                                "' is the name of no table: it must end in .csv, .h5 or .hdf5");
}

[[noreturn]] void fail(const std::string& path, const std::string& why) {
    throw std::runtime_error("table '" + path + "': " + why);
}

void appendNumber(double value, std::string& text) {
    char digits[32];
    text.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
}

std::string quoted(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string result = "\"";
    for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
    return result + "\"";
}

std::vector<std::string> splitCsv(const std::string& line) {
    std::vector<std::string> fields(1);
    bool isQuoted = false;
    for (size_t k = 0; k < line.size(); ++k) {
        if (line[k] == '"') {
            const bool isDouble = isQuoted && k + 1 < line.size() && line[k + 1] == '"';
            if (isDouble)
                fields.back() += line[k++];
            else
                isQuoted = !isQuoted;
        } else if (line[k] == ',' && !isQuoted) {
            fields.emplace_back();
        } else {
            fields.back() += line[k];
        }
    }
    return fields;
}

/** Creates an extendible data set with one row per time. **/
void createGrowing(hid_t file, const char* name, hsize_t columns, int numDimensions) {
    const hsize_t now[2] = {0, columns}, most[2] = {H5S_UNLIMITED, columns},
                  chunk[2] = {std::max<hsize_t>(1, ChunkNumbers / std::max<hsize_t>(1, columns)),
                              std::max<hsize_t>(1, columns)};
    const hdf5::Handle space(H5Screate_simple(numDimensions, now, most), H5Sclose, "shape");
    const hdf5::Handle properties(H5Pcreate(H5P_DATASET_CREATE), H5Pclose, "create properties");
    hdf5::check(H5Pset_obj_track_times(properties, false), "turn time stamps off");
    hdf5::check(H5Pset_chunk(properties, numDimensions, chunk), "set the chunks");
    const hdf5::Handle data(
        H5Dcreate2(file, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, properties, H5P_DEFAULT),
        H5Dclose, std::string("create '") + name + "'");
}

void grow(hid_t file, const char* name, hsize_t rows, hsize_t columns, int numDimensions,
          const double* values) {
    const hdf5::Handle data = hdf5::openData(file, name);
    hsize_t size[2] = {0, 0};
    {
        const hdf5::Handle space(H5Dget_space(data), H5Sclose, "read the shape");
        hdf5::check(H5Sget_simple_extent_dims(space, size, nullptr), "read the shape");
    }
    const hsize_t start[2] = {size[0], 0}, count[2] = {rows, columns};
    size[0] += rows;
    hdf5::check(H5Dset_extent(data, size), "lengthen it");
    const hdf5::Handle file_space(H5Dget_space(data), H5Sclose, "read the shape");
    hdf5::check(H5Sselect_hyperslab(file_space, H5S_SELECT_SET, start, nullptr, count, nullptr),
                "select rows");
    const hdf5::Handle memory(H5Screate_simple(numDimensions, count, nullptr), H5Sclose, "shape");
    hdf5::check(H5Dwrite(data, H5T_NATIVE_DOUBLE, memory, file_space, H5P_DEFAULT, values),
                "write rows (is the disk full?)");
}

hdf5::Handle makeTextType() {
    hdf5::Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "describe texts");
    hdf5::check(H5Tset_size(type, H5T_VARIABLE), "describe texts");
    hdf5::check(H5Tset_cset(type, H5T_CSET_UTF8), "describe texts");
    return type;
}

void writeTexts(hid_t file, const char* name, const std::vector<const char*>& texts) {
    const hsize_t size = texts.size();
    const hdf5::Handle type = makeTextType();
    const hdf5::Handle space(H5Screate_simple(1, &size, nullptr), H5Sclose, "shape");
    const hdf5::Handle data(
        H5Dcreate2(file, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
        std::string("create '") + name + "'");
    if (size > 0)
        hdf5::check(H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()),
                    "write texts");
}

std::vector<std::string> readTexts(hid_t file, const char* name) {
    const hdf5::Handle data = hdf5::openData(file, name);
    const hdf5::Handle space(H5Dget_space(data), H5Sclose, "read the shape");
    const hdf5::Handle stored(H5Dget_type(data), H5Tclose, "read the type");
    const hssize_t size = H5Sget_simple_extent_npoints(space);
    if (H5Tis_variable_str(stored) <= 0 || size < 0 || H5Sget_simple_extent_ndims(space) != 1)
        throw std::runtime_error(std::string("'") + name + "' holds no texts");
    if (double(H5Dget_storage_size(data)) < double(size) * double(H5Tget_size(stored)))
        throw std::runtime_error(std::string("'") + name +
                                 "' claims more texts than the file holds");
    const hdf5::Handle type = makeTextType();
    std::vector<char*> texts(size_t(size), nullptr);
    if (size > 0)
        hdf5::check(H5Dread(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, texts.data()), "read texts");
    std::vector<std::string> result;
    for (const char* text : texts) result.emplace_back(text ? text : "");
    if (size > 0) H5Dvlen_reclaim(type, space, H5P_DEFAULT, texts.data());
    return result;
}

Table readCsv(const std::string& path) {
    std::ifstream in = openInputFile(path);
    std::string line;
    if (!std::getline(in, line)) fail(path, "it cannot be read, or is empty");
    Table table;
    const auto head = splitCsv(line);
    for (size_t k = 1; k < head.size(); ++k) {
        const size_t unit = head[k].rfind(" [");
        if (unit == std::string::npos || head[k].back() != ']')
            fail(path, "column '" + head[k] + "' has no unit");
        table.columns.push_back(
            {head[k].substr(0, unit), head[k].substr(unit + 2, head[k].size() - unit - 3)});
    }
    for (int number = 2; std::getline(in, line); ++number) {
        if (in.eof()) break;  // an unterminated line is incomplete
        const char *at = line.data(), *end = at + line.size();
        std::vector<double> row;
        while (true) {
            double value = 0;
            const auto [next, error] = std::from_chars(at, end, value);
            if (error != std::errc())
                fail(path, "line " + std::to_string(number) + " holds something that is no number");
            row.push_back(value);
            if (next == end) break;
            if (*next != ',')
                fail(path, "line " + std::to_string(number) +
                               " has something else than a comma behind a number");
            at = next + 1;
        }
        if (row.size() != head.size())
            fail(path, "line " + std::to_string(number) + " has " + std::to_string(row.size()) +
                           " numbers, expected " + std::to_string(head.size()));
        table.times.push_back(row[0]);
        table.values.insert(table.values.end(), row.begin() + 1, row.end());
    }
    return table;
}

}  // namespace

TableFile::TableFile(const std::string& path, const std::vector<TableColumn>& columns)
    : m_path(path),
      m_numColumns(int(columns.size())),
      m_isCsv(isCsvName(path)),
      m_lastWrite(std::chrono::steady_clock::now()) {
    if (m_isCsv) {
        m_csv.imbue(std::locale::classic());
        m_csv.open(path);
        m_csv << "time [s]";
        for (const TableColumn& column : columns)
            m_csv << ',' << quoted(column.name + " [" + column.unit + "]");
        m_csv << std::endl;
        if (!m_csv) fail(path, "it cannot be written");
        return;
    }
    const hdf5::Quiet quiet;
    try {
        std::vector<const char*> names, units;
        for (const TableColumn& column : columns) {
            names.push_back(column.name.c_str());
            units.push_back(column.unit.c_str());
        }
        const auto file = hdf5::createFile(path);
        hdf5::writeText(file, "format", "simflex time histories");
        hdf5::writeInteger(file, "version", 1);
        createGrowing(file, "time", 1, 1);
        createGrowing(file, "values", columns.size(), 2);
        writeTexts(file, "channels", names);
        writeTexts(file, "units", units);
    } catch (const std::runtime_error& error) {
        fail(path, error.what());
    }
}

TableFile::~TableFile() {
    try {
        flush();
    } catch (const std::exception& error) {
        std::cerr << "simflex: " << error.what() << '\n';
    }
}

void TableFile::append(double time, const double* values) {
    if (m_isCsv) {
        m_line.clear();
        appendNumber(time, m_line);
        for (int k = 0; k < m_numColumns; ++k) {
            m_line += ',';
            appendNumber(values[k], m_line);
        }
        m_line += '\n';
        if (!(m_csv << m_line << std::flush))
            fail(m_path, "it cannot be written; is the disk full?");
        return;
    }
    m_times.push_back(time);
    m_values.insert(m_values.end(), values, values + m_numColumns);
    if (m_values.size() > MostKept ||
        std::chrono::steady_clock::now() - m_lastWrite > WriteInterval)
        flush();
}

void TableFile::flush() {
    if (m_times.empty()) return;
    const hdf5::Quiet quiet;
    try {
        const hdf5::Handle file(H5Fopen(m_path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose,
                                "open it to write on");
        const hsize_t rows = m_times.size();
        grow(file, "values", rows, hsize_t(m_numColumns), 2, m_values.data());
        grow(file, "time", rows, 1, 1, m_times.data());
    } catch (const std::runtime_error& error) {
        m_times.clear();  // keeps the destructor from writing again
        fail(m_path, error.what());
    }
    m_times.clear();
    m_values.clear();
    m_lastWrite = std::chrono::steady_clock::now();
}

std::vector<double> Table::getColumn(const std::string& name) const {
    const auto found = std::find_if(columns.begin(), columns.end(),
                                    [&](const TableColumn& column) { return column.name == name; });
    if (found == columns.end())
        throw std::out_of_range("the table has no column '" + name + "'; it has " +
                                std::to_string(columns.size()) + " others");
    std::vector<double> column;
    for (size_t at = size_t(found - columns.begin()); at < values.size(); at += columns.size())
        column.push_back(values[at]);
    return column;
}

Table readTable(const std::string& path) {
    if (isCsvName(path)) return readCsv(path);
    const hdf5::Quiet quiet;
    try {
        const auto file = hdf5::openFile(path);
        Table table;
        const auto names = readTexts(file, "channels"), units = readTexts(file, "units");
        if (names.size() != units.size())
            throw std::runtime_error("it has " + std::to_string(names.size()) +
                                     " channels, but units of " + std::to_string(units.size()));
        for (size_t k = 0; k < names.size(); ++k) table.columns.push_back({names[k], units[k]});
        table.times = hdf5::readNumbers(file, "time", {0});
        if (!table.times.empty() && !names.empty())
            table.values = hdf5::readNumbers(file, "values", {0, names.size()});
        // Values are written before times: rows without a time are incomplete.
        const size_t count = table.times.size() * names.size();
        if (table.values.size() < count)
            throw std::runtime_error("it has " + std::to_string(table.times.size()) +
                                     " times, but fewer rows of values");
        table.values.resize(count);
        return table;
    } catch (const std::runtime_error& error) {
        fail(path, error.what());
    }
}

}  // namespace simflex
