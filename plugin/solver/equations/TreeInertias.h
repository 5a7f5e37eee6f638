#pragma once
/** @file
M of rigid trees at several positions (private header). In joint coordinates M of a long chain is
ill-conditioned: small rotations change it little but M⁻¹ΔM much. A Newton matrix from one position
then corrects forces at another poorly, but accelerations well. Forces are therefore transformed by

    r ← M₀ M_i⁻¹ r

with M₀ at the matrix's position, each product in O(n). **/

#include <vector>

#include "simflex/solver/elimination/TreeFactors.h"
#include "simflex/solver/equations/Blocks.h"

namespace simflex {

class TreeInertias {
public:
    explicit TreeInertias(int numPlaces) : m_places(size_t(numPlaces)) {}

    /** Stores the trees' current M under this index. **/
    void take(int place, const Blocks& blocks);
    /** r ← M(to) M(from)⁻¹ r of the trees. **/
    void carry(int from, int to, const Blocks& blocks, double* r);

private:
    struct Inertia {
        BasicTreeMatrix<double> matrix;
        TreeFactors<double> factors;
        bool isRegular = false;
    };
    std::vector<std::vector<Inertia>> m_places;
    std::vector<double> m_accelerations, m_workspace;
};

}  // namespace simflex
