#pragma once
/** @file
Time histories in a file that grows during a run: one row per time, one column per channel. The
extension determines the format, .csv or .h5 (.hdf5). Standard types only.

    TableFile table("run.csv", {{"crank.118.von_mises", "Pa"}, {"crank.118.displacement_x", "m"}});
    table.append(0.001, values);
    Table run = readTable("run.csv");

CSV: a header line of `name [unit]`, then one line per row, written immediately and with all digits.
HDF5: `/time` (rows), `/values` (rows×channels), `/channels` and `/units` (texts). The HDF5 file is
written and closed about every second, so an interrupted or killed run leaves its results so far;
read it with h5py as

    f = h5py.File("run.h5"); t = f["time"][:]
    x = f["values"][:, list(f["channels"].asstr()).index(name)]  **/

#include <chrono>
#include <fstream>
#include <string>
#include <vector>

namespace simflex {

struct TableColumn {
    std::string name, unit;
};

class TableFile {
public:
    /** Creates the file or replaces an existing one.
    @throws std::invalid_argument for another extension. @throws std::runtime_error if the file
    cannot be written. **/
    TableFile(const std::string& path, const std::vector<TableColumn>& columns);
    /** Writes buffered rows; reports failure on std::cerr. **/
    ~TableFile();
    TableFile(const TableFile&) = delete;
    TableFile& operator=(const TableFile&) = delete;

    /** Appends a row. @param values  one per column
    @throws std::runtime_error naming the file if it cannot be written. **/
    void append(double time, const double* values);
    /** Writes buffered rows. @throws std::runtime_error. **/
    void flush();

    const std::string& getPath() const { return m_path; }
    int getNumColumns() const { return m_numColumns; }

private:
    std::string m_path;
    int m_numColumns = 0;
    bool m_isCsv = false;
    std::ofstream m_csv;
    std::string m_line;
    std::vector<double> m_times, m_values;  ///< rows not yet in the HDF5 file
    std::chrono::steady_clock::time_point m_lastWrite;
};

struct Table {
    std::vector<TableColumn> columns;
    std::vector<double> times;
    std::vector<double> values;  ///< rows×columns, row by row

    /** @throws std::out_of_range naming the column asked for. **/
    std::vector<double> getColumn(const std::string& name) const;
};

/** @throws std::runtime_error naming the file and the error. **/
Table readTable(const std::string& path);

}  // namespace simflex
