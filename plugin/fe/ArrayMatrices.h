#pragma once
/** @file
K and M of one free part from MATLAB (.mat) or NumPy (.npz).

- K, M: 3 rows per node, sparse or dense, symmetric; M = m ⊗ 1₃. In a .npz a sparse matrix is
  SciPy's K_data, K_indices, K_indptr.
- nodes: a row x y z, or number x y z, for each node, in the order of the rows of K.
- Every other vector of integers is a node set of its name.

In NumPy, with sparse K and M:

    np.savez("crank.npz", K_data=K.data, K_indices=K.indices, K_indptr=K.indptr,
             M_data=M.data, M_indices=M.indices, M_indptr=M.indptr, nodes=xyz, seat=[3, 17, 18])

In MATLAB: save crank.mat K M nodes seat **/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Reads and validates a model. Numbers are not converted: see UnitSystem.h.
@throws std::runtime_error if the file cannot be read.
@throws std::invalid_argument naming file, array, error and remedy.
@throws Cancelled if progress requests it. **/
FeModel readArrayMatrices(const std::string& path, const ProgressCallback& progress = {});

/** Writes K, M (sparse), nodes and node sets, which readArrayMatrices() reads back bit-identically.
Elements are omitted.
@throws std::invalid_argument for a model with constraints, which the file cannot represent.
@throws std::runtime_error if the file cannot be written. **/
void writeArrayMatrices(const FeModel& model, const std::string& path);

}  // namespace simflex
