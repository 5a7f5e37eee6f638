#include "simflex/solver/equations/TreeInertias.h"

#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

void TreeInertias::take(int place, const Blocks& blocks) {
    std::vector<Inertia>& inertias = m_places[size_t(place)];
    inertias.resize(blocks.rigid.size());
    for (size_t k = 0; k < inertias.size(); ++k) {
        blocks.rigid[k]->formInertia(inertias[k].matrix);
        inertias[k].isRegular = inertias[k].factors.eliminate(inertias[k].matrix);
    }
}

void TreeInertias::carry(int from, int to, const Blocks& blocks, double* r) {
    if (from == to) return;
    for (size_t k = 0; k < blocks.rigid.size(); ++k) {
        Inertia& inertia = m_places[size_t(from)][k];
        if (!inertia.isRegular) continue;
        double* own = r + blocks.rigid[k]->firstU;
        m_accelerations.assign(own, own + blocks.rigid[k]->numU);
        inertia.factors.solveInPlace(m_accelerations.data());
        m_places[size_t(to)][k].matrix.multiply(m_accelerations.data(), own, m_workspace);
    }
}

}  // namespace simflex
