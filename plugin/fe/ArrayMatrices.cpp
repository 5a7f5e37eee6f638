#include "simflex/fe/ArrayMatrices.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/fe/decks/NodeTable.h"
#include "simflex/part/ArrayFile.h"

namespace simflex {
namespace {

constexpr double LargestNumber = std::numeric_limits<int>::max();

class ArrayModel {
public:
    explicit ArrayModel(const std::string& path) : m_path(path), m_arrays(readArrayFile(path)) {}

    FeModel read(const ProgressCallback& progress) {
        const FileArray &K = find("K", "stiffness matrix"), &M = find("M", "mass matrix");
        NodeTable nodes = readNodes(find("nodes", "positions of its nodes"));
        for (const FileArray* A : {&K, &M})
            if (A->numRows() != A->numColumns() || A->numRows() != 3 * nodes.mesh.numNodes())
                refuse(*A, "has " + std::to_string(A->numRows()) + "×" +
                               std::to_string(A->numColumns()) +
                               " entries; it must have three rows and columns for each of the " +
                               std::to_string(nodes.mesh.numNodes()) + " nodes");
        readSets(nodes);
        return assembleModel(m_path, "", std::move(nodes), readMatrix(K), readMatrix(M), progress);
    }

private:
    [[noreturn]] void refuse(const FileArray& array, const std::string& what) const {
        throw std::invalid_argument(m_path + ": " + array.name + " " + what);
    }

    const FileArray& find(const std::string& name, const char* what) const {
        std::string others;
        for (const FileArray& array : m_arrays) {
            if (array.name == name) return array;
            others += (others.empty() ? "" : ", ") + array.name;
        }
        throw std::invalid_argument(m_path + ": it has no array " + name + ", the " + what +
                                    "; it has " + (others.empty() ? "none of numbers" : others));
    }

    NodeTable readNodes(const FileArray& array) {
        const size_t count = size_t(array.numRows()), width = size_t(array.numColumns());
        if (array.isSparse() || (width != 3 && width != 4) || count == 0)
            refuse(array, "has " + std::to_string(count) + "×" + std::to_string(width) +
                              " entries; it must have a row x y z, or number x y z, for each node");
        NodeTable table;
        m_row.resize(count);
        std::vector<std::pair<int, size_t>> byNumber;
        for (size_t k = 0; k < count; ++k) {
            const double number = width == 4 ? array.values[k] : double(k + 1);
            if (!(number >= 1 && number <= LargestNumber) || number != std::floor(number))
                refuse(array, "numbers a node " + writeGeneral(number, 10) +
                                  "; it must be a whole number from 1 on");
            byNumber.emplace_back(int(number), k);
        }
        std::sort(byNumber.begin(), byNumber.end());
        for (const auto& [number, row] : byNumber) {
            if (!table.mesh.nodeNumbers.empty() && table.mesh.nodeNumbers.back() == number)
                refuse(array, "has node " + std::to_string(number) + " twice");
            m_row[row] = table.mesh.numNodes();
            table.mesh.nodeNumbers.push_back(number);
            for (size_t a = 0; a < 3; ++a)
                table.mesh.positions.push_back(array.values[row + count * (width - 3 + a)]);
        }
        return table;
    }

    void readSets(NodeTable& nodes) const {
        const auto& numbers = nodes.mesh.nodeNumbers;
        for (const FileArray& array : m_arrays) {
            if (array.name == "K" || array.name == "M" || array.name == "nodes") continue;
            std::vector<int> members;
            for (const double value : array.values) {
                const auto at = std::lower_bound(numbers.begin(), numbers.end(), value);
                if (at == numbers.end() || *at != value) break;
                members.push_back(int(at - numbers.begin()));
            }
            const bool isSet = !members.empty() && !array.isSparse() &&
                               members.size() == array.values.size() &&
                               std::min(array.numRows(), array.numColumns()) == 1;
            if (!isSet) {
                nodes.notes.push_back("left out array " + array.name +
                                      ", which is no list of node numbers");
                continue;
            }
            std::sort(members.begin(), members.end());
            members.erase(std::unique(members.begin(), members.end()), members.end());
            nodes.mesh.nodeSets[array.name] = std::move(members);
        }
    }

    int dofOf(std::int64_t row) const { return 3 * m_row[size_t(row / 3)] + int(row % 3); }

    MatrixFile readMatrix(const FileArray& array) const {
        MatrixFile file;
        file.what = m_path + ": the matrix " + array.name;
        const std::int64_t size = array.numRows();
        for (std::int64_t column = 0; column < size; ++column) {
            const std::int64_t first = array.isSparse() ? array.columnStarts[size_t(column)]
                                                        : column * size,
                               last = array.isSparse() ? array.columnStarts[size_t(column) + 1]
                                                       : first + size;
            for (std::int64_t k = first; k < last; ++k)
                if (const double value = array.values[size_t(k)]; value != 0)
                    file.entries.add(dofOf(array.isSparse() ? array.rows[size_t(k)] : k - first),
                                     dofOf(column), value);
        }
        return file;
    }

    std::string m_path;
    std::vector<FileArray> m_arrays;
    std::vector<int> m_row;  ///< mesh index of the node of each three rows of K
};

/** Makes both triangles of a symmetric matrix, with every entry repeated `axes` times along the
diagonal. **/
FileArray makeSparse(const std::string& name, const SymmetricMatrix& A, int axes) {
    const auto size = size_t(A.size);
    std::vector<std::vector<std::pair<std::int64_t, double>>> columns(size);
    for (size_t column = 0; column < size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k) {
            const auto row = size_t(A.rows[size_t(k)]);
            columns[column].emplace_back(std::int64_t(row), A.values[size_t(k)]);
            if (row != column) columns[row].emplace_back(std::int64_t(column), A.values[size_t(k)]);
        }
    FileArray array;
    array.name = name;
    array.shape = {axes * A.size, axes * A.size};
    for (auto& column : columns) {
        std::sort(column.begin(), column.end());
        for (int axis = 0; axis < axes; ++axis) {
            array.columnStarts.push_back(std::int64_t(array.values.size()));
            for (const auto& [row, value] : column) {
                array.rows.push_back(axes * row + axis);
                array.values.push_back(value);
            }
        }
    }
    array.columnStarts.push_back(std::int64_t(array.values.size()));
    return array;
}

}  // namespace

FeModel readArrayMatrices(const std::string& path, const ProgressCallback& progress) {
    reportProgress(progress, "reading the matrices", 0);
    return ArrayModel(path).read(progress);
}

void writeArrayMatrices(const FeModel& model, const std::string& path) {
    if (!model.constraints.empty())
        throw std::invalid_argument(
            path + ": a model with constraints (ties, shells, beams) cannot be written as K and M");
    const size_t count = size_t(model.mesh.numNodes());
    std::vector<double> nodes(4 * count);
    for (size_t k = 0; k < count; ++k) {
        nodes[k] = model.mesh.nodeNumbers[k];
        const auto x = model.mesh.position(int(k));
        for (size_t a = 0; a < 3; ++a) nodes[k + count * (a + 1)] = x[a];
    }
    std::vector<FileArray> arrays = {makeSparse("K", model.K, 1), makeSparse("M", model.m, 3),
                                     makeArray("nodes", std::int64_t(count), 4, std::move(nodes))};
    for (const auto& [name, members] : model.mesh.nodeSets) {
        std::vector<double> numbers;
        for (const int node : members) numbers.push_back(model.mesh.nodeNumbers[size_t(node)]);
        arrays.push_back(makeArray(name, std::int64_t(members.size()), 1, std::move(numbers)));
    }
    writeArrayFile(path, arrays);
}

}  // namespace simflex
