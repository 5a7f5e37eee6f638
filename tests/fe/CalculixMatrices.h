#pragma once
/** @file
K and M of a deck's solids as assembled by CalculiX, for comparison. **/

#include <Eigen/Dense>

#include "simflex/fe/decks/DeckModel.h"
#include "support/TestFolder.h"

namespace simflex {
namespace testing {

/** Rows 3·mesh index + axis; M also has one row per direction. The source text has 14 digits. **/
struct CalculixMatrices {
    Eigen::MatrixXd K, M;
};

/** For solids only: writes nodes, elements, materials and sections to the folder, runs ccx with
`*FREQUENCY, SOLVER=MATRIXSTORAGE` and reads the stored matrices. Solids of B32R and layers are left
out. **/
CalculixMatrices calcCalculixMatrices(const TestFolder& folder, const DeckModel& deck);

}  // namespace testing
}  // namespace simflex
