#pragma once
/** @file
K and M as DMIG entries of a Nastran punch file (EXTSEOUT or PARAM,EXTOUT,DMIGPCH): KAAX and MAAX by
default. Small, large and free field; real matrices (types 1 and 2), symmetric (form 6) or square
(form 1). Grids come from the bulk data file (or any file that readNodeTable() knows), in the basic
system. Small fields have too few digits for a stiffness matrix: punch large ones.

    FeModel crank = readNastranDmig("crank.pch", "crank.bdf");
**/

#include <string>

#include "simflex/base/Progress.h"
#include "simflex/fe/FeModel.h"

namespace simflex {

struct NastranDmigOptions {
    std::string stiffnessName = "KAAX", massName = "MAAX";
    std::string massFile;  ///< empty: the mass matrix is in the same file
    ProgressCallback progress;
};

/** Reads and validates a model. Numbers are taken as they are: see UnitSystem.h.
@throws std::runtime_error if a file cannot be read.
@throws std::invalid_argument naming file, line, what is wrong and what to do: a matrix that is not
    there (with those that are), complex, rectangular; grids in other coordinate systems; rotations
    (components 4 to 6) with entries; matrices that are not symmetric or not free.
@throws Cancelled if options.progress asks to stop. **/
FeModel readNastranDmig(const std::string& punchFile, const std::string& gridsFile,
                        const NastranDmigOptions& options = {});

}  // namespace simflex
