#pragma once
/** @file
K and M as written by Abaqus in text form:

    *STEP
    *MATRIX GENERATE, STIFFNESS, MASS
    *MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=MATRIX INPUT
    *END STEP

gives JOB_STIF1.mtx and JOB_MASS1.mtx with lines `node, direction, node, direction, value`.
FORMAT=COORDINATE (`row column value`) is read too; its rows are assumed to be three per node, in
the order of the node numbers. One triangle or both may be given; element-by-element entries are
added. Nodes, elements and node sets come from the deck (or any file supported by readNodeTable());
nodes without matrix entries are left out. Boundary conditions must be absent: K must be free.

    FeModel crank = readAbaqusMatrices("job_STIF1.mtx", "job_MASS1.mtx", "job.inp");  **/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

/** Reads and validates a model. Numbers are not converted: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, error and remedy: rotations (directions 4 to 6)
with entries, internal nodes, matrices that are not symmetric or not free.
@throws Cancelled if progress requests it. **/
FeModel readAbaqusMatrices(const std::string& stiffnessFile, const std::string& massFile,
                           const std::string& nodesFile, const ProgressCallback& progress = {});

}  // namespace simflex
