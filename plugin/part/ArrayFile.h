#pragma once
/** @file
Named arrays in the files of MATLAB (.mat of format 5: save -v6 and -v7) and NumPy (.npz). Standard
types only.

    std::vector<FileArray> arrays = readArrayFile("crank.npz");
    writeArrayFile("rod.mat", {makeArray("K", 60, 60, values)});

A sparse matrix is one variable of a .mat; in a .npz it is SciPy's three arrays K_data, K_indices,
K_indptr, by columns (or by rows, which is the same for a symmetric matrix). **/

#include <cstdint>
#include <string>
#include <vector>

namespace simflex {

struct FileArray {
    std::string name;
    std::vector<std::int64_t> shape;
    std::vector<double> values;  ///< first index fastest; stored values of a sparse matrix
    std::vector<std::int64_t> columnStarts;  ///< of a sparse matrix, else empty
    std::vector<std::int64_t> rows;          ///< row of each stored value, 0-based
    std::vector<std::string> texts;          ///< UTF-8, instead of numbers; written, not read

    bool isSparse() const { return !columnStarts.empty(); }
    std::int64_t numRows() const { return shape.empty() ? 1 : shape[0]; }
    std::int64_t numColumns() const { return shape.size() < 2 ? 1 : shape[1]; }
};

/** Returns whether the name has an extension that is supported here. **/
bool isArrayFile(const std::string& path);

/** Makes a dense matrix; `values` is column-major. **/
FileArray makeArray(const std::string& name, std::int64_t numRows, std::int64_t numColumns,
                    std::vector<double> values);

/** Reads the real numeric arrays with at most two dimensions; others are ignored.
@throws std::runtime_error or std::invalid_argument naming a file that is damaged or cannot be
read. **/
std::vector<FileArray> readArrayFile(const std::string& path);

/** Writes arrays; equal arrays give equal bytes. @throws std::runtime_error if the file cannot be
written. **/
void writeArrayFile(const std::string& path, const std::vector<FileArray>& arrays);

}  // namespace simflex
