#include "simflex/solver/SteadyMotion.h"

namespace simflex {

using namespace SimTK;

SteadyMotion::SteadyMotion(const MultibodyEquations& equations, const State& state, const double* q,
                           const double* u)
    : m_u(u, u + equations.numU()) {
    for (int b = 0; b < equations.numFlexibleBlocks(); ++b) {
        const Block& block = equations.getBlock(b);
        Turning turning;
        turning.isFlexible = true;
        turning.q0 = block.firstQ;
        turning.p0 = block.firstQ + 4;
        turning.u0 = block.firstU;
        turning.omega = rotationOf(q + block.firstQ) * Vec3::getAs(u + block.firstU);
        turning.v = Vec3::getAs(u + block.firstU + 3);
        turning.p = Vec3::getAs(q + turning.p0);
        m_turning.push_back(turning);
        std::fill_n(m_u.begin() + block.firstU, block.numU, 0.0);
    }
    const SimbodyMatterSubsystem& matter = equations.getMatter();
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        Turning turning;
        int nq;
        if (!equations.findRigidSlots(i, turning.q0, nq, turning.u0) ||
            !MobilizedBody::Free::isInstanceOf(mobod) ||
            mobod.getParentMobilizedBody().getMobilizedBodyIndex() != GroundIndex)
            continue;
        turning.isFlexible = false;
        turning.p0 = turning.q0 + (mobod.getNumQ(state) == 7 ? 4 : 3);
        turning.omega = Vec3::getAs(u + turning.u0);
        turning.v = Vec3::getAs(u + turning.u0 + 3);
        turning.p = Vec3::getAs(q + turning.p0);
        m_turning.push_back(turning);
    }
}

void SteadyMotion::calcSpeeds(const double* q, std::vector<double>& u,
                              std::vector<double>& uDot) const {
    std::fill(u.begin(), u.end(), 0.0);
    std::fill(uDot.begin(), uDot.end(), 0.0);
    for (size_t i = 0; i < m_u.size(); ++i) u[i] = m_factor * m_u[i];
    for (const Turning& turning : m_turning) {
        const Vec3 omega = m_factor * turning.omega;
        const Vec3 v = m_factor * turning.v + omega % (Vec3::getAs(q + turning.p0) - turning.p);
        const Vec3 vDot = omega % v;
        Vec3::updAs(u.data() + turning.u0) =
            turning.isFlexible ? ~rotationOf(q + turning.q0) * omega : omega;
        Vec3::updAs(u.data() + turning.u0 + 3) = v;
        Vec3::updAs(uDot.data() + turning.u0 + 3) = vDot;
    }
}

}  // namespace simflex
