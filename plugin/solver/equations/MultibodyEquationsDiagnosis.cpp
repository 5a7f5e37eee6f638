// What MultibodyEquations tells of a failure.

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/MultibodyEquations.h"

namespace simflex {

using namespace SimTK;

namespace {

bool isFinite(const double* values, int count) {
    return std::all_of(values, values + count, [](double value) { return std::isfinite(value); });
}

bool isFinite(const SpatialVec& force) {
    return isFinite(&force[0][0], 3) && isFinite(&force[1][0], 3);
}

std::string describeForce(const Force& force) {
    ForceSelection selection;
    selection.force = force;
    return selection.describe();
}

Real sizeOf(const SpatialVec& force) {
    return std::max(force[0].norm(), force[1].norm());
}

}  // namespace

std::string MultibodyEquations::describeElement(const ElementRef& element) const {
    std::string text = element.signs.empty() ? "the load" : "the spring, damper or stop";
    const char* separator = element.element->getAttachments().size() > 1 ? " between " : " on ";
    for (const Attachment& attachment : element.element->getAttachments()) {
        text += separator + ("'" + attachment.getName() + "'");
        separator = " and ";
    }
    return text;
}

template <class Visit>
void MultibodyEquations::visitForeignForces(double time, const double* q, const double* u,
                                            Visit visit) const {
    State state = m_private;
    disableAllBut(Force(), m_system, state);
    m_system.realize(state, Stage::Instance);
    putIntoState(time, q, u, state);
    m_system.realize(state, Stage::Dynamics);
    const Vector_<SpatialVec> otherBodyForces = m_system.getRigidBodyForces(state, Stage::Dynamics);
    const Vector otherMobilityForces = m_system.getMobilityForces(state, Stage::Dynamics);
    for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(m_system))
        for (ForceIndex f(0); f < forces->getNumForces(); ++f) {
            if (forces->isForceDisabled(m_private, f)) continue;
            forces->setForceIsDisabled(state, f, false);
            m_system.realize(state, Stage::Dynamics);
            visit(forces->getForce(f),
                  m_system.getRigidBodyForces(state, Stage::Dynamics) - otherBodyForces,
                  m_system.getMobilityForces(state, Stage::Dynamics) - otherMobilityForces);
            forces->setForceIsDisabled(state, f, true);
        }
}

std::string MultibodyEquations::findNonFinite(double time, const double* q, const double* u) {
    std::ostringstream at;
    at << " at t = " << time << " s";
    if (!isFinite(q, m_numQ) || !isFinite(u, m_numU)) return "";
    realize(time, q, u);
    for (const JointRef& joint : m_joints) {
        std::vector<double> errors(size_t(joint.numRows()), 0);
        joint.record->equations->calcErrors(driveOf(joint), joint.motions.data(), errors.data());
        bool isGood = isFinite(errors.data(), joint.numRows());
        joint.record->equations->calcErrorDots(driveOf(joint), joint.motions.data(), errors.data());
        isGood = isGood && isFinite(errors.data(), joint.numRows());
        if (!isGood && joint.record->equations->dependsOnTime())
            return "the motion of joint '" + joint.record->name + "' is not" + at.str();
    }
    for (const ElementRef& element : m_elements)
        for (const SpatialVec& force : element.forces)
            if (!isFinite(force)) return describeElement(element) + " is not" + at.str();
    for (FlexibleBlock* block : m_flexible) {
        if (!block->hasLoads()) continue;
        std::vector<double> r(size_t(block->numU), 0);
        block->subtractLoads(m_context, q + block->firstQ, r.data());
        if (!isFinite(r.data(), block->numU))
            return "a load on the whole of '" + block->name + "' is not" + at.str();
    }
    std::string culprit;
    if (!m_hasForeignForces) return culprit;
    visitForeignForces(time, q, u,
                       [&](const Force& force, const Vector_<SpatialVec>& bodyForces,
                           const Vector& mobilityForces) {
                           bool isGood = true;
                           for (int i = 0; i < bodyForces.size(); ++i)
                               isGood = isGood && isFinite(bodyForces[i]);
                           for (int i = 0; i < mobilityForces.size(); ++i)
                               isGood = isGood && std::isfinite(mobilityForces[i]);
                           if (!isGood && culprit.empty())
                               culprit = describeForce(force) + " is not" + at.str();
                       });
    return culprit;
}

std::string MultibodyEquations::findMotionJump(double time, double h, const double* q,
                                               const double* u) {
    // What motions change in the whole of a step that was too long by far: round-off, but for a
    // jump.
    constexpr double SmallestJump = 1e-7, LongestLook = 1e-6;
    const double later = time + std::max(2 * h, std::min(LongestLook, 1e3 * h));
    realize(time, q, u);
    const std::vector<double> none;
    std::ostringstream text;
    for (const JointRef& joint : m_joints) {
        const JointEquations& equations = *joint.record->equations;
        if (!equations.dependsOnTime()) continue;
        std::vector<double> before(size_t(joint.numRows())), after(before.size()),
            rate(before.size(), 0);
        const JointEquations::Drive laterDrive = equations.calcDrive(later);
        equations.calcErrors(driveOf(joint), joint.motions.data(), before.data());
        equations.calcErrors(laterDrive, joint.motions.data(), after.data());
        equations.addInTimeRate(driveOf(joint), joint.motions.data(), rate.data());
        for (size_t k = 0; k < before.size(); ++k) {
            const double smooth = rate[k] * (later - time);
            const double jump = after[k] - before[k] - smooth;
            if (std::abs(jump) <= SmallestJump + 10 * std::abs(smooth)) continue;
            text << "The motion of joint '" << joint.record->name << "' jumps by " << std::abs(jump)
                 << " m or rad at t = " << time << " s";
            return text.str();
        }
        // A jump of the speed.
        std::vector<double> laterRate(rate.size(), 0);
        equations.addInTimeRate(laterDrive, joint.motions.data(), laterRate.data());
        for (size_t k = 0; k < rate.size(); ++k) {
            const double jump = std::abs(laterRate[k] - rate[k]);
            if (jump <= 1e-3 * (1 + std::abs(rate[k]))) continue;
            text << "The speed of the motion of joint '" << joint.record->name << "' jumps by "
                 << jump << " m/s or rad/s at t = " << time << " s";
            return text.str();
        }
    }
    if (!m_prescribed || !m_prescribed->hasMotions()) return "";
    std::vector<double> q0(q, q + m_numQ), u0(u, u + m_numU), q1 = q0, u1 = u0;
    prescribe(time, 0, nullptr, q0.data(), u0.data());
    prescribe(later, 0, nullptr, q1.data(), u1.data());
    for (const auto& block : m_blocks)
        for (int i = 0; i < block->numU; ++i) {
            const int k = block->firstU + i;
            if (!isPrescribed(k)) continue;
            const double jump = std::abs(u1[size_t(k)] - u0[size_t(k)]);
            if (jump <= 1e-3 * (1 + std::abs(u0[size_t(k)]))) continue;
            text << "The Motion of " << block->describeSpeed(i) << " jumps by " << jump
                 << " m/s or rad/s at t = " << time << " s";
            return text.str();
        }
    return "";
}

std::string MultibodyEquations::findLargestElement(double time, const double* q, const double* u,
                                                   int block) {
    realize(time, q, u);
    Real largest = 0;
    std::ostringstream text;
    for (const ElementRef& element : m_elements)
        for (size_t k = 0; k < element.frames.size(); ++k) {
            const Real size = sizeOf(element.forces[unsigned(k)]);
            if (element.frames[k].block != block || size <= largest) continue;
            largest = size;
            text.str("");
            text << describeElement(element) << ", " << size << " N or N m";
        }
    return text.str();
}

std::string MultibodyEquations::findLargestForeignForce(double time, const double* q,
                                                        const double* u, int block) const {
    if (!m_hasForeignForces) return "";
    const Block& target = *m_blocks[size_t(block)];
    std::vector<double> r(size_t(target.numU), 0);
    Real largest = 0;
    std::ostringstream text;
    const auto compare = [&](const Force& force, const Vector_<SpatialVec>& bodyForces,
                             const Vector& mobilityForces) {
        std::fill(r.begin(), r.end(), 0.0);
        target.subtractSimbodyForces(bodyForces, mobilityForces, r.data());
        Real size = 0;
        for (const double value : r) size = std::max(size, std::abs(value));
        if (size <= largest) return;
        largest = size;
        text.str("");
        text << describeForce(force) << ", " << size << " N or N m";
    };
    visitForeignForces(time, q, u, compare);
    return text.str();
}

std::string MultibodyEquations::findMassless(int b) const {
    const Block& block = *m_blocks[size_t(b)];
    NewtonSystem::Block values;
    values.resize(block.numU, {});
    block.formMassBlock(values);
    // Elimination without exchange: the speed whose pivot vanishes moves nothing that the earlier
    // ones do not.
    const int n = block.numU;
    Eigen::MatrixXd M = Eigen::Map<const Eigen::MatrixXd>(values.matrix.data(), n, n);
    for (int i = 0; i < n; ++i) {
        const double scale = values.matrix[size_t(i) + size_t(i) * size_t(n)];
        if (!(M(i, i) > 1e-13 * scale) || !(scale > 0)) return block.describeSpeed(i);
        const Eigen::VectorXd column = M.col(i).tail(n - i - 1) / M(i, i);
        M.bottomRightCorner(n - i - 1, n - i - 1) -= column * M.row(i).tail(n - i - 1);
    }
    return "";
}

}  // namespace simflex
