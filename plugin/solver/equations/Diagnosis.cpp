#include "simflex/solver/equations/Diagnosis.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"

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

/** Calls visit(force, bodyForces, mobilityForces) for Simbody's elements except gravity, or
fail(force, error) for one that throws. **/
template <class Visit, class Fail>
void visitForeignForces(const Evaluation& equations, double time, const double* q, const double* u,
                        Visit visit, Fail fail) {
    const MultibodySystem& system = *equations.getTopology().system;
    const State& start = equations.getSimbody().getState();
    State state = copyState(start);
    disableAllBut(Force(), system, state);
    system.realize(state, Stage::Instance);
    equations.getBlocks().putIntoState(time, q, u, state);
    system.realize(state, Stage::Dynamics);
    const Vector_<SpatialVec> otherBodyForces = system.getRigidBodyForces(state, Stage::Dynamics);
    const Vector otherMobilityForces = system.getMobilityForces(state, Stage::Dynamics);
    for (const GeneralForceSubsystem* forces : listGeneralForceSubsystems(system))
        for (ForceIndex f(0); f < forces->getNumForces(); ++f) {
            const bool isApplied = !forces->isForceDisabled(start, f) ||
                                   equations.getSimbody().isMobilityForce(forces->getForce(f));
            if (!isApplied) continue;
            forces->setForceIsDisabled(state, f, false);
            try {
                system.realize(state, Stage::Dynamics);
                visit(forces->getForce(f),
                      system.getRigidBodyForces(state, Stage::Dynamics) - otherBodyForces,
                      system.getMobilityForces(state, Stage::Dynamics) - otherMobilityForces);
            } catch (const std::exception& error) {
                fail(forces->getForce(f), error);
            }
            forces->setForceIsDisabled(state, f, true);
        }
}

/** Unit of the driven coordinate; empty unless the motion has exactly one. **/
const char* getUnit(const JointEquations& motion) {
    if (motion.getNumCoordinates() != 1) return "";
    return motion.getCoordinate(0).isAngle() ? " rad" : " m";
}

}  // namespace

std::vector<Link> listLinks(const Evaluation& equations) {
    const Topology& topology = equations.getTopology();
    const Blocks& blocks = equations.getBlocks();
    std::vector<Link> links;
    const auto add = [&](const FrameRef& a, const FrameRef& b, int numEquations) {
        if (a.block != b.block)
            links.push_back(
                {{a.block, b.block}, {&blocks.motionOf(a), &blocks.motionOf(b)}, numEquations});
    };
    for (const Topology::Joint& joint : topology.joints)
        if (joint.sides.size() == 2) add(joint.sides[0], joint.sides[1], joint.numRows());
    for (const auto& [pair, count] : topology.constrainedPairs) add(pair[0], pair[1], count);
    for (const Topology::Element& element : topology.elements)
        if (element.frames.size() == 2) add(element.frames[0], element.frames[1], 0);
    return links;
}

std::string findNonFinite(Evaluation& equations, double time, const double* q, const double* u) {
    std::ostringstream at;
    at << " at t = " << time << " s";
    const Topology& topology = equations.getTopology();
    for (const auto& block : equations.getBlocks().all)
        if (!block->isUsable(q + block->firstQ, u + block->firstU)) return "";
    std::string culprit;
    const auto visit = [&](const Force& force, const Vector_<SpatialVec>& bodyForces,
                           const Vector& mobilityForces) {
        bool isGood = true;
        for (int i = 0; i < bodyForces.size(); ++i) isGood = isGood && isFinite(bodyForces[i]);
        for (int i = 0; i < mobilityForces.size(); ++i)
            isGood = isGood && std::isfinite(mobilityForces[i]);
        if (!isGood && culprit.empty()) culprit = describeForce(force) + " is not" + at.str();
    };
    const auto fail = [&](const Force& force, const std::exception& error) {
        if (!culprit.empty()) return;
        const std::string said = error.what();
        culprit = describeForce(force) + " fails" + at.str() + " (" +
                  said.substr(0, said.find('\n')) + ")";
    };
    try {
        equations.realize(time, q, u);
    } catch (const std::exception&) {
        // One of Simbody's forces, or what they act on.
        try {
            visitForeignForces(equations, time, q, u, visit, fail);
        } catch (const std::exception&) {
        }
        return culprit;
    }
    const JointTerms& terms = equations.getJoints();
    for (int j = 0; j < int(topology.joints.size()); ++j) {
        const JointRecord& joint = *topology.joints[size_t(j)].record;
        const FrameMotion* const* motions = terms.getMotions(j).data();
        std::vector<double> errors(size_t(joint.equations->getNumEquations()), 0);
        joint.equations->calcErrors(terms.getDrive(j), motions, errors.data());
        bool isGood = isFinite(errors.data(), int(errors.size()));
        joint.equations->calcErrorDots(terms.getDrive(j), motions, errors.data());
        isGood = isGood && isFinite(errors.data(), int(errors.size()));
        if (!isGood && joint.equations->dependsOnTime())
            return "the motion '" + joint.name + "' is not" + at.str();
    }
    for (int e = 0; e < int(topology.elements.size()); ++e)
        for (const SpatialVec& force : equations.getLoads().getForces(e))
            if (!isFinite(force))
                return topology.elements[size_t(e)].element->describe() + " is not" + at.str();
    for (FlexibleBlock* block : equations.getBlocks().flexible) {
        if (!block->hasLoads()) continue;
        std::vector<double> r(size_t(block->numU), 0);
        block->subtractLoads(equations.getBlocks().context, q + block->firstQ, r.data());
        if (!isFinite(r.data(), block->numU))
            return "a load on the whole of '" + block->name + "' is not" + at.str();
    }
    if (topology.hasSimbodyForces()) visitForeignForces(equations, time, q, u, visit, fail);
    return culprit;
}

std::string findMotionJump(Evaluation& equations, double time, double h, const double* q,
                           const double* u) {
    // What motions change in the whole of a step that was too long by far: round-off, but for a
    // jump.
    constexpr double SmallestJump = 1e-7, LongestLook = 1e-6;
    const double later = time + std::max(2 * h, std::min(LongestLook, 1e3 * h));
    const Topology& topology = equations.getTopology();
    const JointTerms& terms = equations.getJoints();
    equations.realize(time, q, u);
    std::ostringstream text;
    for (int j = 0; j < int(topology.joints.size()); ++j) {
        const Topology::Joint& joint = topology.joints[size_t(j)];
        const JointEquations& own = *joint.record->equations;
        const FrameMotion* const* motions = terms.getMotions(j).data();
        if (!own.dependsOnTime()) continue;
        std::vector<double> before(size_t(joint.numRows())), after(before.size()),
            rate(before.size(), 0);
        const JointEquations::Drive laterDrive = own.calcDrive(later);
        own.calcErrors(terms.getDrive(j), motions, before.data());
        own.calcErrors(laterDrive, motions, after.data());
        own.addInTimeRate(terms.getDrive(j), motions, rate.data());
        for (size_t k = 0; k < before.size(); ++k) {
            const double smooth = rate[k] * (later - time);
            const double jump = after[k] - before[k] - smooth;
            if (std::abs(jump) <= SmallestJump + 10 * std::abs(smooth)) continue;
            text << "The motion '" << joint.record->name << "' jumps by " << std::abs(jump)
                 << getUnit(own) << " at t = " << time << " s";
            return text.str();
        }
        // A jump of the speed.
        std::vector<double> laterRate(rate.size(), 0);
        own.addInTimeRate(laterDrive, motions, laterRate.data());
        for (size_t k = 0; k < rate.size(); ++k) {
            const double jump = std::abs(laterRate[k] - rate[k]);
            if (jump <= 1e-3 * (1 + std::abs(rate[k]))) continue;
            text << "The speed of the motion '" << joint.record->name << "' jumps by " << jump
                 << getUnit(own) << "/s at t = " << time << " s";
            return text.str();
        }
    }
    const PrescribedMotion* prescribed = equations.getSimbody().getPrescribed();
    if (!prescribed || !prescribed->hasMotions()) return "";
    std::vector<double> q0(q, q + topology.numQ), u0(u, u + topology.numU), q1 = q0, u1 = u0;
    equations.prescribe(time, 0, nullptr, q0.data(), u0.data());
    equations.prescribe(later, 0, nullptr, q1.data(), u1.data());
    for (const auto& block : equations.getBlocks().all)
        for (int i = 0; i < block->numU; ++i) {
            const int k = block->firstU + i;
            if (!topology.isPrescribed[size_t(k)]) continue;
            const double jump = std::abs(u1[size_t(k)] - u0[size_t(k)]);
            if (jump <= 1e-3 * (1 + std::abs(u0[size_t(k)]))) continue;
            text << "The Motion of " << block->describeSpeed(i) << " jumps by " << jump
                 << " m/s or rad/s at t = " << time << " s";
            return text.str();
        }
    return "";
}

std::string findLargestElement(Evaluation& equations, double time, const double* q, const double* u,
                               int block) {
    equations.realize(time, q, u);
    Real largest = 0;
    std::ostringstream text;
    const std::vector<Topology::Element>& elements = equations.getTopology().elements;
    for (size_t e = 0; e < elements.size(); ++e)
        for (size_t k = 0; k < elements[e].frames.size(); ++k) {
            const Real size = sizeOf(equations.getLoads().getForces(int(e))[unsigned(k)]);
            if (elements[e].frames[k].block != block || size <= largest) continue;
            largest = size;
            text.str("");
            text << elements[e].element->describe() << ", " << size << " N or N m";
        }
    return text.str();
}

std::string findLargestForeignForce(Evaluation& equations, double time, const double* q,
                                    const double* u, int block) {
    if (!equations.getTopology().hasSimbodyForces()) return "";
    Block& target = *equations.updBlocks().all[size_t(block)];
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
    visitForeignForces(equations, time, q, u, compare,
                       [](const Force&, const std::exception&) { throw; });
    return text.str();
}

std::string findMassless(Block& block) {
    NewtonSystem::Block values;
    values.resize(block.numU, {});
    block.formMassBlock(values);
    // Elimination without pivoting: the speed whose pivot vanishes moves nothing beyond the earlier
    // ones.
    const int n = block.numU;
    Eigen::MatrixXd M = Eigen::Map<const Eigen::MatrixXd>(values.matrix.data(), n, n);
    // Where positions are lost, no mass is to blame.
    if (!M.allFinite()) return "";
    for (int i = 0; i < n; ++i) {
        const double scale = values.matrix[size_t(i) + size_t(i) * size_t(n)];
        if (!(M(i, i) > 1e-13 * scale) || !(scale > 0)) return block.describeSpeed(i);
        const Eigen::VectorXd column = M.col(i).tail(n - i - 1) / M(i, i);
        M.bottomRightCorner(n - i - 1, n - i - 1) -= column * M.row(i).tail(n - i - 1);
    }
    return "";
}

}  // namespace simflex
