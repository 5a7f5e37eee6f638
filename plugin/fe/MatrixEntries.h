#pragma once
/** @file
Converts the entries of a matrix file to the symmetric matrices of an FeModel. Internal to fe. **/

#include <cstdint>
#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

/** Unordered entries of a sparse matrix, 0-based; duplicates are added. **/
struct MatrixEntries {
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;

    void add(std::int32_t row, std::int32_t column, double value) {
        rows.push_back(row), columns.push_back(column), values.push_back(value);
    }
};

/** Form of a file's entries: each given once, in either triangle; or both triangles. **/
enum class MatrixForm { Symmetric, General };

/** Makes a symmetric matrix with one row per nodal translation, 3·node + axis. A general matrix
with entries in one triangle only is taken as symmetric.
@param what  for messages: "K.mtx: the stiffness matrix".
@throws std::invalid_argument if it is not symmetric, naming the nodes. **/
SymmetricMatrix makeSymmetric(const MatrixEntries& entries, MatrixForm form, const Mesh& mesh,
                              const std::string& what);

/** Extracts m from M = m ⊗ 1₃, M with one row per nodal translation.
@throws std::invalid_argument if M has another form. **/
SymmetricMatrix takeNodalMass(const SymmetricMatrix& M, const Mesh& mesh);

/** Returns the matrix with additional entries of its lower triangle, enlarged to `size` rows. **/
SymmetricMatrix addEntries(const SymmetricMatrix& A, MatrixEntries more, int size);

}  // namespace simflex
