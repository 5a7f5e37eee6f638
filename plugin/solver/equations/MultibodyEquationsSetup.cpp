// MultibodyEquations: what is found once, before any evaluation.

#include "simflex/solver/equations/MultibodyEquations.h"

#include <algorithm>
#include <map>
#include <set>

#include "simflex/base/ParallelFor.h"
#include "simflex/solver/equations/CoordinateScales.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

namespace {

/** Of CoordinateScales' steps: contacts and steep springs change within micrometres. **/
constexpr double DifferenceStep = 3e-3;

/** Frames of a PartGroup for each that one of its bodies uses. **/
constexpr size_t LargestShare = 2;

/** The shapes' place in the list. **/
int addOnce(std::vector<const FrameShapes*>& list, const FrameShapes* shapes) {
    const auto found = std::find(list.begin(), list.end(), shapes);
    const int index = int(found - list.begin());
    if (found == list.end()) list.push_back(shapes);
    return index;
}

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

bool isCarrier(const FlexibleBodySubsystem::Guts* guts, MobilizedBodyIndex index) {
    if (!guts) return false;
    return std::any_of(guts->bodies().begin(), guts->bodies().end(),
                       [&](const FlexibleBodyRecord& body) {
                           return std::count(body.carriers.begin(), body.carriers.end(), index) > 0;
                       });
}

}  // namespace

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
    takeWeights(m_private);
    if (m_setting == Setting::Native)
        m_private.clear();
    else
        preparePrivateStates(state);
    makeLoadedBlocks();
    makeForceDifferences(differentiated);
    makeTreeDerivatives();
    linkJointsToFrames();
    makeParts();
    if (m_setting == Setting::Implicit) findTimedLoads();
}

MultibodyEquations::~MultibodyEquations() = default;

void MultibodyEquations::takeWeights(const State& state) {
    m_uWeights.assign(size_t(m_numU), 1);
    for (const RigidTree* tree : m_rigid)
        tree->takeSpeeds(state.getUWeights(), m_uWeights.data() + tree->firstU);
    m_uScales = m_uWeights;
    m_zWeights.resize(size_t(m_numZ));
    for (int i = 0; i < m_numZ; ++i) m_zWeights[size_t(i)] = state.getZWeights()[i];
    m_zScales = m_zWeights;
    m_referenceQ.assign(size_t(m_numQ), 0);
    m_weighed.assign(size_t(m_numQ), 0);
}

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
    for (SubsystemIndex s(0); s < state.getNumSubsystems(); ++s)
        if (s != matter.getMySubsystemIndex() && state.getNQ(s) + state.getNU(s) > 0)
            throw std::invalid_argument(m_owner + ": subsystem '" +
                                        std::string(state.getSubsystemName(s)) +
                                        "' has coordinates or speeds of its own, which only "
                                        "SimTK::Integrator can move; keep them as z");
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
    m_gravity.atBody.assign(m_system.getMatterSubsystem().getNumBodies(), Vec3(0));
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
            if (forces.isForceDisabled(state, f)) continue;
            if (!Force::Gravity::isInstanceOf(force)) {
                m_hasForeignForces = true;
                continue;
            }
            m_gravityForces.push_back(&Force::Gravity::downcast(force));
            forces.setForceIsDisabled(m_private, f, true);
        }
    }
    updateGravity(state);
    // Disabling a force lowers the stage of the private State; blocks still read velocities from
    // it.
    m_system.realize(m_private, Stage::Velocity);
}

void MultibodyEquations::updateGravity(const State& state) {
    std::fill(m_gravity.atBody.begin(), m_gravity.atBody.end(), Vec3(0));
    for (const Force::Gravity* gravity : m_gravityForces)
        for (MobilizedBodyIndex i(1); i < int(m_gravity.atBody.size()); ++i)
            if (!gravity->getBodyIsExcluded(state, i))
                m_gravity.atBody[i] += gravity->getGravityVector(state);
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
            block->setFirstScale(m_functions.add(record.loads));
            m_flexible.push_back(block.get());
            m_blocks.push_back(std::move(block));
        }
    }
    // Forces between trees have their derivatives inside of a block.
    constexpr int LargestBlock = 72;  // beyond, factoring it costs more than Simbody's forces
    const bool isOneBlock = m_setting == Setting::Implicit && m_flexible.empty() &&
                            m_hasForeignForces && state.getNU() <= LargestBlock;
    std::vector<std::vector<MobilizedBodyIndex>> trees;
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
        const bool joins = !trees.empty() && isOneBlock;
        if (!joins) trees.emplace_back();
        blockOfBody = int(m_flexible.size() + trees.size()) - 1;
        trees.back().push_back(i);
    }
    for (const std::vector<MobilizedBodyIndex>& roots : trees) {
        auto tree = std::make_unique<RigidTree>(matter, roots, state);
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
    if (m_setting == Setting::Native) return;
    for (ConstraintIndex constraint : constraints) {
        const auto [first, count] = m_constraints->findRows(constraint);
        if (count == 0) continue;
        const std::vector<MobilizedBodyIndex>& bodies = m_constraints->getBodies(first);
        if (bodies.size() > 2) continue;
        std::array<FrameRef, 2> pair;  // Ground unless told
        for (size_t k = 0; k < bodies.size(); ++k) {
            pair[k].block = findBlock(bodies[k]);
            const int tree = pair[k].block - int(m_flexible.size());
            pair[k].frame = tree < 0 ? -1 : m_rigid[size_t(tree)]->addFrame(bodies[k], Transform());
        }
        if (pair[0].frame >= 0 && (bodies.size() < 2 || pair[1].frame >= 0))
            m_constrainedPairs.emplace_back(pair, count);
    }
}

std::vector<MultibodyEquations::Link> MultibodyEquations::listLinks() const {
    std::vector<Link> links;
    const auto add = [&](const FrameRef& a, const FrameRef& b, int numEquations) {
        if (a.block != b.block)
            links.push_back({{a.block, b.block}, {&motionOf(a), &motionOf(b)}, numEquations});
    };
    for (const JointRef& joint : m_joints)
        if (joint.sides.size() == 2) add(joint.sides[0], joint.sides[1], joint.numRows());
    for (const auto& [pair, count] : m_constrainedPairs) add(pair[0], pair[1], count);
    for (const ElementRef& element : m_elements)
        if (element.frames.size() == 2) add(element.frames[0], element.frames[1], 0);
    return links;
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
        joint.drive = m_functions.add(*record.equations);
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
        const auto visitSides = [&](const auto& visit) {
            const auto visitSide = [&](int& partFrame, int frame) {
                visit(partFrame, m_flexible[size_t(b)]->getShapes(frame));
            };
            for (BlockSide& side : m_blockSides[size_t(b)])
                visitSide(side.partFrame,
                          m_joints[size_t(side.joint)].sides[size_t(side.side)].frame);
            for (ElementSide& side : m_elementSides[size_t(b)])
                visitSide(side.partFrame,
                          m_elements[size_t(side.element)].frames[size_t(side.attachment)].frame);
        };
        std::vector<const FrameShapes*> used;
        visitSides([&](int&, const FrameShapes* shapes) { addOnce(used, shapes); });
        // Products are with all frames of a group: few more than the body has itself.
        const auto found = std::find_if(m_parts.begin(), m_parts.end(), [&](const PartGroup& part) {
            if (!sharesPart(b, part.firstBlock)) return false;
            std::vector<const FrameShapes*> all = part.frames;
            for (const FrameShapes* shapes : used) addOnce(all, shapes);
            return all.size() <= LargestShare * used.size();
        });
        m_partOfBlock[size_t(b)] = int(found - m_parts.begin());
        if (found == m_parts.end()) m_parts.push_back({b, {}, nullptr});
        std::vector<const FrameShapes*>& frames = m_parts[size_t(m_partOfBlock[size_t(b)])].frames;
        visitSides([&](int& partFrame, const FrameShapes* shapes) {
            partFrame = addOnce(frames, shapes);
        });
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

void MultibodyEquations::makeForceElements() {
    if (!m_guts) return;
    for (const auto& element : m_guts->forceElements()) {
        if (element->getAttachments().empty()) continue;
        ElementRef ref;
        ref.element = element.get();
        ref.timedForce = m_functions.add(*element);
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

void MultibodyEquations::makeLoadedBlocks() {
    if (m_setting != Setting::Implicit) return;
    std::vector<std::vector<int>> elements(m_blocks.size());
    for (size_t e = 0; e < m_elements.size(); ++e) {
        const ElementRef& element = m_elements[e];
        if (element.frames.size() == 1 && element.frames[0].block >= 0 && element.signs.empty())
            elements[size_t(element.frames[0].block)].push_back(int(e));
    }
    size_t mostU = 0, mostMoved = 0;
    for (int b = 0; b < numBlocks(); ++b) {
        const Block& block = *m_blocks[size_t(b)];
        if (elements[size_t(b)].empty() && !block.hasLoads()) continue;
        // Where Simbody's State gives the kinematics, the block cannot be moved by itself.
        const int tree = b - numFlexibleBlocks();
        if (tree >= 0 && m_rigid[size_t(tree)]->needsSimbody()) continue;
        LoadedBlock loaded;
        loaded.block = b;
        if (tree < 0) loaded.flexible.push_back(m_flexible[size_t(b)]);
        loaded.elements = std::move(elements[size_t(b)]);
        m_loadedBlocks.push_back(std::move(loaded));
        mostU = std::max(mostU, size_t(block.numU));
        mostMoved = std::max(mostMoved, size_t(block.numU) * size_t(block.numQ));
    }
    if (m_loadedBlocks.empty()) return;
    const CoordinateScales scales(*this);
    for (LoadedBlock& loaded : m_loadedBlocks) {
        const Block& block = *m_blocks[size_t(loaded.block)];
        for (int i = 0; i < block.numU; ++i)
            loaded.steps.push_back(DifferenceStep * scales.step[size_t(block.firstU + i)]);
    }
    m_loadScratch.movedQ.resize(mostMoved);
    m_loadScratch.q.resize(size_t(m_numQ));
    m_loadScratch.u.resize(size_t(m_numU));
    m_loadScratch.r.resize(mostU);
    m_loadScratch.r0.resize(mostU);
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
            speeds.push_back({i, first + k, std::max(scales.metres[own], 1e-9),
                              DifferenceStep * scales.step[own]});
        }
    }
    return speeds;
}

void MultibodyEquations::makeForceDifferences(const std::vector<ForceSelection>& selections) {
    if (selections.empty() || !m_hasForeignForces) return;
    m_system.realize(m_private, Stage::Velocity);
    const std::vector<ForceDifferences::Speed> candidates = listSimbodySpeeds();
    for (const ForceSelection& selection : selections) {
        const GeneralForceSubsystem* owner = selection.force.isEmptyHandle()
                                                 ? nullptr
                                                 : findForceSubsystem(m_system, selection.force);
        if (owner && owner->isForceDisabled(m_private, selection.force.getForceIndex())) continue;
        DifferencedForce forces{ForceDifferences(m_system, selection, candidates, m_private),
                                m_numMultipliers + m_numElementRows,
                                {},
                                -1};
        if (forces.differences.getSpeeds().empty()) {
            // Modes that are held feel no stiffness.
            if (std::any_of(m_flexible.begin(), m_flexible.end(),
                            [](const FlexibleBlock* block) { return block->hasHeldModes(); }))
                continue;
            throw std::invalid_argument(
                "addForceJacobian(): " + selection.describe() +
                " acts on no body in the initial State; name the bodies that it can act on");
        }
        std::set<int> blocks;
        for (const ForceDifferences::Speed& speed : forces.differences.getSpeeds())
            blocks.insert(findBlock(speed.body));
        if (blocks.size() == 1 && *blocks.begin() >= numFlexibleBlocks()) {
            forces.ownBlock = *blocks.begin();
            m_differenced.push_back(std::move(forces));
            continue;
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

void MultibodyEquations::makeTreeDerivatives() {
    constexpr int MostSpeeds = 200;  // each takes two evaluations
    // Joints alone need none, and pass their singular positions best with a symmetric matrix.
    const bool mayBeStiff = m_hasForeignForces || m_numMultipliers == 0;
    m_canDifferentiateTrees = m_setting == Setting::Implicit && m_flexible.empty() && mayBeStiff &&
                              m_numU > 0 && m_numU <= MostSpeeds;
    if (!m_canDifferentiateTrees) return;
    m_metres = CoordinateScales(*this).metres;
    for (int b = 0; b < numBlocks(); ++b) {
        const size_t n = size_t(m_blocks[size_t(b)]->numU);
        m_treeDerivatives.push_back(
            {b, std::vector<double>(n * n, 0), std::vector<double>(n * n, 0)});
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

void requireTopology(const MultibodySystem& system, const State& state, const std::string& method) {
    if (!system.systemTopologyHasBeenRealized())
        throw std::invalid_argument(method + ": call realizeTopology() on the system first");
    if (state.getSystemStage() < Stage::Topology)
        throw std::invalid_argument(method + ": an empty State; take one from realizeTopology()");
}

}  // namespace simflex
