#include "simflex/solver/MultibodyEquations.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "simflex/solver/FlexibleBlock.h"
#include "simflex/solver/RigidTree.h"

namespace simflex {

using namespace SimTK;
using Clock = std::chrono::steady_clock;

namespace {

/** "mobilized body 7", or the flexible body it belongs to. **/
std::string describe(const FlexibleBodySubsystem::Guts* guts, MobilizedBodyIndex index) {
    if (guts)
        for (const FlexibleBodyRecord& body : guts->bodies()) {
            if (body.frame == index) return "the frame of flexible body '" + body.name + "'";
            if (std::count(body.carriers.begin(), body.carriers.end(), index))
                return "a modal mobilizer of flexible body '" + body.name + "'";
        }
    return "mobilized body " + std::to_string(int(index));
}

}  // namespace

//-------------------------------------------------------------------------------------------------------
// construction

MultibodyEquations::MultibodyEquations(const MultibodySystem& system, const State& state)
    : m_system(system), m_private(state) {
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
    m_guts = flexible ? &flexible->getGuts() : nullptr;
    system.realize(m_private, Stage::Velocity);
    refuseUnsupported(m_private);
    collectGravityAndForces(m_private);
    makeBlocks(m_private);
    makeJoints();
    makeParts();
    makeForceElements();
    m_context.gravity = &m_gravity;
    m_context.state = m_needsSimbody ? &m_private : nullptr;

    // On the private State Simbody evaluates foreign forces only.
    const SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    for (const JointRef& joint : m_joints)
        matter.getConstraint(joint.record->constraint).disable(m_private);
    if (m_guts) m_guts->setNativeForcesEnabled(m_private, false);
    system.realize(m_private, Stage::Instance);
}

MultibodyEquations::~MultibodyEquations() = default;

void MultibodyEquations::refuseUnsupported(const State& state) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (mobod.isLocked(state))
            throw std::invalid_argument("BdfIntegrator: " + describe(m_guts, i) +
                                        " is locked; unlock it before initialize()");
        if (mobod.hasMotion() && !mobod.getMotion().isDisabled(state))
            throw std::invalid_argument(
                "BdfIntegrator: " + describe(m_guts, i) +
                " has a prescribed Motion; use Joint::PrescribedRotation, or disable it");
    }
    const auto nameOfJoint = [&](ConstraintIndex constraint) {
        for (const JointRecord& joint : m_guts->joints())
            if (joint.constraint == constraint) return joint.name;
        return std::string();
    };
    std::set<ConstraintIndex> own;
    if (m_guts)
        for (const JointRecord& joint : m_guts->joints()) own.insert(joint.constraint);
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i) {
        const Constraint& constraint = matter.getConstraint(i);
        if (constraint.isDisabled(state)) {
            if (own.count(i))
                throw std::invalid_argument(
                    "BdfIntegrator: joint '" + nameOfJoint(i) +
                    "' is disabled in the State; leave it out of the model instead");
            continue;
        }
        if (own.count(i)) continue;
        std::string bodies;
        for (ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b)
            bodies +=
                (b > 0 ? ", " : "") +
                std::to_string(
                    int(constraint.getMobilizedBodyFromConstrainedBody(b).getMobilizedBodyIndex()));
        throw std::invalid_argument(
            "BdfIntegrator: Simbody constraint " + std::to_string(int(i)) + " on bodies (" +
            bodies + ") is not supported; use the joints of simflex/body/Joint.h, or disable it");
    }
    if (state.getNZ() > 0)
        throw std::invalid_argument(
            "BdfIntegrator: the system has " + std::to_string(state.getNZ()) +
            " auxiliary state variables z (a Measure or force element with its own "
            "differential equation), which are not supported");
}

void MultibodyEquations::collectGravityAndForces(const State& state) {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    m_gravity.atBody.assign(matter.getNumBodies(), Vec3(0));
    for (SubsystemIndex s(0); s < m_system.getNumSubsystems(); ++s) {
        const Subsystem& subsystem = m_system.getSubsystem(s);
        if (!dynamic_cast<const ForceSubsystem::Guts*>(&subsystem.getSubsystemGuts())) continue;
        if (m_guts && &subsystem.getSubsystemGuts() == m_guts) continue;
        if (!GeneralForceSubsystem::isInstanceOf(ForceSubsystem::downcast(subsystem))) {
            m_hasForeignForces = true;
            continue;
        }
        const GeneralForceSubsystem& forces =
            GeneralForceSubsystem::downcast(ForceSubsystem::downcast(subsystem));
        for (ForceIndex f(0); f < forces.getNumForces(); ++f) {
            const Force& force = forces.getForce(f);
            if (force.isDisabled(state)) continue;
            if (!Force::Gravity::isInstanceOf(force)) {
                m_hasForeignForces = true;
                continue;
            }
            const Force::Gravity& gravity = Force::Gravity::downcast(force);
            for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i)
                if (!gravity.getBodyIsExcluded(state, i))
                    m_gravity.atBody[i] += gravity.getGravityVector(state);
            force.disable(m_private);
        }
    }
    // Disabling a force lowers the stage of the private State; blocks still read velocities from
    // it.
    m_system.realize(m_private, Stage::Velocity);
}

void MultibodyEquations::makeBlocks(const State& state) {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::set<MobilizedBodyIndex> taken;
    if (m_guts) {
        for (int b = 0; b < int(m_guts->bodies().size()); ++b) {
            const FlexibleBodyRecord& record = m_guts->body(FlexibleBodyIndex(b));
            taken.insert(record.frame);
            taken.insert(record.carriers.begin(), record.carriers.end());
            auto block = std::make_unique<FlexibleBlock>(*m_guts, FlexibleBodyIndex(b), state);
            m_flexible.push_back(block.get());
            m_blocks.push_back(std::move(block));
        }
    }
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        if (taken.count(i)) continue;
        const MobilizedBodyIndex parent =
            matter.getMobilizedBody(i).getParentMobilizedBody().getMobilizedBodyIndex();
        if (taken.count(parent))
            throw std::invalid_argument(
                "BdfIntegrator: mobilized body " + std::to_string(int(i)) +
                " is mobilized on the frame of a flexible body; put it on Ground and hold it "
                "with a Joint to an interface instead");
        if (parent != GroundIndex) continue;
        auto tree = std::make_unique<RigidTree>(matter, i, state);
        m_needsSimbody = m_needsSimbody || tree->needsSimbody();
        m_rigid.push_back(tree.get());
        m_blocks.push_back(std::move(tree));
    }
    for (const auto& block : m_blocks) {
        block->firstQ = m_numQ;
        block->firstU = m_numU;
        m_numQ += block->numQ;
        m_numU += block->numU;
    }
    m_needsSimbody = m_needsSimbody || m_hasForeignForces;
    m_blockRows.resize(m_blocks.size());
    m_blockSides.resize(m_blocks.size());
}

MultibodyEquations::FrameRef MultibodyEquations::makeFrame(const Attachment& attachment) {
    FrameRef ref;
    if (attachment.isFlexible()) {
        ref.block = int(attachment.getFlexibleBodyIndex());  // flexible blocks come first, in order
        ref.frame = m_flexible[ref.block]->addFrame(attachment.getFlexibleFrame());
        return ref;
    }
    const MobilizedBodyIndex index = attachment.getMobilizedBodyIndex();
    if (index == GroundIndex) {
        ref.fixed.X = attachment.getFrame();
        return ref;
    }
    for (size_t k = 0; k < m_rigid.size(); ++k) {
        if (!m_rigid[k]->contains(index)) continue;
        ref.block = int(m_flexible.size() + k);
        ref.frame = m_rigid[k]->addFrame(index, attachment.getFrame());
        return ref;
    }
    throw std::invalid_argument(
        "BdfIntegrator: " + attachment.getName() +
        " is the frame or a modal mobilizer of a flexible body; attach to an interface or node");
}

void MultibodyEquations::makeJoints() {
    if (!m_guts) return;
    for (const JointRecord& record : m_guts->joints()) {
        JointRef joint;
        joint.record = &record;
        joint.firstRow = m_numMultipliers;
        joint.sides[0] = makeFrame(record.F);
        joint.sides[1] = makeFrame(record.M);
        const int rows = record.equations->getNumEquations();
        m_numMultipliers += rows;
        const int self = int(m_joints.size());
        for (int side = 0; side < 2; ++side) {
            const int b = joint.sides[side].block;
            if (b < 0) continue;
            m_blockSides[b].push_back({self, side, int(m_blockRows[b].size())});
            for (int k = 0; k < rows; ++k) m_blockRows[b].push_back(joint.firstRow + k);
        }
        m_joints.push_back(joint);
    }
}

bool MultibodyEquations::sharesPart(int block, int other) const {
    const FlexibleBlock &a = *m_flexible[size_t(block)], &b = *m_flexible[size_t(other)];
    return &a.getModel() == &b.getModel() && a.getDamping() == b.getDamping();
}

void MultibodyEquations::makeParts() {
    m_partOfBlock.assign(m_blocks.size(), -1);
    for (int b = 0; b < int(m_flexible.size()); ++b) {
        const auto found = std::find_if(m_parts.begin(), m_parts.end(), [&](const PartGroup& part) {
            return sharesPart(b, part.firstBlock);
        });
        m_partOfBlock[size_t(b)] = int(found - m_parts.begin());
        if (found == m_parts.end()) m_parts.push_back({b, {}, nullptr});
        std::vector<const FrameShapes*>& frames = m_parts[size_t(m_partOfBlock[size_t(b)])].frames;
        for (BlockSide& side : m_blockSides[size_t(b)]) {
            const FrameShapes* shapes = m_flexible[size_t(b)]->getShapes(
                m_joints[size_t(side.joint)].sides[side.side].frame);
            const auto frame = std::find(frames.begin(), frames.end(), shapes);
            side.partFrame = int(frame - frames.begin());
            if (frame == frames.end()) frames.push_back(shapes);
        }
    }
    for (PartGroup& part : m_parts) {
        const size_t n = size_t(m_flexible[size_t(part.firstBlock)]->getModel().n);
        auto shapes = std::make_shared<std::vector<double>>(6 * n * part.frames.size());
        double* column = shapes->data();
        for (const FrameShapes* frame : part.frames)
            for (const std::vector<double>* source : {&frame->Phi, &frame->Psi})
                for (size_t a = 0; a < 3; ++a)
                    for (size_t i = 0; i < n; ++i) *column++ = (*source)[3 * i + a];
        part.shapes = shapes;
    }
}

void MultibodyEquations::makeForceElements() {
    if (!m_guts) return;
    for (const auto& element : m_guts->forceElements()) {
        if (element->getAttachments().empty()) continue;
        ElementRef ref;
        ref.element = element.get();
        for (const Attachment& attachment : element->getAttachments())
            ref.frames.push_back(makeFrame(attachment));
        ref.motions.resize(unsigned(ref.frames.size()));
        ref.forces.resize(unsigned(ref.frames.size()));
        m_elements.push_back(ref);
    }
}

NewtonSystem MultibodyEquations::makeNewtonSystem() const {
    NewtonSystem system;
    for (const PartGroup& part : m_parts) {
        const int n = m_flexible[size_t(part.firstBlock)]->getModel().n;
        system.parts.push_back({n, int(part.frames.size()), {}, part.shapes});
        system.parts.back().diagonal.assign(size_t(n), 0);
    }
    system.blocks.resize(m_blocks.size());
    for (size_t b = 0; b < m_blocks.size(); ++b) {
        if (m_partOfBlock[b] < 0) {
            system.blocks[b].resize(m_blocks[b]->numU, m_blockRows[b]);
            continue;
        }
        std::vector<NewtonSystem::Side> sides;
        for (const BlockSide& side : m_blockSides[b])
            sides.push_back({side.partFrame,
                             m_joints[size_t(side.joint)].record->equations->getNumEquations()});
        system.blocks[b].resize(m_partOfBlock[b], m_blocks[b]->numU - 6, std::move(sides),
                                m_blockRows[b]);
    }
    system.c.assign(m_numMultipliers, 0);
    return system;
}

const std::string& MultibodyEquations::getJointName(int row) const {
    for (const JointRef& joint : m_joints)
        if (row < joint.firstRow + joint.record->equations->getNumEquations())
            return joint.record->name;
    throw std::out_of_range("no joint has multiplier " + std::to_string(row));
}

//---------------------------------------------------------------------------------------------------------
// evaluation

const FrameMotion& MultibodyEquations::motionOf(const FrameRef& frame) const {
    return frame.block < 0 ? frame.fixed : m_blocks[frame.block]->frames[frame.frame];
}

void MultibodyEquations::realizeSimbody(double time, const double* q, const double* u) {
    const auto start = Clock::now();
    putIntoState(time, q, u, m_private);
    m_system.realize(m_private, m_hasForeignForces ? Stage::Dynamics : Stage::Velocity);
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::realize(double time, const double* q, const double* u) {
    m_time = time;
    if (m_needsSimbody) realizeSimbody(time, q, u);
    const int count = numBlocks();
#pragma omp parallel for schedule(static) num_threads(m_numThreads) if (m_numThreads > 1)
    for (int b = 0; b < count; ++b)
        m_blocks[b]->realize(m_context, q + m_blocks[b]->firstQ, u + m_blocks[b]->firstU);

    for (JointRef& joint : m_joints)
        joint.record->equations->calcJacobian(motionOf(joint.sides[0]).X,
                                              motionOf(joint.sides[1]).X, joint.D[0], joint.D[1]);
    for (ElementRef& element : m_elements) {
        for (size_t k = 0; k < element.frames.size(); ++k) {
            element.motions[unsigned(k)] = motionOf(element.frames[k]);
            element.forces[unsigned(k)] = SpatialVec(Vec3(0), Vec3(0));
        }
        element.element->addInForces(time, element.motions, element.forces);
    }
}

void MultibodyEquations::calcPositionErrors(double* g) const {
    for (const JointRef& joint : m_joints)
        joint.record->equations->calcErrors(m_time, motionOf(joint.sides[0]).X,
                                            motionOf(joint.sides[1]).X, g + joint.firstRow);
}

void MultibodyEquations::calcVelocityErrors(double* gDot) const {
    for (const JointRef& joint : m_joints)
        joint.record->equations->calcErrorDots(m_time, motionOf(joint.sides[0]),
                                               motionOf(joint.sides[1]), gDot + joint.firstRow);
}

void MultibodyEquations::calcAccelerationErrors(const double* u, const double* uDot,
                                                double* gDotDot) const {
    for (const JointRef& joint : m_joints) {
        FrameMotion motions[2];
        for (int side = 0; side < 2; ++side) {
            const FrameRef& ref = joint.sides[side];
            motions[side] = motionOf(ref);
            if (ref.block < 0) continue;
            const int first = m_blocks[ref.block]->firstU;
            motions[side].A =
                m_blocks[ref.block]->calcFrameAcceleration(ref.frame, u + first, uDot + first);
        }
        joint.record->equations->calcErrorDotDots(m_time, motions[0], motions[1],
                                                  gDotDot + joint.firstRow);
    }
}

void MultibodyEquations::calcResidual(const double* q, const double* u, const double* uDot,
                                      const double* lambda, double* r) {
    const int count = numBlocks();
#pragma omp parallel for schedule(static) num_threads(m_numThreads) if (m_numThreads > 1)
    for (int b = 0; b < count; ++b) {
        Block& block = *m_blocks[b];
        double* rb = r + block.firstU;
        block.calcResidual(m_context, q + block.firstQ, u + block.firstU, uDot + block.firstU, rb);
        for (const BlockSide& blockSide : m_blockSides[b]) {
            const JointRef& joint = m_joints[blockSide.joint];
            SpatialVec force(Vec3(0), Vec3(0));
            for (int k = 0; k < joint.record->equations->getNumEquations(); ++k)
                force -= lambda[joint.firstRow + k] * joint.D[blockSide.side][k];
            block.subtractForce(joint.sides[blockSide.side].frame, force, rb);
        }
        if (m_hasForeignForces)
            block.subtractSimbodyForces(m_system.getRigidBodyForces(m_private, Stage::Dynamics),
                                        m_system.getMobilityForces(m_private, Stage::Dynamics), rb);
    }
    for (const ElementRef& element : m_elements)
        for (size_t k = 0; k < element.frames.size(); ++k) {
            const FrameRef& ref = element.frames[k];
            if (ref.block >= 0)
                m_blocks[ref.block]->subtractForce(ref.frame, element.forces[unsigned(k)],
                                                   r + m_blocks[ref.block]->firstU);
        }
}

double MultibodyEquations::calcPower(const double* u, const double* lambda) const {
    Real power = 0;
    for (const ElementRef& element : m_elements)
        for (unsigned k = 0; k < element.forces.size(); ++k)
            power += ~element.forces[k][0] * element.motions[k].V[0] +
                     ~element.forces[k][1] * element.motions[k].V[1];
    for (const auto& block : m_blocks) power += block->calcDampingPower(u + block->firstU);
    for (const JointRef& joint : m_joints) {
        const JointEquations& equations = *joint.record->equations;
        if (!equations.dependsOnTime()) continue;
        // The joint's forces −Gᵀλ have power −λᵀGu = λᵀ ∂g/∂t.
        double timeRate[JointEquations::MaxEquations] = {};
        equations.addInTimeRate(m_time, timeRate);
        for (int k = 0; k < equations.getNumEquations(); ++k)
            power += lambda[joint.firstRow + k] * timeRate[k];
    }
    return power;
}

const std::string* MultibodyEquations::findFlippedJoint() const {
    for (const JointRef& joint : m_joints)
        if (joint.record->equations->isFlipped(motionOf(joint.sides[0]).X,
                                               motionOf(joint.sides[1]).X))
            return &joint.record->name;
    return nullptr;
}

void MultibodyEquations::formConstraintBlock(int b, NewtonSystem::Block& block) const {
    if (block.part < 0) std::fill(block.Gt.begin(), block.Gt.end(), 0.0);
    for (const BlockSide& blockSide : m_blockSides[b]) {
        const JointRef& joint = m_joints[blockSide.joint];
        const int frame = joint.sides[blockSide.side].frame;
        for (int k = 0; k < joint.record->equations->getNumEquations(); ++k) {
            const SpatialVec& d = joint.D[blockSide.side][k];
            const size_t column = size_t(blockSide.firstColumn + k);
            if (block.part < 0)
                m_blocks[b]->addInRow(frame, d, block.Gt.data() + column * size_t(block.size));
            else
                m_flexible[size_t(b)]->calcColumn(frame, d, block.Gt.data() + 6 * column,
                                                  block.coefficients.data() + 6 * column);
        }
    }
}

void MultibodyEquations::formNewtonSystem(double gamma, bool dense, const double* u,
                                          const double* uDot, NewtonSystem& system) const {
    for (size_t p = 0; p < m_parts.size(); ++p)
        m_flexible[size_t(m_parts[p].firstBlock)]->calcDiagonal(gamma,
                                                                system.parts[p].diagonal.data());
    const int count = numBlocks();
#pragma omp parallel for schedule(static) num_threads(m_numThreads) if (m_numThreads > 1)
    for (int b = 0; b < count; ++b) {
        const int first = m_blocks[b]->firstU;
        m_blocks[b]->formNewtonBlock(gamma, dense, u + first, uDot + first, system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    }
}

void MultibodyEquations::formMassSystem(NewtonSystem& system) const {
    for (NewtonSystem::Part& part : system.parts)
        std::fill(part.diagonal.begin(), part.diagonal.end(), 1.0);
    for (int b = 0; b < numBlocks(); ++b) {
        m_blocks[b]->formMassBlock(system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    }
}

void MultibodyEquations::setResidual(const double* r, NewtonSystem& system) const {
    for (size_t b = 0; b < m_blocks.size(); ++b)
        std::copy_n(r + m_blocks[b]->firstU, m_blocks[b]->numU, system.blocks[b].r.begin());
}

//---------------------------------------------------------------------------------------------------------
// coordinates

void MultibodyEquations::integrateQ(const double* qHist, double gamma, const double* u,
                                    double* q) const {
    for (const auto& block : m_blocks)
        block->integrateQ(m_context, qHist + block->firstQ, gamma, u + block->firstU,
                          q + block->firstQ);
}

void MultibodyEquations::displaceQ(const double* delta, double* q) const {
    for (const auto& block : m_blocks)
        block->displaceQ(m_context, delta + block->firstU, q + block->firstQ);
}

void MultibodyEquations::normalizeQ(double* q) const {
    for (const auto& block : m_blocks) block->normalizeQ(q + block->firstQ);
}

double MultibodyEquations::calcDisplacement(const double* delta, int* worst) const {
    double largest = 0;
    for (int b = 0; b < numBlocks(); ++b) {
        const double displacement = m_blocks[b]->calcDisplacement(delta + m_blocks[b]->firstU);
        if (displacement <= largest) continue;
        largest = displacement;
        if (worst) *worst = b;
        if (std::isnan(largest)) return largest;
    }
    return largest;
}

double MultibodyEquations::calcErrorDisplacement(const double* deltaQ, const double* deltaU,
                                                 double h, int* worst) const {
    double largest = 0;
    for (int b = 0; b < numBlocks(); ++b) {
        const Block& block = *m_blocks[b];
        const double displacement = std::max(block.calcQDisplacement(deltaQ + block.firstQ),
                                             block.calcUDisplacement(deltaU + block.firstU, h));
        if (displacement <= largest) continue;
        largest = displacement;
        if (worst) *worst = b;
        if (std::isnan(largest)) return largest;
    }
    return largest;
}

void MultibodyEquations::getFromState(const State& state, double* q, double* u) const {
    for (const auto& block : m_blocks)
        block->getFromState(state, q + block->firstQ, u + block->firstU);
}

void MultibodyEquations::putIntoState(double time, const double* q, const double* u,
                                      State& state) const {
    state.setTime(time);
    for (const auto& block : m_blocks)
        block->putIntoState(q + block->firstQ, u + block->firstU, state);
}

Vector MultibodyEquations::calcSimbodyUDot(const double* q, const double* uDot) const {
    Vector simbodyUDot(m_private.getNU(), Real(0));
    for (const auto& block : m_blocks)
        block->putUDot(q + block->firstQ, uDot + block->firstU, simbodyUDot);
    return simbodyUDot;
}

}  // namespace simflex
