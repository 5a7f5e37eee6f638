#pragma once
/** @file
K and M of one free part in the Matrix Market format, from any program that can write a sparse
matrix.

- K, M: `%%MatrixMarket matrix coordinate real symmetric` (or general; it must be symmetric then;
  integer entries too), 3 rows a node, both of the same size. M = m ⊗ 1₃.
- nodes: a table `number x y z`, or a deck (.inp) or bulk data (.bdf …) with them: see
  readNodeTable(). Elements and node sets of a deck come along, for pictures and interfaces.
- Row 3·k + axis belongs to the k-th node of that file (0-based), unless a file of the degrees of
  freedom says otherwise: `node direction` (or node.direction, as ccx writes it) for each row.

    FeModel crank = readMatrixMarket("K.mtx", "M.mtx", "nodes.csv");
    writeMatrixMarket(crank, "out/crank");   // crank_K.mtx, crank_M.mtx, crank_nodes.inp
**/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

struct MatrixMarketOptions {
    std::string dofs;  ///< file of the degrees of freedom; empty: by the order of the nodes
    ProgressCallback progress;
};

/** Reads and validates a model. Numbers are taken as they are: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, what is wrong and what to do.
@throws Cancelled if options.progress asks to stop. **/
FeModel readMatrixMarket(const std::string& stiffnessFile, const std::string& massFile,
                         const std::string& nodesFile, const MatrixMarketOptions& options = {});

/** Writes prefix_K.mtx, prefix_M.mtx (symmetric, 17 digits) and prefix_nodes.inp (nodes, elements
and node sets): what readMatrixMarket() reads back to the same bits.
@throws std::invalid_argument for a model with constraints, which the files could not hold.
@throws std::runtime_error if a file cannot be written. **/
void writeMatrixMarket(const FeModel& model, const std::string& prefix);

}  // namespace simflex
