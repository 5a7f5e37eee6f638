#pragma once
/** @file
K and M as Abaqus writes them in text:

    *STEP
    *MATRIX GENERATE, STIFFNESS, MASS
    *MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=MATRIX INPUT
    *END STEP

gives JOB_STIF1.mtx and JOB_MASS1.mtx with lines `node, direction, node, direction, value`.
FORMAT=COORDINATE (`row column value`) is read too; its rows are taken as three a node, in the order
of the node numbers. One triangle may be given or both; element by element entries are added. Nodes
come from the deck (or any file that readNodeTable() knows), elements and node sets with them; nodes
that the matrices do not have are left out. Boundary conditions must be absent: K must be free.

    FeModel crank = readAbaqusMatrices("job_STIF1.mtx", "job_MASS1.mtx", "job.inp");
**/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Reads and validates a model. Numbers are taken as they are: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, what is wrong and what to do: rotations (directions
    4 to 6) with entries, internal nodes, matrices that are not symmetric or not free.
@throws Cancelled if progress asks to stop. **/
FeModel readAbaqusMatrices(const std::string& stiffnessFile, const std::string& massFile,
                           const std::string& nodesFile, const ProgressCallback& progress = {});

}  // namespace simflex
