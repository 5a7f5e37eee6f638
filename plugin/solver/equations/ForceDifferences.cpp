#include "simflex/solver/equations/ForceDifferences.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/UnusablePoint.h"

namespace simflex {

using namespace SimTK;
using Eigen::MatrixXd;

namespace {

/** Springs and contacts between two bodies need 12. **/
constexpr int MostTerms = 24;

/** The force as a cable; null if it is not one. **/
const CableSpring* asCable(const Force& force) {
    return !force.isEmptyHandle() && CableSpring::isInstanceOf(force)
               ? &CableSpring::downcast(force)
               : nullptr;
}

}  // namespace

std::string ForceSelection::describe() const {
    if (force.isEmptyHandle()) return "Simbody's force elements together";
    return "force element " + std::to_string(int(force.getForceIndex()));
}

ForceDifferences::ForceDifferences(const MultibodySystem& system, const ForceSelection& selection,
                                   const std::vector<Speed>& candidates, const State& state)
    : m_system(system), m_selection(selection), m_moved(state) {
    if (!selection.force.isEmptyHandle() && !findForceSubsystem(system, selection.force))
        throw std::invalid_argument("addForceJacobian(): " + selection.describe() +
                                    " belongs to another system");
    m_unit.resize(state.getNU());
    m_unit = 0;
    m_without = m_moved;
    if (!selection.force.isEmptyHandle()) {
        disableAllBut(selection.force, system, m_moved);
        disableAllBut(Force(), system, m_without);
        system.realize(m_moved, Stage::Velocity);
        system.realize(m_without, Stage::Velocity);
    }
    findSpeeds(candidates);
    const int n = int(m_speeds.size());
    m_numTerms = std::min(n, MostTerms);
    m_matrix.resize(n, n);
    m_directions.setZero(n, m_numTerms);
    m_signs.setOnes(m_numTerms);
}

void ForceDifferences::findSpeeds(const std::vector<Speed>& candidates) {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::set<MobilizedBodyIndex> bodies;
    for (MobilizedBodyIndex named : m_selection.bodies) {
        if (named < GroundIndex || named >= matter.getNumBodies())
            throw std::invalid_argument("addForceJacobian(): there is no mobilized body " +
                                        std::to_string(int(named)));
        // A body moves with its inboard bodies.
        for (MobilizedBodyIndex i = named; i != GroundIndex;
             i = matter.getMobilizedBody(i).getParentMobilizedBody().getMobilizedBodyIndex())
            bodies.insert(i);
    }
    // A slack cable does not respond to small motions: take the bodies from its path.
    if (m_selection.bodies.empty() && asCable(m_selection.force)) {
        const CablePath& path = asCable(m_selection.force)->getCablePath();
        for (CableObstacleIndex i(0); i < path.getNumObstacles(); ++i)
            for (MobilizedBodyIndex at =
                     path.getObstacle(i).getMobilizedBody().getMobilizedBodyIndex();
                 at != GroundIndex;
                 at = matter.getMobilizedBody(at).getParentMobilizedBody().getMobilizedBodyIndex())
                bodies.insert(at);
    } else if (m_selection.bodies.empty()) {
        const State start = copyState(m_moved);
        m_system.realize(start, Stage::Velocity);
        const Vector force = calcForce();
        for (const Speed& speed : candidates) {
            if (bodies.count(speed.body)) continue;
            move(start, speed, speed.step, speed.step);
            const bool responds = force[speed.u] != 0 || (calcForce() - force).normInf() != 0;
            if (responds) bodies.insert(speed.body);
        }
        copyState(start, m_moved);
    }
    for (const Speed& speed : candidates)
        if (bodies.count(speed.body)) m_speeds.push_back(speed);
}

void ForceDifferences::move(const State& state, const Speed& speed, double dq, double du) {
    m_unit[speed.u] = 1;
    m_system.getMatterSubsystem().multiplyByN(state, false, m_unit, m_qDot);
    m_unit[speed.u] = 0;
    m_moved.setTime(state.getTime());
    m_moved.updQ() = state.getQ() + dq * m_qDot;
    m_moved.updU() = state.getU();
    m_moved.updU()[speed.u] += du;
}

const Vector& ForceDifferences::calcForce() {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    try {
        m_system.realize(m_moved, Stage::Dynamics);
        m_bodyForces = m_system.getRigidBodyForces(m_moved, Stage::Dynamics);
        m_mobilityForces = m_system.getMobilityForces(m_moved, Stage::Dynamics);
        if (!m_selection.force.isEmptyHandle()) {
            m_without.setTime(m_moved.getTime());
            m_without.updY() = m_moved.getY();
            m_system.realize(m_without, Stage::Dynamics);
            m_bodyForces -= m_system.getRigidBodyForces(m_without, Stage::Dynamics);
            m_mobilityForces -= m_system.getMobilityForces(m_without, Stage::Dynamics);
        }
    } catch (const std::exception& error) {
        throw UnusablePoint(m_selection.describe() + " failed near t = " +
                            std::to_string(m_moved.getTime()) + " s: " + error.what());
    }
    matter.multiplyBySystemJacobianTranspose(m_moved, m_bodyForces, m_force);
    m_force += m_mobilityForces;
    return m_force;
}

const MatrixXd& ForceDifferences::calcMatrix(const State& state, double gamma) {
    const int n = int(m_speeds.size());
    if (m_moved.getNZ() > 0) m_moved.updZ() = state.getZ();
    for (int j = 0; j < n; ++j) {
        const Speed& speed = m_speeds[size_t(j)];
        const double h = speed.step;
        for (double sign : {1.0, -1.0}) {
            move(state, speed, sign * h, sign * h / gamma);
            const Vector& force = calcForce();
            for (int i = 0; i < n; ++i) {
                const double f = force[m_speeds[size_t(i)].u];
                if (!std::isfinite(f))
                    throw UnusablePoint(
                        m_selection.describe() + " is not a finite number near t = " +
                        std::to_string(state.getTime()) + " s where mobilized body " +
                        std::to_string(int(speed.body)) + " moves a little");
                if (sign > 0)
                    m_matrix(i, j) = -f;
                else
                    m_matrix(i, j) = (m_matrix(i, j) + f) * gamma / (2 * h);
            }
        }
    }
    return m_matrix;
}

void ForceDifferences::calcTerms(const State& state, double gamma) {
    const int n = int(m_speeds.size());
    calcMatrix(state, gamma);
    // Scaled to displacements [m]: terms are sorted and truncated by their effect on these.
    for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i)
            m_matrix(i, j) /= m_speeds[size_t(i)].metres * m_speeds[size_t(j)].metres;
    const SymmetricEigen eigen = calcSymmetricEigen(0.5 * (m_matrix + m_matrix.transpose()));
    std::vector<int> order(size_t(n), 0);
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(),
              [&](int a, int b) { return std::abs(eigen.values[a]) > std::abs(eigen.values[b]); });
    for (int term = 0; term < m_numTerms; ++term) {
        const double value = eigen.values[order[size_t(term)]];
        m_signs[term] = value < 0 ? -1 : 1;
        const auto vector = eigen.vectors.col(order[size_t(term)]);
        for (int i = 0; i < n; ++i)
            m_directions(i, term) =
                std::sqrt(std::abs(value)) * vector[i] * m_speeds[size_t(i)].metres;
    }
}

}  // namespace simflex
