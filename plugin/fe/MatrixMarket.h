#pragma once
/** @file
K and M of one free part in Matrix Market format, from any program that writes sparse matrices.

- K, M: `%%MatrixMarket matrix coordinate real symmetric` (or general, but numerically symmetric;
  integer entries too), 3 rows per node, both of the same size. M = m ⊗ 1₃.
- nodes: a table `number x y z`, or a deck (.inp) or bulk data (.bdf …): see readNodeTable().
  Elements and node sets of a deck are read as well, for pictures and interfaces.
- Row 3·k + axis belongs to the k-th node of that file (0-based), unless a file of the degrees of
  freedom gives `node direction` (or node.direction, as written by ccx) for each row.

    FeModel crank = readMatrixMarket("K.mtx", "M.mtx", "nodes.csv");
    writeMatrixMarket(crank, "out/crank");   // crank_K.mtx, crank_M.mtx, crank_nodes.inp  **/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

struct MatrixMarketOptions {
    std::string dofs;  ///< file of the degrees of freedom; empty: in the order of the nodes
    ProgressCallback progress;
};

/** Reads and validates a model. Numbers are not converted: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, error and remedy.
@throws Cancelled if options.progress requests it. **/
FeModel readMatrixMarket(const std::string& stiffnessFile, const std::string& massFile,
                         const std::string& nodesFile, const MatrixMarketOptions& options = {});

/** Writes prefix_K.mtx, prefix_M.mtx (symmetric, 17 digits) and prefix_nodes.inp (nodes, elements
and node sets), which readMatrixMarket() reads back bit-identically.
@throws std::invalid_argument for a model with constraints, which the files cannot represent.
@throws std::runtime_error if a file cannot be written. **/
void writeMatrixMarket(const FeModel& model, const std::string& prefix);

}  // namespace simflex
