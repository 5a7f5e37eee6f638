#pragma once
/** @file
Time histories in a file that grows while a run goes on: one row a time, one column a channel. The
ending of the name says the format, .csv or .h5 (.hdf5). Standard types only.

    TableFile table("run.csv", {{"crank.118.von_mises", "Pa"}, {"crank.118.displacement_x", "m"}});
    table.append(0.001, values);
    Table run = readTable("run.csv");

CSV: a head line of `name [unit]`, then a line a row, written at once, with all digits. HDF5:
`/time` (rows), `/values` (rows×channels), `/channels` and `/units` (texts). It is written and
closed again about every second, so that a run that is stopped, or killed, leaves what was done till
then; read it with h5py as

    f = h5py.File("run.h5"); t = f["time"][:]; x = f["values"][:,
list(f["channels"].asstr()).index(name)]
**/

#include <chrono>
#include <fstream>
#include <string>
#include <vector>

namespace simflex {

/** Name and unit of a column. **/
struct TableColumn {
    std::string name, unit;
};

class TableFile {
public:
    /** Creates the file; one that exists is replaced.
    @throws std::invalid_argument for another ending. @throws std::runtime_error if it cannot be
        written. **/
    TableFile(const std::string& path, const std::vector<TableColumn>& columns);
    /** Writes what is left; says so on std::cerr if it cannot. **/
    ~TableFile();
    TableFile(const TableFile&) = delete;
    TableFile& operator=(const TableFile&) = delete;

    /** Adds a row. @param values  of each column
    @throws std::runtime_error naming the file if it cannot be written. **/
    void append(double time, const double* values);
    /** Writes what is kept back. @throws std::runtime_error. **/
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

/** A table read back. **/
struct Table {
    std::vector<TableColumn> columns;
    std::vector<double> times;
    std::vector<double> values;  ///< rows×columns, row by row

    /** @throws std::out_of_range naming the column asked for. **/
    std::vector<double> getColumn(const std::string& name) const;
};

/** @throws std::runtime_error naming the file and what is wrong with it. **/
Table readTable(const std::string& path);

}  // namespace simflex
