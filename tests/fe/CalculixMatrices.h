#pragma once
/** @file
K and M as CalculiX assembles them of a deck's solids, for comparison. **/

#include <Eigen/Dense>

#include "simflex/fe/decks/DeckModel.h"
#include "support/TestFolder.h"

namespace simflex {
namespace testing {

/** Rows 3·mesh index + axis; M one row a direction, too. The text they come from has 14 digits. **/
struct CalculixMatrices {
    Eigen::MatrixXd K, M;
};

/** Of the solids alone: writes nodes, elements, materials and sections in the folder, runs ccx with
`*FREQUENCY, SOLVER=MATRIXSTORAGE` and reads what it stores. Solids of B32R and layers are left
out. **/
CalculixMatrices calcCalculixMatrices(const TestFolder& folder, const DeckModel& deck);

}  // namespace testing
}  // namespace simflex
