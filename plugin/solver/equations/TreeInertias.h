#pragma once
/** @file
M of rigid trees at several places (private header). In joint coordinates M of a long chain is
ill-conditioned: small turns change it little and M⁻¹ΔM much. A matrix of one place then corrects
forces at another badly, and accelerations well: these are

    r ← M₀ M_i⁻¹ r

with M₀ of the matrix's place, each product in O(n). **/

#include <vector>

#include "simflex/solver/elimination/TreeFactors.h"
#include "simflex/solver/equations/Blocks.h"

namespace simflex {

class TreeInertias {
public:
    explicit TreeInertias(int numPlaces) : m_places(size_t(numPlaces)) {}

    /** The trees' M where they are now, at this place from now on. **/
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
