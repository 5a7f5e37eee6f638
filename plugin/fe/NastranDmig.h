#pragma once
/** @file
K and M as DMIG entries of a Nastran punch file (EXTSEOUT or PARAM,EXTOUT,DMIGPCH): KAAX and MAAX by
default. Small, large and free field; real matrices (types 1 and 2), symmetric (form 6) or square
(form 1). Grids come from the bulk data file (or any file supported by readNodeTable()), in the
basic system. Small fields have too few digits for a stiffness matrix: punch large ones.

    FeModel crank = readNastranDmig("crank.pch", "crank.bdf");  **/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

struct NastranDmigOptions {
    std::string stiffnessName = "KAAX", massName = "MAAX";
    std::string massFile;  ///< empty: same file as the stiffness matrix
    ProgressCallback progress;
};

/** Reads and validates a model. Numbers are not converted: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, error and remedy: a missing matrix (listing the
existing ones), a complex or rectangular one; grids in other coordinate systems; rotations
(components 4 to 6) with entries; matrices that are not symmetric or not free.
@throws Cancelled if options.progress requests it. **/
FeModel readNastranDmig(const std::string& punchFile, const std::string& gridsFile,
                        const NastranDmigOptions& options = {});

}  // namespace simflex
