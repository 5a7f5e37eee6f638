#pragma once
/** @file
Node positions of a model whose matrices are in separate files. Internal to fe. **/

#include <string>
#include <unordered_map>
#include <vector>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"
#include "simflex/fe/MatrixEntries.h"
#include "simflex/part/TextLines.h"

namespace simflex {

struct NodeTable {
    Mesh mesh;               ///< elements and node sets if the file has them
    std::vector<int> order;  ///< mesh index of each node in the order of the file
    std::vector<std::string> notes;
};

/** Reads nodes from a file, whose format is determined by its suffix:

- .inp: a CalculiX or Abaqus deck, of which only nodes, solid elements and node sets are used; at
  most one part and one instance;
- .bdf, .nas, .dat, .blk, .pch: Nastran bulk data, GRID entries in the basic system;
- anything else: a table `number x y z`, separated by blanks, commas or semicolons. Lines that begin
  with # % ! * or $ are comments; the first line may be a header.

@throws std::runtime_error if the file cannot be read. @throws std::invalid_argument naming file and
line. **/
NodeTable readNodeTable(const std::string& path);

/** Matrix entries by node number and direction. **/
class NodalEntries {
public:
    explicit NodalEntries(const NodeTable& nodes);

    /** Adds an entry of the current line. Zero entries of rotations (4 to 6) are ignored.
    @throws std::invalid_argument for a node that the table lacks, or a non-zero rotation entry. **/
    void add(const TextLines& at, int node1, int direction1, int node2, int direction2,
             double value);

    MatrixEntries entries;

private:
    int findDof(const TextLines& at, int node, int direction) const;

    std::unordered_map<int, int> m_indexOf;
};

/** A matrix and the form stated by its file. **/
struct MatrixFile {
    std::string what;  ///< "K.mtx: the stiffness matrix"
    MatrixEntries entries;
    MatrixForm form = MatrixForm::General;
};

/** Assembles the model: removes nodes without stiffness or mass (with a note), makes the matrices
symmetric, extracts m from M and validates the result.
@throws std::invalid_argument. **/
FeModel assembleModel(const std::string& source, const std::string& program, NodeTable nodes,
                      MatrixFile K, MatrixFile M, const ProgressCallback& progress);

}  // namespace simflex
