#include "simflex/solver/MultibodyEquations.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <set>
#include <typeinfo>

#include "simflex/solver/FlexibleBlock.h"
#include "simflex/solver/ParallelFor.h"
#include "simflex/solver/RigidTree.h"
#include "simflex/solver/TangentMatrices.h"

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

bool isGeneralForceSubsystem(const Subsystem& subsystem) {
    // Simbody 3.7's isInstanceOf() takes any force subsystem for one.
    try {
        GeneralForceSubsystem::downcast(ForceSubsystem::downcast(subsystem)).getNumForces();
        return true;
    } catch (const std::bad_cast&) {
        return false;
    }
}

bool isCarrier(const FlexibleBodySubsystem::Guts* guts, MobilizedBodyIndex index) {
    if (!guts) return false;
    return std::any_of(guts->bodies().begin(), guts->bodies().end(),
                       [&](const FlexibleBodyRecord& body) {
                           return std::count(body.carriers.begin(), body.carriers.end(), index) > 0;
                       });
}

}  // namespace

//-------------------------------------------------------------------------------------------------------
// construction

MultibodyEquations::MultibodyEquations(const MultibodySystem& system, const State& state,
                                       Setting setting,
                                       const std::vector<ForceSelection>& differentiated)
    : m_system(system),
      m_setting(setting),
      m_owner(setting == Setting::Native ? "flexible bodies" : "ImplicitIntegrator"),
      m_private(state) {
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
    m_guts = flexible ? &flexible->getGuts() : nullptr;
    system.realize(m_private, Stage::Velocity);
    refuseUnsupported(m_private);
    collectGravityAndForces(m_private);
    makeBlocks(m_private);
    makeBatches();
    makeJoints();
    makeSimbodyConstraints();
    makePrescribedMotion();
    makeForceElements();
    m_context.gravity = &m_gravity;
    m_numSimbodyU = m_private.getNU();
    m_numZ = m_private.getNZ();
    if (m_setting == Setting::Native)
        m_private.clear();
    else
        preparePrivateStates(state);
    makeForceDifferences(differentiated);
    linkJointsToFrames();
    makeParts();
}

MultibodyEquations::~MultibodyEquations() = default;

void MultibodyEquations::preparePrivateStates(const State& state) {
    m_context.state = m_needsSimbody ? &m_private : nullptr;
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    if (m_numZ > 0) {
        // Accelerations are given there: Simbody need not solve for the joints.
        m_zState = state;
        for (const JointRef& joint : m_joints)
            matter.getConstraint(joint.record->constraint).disable(m_zState);
        m_system.realize(m_zState, Stage::Instance);
    }
    // On the private State Simbody evaluates foreign forces only.
    for (const JointRef& joint : m_joints)
        matter.getConstraint(joint.record->constraint).disable(m_private);
    if (m_guts) m_guts->setNativeForcesEnabled(m_private, false);
    m_system.realize(m_private, Stage::Instance);
    // What nobody will look at need not be kept: a flexible body takes some 60 kB of a State.
    if (!m_needsSimbody && !m_constraints && !m_prescribed && m_numZ == 0) m_private.clear();
}

void MultibodyEquations::refuseUnsupported(const State& state) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    const auto nameOfJoint = [&](ConstraintIndex constraint) {
        for (const JointRecord& joint : m_guts->joints())
            if (joint.constraint == constraint) return joint.name;
        return std::string();
    };
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i)
        if (PrescribedMotion::isUnsupported(matter.getMobilizedBody(i), state))
            throw std::invalid_argument(m_owner + ": " + describe(m_guts, i) +
                                        " has a Motion of method Fast, which is not supported; "
                                        "use a Prescribed one, or disable it");
    std::set<ConstraintIndex> own;
    if (m_guts)
        for (const JointRecord& joint : m_guts->joints()) own.insert(joint.constraint);
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i) {
        const Constraint& constraint = matter.getConstraint(i);
        if (constraint.isDisabled(state)) {
            if (own.count(i) && m_setting != Setting::Native)
                throw std::invalid_argument(
                    m_owner + ": joint '" + nameOfJoint(i) +
                    "' is disabled in the State; leave it out of the model instead");
            continue;
        }
        if (own.count(i)) continue;
        // A carrier's body stands still in Ground: only its coordinates can be constrained.
        for (ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b) {
            const MobilizedBodyIndex body =
                constraint.getMobilizedBodyFromConstrainedBody(b).getMobilizedBodyIndex();
            if (isCarrier(m_guts, body))
                throw std::invalid_argument(m_owner + ": " +
                                            SimbodyConstraints::describe(constraint) + " holds " +
                                            describe(m_guts, body) +
                                            ", which has no place in space; constrain its "
                                            "coordinates, or use a Joint to an interface");
        }
    }
}

void MultibodyEquations::collectGravityAndForces(const State& state) {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    m_gravity.atBody.assign(matter.getNumBodies(), Vec3(0));
    m_hasForeignForces = m_setting == Setting::Native;
    if (m_hasForeignForces) return;
    for (SubsystemIndex s(0); s < m_system.getNumSubsystems(); ++s) {
        const Subsystem& subsystem = m_system.getSubsystem(s);
        if (!dynamic_cast<const ForceSubsystem::Guts*>(&subsystem.getSubsystemGuts())) continue;
        if (m_guts && &subsystem.getSubsystemGuts() == m_guts) continue;
        if (!isGeneralForceSubsystem(subsystem)) {
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
    m_blockOfBody.assign(size_t(matter.getNumBodies()), -1);
    if (m_guts) {
        for (int b = 0; b < int(m_guts->bodies().size()); ++b) {
            const FlexibleBodyRecord& record = m_guts->body(FlexibleBodyIndex(b));
            m_blockOfBody[size_t(record.frame)] = b;
            for (MobilizedBodyIndex carrier : record.carriers) m_blockOfBody[size_t(carrier)] = b;
            const bool isRigid = m_setting == Setting::Implicit && m_guts->isRigid(state, record);
            auto block = std::make_unique<FlexibleBlock>(
                *m_guts, FlexibleBodyIndex(b), state,
                isRigid ? FlexibleBlock::Modes::None : FlexibleBlock::Modes::All);
            m_flexible.push_back(block.get());
            m_blocks.push_back(std::move(block));
        }
    }
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        int& blockOfBody = m_blockOfBody[size_t(i)];
        if (blockOfBody >= 0) continue;  // a flexible body's
        const MobilizedBodyIndex parent =
            matter.getMobilizedBody(i).getParentMobilizedBody().getMobilizedBodyIndex();
        blockOfBody = m_blockOfBody[size_t(parent)];
        if (blockOfBody >= 0 && blockOfBody < int(m_flexible.size()))
            throw std::invalid_argument(
                m_owner + ": mobilized body " + std::to_string(int(i)) + " is mobilized on " +
                describe(m_guts, parent) +
                "; put it on Ground and hold it with a Joint to an interface instead");
        if (parent != GroundIndex) continue;
        blockOfBody = int(m_blocks.size());
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
    m_elementSides.resize(m_blocks.size());
    m_simbodyColumns.resize(m_blocks.size());
}

int MultibodyEquations::findBlock(MobilizedBodyIndex mobod) const {
    return m_blockOfBody[size_t(mobod)];
}

std::vector<ConstraintIndex> MultibodyEquations::findSimbodyConstraints(const State& state) const {
    std::set<ConstraintIndex> own;
    if (m_guts)
        for (const JointRecord& joint : m_guts->joints()) own.insert(joint.constraint);
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<ConstraintIndex> constraints;
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i)
        if (!own.count(i) && !matter.getConstraint(i).isDisabled(state)) constraints.push_back(i);
    return constraints;
}

void MultibodyEquations::makeSimbodyConstraints() {
    m_firstSimbodyRow = m_numMultipliers;
    const std::vector<ConstraintIndex> constraints = findSimbodyConstraints(m_private);
    if (constraints.empty()) return;
    m_needsSimbody = true;
    m_constraints =
        std::make_unique<SimbodyConstraints>(m_system.getMatterSubsystem(), constraints, m_private);
    m_numMultipliers += m_constraints->numRows();
    for (int row = 0; row < m_constraints->numRows(); ++row) {
        std::set<int> blocks;
        for (MobilizedBodyIndex mobod : m_constraints->getBodies(row))
            blocks.insert(findBlock(mobod));
        for (int b : blocks) {
            m_simbodyColumns[size_t(b)].emplace_back(row, int(m_blockRows[size_t(b)].size()));
            m_blockRows[size_t(b)].push_back(m_firstSimbodyRow + row);
        }
    }
}

bool MultibodyEquations::isHeld(MobilizedBodyIndex body) const {
    const int b = findBlock(body);
    return b < int(m_flexible.size()) && m_flexible[size_t(b)]->hasHeldModes() &&
           m_guts->body(FlexibleBodyIndex(b)).frame != body;
}

PrescribedMotion::Mobilizer MultibodyEquations::findMobilizer(MobilizedBodyIndex body) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    PrescribedMotion::Mobilizer mobilizer;
    mobilizer.body = body;
    const int b = findBlock(body);
    const Block& block = *m_blocks[size_t(b)];
    if (b >= int(m_flexible.size())) {
        const RigidTree::Slots slots = m_rigid[size_t(b) - m_flexible.size()]->findSlots(body);
        mobilizer.q0 = slots.q0, mobilizer.nq = slots.nq;
        mobilizer.u0 = slots.u0, mobilizer.nu = slots.nu;
    } else {
        const FlexibleBodyRecord& record = m_guts->body(FlexibleBodyIndex(b));
        mobilizer.isFlexibleFrame = record.frame == body;
        const MobilizedBody& mobod = matter.getMobilizedBody(body);
        mobilizer.nq = mobilizer.isFlexibleFrame ? 7 : mobod.getNumQ(m_private);
        mobilizer.nu = mobod.getNumU(m_private);
        if (!mobilizer.isFlexibleFrame) {
            mobilizer.q0 = 7, mobilizer.u0 = 6;
            for (MobilizedBodyIndex carrier : record.carriers) {
                if (carrier == body) break;
                const int modes = matter.getMobilizedBody(carrier).getNumU(m_private);
                mobilizer.q0 += modes, mobilizer.u0 += modes;
            }
        }
    }
    mobilizer.q0 += block.firstQ;
    mobilizer.u0 += block.firstU;
    return mobilizer;
}

void MultibodyEquations::makePrescribedMotion() {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<PrescribedMotion::Mobilizer> mobilizers;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (!PrescribedMotion::isPrescribed(mobod, m_private)) continue;
        if (!isHeld(i)) mobilizers.push_back(findMobilizer(i));
    }
    if (mobilizers.empty()) return;
    m_system.prescribe(m_private);
    m_system.realize(m_private, Stage::Velocity);
    m_prescribed = std::make_unique<PrescribedMotion>(matter, mobilizers, m_numU, m_private);
    m_needsSimbody = m_needsSimbody || m_prescribed->dependsOnState();
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
    ref.block = findBlock(index);
    const int tree = ref.block - int(m_flexible.size());
    if (tree < 0)
        throw std::invalid_argument(m_owner + ": " + attachment.getName() +
                                    " is the frame or a modal mobilizer of a flexible body; "
                                    "attach to an interface or node");
    ref.frame = m_rigid[size_t(tree)]->addFrame(index, attachment.getFrame());
    return ref;
}

void MultibodyEquations::makeJoints() {
    if (!m_guts) return;
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (const JointRecord& record : m_guts->joints()) {
        if (matter.getConstraint(record.constraint).isDisabled(m_private)) continue;
        JointRef joint;
        joint.record = &record;
        joint.firstRow = m_numMultipliers;
        for (const Attachment& attachment : record.frames)
            joint.sides.push_back(makeFrame(attachment));
        const int rows = joint.numRows();
        joint.D.resize(joint.sides.size() * size_t(rows));
        if (record.equations->getPeriod() > 0)
            m_periods.emplace_back(joint.firstRow, record.equations->getPeriod());
        m_numMultipliers += rows;
        const int self = int(m_joints.size());
        for (int side = 0; side < int(joint.sides.size()); ++side) {
            const int b = joint.sides[size_t(side)].block;
            if (b < 0) continue;
            m_blockSides[b].push_back({self, side, int(m_blockRows[b].size())});
            for (int k = 0; k < rows; ++k) m_blockRows[b].push_back(joint.firstRow + k);
        }
        m_joints.push_back(joint);
    }
}

void MultibodyEquations::linkJointsToFrames() {
    size_t most = 0;
    for (JointRef& joint : m_joints) {
        for (const FrameRef& side : joint.sides) joint.motions.push_back(&motionOf(side));
        most = std::max(most, joint.sides.size());
    }
    m_accelerated.resize(most);
    for (const FrameMotion& motion : m_accelerated) m_acceleratedFrames.push_back(&motion);
}

bool MultibodyEquations::sharesPart(int block, int other) const {
    const FlexibleBlock &a = *m_flexible[size_t(block)], &b = *m_flexible[size_t(other)];
    return &a.getModel() == &b.getModel() && a.getDamping() == b.getDamping();
}

void MultibodyEquations::makeBatches() {
    std::map<const FlexibleBodyModel*, size_t> open;  // the batch that a part still fills
    const size_t flexible = m_flexible.size();
    for (size_t b = 0; b < m_blocks.size(); ++b) {
        const FlexibleBodyModel* model = b < flexible ? &m_flexible[b]->getModel() : nullptr;
        const auto [found, isNew] = open.emplace(model, m_batches.size());
        if (isNew || int(m_batches[found->second].blocks.size()) == FlexibleBlock::LargestBatch) {
            found->second = m_batches.size();
            m_batches.emplace_back();
        }
        Batch& batch = m_batches[found->second];
        batch.blocks.push_back(int(b));
        if (model) batch.flexible.push_back(m_flexible[b]);
    }
}

void MultibodyEquations::makeParts() {
    m_partOfBlock.assign(m_blocks.size(), -1);
    for (int b = 0; b < int(m_flexible.size()); ++b) {
        // Constrained or prescribed modes have no place in an arrow, nor shapes that change.
        const Block& block = *m_blocks[size_t(b)];
        if (m_flexible[size_t(b)]->getModel().n == 0 || m_flexible[size_t(b)]->hasCurvedFrames() ||
            !m_simbodyColumns[size_t(b)].empty() || hasDifferencedModes(b) ||
            (m_prescribed && m_prescribed->touches(block.firstU, block.numU)))
            continue;
        const auto found = std::find_if(m_parts.begin(), m_parts.end(), [&](const PartGroup& part) {
            return sharesPart(b, part.firstBlock);
        });
        m_partOfBlock[size_t(b)] = int(found - m_parts.begin());
        if (found == m_parts.end()) m_parts.push_back({b, {}, nullptr});
        for (BlockSide& side : m_blockSides[size_t(b)])
            side.partFrame =
                addPartFrame(b, m_joints[size_t(side.joint)].sides[size_t(side.side)].frame);
        for (ElementSide& side : m_elementSides[size_t(b)])
            side.partFrame = addPartFrame(
                b, m_elements[size_t(side.element)].frames[size_t(side.attachment)].frame);
    }
    for (PartGroup& part : m_parts) {
        const size_t n = size_t(m_flexible[size_t(part.firstBlock)]->getModel().n);
        auto shapes = std::make_shared<std::vector<double>>(6 * n * part.frames.size());
        double* column = shapes->data();
        for (const FrameShapes* frame : part.frames)
            column = std::copy(frame->columns.begin(), frame->columns.end(), column);
        part.shapes = shapes;
    }
}

int MultibodyEquations::addPartFrame(int block, int frame) {
    std::vector<const FrameShapes*>& frames = m_parts[size_t(m_partOfBlock[size_t(block)])].frames;
    const FrameShapes* shapes = m_flexible[size_t(block)]->getShapes(frame);
    const auto found = std::find(frames.begin(), frames.end(), shapes);
    const int index = int(found - frames.begin());
    if (found == frames.end()) frames.push_back(shapes);
    return index;
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
        const int rows = element->getNumJacobianTerms();
        ref.firstRow = m_numMultipliers + m_numElementRows;
        ref.signs.resize(unsigned(rows), Real(1));
        ref.directions.resize(unsigned(rows) * ref.motions.size());
        m_numElementRows += rows;
        for (size_t k = 0; k < ref.frames.size() && rows > 0; ++k) {
            const int b = ref.frames[k].block;
            if (b < 0) continue;
            std::vector<int>& blockRows = m_blockRows[size_t(b)];
            m_elementSides[size_t(b)].push_back(
                {int(m_elements.size()), int(k), int(blockRows.size())});
            for (int i = 0; i < rows; ++i) blockRows.push_back(ref.firstRow + i);
        }
        m_elements.push_back(ref);
    }
}

std::vector<ForceDifferences::Speed> MultibodyEquations::listSimbodySpeeds() const {
    const CoordinateScales scales(*this);
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<ForceDifferences::Speed> speeds;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        if (isHeld(i)) continue;
        const PrescribedMotion::Mobilizer mobilizer = findMobilizer(i);
        const int first = matter.getMobilizedBody(i).getFirstUIndex(m_private);
        for (int k = 0; k < mobilizer.nu; ++k) {
            const size_t own = size_t(mobilizer.u0 + k);
            // Contacts and steep springs change within micrometres.
            speeds.push_back(
                {i, first + k, std::max(scales.metres[own], 1e-9), 3e-3 * scales.step[own]});
        }
    }
    return speeds;
}

void MultibodyEquations::makeForceDifferences(const std::vector<ForceSelection>& selections) {
    if (selections.empty() || !m_hasForeignForces) return;
    m_system.realize(m_private, Stage::Velocity);
    const std::vector<ForceDifferences::Speed> candidates = listSimbodySpeeds();
    for (const ForceSelection& selection : selections) {
        if (!selection.force.isEmptyHandle() && selection.force.isDisabled(m_private)) continue;
        DifferencedForce forces{ForceDifferences(m_system, selection, candidates, m_private),
                                m_numMultipliers + m_numElementRows,
                                {}};
        if (forces.differences.getSpeeds().empty()) {
            // Modes that are held feel no stiffness.
            if (std::any_of(m_flexible.begin(), m_flexible.end(),
                            [](const FlexibleBlock* block) { return block->hasHeldModes(); }))
                continue;
            throw std::invalid_argument(
                "addForceJacobian(): " + selection.describe() +
                " acts on no body in the initial State; name the bodies that it can act on");
        }
        const int terms = forces.differences.getNumTerms();
        m_numElementRows += terms;
        for (const ForceDifferences::Speed& speed : forces.differences.getSpeeds()) {
            const int b = findBlock(speed.body),
                      own = int(&speed - &forces.differences.getSpeeds()[0]);
            auto side = std::find_if(forces.sides.begin(), forces.sides.end(),
                                     [b](const auto& known) { return known.block == b; });
            if (side == forces.sides.end()) {
                std::vector<int>& rows = m_blockRows[size_t(b)];
                side = forces.sides.insert(side, {b, int(rows.size()), {}});
                for (int i = 0; i < terms; ++i) rows.push_back(forces.firstRow + i);
            }
            side->speeds.push_back(own);
        }
        m_differenced.push_back(std::move(forces));
    }
}

bool MultibodyEquations::hasDifferencedModes(int block) const {
    const bool hasFrame =
        !m_blockSides[size_t(block)].empty() || !m_elementSides[size_t(block)].empty();
    for (const DifferencedForce& forces : m_differenced)
        for (const DifferencedForce::Side& side : forces.sides) {
            if (side.block != block) continue;
            if (!hasFrame) return true;
            const MobilizedBodyIndex frame = m_guts->body(FlexibleBodyIndex(block)).frame;
            for (int k : side.speeds)
                if (forces.differences.getSpeeds()[size_t(k)].body != frame) return true;
        }
    return false;
}

void MultibodyEquations::setNumThreads(int most) {
    constexpr double FlopsPerThread = 2e5;
    double flops = 0;  // about two passes over the invariants
    for (const auto& block : m_blocks) flops += 36.0 * block->numU * block->numU;
    m_numThreads = chooseNumThreads(most, flops, FlopsPerThread);
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
            sides.push_back({side.partFrame, m_joints[size_t(side.joint)].numRows()});
        for (const ElementSide& side : m_elementSides[b])
            sides.push_back({side.partFrame, int(m_elements[size_t(side.element)].signs.size())});
        // Differenced forces act on the body's rigid motion: the frame's shapes get no coefficient.
        for (const DifferencedForce& forces : m_differenced)
            for (const DifferencedForce::Side& side : forces.sides)
                if (side.block == int(b))
                    sides.push_back({sides.front().frame, forces.differences.getNumTerms()});
        system.blocks[b].resize(m_partOfBlock[b], m_blocks[b]->numU - 6, std::move(sides),
                                m_blockRows[b]);
    }
    system.r.assign(size_t(m_numU), 0);
    system.c.assign(size_t(m_numMultipliers + m_numElementRows), 0);
    if (m_numElementRows > 0) {
        system.compliance.assign(system.c.size(), 0);
        std::fill(system.compliance.begin() + m_numMultipliers, system.compliance.end(), 1.0);
    }
    return system;
}

const std::string& MultibodyEquations::getJointName(int row) const {
    for (const JointRef& joint : m_joints)
        if (row < joint.firstRow + joint.numRows()) return joint.record->name;
    if (m_constraints && row < m_numMultipliers)
        return m_constraints->getName(row - m_firstSimbodyRow);
    throw std::out_of_range("no joint has multiplier " + std::to_string(row));
}

std::string MultibodyEquations::describeConstraint(int row) const {
    const std::string& name = getJointName(row);
    return row < m_firstSimbodyRow ? "joint '" + name + "'" : name;
}

std::string MultibodyEquations::describeRow(int row) const {
    int first = m_firstSimbodyRow;
    for (const JointRef& joint : m_joints)
        if (joint.firstRow <= row && row < m_firstSimbodyRow) first = joint.firstRow;
    while (row >= m_firstSimbodyRow && first < row && getJointName(first) != getJointName(row))
        ++first;
    return "equation " + std::to_string(row - first + 1) + " of '" + getJointName(row) + "'";
}

MotionLevel MultibodyEquations::getRowLevel(int row) const {
    if (row < m_firstSimbodyRow) return MotionLevel::Position;
    return m_constraints->getLevel(row - m_firstSimbodyRow);
}

bool MultibodyEquations::isPrescribed(int speed) const {
    return m_prescribed && m_prescribed->touches(speed, 1);
}

bool MultibodyEquations::findRigidSlots(MobilizedBodyIndex body, int& q0, int& nq, int& u0) const {
    const int b = findBlock(body), tree = b - numFlexibleBlocks();
    if (tree < 0) return false;
    const RigidTree::Slots slots = m_rigid[size_t(tree)]->findSlots(body);
    q0 = m_blocks[size_t(b)]->firstQ + slots.q0;
    nq = slots.nq;
    u0 = m_blocks[size_t(b)]->firstU + slots.u0;
    return true;
}

void MultibodyEquations::setLoadFraction(double fraction) {
    if (m_fullGravity.atBody.empty()) m_fullGravity = m_gravity;
    m_loadFraction = m_context.loadFraction = fraction;
    for (size_t i = 0; i < m_gravity.atBody.size(); ++i)
        m_gravity.atBody[i] = fraction * m_fullGravity.atBody[i];
}

//---------------------------------------------------------------------------------------------------------
// evaluation

const FrameMotion& MultibodyEquations::motionOf(const FrameRef& frame) const {
    return frame.block < 0 ? frame.fixed : m_blocks[frame.block]->frames[frame.frame];
}

std::pair<int, int> MultibodyEquations::findRows(ConstraintIndex constraint) const {
    std::pair<int, int> rows{0, 0};
    if (m_constraints) rows = m_constraints->findRows(constraint);
    rows.first += m_firstSimbodyRow;
    return rows;
}

void MultibodyEquations::updatePrescribed(double time, const double* q, const double* u) {
    const bool isKnown = m_prescribedTime == time && !m_prescribed->dependsOnState();
    if (!m_prescribed->hasMotions() || isKnown) return;
    const auto start = Clock::now();
    putIntoState(time, q, u, m_private);
    m_prescribed->updateFromSimbody(m_private);
    if (!m_prescribed->dependsOnState()) {
        m_system.realize(m_private, Stage::Dynamics);
        m_prescribed->updateAccelerations(m_private);
    }
    m_prescribedTime = time;
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::prescribe(double time, double gamma, const double* uHist, double* q,
                                   double* u) {
    if (!m_prescribed) return;
    updatePrescribed(time, q, u);
    m_prescribed->apply(gamma, uHist, q, u);
}

void MultibodyEquations::clearPrescribedErrors(double* errorQ, double* errorU) const {
    if (m_prescribed) m_prescribed->clearErrors(errorQ, errorU);
}

void MultibodyEquations::calcStepUDot(const double* q, const double* u, const double* uHist,
                                      double gamma, double* uDot) const {
    for (int i = 0; i < m_numU; ++i) uDot[i] = (u[i] - uHist[i]) / gamma;
    if (m_prescribed) m_prescribed->applyAccelerations(q, uDot);
}

void MultibodyEquations::calcPrescribedUDot(const double* q, double* uDot) const {
    std::fill_n(uDot, m_numU, 0.0);
    if (m_prescribed) m_prescribed->applyAccelerations(q, uDot);
}

void MultibodyEquations::realizeSimbody(double time, const double* q, const double* u) {
    const auto start = Clock::now();
    putIntoState(time, q, u, m_private);
    const bool hasMotions = m_prescribed && m_prescribed->dependsOnState();
    m_system.realize(m_private,
                     m_hasForeignForces || hasMotions ? Stage::Dynamics : Stage::Velocity);
    if (hasMotions) m_prescribed->updateAccelerations(m_private);
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::realize(double time, const double* q, const double* u) {
    m_time = m_context.time = time;
    if (m_prescribed && !m_prescribed->dependsOnState()) updatePrescribed(time, q, u);
    if (m_needsSimbody) realizeSimbody(time, q, u);
    realizeBlocks(time, q, u);
}

void MultibodyEquations::realizeNatively(const State& state, const Vector_<SpatialVec>& bodyForces,
                                         const Vector& mobilityForces, const double* q,
                                         const double* u) {
    m_time = m_context.time = state.getTime();
    m_now = m_context.state = &state;
    m_bodyForces = bodyForces;
    m_mobilityForces = mobilityForces;
    if (m_prescribed) m_prescribed->updateAccelerations(state);
    realizeBlocks(m_time, q, u);
}

void MultibodyEquations::realizeBlocks(double time, const double* q, const double* u) {
    const int count = int(m_batches.size());
    parallelFor(count, m_numThreads, [&](int k) {
        FlexibleBlock::calcShapeProducts(m_batches[size_t(k)].flexible, q, u);
        for (int b : m_batches[size_t(k)].blocks)
            m_blocks[b]->realize(m_context, q + m_blocks[b]->firstQ, u + m_blocks[b]->firstU);
    });

    m_hasJacobians = false;
    for (ElementRef& element : m_elements) {
        for (size_t k = 0; k < element.frames.size(); ++k) {
            element.motions[unsigned(k)] = motionOf(element.frames[k]);
            element.forces[unsigned(k)] = SpatialVec(Vec3(0), Vec3(0));
        }
        element.element->addInForces(time, element.motions, element.forces);
        // What has a stiffness is no load.
        if (m_loadFraction != 1 && element.signs.empty())
            for (SpatialVec& force : element.forces) force *= m_loadFraction;
    }
}

void MultibodyEquations::updateJacobians() const {
    if (m_hasJacobians) return;
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcJacobian(m_time, joint.motions.data(), joint.D.data());
    });
    m_hasJacobians = true;
}

void MultibodyEquations::calcPositionErrors(double* g) const {
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        const JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcErrors(m_time, joint.motions.data(), g + joint.firstRow);
    });
    if (m_constraints) m_constraints->calcPositionErrors(*m_now, g + m_firstSimbodyRow);
}

bool MultibodyEquations::mayLoseCount(const double* g, double scale) const {
    // Errors grow by 2³ = 8 where order 2 doubles its step, by 1.5⁶ = 11 at order 5.
    constexpr double LargestPart = 1.0 / 24;
    for (const auto& [row, period] : m_periods)
        if (std::abs(scale * g[row]) > LargestPart * period) return true;
    return false;
}

void MultibodyEquations::calcVelocityErrors(double* gDot) const {
    parallelFor(int(m_joints.size()), m_numThreads, [&](int k) {
        const JointRef& joint = m_joints[size_t(k)];
        joint.record->equations->calcErrorDots(m_time, joint.motions.data(), gDot + joint.firstRow);
    });
    if (m_constraints) m_constraints->calcVelocityErrors(*m_now, gDot + m_firstSimbodyRow);
}

void MultibodyEquations::calcStepErrors(MotionLevel level, const NewtonFactors& factors,
                                        const double* uDot, const double* q, double* c) const {
    if (level == MotionLevel::Velocity)
        calcVelocityErrors(c);
    else
        calcPositionErrors(c);
    if (level == MotionLevel::Position)
        for (int k = 0; k < m_numMultipliers; ++k) c[k] /= factors.stiffness;
    if (!m_constraints) return;
    // Rows that are not holonomic stand at their own level, in terms of Δu.
    double* rows = c + m_firstSimbodyRow;
    std::vector<double> errors(size_t(m_constraints->numRows()));
    const auto takeRows = [&](MotionLevel which, double factor) {
        for (int k = 0; k < m_constraints->numRows(); ++k)
            if (m_constraints->getLevel(k) == which) rows[k] = factor * errors[size_t(k)];
    };
    if (level == MotionLevel::Position) {
        m_constraints->calcVelocityErrors(*m_now, errors.data());
        takeRows(MotionLevel::Velocity, 1);
    }
    if (m_constraints->hasAccelerationRows()) {
        m_constraints->calcAccelerationErrors(*m_now, calcSimbodyUDot(q, uDot), errors.data());
        takeRows(MotionLevel::Acceleration, factors.mass);
    }
}

void MultibodyEquations::calcAccelerationErrors(const double* q, const double* u,
                                                const double* uDot, double* gDotDot) const {
    if (m_constraints)
        m_constraints->calcAccelerationErrors(*m_now, calcSimbodyUDot(q, uDot),
                                              gDotDot + m_firstSimbodyRow);
    for (const Batch& batch : m_batches)
        FlexibleBlock::calcAccelerationProducts(batch.flexible, uDot);
    for (const JointRef& joint : m_joints) {
        for (size_t side = 0; side < joint.sides.size(); ++side) {
            const FrameRef& ref = joint.sides[side];
            m_accelerated[side] = motionOf(ref);
            if (ref.block < 0) continue;
            const int first = m_blocks[ref.block]->firstU;
            m_accelerated[side].A =
                m_blocks[ref.block]->calcFrameAcceleration(ref.frame, u + first, uDot + first);
        }
        joint.record->equations->calcErrorDotDots(m_time, m_acceleratedFrames.data(),
                                                  gDotDot + joint.firstRow);
    }
}

void MultibodyEquations::calcResidual(const double* q, const double* u, const double* uDot,
                                      const double* lambda, double* r) {
    calcUnclearedResidual(q, u, uDot, lambda, r);
    if (m_prescribed) m_prescribed->clearResidual(r);
}

void MultibodyEquations::calcUnclearedResidual(const double* q, const double* u, const double* uDot,
                                               const double* lambda, double* r) {
    const bool hasSimbodyForces = m_hasForeignForces || m_constraints;
    updateJacobians();
    if (m_setting == Setting::Native) {
        // Given.
    } else if (m_hasForeignForces) {
        m_bodyForces = m_system.getRigidBodyForces(*m_now, Stage::Dynamics);
        m_mobilityForces = m_system.getMobilityForces(*m_now, Stage::Dynamics);
        if (m_loadFraction != 1) {
            m_bodyForces *= m_loadFraction;
            m_mobilityForces *= m_loadFraction;
        }
    } else if (m_constraints) {
        m_bodyForces.resize(m_system.getMatterSubsystem().getNumBodies());
        m_bodyForces = SpatialVec(Vec3(0), Vec3(0));
        m_mobilityForces.resize(m_numSimbodyU);
        m_mobilityForces = Real(0);
    }
    if (m_constraints)
        m_constraints->addInForces(*m_now, lambda + m_firstSimbodyRow, m_bodyForces,
                                   m_mobilityForces);
    const int count = int(m_batches.size());
    parallelFor(count, m_numThreads, [&](int k) {
        FlexibleBlock::calcInertiaProducts(m_batches[size_t(k)].flexible, q, u);
        for (int b : m_batches[size_t(k)].blocks) {
            Block& block = *m_blocks[b];
            double* rb = r + block.firstU;
            block.calcResidual(m_context, q + block.firstQ, u + block.firstU, uDot + block.firstU,
                               rb);
            subtractJointForces(b, lambda, rb);
            if (hasSimbodyForces) block.subtractSimbodyForces(m_bodyForces, m_mobilityForces, rb);
        }
    });
    for (const ElementRef& element : m_elements)
        for (size_t k = 0; k < element.frames.size(); ++k) {
            const FrameRef& ref = element.frames[k];
            if (ref.block >= 0)
                m_blocks[ref.block]->subtractForce(ref.frame, element.forces[unsigned(k)],
                                                   r + m_blocks[ref.block]->firstU);
        }
}

void MultibodyEquations::subtractJointForces(int b, const double* lambda, double* r) const {
    for (const BlockSide& blockSide : m_blockSides[b]) {
        const JointRef& joint = m_joints[blockSide.joint];
        const SpatialVec* D = joint.rowsOf(blockSide.side);
        SpatialVec force(Vec3(0), Vec3(0));
        for (int k = 0; k < joint.numRows(); ++k) force -= lambda[joint.firstRow + k] * D[k];
        m_blocks[b]->subtractForce(joint.sides[size_t(blockSide.side)].frame, force, r);
    }
}

double MultibodyEquations::calcPower(const double* q, const double* u, const double* uDot,
                                     const double* lambda) {
    Real power = 0;
    if (m_prescribed && m_prescribed->canWork()) {
        m_scratch.resize(size_t(m_numU));
        calcUnclearedResidual(q, u, uDot, lambda, m_scratch.data());
        power += m_prescribed->calcPower(m_scratch.data(), u);
    }
    if (m_constraints) power += m_constraints->calcPower(*m_now, lambda + m_firstSimbodyRow);
    for (const ElementRef& element : m_elements)
        power += element.element->calcPower(m_time, element.motions, element.forces);
    for (const auto& block : m_blocks)
        power += block->calcDampingPower(u + block->firstU) +
                 block->calcLoadPower(m_context, q + block->firstQ, u + block->firstU);
    for (const JointRef& joint : m_joints) {
        const JointEquations& equations = *joint.record->equations;
        if (!equations.dependsOnTime()) continue;
        // The joint's forces −Gᵀλ have power −λᵀGu = λᵀ ∂g/∂t.
        double timeRate[JointEquations::MaxEquations] = {};
        equations.addInTimeRate(m_time, joint.motions.data(), timeRate);
        for (int k = 0; k < equations.getNumEquations(); ++k)
            power += lambda[joint.firstRow + k] * timeRate[k];
    }
    return power;
}

const std::string* MultibodyEquations::findFlippedJoint() const {
    for (const JointRef& joint : m_joints)
        if (joint.record->equations->isFlipped(m_time, joint.motions.data()))
            return &joint.record->name;
    return nullptr;
}

void MultibodyEquations::formConstraintBlock(int b, NewtonSystem::Block& block) const {
    if (block.part < 0) std::fill(block.Gt.begin(), block.Gt.end(), 0.0);
    for (const BlockSide& blockSide : m_blockSides[b]) {
        const JointRef& joint = m_joints[blockSide.joint];
        const int frame = joint.sides[size_t(blockSide.side)].frame;
        const SpatialVec* D = joint.rowsOf(blockSide.side);
        for (int k = 0; k < joint.numRows(); ++k)
            setColumn(b, frame, blockSide.firstColumn + k, D[k], block);
    }
}

void MultibodyEquations::setColumn(int b, int frame, int column, const SpatialVec& d,
                                   NewtonSystem::Block& block) const {
    const size_t k = size_t(column);
    if (block.part < 0)
        m_blocks[size_t(b)]->addInRow(frame, d, block.Gt.data() + k * size_t(block.size));
    else
        m_flexible[size_t(b)]->calcColumn(frame, d, block.Gt.data() + 6 * k,
                                          block.coefficients.data() + 6 * k);
}

void MultibodyEquations::formElementColumns(const NewtonFactors& factors,
                                            NewtonSystem& system) const {
    if (m_numElementRows == 0) return;
    for (ElementRef& element : m_elements) {
        if (element.signs.empty()) continue;
        element.element->calcJacobian(m_time, element.motions, factors.stiffness, element.signs,
                                      element.directions);
        for (unsigned i = 0; i < element.signs.size(); ++i)
            system.compliance[size_t(element.firstRow) + i] = element.signs[i];
    }
    for (int b = 0; b < numBlocks(); ++b) {
        NewtonSystem::Block& block = system.blocks[size_t(b)];
        for (const ElementSide& side : m_elementSides[size_t(b)]) {
            const ElementRef& element = m_elements[size_t(side.element)];
            const unsigned count = element.motions.size();
            const int frame = element.frames[size_t(side.attachment)].frame;
            for (unsigned i = 0; i < element.signs.size(); ++i)
                setColumn(b, frame, side.firstColumn + int(i),
                          element.directions[i * count + unsigned(side.attachment)], block);
        }
    }
}

void MultibodyEquations::formDifferencedColumns(const NewtonFactors& factors,
                                                NewtonSystem& system) const {
    if (m_differenced.empty()) return;
    const auto start = Clock::now();
    const Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                         SpatialVec(Vec3(0), Vec3(0)));
    Vector mobilityForces(m_numSimbodyU, Real(0));
    std::vector<double> column;
    for (DifferencedForce& forces : m_differenced) {
        ForceDifferences& differences = forces.differences;
        differences.calcTerms(m_private, factors.stiffness);
        for (int term = 0; term < differences.getNumTerms(); ++term)
            system.compliance[size_t(forces.firstRow + term)] = differences.getSign(term);
        for (const DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            for (int term = 0; term < differences.getNumTerms(); ++term) {
                for (int k : side.speeds)
                    mobilityForces[differences.getSpeeds()[size_t(k)].u] =
                        -differences.getDirection(term, k);
                column.assign(size_t(block.size), 0.0);
                m_blocks[size_t(side.block)]->subtractSimbodyForces(bodyForces, mobilityForces,
                                                                    column.data());
                const int rows = block.part < 0 ? block.size : 6;
                std::copy_n(column.data(), rows,
                            block.Gt.data() + size_t(side.firstColumn + term) * size_t(rows));
                for (int k : side.speeds) mobilityForces[differences.getSpeeds()[size_t(k)].u] = 0;
            }
        }
    }
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

void MultibodyEquations::formSimbodyColumns(MotionLevel level, NewtonSystem& system) const {
    if (m_constraints) {
        std::vector<SimbodyConstraints::RowForces> rows;
        m_constraints->calcRowForces(*m_now, rows);
        Vector_<SpatialVec> bodyForces(m_system.getMatterSubsystem().getNumBodies(),
                                       SpatialVec(Vec3(0), Vec3(0)));
        Vector mobilityForces(m_numSimbodyU, Real(0));
        for (int b = 0; b < numBlocks(); ++b)
            for (const auto& [row, column] : m_simbodyColumns[size_t(b)]) {
                NewtonSystem::Block& block = system.blocks[size_t(b)];
                double* Gt = block.Gt.data() + size_t(column) * size_t(block.size);
                std::fill_n(Gt, block.size, 0.0);
                const MotionLevel own = m_constraints->getLevel(row);
                const bool takesPart = own == MotionLevel::Position ||
                                       level == MotionLevel::Acceleration || own == level;
                if (!takesPart) continue;
                // Constraint forces stand left of the equations' sign.
                const SimbodyConstraints::RowForces& forces = rows[size_t(row)];
                for (const auto& [body, force] : forces.bodies) bodyForces[body] -= force;
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] -= force;
                m_blocks[size_t(b)]->subtractSimbodyForces(bodyForces, mobilityForces, Gt);
                for (const auto& [body, force] : forces.bodies)
                    bodyForces[body] = SpatialVec(Vec3(0), Vec3(0));
                for (const auto& [speed, force] : forces.speeds) mobilityForces[speed] = 0;
            }
    }
    if (m_prescribed)
        for (int b = 0; b < numBlocks(); ++b)
            if (m_prescribed->touches(m_blocks[size_t(b)]->firstU, m_blocks[size_t(b)]->numU))
                m_prescribed->mask(level, m_blocks[size_t(b)]->firstU, system.blocks[size_t(b)]);
}

void MultibodyEquations::formNewtonSystem(const NewtonFactors& factors, bool dense, const double* u,
                                          const double* uDot, NewtonSystem& system,
                                          MotionLevel level) const {
    updateJacobians();
    for (size_t p = 0; p < m_parts.size(); ++p)
        m_flexible[size_t(m_parts[p].firstBlock)]->calcDiagonal(factors,
                                                                system.parts[p].diagonal.data());
    const int count = numBlocks();
    parallelFor(count, m_numThreads, [&](int b) {
        const int first = m_blocks[b]->firstU;
        m_blocks[b]->formNewtonBlock(factors, dense, u + first, uDot + first, system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    });
    formElementColumns(factors, system);
    formDifferencedColumns(factors, system);
    formSimbodyColumns(level, system);
}

void MultibodyEquations::formMassSystem(NewtonSystem& system) const {
    updateJacobians();
    for (NewtonSystem::Part& part : system.parts)
        std::fill(part.diagonal.begin(), part.diagonal.end(), 1.0);
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        m_blocks[b]->formMassBlock(system.blocks[b]);
        formConstraintBlock(b, system.blocks[b]);
    });
    // Springs and dampers have no part in accelerations.
    for (int b = 0; b < numBlocks(); ++b)
        for (const ElementSide& side : m_elementSides[size_t(b)])
            for (unsigned i = 0; i < m_elements[size_t(side.element)].signs.size(); ++i)
                setColumn(b, m_elements[size_t(side.element)].frames[size_t(side.attachment)].frame,
                          side.firstColumn + int(i), SpatialVec(Vec3(0), Vec3(0)),
                          system.blocks[size_t(b)]);
    for (const DifferencedForce& forces : m_differenced)
        for (const DifferencedForce::Side& side : forces.sides) {
            NewtonSystem::Block& block = system.blocks[size_t(side.block)];
            const int rows = block.part < 0 ? block.size : 6;
            std::fill_n(block.Gt.data() + size_t(side.firstColumn) * size_t(rows),
                        rows * forces.differences.getNumTerms(), 0.0);
        }
    formSimbodyColumns(MotionLevel::Acceleration, system);
}

void MultibodyEquations::addInCouplingForces(const double* uDot, Vector_<SpatialVec>& bodyForces,
                                             Vector& mobilityForces) const {
    for (const FlexibleBlock* block : m_flexible)
        block->addInCouplingForces(uDot + block->firstU, bodyForces, mobilityForces);
}

//---------------------------------------------------------------------------------------------------------
// coordinates

void MultibodyEquations::integrateQ(const double* qHist, double gamma, const double* u,
                                    double* q) const {
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        const Block& block = *m_blocks[size_t(b)];
        block.integrateQ(m_context, qHist + block.firstQ, gamma, u + block.firstU,
                         q + block.firstQ);
    });
}

void MultibodyEquations::calcQDot(const double* q, const double* u, double* qDot) const {
    for (const auto& block : m_blocks)
        block->calcQDot(m_context, q + block->firstQ, u + block->firstU, qDot + block->firstQ);
}

void MultibodyEquations::displaceQ(const double* delta, double* q) const {
    parallelFor(numBlocks(), m_numThreads, [&](int b) {
        const Block& block = *m_blocks[size_t(b)];
        block.displaceQ(m_context, delta + block.firstU, q + block.firstQ);
    });
}

void MultibodyEquations::moveQ(const double* delta, double* q) const {
    for (const auto& block : m_blocks)
        block->moveQ(m_context, delta + block->firstU, q + block->firstQ);
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
    Vector simbodyUDot(m_numSimbodyU, Real(0));
    for (const auto& block : m_blocks)
        block->putUDot(q + block->firstQ, uDot + block->firstU, simbodyUDot);
    return simbodyUDot;
}

//---------------------------------------------------------------------------------------------------------
// auxiliary variables

void MultibodyEquations::setZ(const double* z) {
    if (numZ() == 0) return;
    Vector& stateZ = m_private.updZ();
    std::copy_n(z, numZ(), &stateZ[0]);
}

void MultibodyEquations::calcZDot(const double* q, const double* u, const double* uDot,
                                  const double* z, double* zDot) {
    if (numZ() == 0) return;
    const auto start = Clock::now();
    putIntoState(m_time, q, u, m_zState);
    std::copy_n(z, numZ(), &m_zState.updZ()[0]);
    if (m_guts) m_guts->setKnownAccelerations(m_zState, calcSimbodyUDot(q, uDot));
    m_system.realize(m_zState, Stage::Acceleration);
    const Vector& stateZDot = m_zState.getZDot();
    for (int i = 0; i < numZ(); ++i) zDot[i] = stateZDot[i];
    m_simbodySeconds += std::chrono::duration<double>(Clock::now() - start).count();
}

double MultibodyEquations::calcZError(const double* deltaZ) const {
    double largest = 0;
    for (int i = 0; i < numZ(); ++i)
        largest = std::max(largest, std::abs(m_private.getZWeights()[i] * deltaZ[i]));
    return largest;
}

}  // namespace simflex
