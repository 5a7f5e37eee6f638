#include "simflex/solver/equations/PrescribedMotion.h"

#include <algorithm>

#include "simflex/base/Checkpoint.h"
#include "simflex/solver/equations/Block.h"

namespace simflex {

using namespace SimTK;

namespace {

bool isKnownMethod(Motion::Method method) {
    return method == Motion::Zero || method == Motion::Discrete || method == Motion::Prescribed;
}

int rankOf(MotionLevel level) {
    switch (level) {
        case MotionLevel::Position:
            return 3;
        case MotionLevel::Velocity:
            return 2;
        case MotionLevel::Acceleration:
            break;
    }
    return 1;
}

}  // namespace

bool PrescribedMotion::isPrescribed(const MobilizedBody& mobod, const State& state) {
    return mobod.getNumU(state) > 0 && isKnownMethod(mobod.getUDotMotionMethod(state));
}

bool PrescribedMotion::isUnsupported(const MobilizedBody& mobod, const State& state) {
    return mobod.getNumU(state) > 0 && (mobod.getQMotionMethod(state) == Motion::Fast ||
                                        mobod.getUMotionMethod(state) == Motion::Fast ||
                                        mobod.getUDotMotionMethod(state) == Motion::Fast);
}

bool PrescribedMotion::hasActiveMotion(const MobilizedBody& mobod, const State& state) {
    return isPrescribed(mobod, state) && !mobod.isLocked(state);
}

PrescribedMotion::PrescribedMotion(const SimbodyMatterSubsystem& matter,
                                   const std::vector<Mobilizer>& mobilizers, int numU,
                                   const State& state)
    : m_matter(matter), m_levelOfU(size_t(numU), 0) {
    for (const Mobilizer& mobilizer : mobilizers) {
        const MobilizedBody& mobod = matter.getMobilizedBody(mobilizer.body);
        Entry entry;
        entry.mobilizer = mobilizer;
        entry.level = isKnownMethod(mobod.getQMotionMethod(state))   ? MotionLevel::Position
                      : isKnownMethod(mobod.getUMotionMethod(state)) ? MotionLevel::Velocity
                                                                     : MotionLevel::Acceleration;
        // A steady speed is as constant as a locked one.
        entry.isMotion =
            hasActiveMotion(mobod, state) && !Motion::Steady::isInstanceOf(mobod.getMotion());
        entry.stateQ0 = int(mobod.getFirstQIndex(state));
        entry.stateU0 = int(mobod.getFirstUIndex(state));
        entry.q.resize(size_t(mobilizer.nq));
        entry.u.resize(size_t(mobilizer.nu));
        entry.uDot.assign(size_t(mobilizer.nu), 0);
        if (mobilizer.isFlexibleFrame) {
            const Transform& X_GB = mobod.getBodyTransform(state);
            const Quaternion quaternion = X_GB.R().convertRotationToQuaternion();
            for (int k = 0; k < 4; ++k) entry.q[size_t(k)] = quaternion[k];
            for (int k = 0; k < 3; ++k) entry.q[size_t(4 + k)] = X_GB.p()[k];
        } else {
            for (int k = 0; k < mobilizer.nq; ++k)
                entry.q[size_t(k)] = state.getQ()[entry.stateQ0 + k];
        }
        for (int k = 0; k < mobilizer.nu; ++k) entry.u[size_t(k)] = state.getU()[entry.stateU0 + k];
        if (!entry.isMotion && mobod.getLockLevel(state) == Motion::Acceleration) {
            const Vector value = mobod.getLockValueAsVector(state);
            for (int k = 0; k < mobilizer.nu; ++k) entry.uDot[size_t(k)] = value[k];
        }
        for (int k = 0; k < mobilizer.nu; ++k)
            m_levelOfU[size_t(mobilizer.u0 + k)] = char(rankOf(entry.level));
        m_hasMotions = m_hasMotions || entry.isMotion;
        m_hasAccelerationMotions = m_hasAccelerationMotions ||
                                   (entry.isMotion && entry.level == MotionLevel::Acceleration);
        if (entry.isMotion) {
            const Motion& motion = mobod.getMotion();
            m_dependsOnState = m_dependsOnState || !(entry.level == MotionLevel::Position ||
                                                     Motion::Sinusoid::isInstanceOf(motion));
        }
        m_canWork = m_canWork || entry.isMotion || entry.level != MotionLevel::Position;
        m_entries.push_back(std::move(entry));
    }
}

void PrescribedMotion::updateFromSimbody(State& state) {
    const System& system = m_matter.getSystem();
    system.realize(state, Stage::Time);
    system.prescribeQ(state);
    system.realize(state, Stage::Position);
    system.prescribeU(state);
    if (m_hasAccelerationMotions) {
        system.realize(state, Stage::Dynamics);
        updateAccelerations(state);
    }
    for (Entry& entry : m_entries) {
        if (!entry.isMotion) continue;
        if (entry.level == MotionLevel::Position) {
            if (entry.mobilizer.isFlexibleFrame) {
                const Transform& X_GB =
                    m_matter.getMobilizedBody(entry.mobilizer.body).getBodyTransform(state);
                const Quaternion quaternion = X_GB.R().convertRotationToQuaternion();
                for (int k = 0; k < 4; ++k) entry.q[size_t(k)] = quaternion[k];
                for (int k = 0; k < 3; ++k) entry.q[size_t(4 + k)] = X_GB.p()[k];
            } else {
                for (int k = 0; k < entry.mobilizer.nq; ++k)
                    entry.q[size_t(k)] = state.getQ()[entry.stateQ0 + k];
            }
        }
        if (entry.level != MotionLevel::Acceleration)
            for (int k = 0; k < entry.mobilizer.nu; ++k)
                entry.u[size_t(k)] = state.getU()[entry.stateU0 + k];
    }
}

void PrescribedMotion::updateAccelerations(const State& state) {
    // This omits applied forces: only prescribed accelerations are right and used.
    Vector uDot;
    Vector_<SpatialVec> accelerations;
    const Vector mobilityForces(state.getNU(), Real(0));
    const Vector_<SpatialVec> bodyForces(m_matter.getNumBodies(), SpatialVec(Vec3(0), Vec3(0)));
    m_matter.calcAccelerationIgnoringConstraints(state, mobilityForces, bodyForces, uDot,
                                                 accelerations);
    for (Entry& entry : m_entries)
        for (int k = 0; k < entry.mobilizer.nu; ++k)
            entry.uDot[size_t(k)] = uDot[entry.stateU0 + k];
}

void PrescribedMotion::putSpeeds(const Entry& entry, const std::vector<double>& simbody,
                                 const double* q, double* solver) const {
    double* values = solver + entry.mobilizer.u0;
    std::copy(simbody.begin(), simbody.end(), values);
    if (!entry.mobilizer.isFlexibleFrame) return;
    // Simbody's ω and ω̇ of a Free mobilizer are in Ground; R ω̇_B = ω̇_G.
    const Vec3 inBody = ~rotationOf(q + entry.mobilizer.q0) * Vec3(values[0], values[1], values[2]);
    for (int a = 0; a < 3; ++a) values[a] = inBody[a];
}

void PrescribedMotion::apply(double gamma, const double* uHist, double* q, double* u) const {
    for (const Entry& entry : m_entries) {
        const Mobilizer& mobilizer = entry.mobilizer;
        if (entry.level == MotionLevel::Position) {
            // Keep the sign of a quaternion: q and −q are the same rotation.
            double* own = q + mobilizer.q0;
            const bool hasQuaternion = mobilizer.nq > mobilizer.nu && mobilizer.nq >= 4;
            double product = 0;
            for (int k = 0; k < 4 && hasQuaternion; ++k) product += own[k] * entry.q[size_t(k)];
            std::copy(entry.q.begin(), entry.q.end(), own);
            for (int k = 0; k < 4 && product < 0; ++k) own[k] = -own[k];
        }
        if (entry.level != MotionLevel::Acceleration) {
            putSpeeds(entry, entry.u, q, u);
        } else if (uHist) {
            putSpeeds(entry, entry.uDot, q, u);
            for (int i = mobilizer.u0; i < mobilizer.u0 + mobilizer.nu; ++i)
                u[i] = uHist[i] + gamma * u[i];
        }
    }
}

void PrescribedMotion::applyAccelerations(const double* q, double* uDot) const {
    for (const Entry& entry : m_entries) putSpeeds(entry, entry.uDot, q, uDot);
}

void PrescribedMotion::subtractAccelerations(double factor, const double* q, double* r) const {
    for (const Entry& entry : m_entries) {
        if (!entry.isMotion || entry.level != MotionLevel::Acceleration) continue;
        putSpeeds(entry, entry.uDot, q, r);
        for (int k = 0; k < entry.mobilizer.nu; ++k) r[entry.mobilizer.u0 + k] *= -factor;
    }
}

void PrescribedMotion::clearResidual(double* r) const {
    for (const Entry& entry : m_entries)
        std::fill_n(r + entry.mobilizer.u0, entry.mobilizer.nu, 0.0);
}

double PrescribedMotion::calcPower(const double* r, const double* u) const {
    double power = 0;
    for (const Entry& entry : m_entries)
        for (int i = entry.mobilizer.u0; i < entry.mobilizer.u0 + entry.mobilizer.nu; ++i)
            power += r[i] * u[i];
    return power;
}

void PrescribedMotion::clearErrors(double* errorQ, double* errorU) const {
    for (const Entry& entry : m_entries) {
        const Mobilizer& mobilizer = entry.mobilizer;
        if (entry.level == MotionLevel::Position)
            std::fill_n(errorQ + mobilizer.q0, mobilizer.nq, 0.0);
        if (entry.level != MotionLevel::Acceleration)
            std::fill_n(errorU + mobilizer.u0, mobilizer.nu, 0.0);
    }
}

void PrescribedMotion::mask(MotionLevel level, int firstU, NewtonSystem::Block& block) const {
    const size_t n = size_t(block.size), m = size_t(block.numColumns());
    for (size_t i = 0; i < n; ++i) {
        if (!isKnown(level, size_t(firstU) + i)) continue;
        for (size_t column = 0; column < m; ++column) block.Gt[i + column * n] = 0;
        const bool isArrow = block.form == NewtonSystem::Block::Form::Arrow;
        std::vector<double>& matrix = isArrow ? block.head : block.matrix;
        const size_t size = isArrow ? 6 : n;
        for (size_t j = 0; j < size && i < size; ++j)
            matrix[i + j * size] = matrix[j + i * size] = i == j ? 1 : 0;
        if (!isArrow) continue;
        // The coupling is (n − 6)×3: clear the column of a rotation, or the row of a mode.
        for (size_t mode = 0; mode < n - 6 && i < 3; ++mode) block.coupling[mode + i * (n - 6)] = 0;
        for (size_t a = 0; a < 3 && i >= 6; ++a) block.coupling[i - 6 + a * (n - 6)] = 0;
    }
}

bool PrescribedMotion::touches(int firstU, int numU) const {
    return std::any_of(m_levelOfU.begin() + firstU, m_levelOfU.begin() + firstU + numU,
                       [](char level) { return level > 0; });
}

bool PrescribedMotion::isKnown(MotionLevel level, size_t u) const {
    return m_levelOfU[u] >= rankOf(level);
}

void PrescribedMotion::visit(Checkpoint& checkpoint) {
    for (Entry& entry : m_entries) checkpoint.visit(entry.q, entry.u, entry.uDot);
}

}  // namespace simflex
