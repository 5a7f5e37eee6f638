#pragma once
/** @file
Where the nodes are of a model whose matrices come from a file of their own. Internal to fe. **/

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

/** Reads nodes by the kind of file, told by its name:
- .inp: a CalculiX or Abaqus deck, of which only nodes, solid elements and node sets matter; one
  part and one instance at the most;
- .bdf, .nas, .dat, .blk, .pch: Nastran bulk data, GRID entries in the basic system;
- anything else: a table `number x y z`, separated by blanks, commas or semicolons. Lines that begin
  with # % ! * or $ are comments; the first line may be a header.
@throws std::runtime_error if the file cannot be read. @throws std::invalid_argument naming file and
line. **/
NodeTable readNodeTable(const std::string& path);

/** Entries of a matrix as files name them: by node number and direction. **/
class NodalEntries {
public:
    explicit NodalEntries(const NodeTable& nodes);

    /** Adds an entry of the line at hand. Zero entries of rotations (4 to 6) are left out.
    @throws std::invalid_argument for a node that the table lacks, or a rotation. **/
    void add(const TextLines& at, int node1, int direction1, int node2, int direction2,
             double value);

    MatrixEntries entries;

private:
    int findDof(const TextLines& at, int node, int direction) const;

    std::unordered_map<int, int> m_indexOf;
};

/** A matrix and what its file says of its form. **/
struct MatrixFile {
    std::string what;  ///< "K.mtx: the stiffness matrix"
    MatrixEntries entries;
    MatrixForm form = MatrixForm::General;
};

/** Puts together the model: nodes without stiffness or mass are left out (with a note), the
matrices made symmetric, m taken out of M, everything validated.
@throws std::invalid_argument. **/
FeModel assembleModel(const std::string& source, const std::string& program, NodeTable nodes,
                      MatrixFile K, MatrixFile M, const ProgressCallback& progress);

}  // namespace simflex
