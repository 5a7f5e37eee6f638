#pragma once
/** @file
From the entries of a matrix file to the symmetric matrices of an FeModel. Internal to fe. **/

#include <cstdint>
#include <string>
#include <vector>

#include "simflex/fe/FeModel.h"

namespace simflex {

/** Entries of a sparse matrix, 0-based, in any order; given several times they are added. **/
struct MatrixEntries {
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;

    void add(std::int32_t row, std::int32_t column, double value) {
        rows.push_back(row), columns.push_back(column), values.push_back(value);
    }
};

/** What a file says of its entries: each is given once, in either triangle; or both triangles are
there. **/
enum class MatrixForm { Symmetric, General };

/** Makes a symmetric matrix of one row per nodal translation, 3·node + axis. A general matrix with
entries in one triangle alone counts as symmetric.
@param what  for messages: "K.mtx: the stiffness matrix".
@throws std::invalid_argument if it is not symmetric, naming the nodes. **/
SymmetricMatrix makeSymmetric(const MatrixEntries& entries, MatrixForm form, const Mesh& mesh,
                              const std::string& what);

/** Takes m out of M = m ⊗ 1₃, M one row per nodal translation.
@throws std::invalid_argument if M is not that. **/
SymmetricMatrix takeNodalMass(const SymmetricMatrix& M, const Mesh& mesh);

/** The matrix with more entries, of its lower triangle, and so many rows. **/
SymmetricMatrix addEntries(const SymmetricMatrix& A, MatrixEntries more, int size);

}  // namespace simflex
