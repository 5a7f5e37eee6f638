#pragma once
/** @file
Named arrays in the files of MATLAB (.mat of format 5: save -v6 and -v7) and NumPy (.npz). Standard
types only.

    std::vector<FileArray> arrays = readArrayFile("crank.npz");
    writeArrayFile("rod.mat", {makeArray("K", 60, 60, values)});

A sparse matrix is one variable of a .mat; in a .npz it is SciPy's three arrays K_data, K_indices,
K_indptr, by columns (or by rows, which for a symmetric matrix is the same). **/

#include <cstdint>
#include <string>
#include <vector>

namespace simflex {

struct FileArray {
    std::string name;
    std::vector<std::int64_t> shape;
    std::vector<double> values;  ///< the first index runs fastest; of a sparse matrix those stored
    std::vector<std::int64_t> columnStarts;  ///< of a sparse matrix, else empty
    std::vector<std::int64_t> rows;          ///< of its values, 0-based
    std::vector<std::string> texts;          ///< in UTF-8, instead of numbers; written, not read

    bool isSparse() const { return !columnStarts.empty(); }
    std::int64_t numRows() const { return shape.empty() ? 1 : shape[0]; }
    std::int64_t numColumns() const { return shape.size() < 2 ? 1 : shape[1]; }
};

/** True for names of files that are read and written here. **/
bool isArrayFile(const std::string& path);

/** A dense matrix; `values` by columns. **/
FileArray makeArray(const std::string& name, std::int64_t numRows, std::int64_t numColumns,
                    std::vector<double> values);

/** The real numeric arrays of a file of at most two dimensions; others are passed over.
@throws std::runtime_error or std::invalid_argument naming a file that is damaged or cannot be
read. **/
std::vector<FileArray> readArrayFile(const std::string& path);

/** The same arrays give the same bytes. @throws std::runtime_error if it cannot be written. **/
void writeArrayFile(const std::string& path, const std::vector<FileArray>& arrays);

}  // namespace simflex
