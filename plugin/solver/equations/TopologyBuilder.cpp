#include "simflex/solver/equations/TopologyBuilder.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "simflex/body/StateCopy.h"
#include "simflex/solver/equations/CoordinateScales.h"
#include "simflex/solver/equations/FlexibleBlock.h"
#include "simflex/solver/equations/ForceElements.h"
#include "simflex/solver/equations/RigidTree.h"

namespace simflex {

using namespace SimTK;

namespace {

/** Relative to CoordinateScales' steps: contacts and steep springs change within micrometres. **/
constexpr double DifferenceStep = 3e-3;

/** Largest number of frames of a PartGroup per frame used by one of its bodies. **/
constexpr size_t LargestShare = 2;

/** Index of the shapes in the list. **/
int addOnce(std::vector<const FrameShapes*>& list, const FrameShapes* shapes) {
    const auto found = std::find(list.begin(), list.end(), shapes);
    const int index = int(found - list.begin());
    if (found == list.end()) list.push_back(shapes);
    return index;
}

/** "mobilized body 7", or its name, or the flexible body it belongs to. **/
std::string describe(const FlexibleBodySubsystem::Guts* guts, MobilizedBodyIndex index) {
    if (guts) {
        for (const FlexibleBodyRecord& body : guts->bodies()) {
            if (body.frame == index) return "the frame of flexible body '" + body.name + "'";
            if (std::count(body.carriers.begin(), body.carriers.end(), index))
                return "a modal mobilizer of flexible body '" + body.name + "'";
        }
        return describeBody(guts->getMatter(), index, "mobilized body");
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

std::shared_ptr<Topology> startTopology(const MultibodySystem& system, Topology::Setting setting) {
    auto topology = std::make_shared<Topology>();
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
    topology->system = &system;
    topology->guts = flexible ? &flexible->getGuts() : nullptr;
    topology->setting = setting;
    return topology;
}

TopologyBuilder::Result startResult(const std::shared_ptr<Topology>& topology, const State& state) {
    auto blocks = std::make_unique<Blocks>();
    auto simbody = std::make_unique<SimbodyBridge>(*topology, *blocks, state);
    return {topology, std::move(blocks), std::make_unique<FunctionsOfTime>(), std::move(simbody),
            nullptr};
}

}  // namespace

TopologyBuilder::TopologyBuilder(const MultibodySystem& system, const State& state,
                                 Topology::Setting setting)
    : m_system(system),
      m_owner(setting == Topology::Setting::Native ? "flexible bodies" : "ImplicitIntegrator"),
      m_shared(startTopology(system, setting)),
      m_result(startResult(m_shared, state)),
      m_topology(*m_shared),
      m_blocks(*m_result.blocks),
      m_functions(*m_result.functions),
      m_simbody(*m_result.simbody) {}

TopologyBuilder::Result TopologyBuilder::build(const MultibodySystem& system, const State& state,
                                               Topology::Setting setting,
                                               const std::vector<ForceSelection>& differentiated) {
    TopologyBuilder builder(system, state, setting);
    builder.analyse(state, differentiated);
    return std::move(builder.m_result);
}

void TopologyBuilder::analyse(const State& state,
                              const std::vector<ForceSelection>& differentiated) {
    State& own = m_simbody.m_private;
    m_system.realize(own, Stage::Velocity);
    refuseUnsupported(own);
    collectGravityAndForces(own, differentiated);
    makeBlocks(own);
    makeBatches();
    makeJoints();
    makeSimbodyConstraints();
    makeFrictions();
    makePrescribedMotion();
    makeForceElements();
    m_result.errorNorm = std::make_unique<ErrorNorm>(m_blocks, own);
    for (size_t i = 0; i < m_topology.states.size(); ++i)
        m_result.errorNorm->setZScale(m_topology.firstZ + int(i),
                                      m_topology.states[i].equation->getScale());
    m_topology.numSimbodyU = m_blocks.numSimbodyU = own.getNU();
    m_topology.numZ = own.getNZ();
    if (m_topology.setting == Topology::Setting::Native)
        own.clear();
    else
        preparePrivateStates(state);
    makeLoadedBlocks();
    makeForceDifferences(differentiated);
    makeParts();
}

void TopologyBuilder::preparePrivateStates(const State& state) {
    m_blocks.context.state = m_topology.needsSimbody ? &m_simbody.m_private : nullptr;
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    if (m_topology.hasForeignZ() && m_topology.guts) {
        // Accelerations are given there: Simbody need not solve for the joints.
        copyState(state, m_simbody.m_zState);
        for (const Topology::Joint& joint : m_topology.joints)
            matter.getConstraint(joint.record->constraint).disable(m_simbody.m_zState);
        m_system.realize(m_simbody.m_zState, Stage::Instance);
    }
    // On the private State Simbody evaluates foreign forces only.
    for (const Topology::Joint& joint : m_topology.joints)
        matter.getConstraint(joint.record->constraint).disable(m_simbody.m_private);
    if (m_topology.guts) m_topology.guts->setNativeForcesEnabled(m_simbody.m_private, false);
    m_system.realize(m_simbody.m_private, Stage::Instance);
    // Unneeded private States are dropped: a flexible body takes some 60 kB of a State.
    if (!m_topology.needsSimbody && !m_simbody.m_constraints && !m_simbody.m_prescribed &&
        !m_topology.hasForeignZ() && !m_topology.areForcesHeld)
        m_simbody.m_private.clear();
    m_simbody.updateHeldForces();
}

void TopologyBuilder::refuseUnsupported(const State& state) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (SubsystemIndex s(0); s < state.getNumSubsystems(); ++s)
        if (s != matter.getMySubsystemIndex() && state.getNQ(s) + state.getNU(s) > 0)
            throw std::invalid_argument(m_owner + ": subsystem '" +
                                        std::string(state.getSubsystemName(s)) +
                                        "' has coordinates or speeds of its own, which only "
                                        "SimTK::Integrator can move; keep them as z");
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i)
        if (PrescribedMotion::isUnsupported(matter.getMobilizedBody(i), state))
            throw std::invalid_argument(m_owner + ": " + describe(m_topology.guts, i) +
                                        " has a Motion of method Fast, which is not supported; "
                                        "use a Prescribed one, or disable it");
    std::set<ConstraintIndex> own;
    if (m_topology.guts)
        for (const JointRecord& joint : m_topology.guts->joints()) own.insert(joint.constraint);
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i) {
        const Constraint& constraint = matter.getConstraint(i);
        if (constraint.isDisabled(state)) continue;
        if (own.count(i)) continue;
        // A modal mobilizer's body is fixed in Ground: only its coordinates can be constrained.
        for (ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b) {
            const MobilizedBodyIndex body =
                constraint.getMobilizedBodyFromConstrainedBody(b).getMobilizedBodyIndex();
            if (isCarrier(m_topology.guts, body))
                throw std::invalid_argument(m_owner + ": " +
                                            SimbodyConstraints::describe(constraint) + " holds " +
                                            describe(m_topology.guts, body) +
                                            ", which has no place in space; constrain its "
                                            "coordinates, or use a Joint to an interface");
        }
    }
}

void TopologyBuilder::collectGravityAndForces(const State& state,
                                              const std::vector<ForceSelection>& differentiated) {
    m_simbody.m_gravity.atBody.assign(m_system.getMatterSubsystem().getNumBodies(), Vec3(0));
    m_topology.hasForeignForces = m_topology.setting == Topology::Setting::Native;
    if (m_topology.hasForeignForces) return;
    m_topology.areForcesHeld = differentiated.empty();
    // ż follows from Simbody's accelerations, which depend on all its forces.
    const bool isGravitySimbodys = !m_topology.guts && state.getNZ() > 0;
    // Rigid trees apply mobility forces; a force to be differentiated stays Simbody's.
    const bool takesMobilityForces = m_topology.setting == Topology::Setting::Implicit &&
                                     differentiated.empty() &&
                                     (!m_topology.guts || m_topology.guts->bodies().empty());
    for (SubsystemIndex s(0); s < m_system.getNumSubsystems(); ++s) {
        const Subsystem& subsystem = m_system.getSubsystem(s);
        if (!dynamic_cast<const ForceSubsystem::Guts*>(&subsystem.getSubsystemGuts())) continue;
        if (m_topology.guts && &subsystem.getSubsystemGuts() == m_topology.guts) continue;
        if (!isGeneralForceSubsystem(subsystem)) {
            m_topology.hasForeignForces = true;
            m_topology.areForcesHeld = false;
            continue;
        }
        const GeneralForceSubsystem& forces =
            GeneralForceSubsystem::downcast(ForceSubsystem::downcast(subsystem));
        for (ForceIndex f(0); f < forces.getNumForces(); ++f) {
            const Force& force = forces.getForce(f);
            if (forces.isForceDisabled(state, f)) continue;
            const bool isKnown =
                !isGravitySimbodys &&
                (takeGravity(force) || (takesMobilityForces && takeMobilityForce(force)));
            if (!isKnown) {
                m_topology.hasForeignForces = true;
                m_topology.areForcesHeld = m_topology.areForcesHeld && isHeldForce(force);
                continue;
            }
            forces.setForceIsDisabled(m_simbody.m_private, f, true);
        }
    }
    m_topology.hasMobilityForces = !m_simbody.m_mobilityForceElements.empty();
    m_simbody.updateKnownForces(state);
    // Disabling a force lowers the stage of the private State; blocks still read velocities from
    // it.
    m_system.realize(m_simbody.m_private, Stage::Velocity);
}

bool TopologyBuilder::takeGravity(const Force& force) {
    if (Force::Gravity::isInstanceOf(force))
        m_simbody.m_gravityForces.push_back(&Force::Gravity::downcast(force));
    else if (Force::UniformGravity::isInstanceOf(force))
        m_simbody.m_uniformGravities.push_back(&Force::UniformGravity::downcast(force));
    else
        return false;
    return true;
}

bool TopologyBuilder::takeMobilityForce(const Force& force) {
    const bool isGlobal = Force::GlobalDamper::isInstanceOf(force),
               isSpring = Force::MobilityLinearSpring::isInstanceOf(force),
               isDamper = Force::MobilityLinearDamper::isInstanceOf(force);
    if (!isGlobal && !isSpring && !isDamper) return false;
    // Only the force itself knows its mobility, and a GlobalDamper's constant.
    State trial = copyState(m_simbody.m_private);
    trial.updU() = Real(1);
    constexpr Real Far = 1e6;
    if (isSpring) {
        const auto& spring = Force::MobilityLinearSpring::downcast(force);
        spring.setStiffness(trial, 1);
        spring.setQZero(trial, Far);
    } else if (isDamper) {
        Force::MobilityLinearDamper::downcast(force).setDamping(trial, 1);
    }
    Vector_<SpatialVec> bodyForces;
    Vector_<Vec3> particleForces;
    Vector mobilityForces;
    force.calcForceContribution(trial, bodyForces, particleForces, mobilityForces);
    if (isGlobal) {
        if (trial.getNU() > 0)
            m_simbody.m_mobilityForceElements.push_back({&force, -1, -mobilityForces[0]});
        return true;
    }
    for (int u = 0; u < mobilityForces.size(); ++u)
        if (mobilityForces[u] != 0) m_simbody.m_mobilityForceElements.push_back({&force, u, 0});
    return true;
}

void TopologyBuilder::makeBlocks(const State& state) {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    m_topology.blockOfBody.assign(size_t(matter.getNumBodies()), -1);
    if (m_topology.guts) {
        for (int b = 0; b < int(m_topology.guts->bodies().size()); ++b) {
            const FlexibleBodyRecord& record = m_topology.guts->body(FlexibleBodyIndex(b));
            m_topology.blockOfBody[size_t(record.frame)] = b;
            for (MobilizedBodyIndex carrier : record.carriers)
                m_topology.blockOfBody[size_t(carrier)] = b;
            const bool isRigid = m_topology.setting == Topology::Setting::Implicit &&
                                 m_topology.guts->isRigid(state, record);
            auto block = std::make_unique<FlexibleBlock>(
                *m_topology.guts, FlexibleBodyIndex(b), state,
                isRigid ? FlexibleBlock::Modes::None : FlexibleBlock::Modes::All);
            block->setFirstScale(m_functions.add(record.loads));
            if (!m_blocks.flexible.empty()) block->shareConstants(*m_blocks.flexible.back());
            m_blocks.flexible.push_back(block.get());
            m_blocks.all.push_back(std::move(block));
        }
    }
    // Forces between trees of one block have exact derivatives.
    constexpr int LargestBlock = 72;  // beyond, factoring it costs more than Simbody's forces
    const bool isOneBlock = m_topology.setting == Topology::Setting::Implicit &&
                            m_blocks.flexible.empty() && m_topology.hasForeignForces &&
                            state.getNU() <= LargestBlock;
    std::vector<std::vector<MobilizedBodyIndex>> trees;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        int& blockOfBody = m_topology.blockOfBody[size_t(i)];
        if (blockOfBody >= 0) continue;  // a flexible body's
        const MobilizedBodyIndex parent =
            matter.getMobilizedBody(i).getParentMobilizedBody().getMobilizedBodyIndex();
        blockOfBody = m_topology.blockOfBody[size_t(parent)];
        if (blockOfBody >= 0 && blockOfBody < int(m_blocks.flexible.size()))
            throw std::invalid_argument(
                m_owner + ": " + describe(m_topology.guts, i) + " is mobilized on " +
                describe(m_topology.guts, parent) +
                "; put it on Ground and hold it with a Joint to an interface instead");
        if (parent != GroundIndex) continue;
        const bool joins = !trees.empty() && isOneBlock;
        if (!joins) trees.emplace_back();
        blockOfBody = int(m_blocks.flexible.size() + trees.size()) - 1;
        trees.back().push_back(i);
    }
    for (const std::vector<MobilizedBodyIndex>& roots : trees) {
        auto tree = std::make_unique<RigidTree>(matter, roots, state);
        m_topology.needsKinematics = m_topology.needsKinematics || tree->needsSimbody();
        m_blocks.rigid.push_back(tree.get());
        m_blocks.all.push_back(std::move(tree));
    }
    for (const auto& block : m_blocks.all) {
        m_topology.blockSizes.push_back(block->numU);
        block->firstQ = m_topology.numQ;
        block->firstU = m_topology.numU;
        m_topology.numQ += block->numQ;
        m_topology.numU += block->numU;
    }
    m_topology.areForcesHeld = m_topology.areForcesHeld && m_topology.hasForeignForces;
    m_topology.needsSimbody =
        m_topology.needsKinematics || (m_topology.hasForeignForces && !m_topology.areForcesHeld);
    m_topology.numFlexible = int(m_blocks.flexible.size());
    m_topology.isPrescribed.assign(size_t(m_topology.numU), 0);
    m_topology.blockRows.resize(m_blocks.all.size());
    m_topology.blockSides.resize(m_blocks.all.size());
    m_topology.frictionSides.resize(m_blocks.all.size());
    m_topology.elementSides.resize(m_blocks.all.size());
    m_topology.simbodyColumns.resize(m_blocks.all.size());
}

std::vector<ConstraintIndex> TopologyBuilder::findSimbodyConstraints(const State& state) const {
    std::set<ConstraintIndex> own;
    if (m_topology.guts)
        for (const JointRecord& joint : m_topology.guts->joints()) own.insert(joint.constraint);
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<ConstraintIndex> constraints;
    for (ConstraintIndex i(0); i < matter.getNumConstraints(); ++i)
        if (!own.count(i) && !matter.getConstraint(i).isDisabled(state)) constraints.push_back(i);
    return constraints;
}

void TopologyBuilder::makeSimbodyConstraints() {
    m_topology.firstSimbodyRow = m_topology.numMultipliers;
    const std::vector<ConstraintIndex> constraints = findSimbodyConstraints(m_simbody.m_private);
    if (constraints.empty()) return;
    m_topology.needsSimbody = m_topology.needsKinematics = true;
    m_simbody.m_constraints = std::make_unique<SimbodyConstraints>(
        m_system.getMatterSubsystem(), constraints, m_simbody.m_private);
    m_topology.numMultipliers += m_simbody.m_constraints->numRows();
    for (ConstraintIndex constraint : constraints)
        for (int k = 0; k < m_simbody.m_constraints->findRows(constraint).second; ++k) {
            const int row = int(m_topology.simbodyRows.size());
            m_topology.simbodyRows.push_back({constraint, m_simbody.m_constraints->getLevel(row),
                                              m_simbody.m_constraints->getName(row)});
        }
    for (int row = 0; row < m_simbody.m_constraints->numRows(); ++row) {
        std::set<int> blocks;
        for (MobilizedBodyIndex mobod : m_simbody.m_constraints->getBodies(row))
            blocks.insert(m_topology.findBlock(mobod));
        for (int b : blocks) {
            m_topology.simbodyColumns[size_t(b)].emplace_back(
                row, int(m_topology.blockRows[size_t(b)].size()));
            m_topology.blockRows[size_t(b)].push_back(m_topology.firstSimbodyRow + row);
        }
    }
    if (m_topology.setting == Topology::Setting::Native) return;
    for (ConstraintIndex constraint : constraints) {
        const auto [first, count] = m_simbody.m_constraints->findRows(constraint);
        if (count == 0) continue;
        const std::vector<MobilizedBodyIndex>& bodies = m_simbody.m_constraints->getBodies(first);
        if (bodies.size() > 2) continue;
        std::array<FrameRef, 2> pair;  // Ground unless told
        for (size_t k = 0; k < bodies.size(); ++k) {
            pair[k].block = m_topology.findBlock(bodies[k]);
            const int tree = pair[k].block - int(m_blocks.flexible.size());
            pair[k].frame =
                tree < 0 ? -1 : m_blocks.rigid[size_t(tree)]->addFrame(bodies[k], Transform());
        }
        if (pair[0].frame >= 0 && (bodies.size() < 2 || pair[1].frame >= 0))
            m_topology.constrainedPairs.emplace_back(pair, count);
    }
}

bool TopologyBuilder::isHeld(MobilizedBodyIndex body) const {
    const int b = m_topology.findBlock(body);
    return b < int(m_blocks.flexible.size()) && m_blocks.flexible[size_t(b)]->hasHeldModes() &&
           m_topology.guts->body(FlexibleBodyIndex(b)).frame != body;
}

PrescribedMotion::Mobilizer TopologyBuilder::findMobilizer(MobilizedBodyIndex body) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    PrescribedMotion::Mobilizer mobilizer;
    mobilizer.body = body;
    const int b = m_topology.findBlock(body);
    const Block& block = *m_blocks.all[size_t(b)];
    if (b >= int(m_blocks.flexible.size())) {
        const RigidTree::Slots slots =
            m_blocks.rigid[size_t(b) - m_blocks.flexible.size()]->findSlots(body);
        mobilizer.q0 = slots.q0, mobilizer.nq = slots.nq;
        mobilizer.u0 = slots.u0, mobilizer.nu = slots.nu;
    } else {
        const FlexibleBodyRecord& record = m_topology.guts->body(FlexibleBodyIndex(b));
        mobilizer.isFlexibleFrame = record.frame == body;
        const MobilizedBody& mobod = matter.getMobilizedBody(body);
        mobilizer.nq = mobilizer.isFlexibleFrame ? 7 : mobod.getNumQ(m_simbody.m_private);
        mobilizer.nu = mobod.getNumU(m_simbody.m_private);
        if (!mobilizer.isFlexibleFrame) {
            mobilizer.q0 = 7, mobilizer.u0 = 6;
            for (MobilizedBodyIndex carrier : record.carriers) {
                if (carrier == body) break;
                const int modes = matter.getMobilizedBody(carrier).getNumU(m_simbody.m_private);
                mobilizer.q0 += modes, mobilizer.u0 += modes;
            }
        }
    }
    mobilizer.q0 += block.firstQ;
    mobilizer.u0 += block.firstU;
    return mobilizer;
}

void TopologyBuilder::makePrescribedMotion() {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<PrescribedMotion::Mobilizer> mobilizers;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& mobod = matter.getMobilizedBody(i);
        if (!PrescribedMotion::isPrescribed(mobod, m_simbody.m_private)) continue;
        if (!isHeld(i)) mobilizers.push_back(findMobilizer(i));
    }
    if (mobilizers.empty()) return;
    m_system.prescribe(m_simbody.m_private);
    m_system.realize(m_simbody.m_private, Stage::Velocity);
    m_simbody.m_prescribed = std::make_unique<PrescribedMotion>(matter, mobilizers, m_topology.numU,
                                                                m_simbody.m_private);
    m_topology.needsSimbody = m_topology.needsSimbody || m_simbody.m_prescribed->dependsOnState();
    m_topology.needsKinematics = true;
    for (int i = 0; i < m_topology.numU; ++i)
        m_topology.isPrescribed[size_t(i)] = m_simbody.m_prescribed->touches(i, 1);
}

FrameRef TopologyBuilder::makeFrame(const Attachment& attachment) {
    FrameRef ref;
    if (attachment.isFlexible()) {
        ref.block = int(attachment.getFlexibleBodyIndex());  // flexible blocks come first, in order
        ref.frame = m_blocks.flexible[ref.block]->addFrame(attachment.getFlexibleFrame());
        return ref;
    }
    const MobilizedBodyIndex index = attachment.getMobilizedBodyIndex();
    if (index == GroundIndex) {
        ref.fixed.X = attachment.getFrame();
        return ref;
    }
    ref.block = m_topology.findBlock(index);
    const int tree = ref.block - int(m_blocks.flexible.size());
    if (tree < 0)
        throw std::invalid_argument(m_owner + ": " + attachment.getName() +
                                    " is the frame or a modal mobilizer of a flexible body; "
                                    "attach to an interface or node");
    ref.frame = m_blocks.rigid[size_t(tree)]->addFrame(index, attachment.getFrame());
    return ref;
}

void TopologyBuilder::makeJoints() {
    if (!m_topology.guts) return;
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    for (JointIndex j(0); j < int(m_topology.guts->joints().size()); ++j) {
        const JointRecord& record = m_topology.guts->joint(j);
        if (matter.getConstraint(record.constraint).isDisabled(m_simbody.m_private)) continue;
        Topology::Joint joint;
        joint.record = &record;
        joint.firstRow = m_topology.numMultipliers;
        joint.drive =
            m_functions.add(*record.equations, m_topology.guts->getHeld(m_simbody.m_private, j));
        for (const Attachment& attachment : record.frames)
            joint.sides.push_back(makeFrame(attachment));
        const int rows = joint.numRows();
        if (record.equations->getPeriod() > 0)
            m_topology.periods.emplace_back(joint.firstRow, record.equations->getPeriod());
        m_topology.numMultipliers += rows;
        const int self = int(m_topology.joints.size());
        for (int side = 0; side < int(joint.sides.size()); ++side) {
            const int b = joint.sides[size_t(side)].block;
            if (b < 0) continue;
            m_topology.blockSides[b].push_back({self, side, int(m_topology.blockRows[b].size())});
            for (int k = 0; k < rows; ++k) m_topology.blockRows[b].push_back(joint.firstRow + k);
        }
        m_topology.joints.push_back(joint);
    }
}

void TopologyBuilder::makeFrictions() {
    m_topology.firstFrictionRow = m_topology.numMultipliers;
    for (int j = 0; j < int(m_topology.joints.size()); ++j) {
        const Topology::Joint& joint = m_topology.joints[size_t(j)];
        const FrictionEquations* equations = joint.record->friction.get();
        for (int contact = 0; equations && contact < equations->getNumContacts(); ++contact) {
            const Topology::Friction friction{j, contact, m_topology.numMultipliers,
                                              equations->getNumRates(contact)};
            m_topology.numMultipliers += friction.numRows();
            for (int side = 0; side < int(joint.sides.size()); ++side) {
                const int b = joint.sides[size_t(side)].block;
                if (b < 0) continue;
                std::vector<int>& blockRows = m_topology.blockRows[size_t(b)];
                m_topology.frictionSides[size_t(b)].push_back(
                    {int(m_topology.frictions.size()), side, int(blockRows.size())});
                for (int i = 0; i < friction.numRows(); ++i)
                    blockRows.push_back(friction.firstRow + i);
            }
            m_topology.frictions.push_back(friction);
        }
    }
}

bool TopologyBuilder::sharesPart(int block, int other) const {
    const FlexibleBlock &a = *m_blocks.flexible[size_t(block)],
                        &b = *m_blocks.flexible[size_t(other)];
    return &a.getModel() == &b.getModel() && a.getDamping() == b.getDamping();
}

void TopologyBuilder::makeBatches() {
    std::map<const FlexibleBodyModel*, size_t> open;  // the batch that a part still fills
    const size_t flexible = m_blocks.flexible.size();
    for (size_t b = 0; b < m_blocks.all.size(); ++b) {
        const FlexibleBodyModel* model = b < flexible ? &m_blocks.flexible[b]->getModel() : nullptr;
        const auto [found, isNew] = open.emplace(model, m_topology.batches.size());
        if (isNew || int(m_topology.batches[found->second].size()) == FlexibleBlock::LargestBatch) {
            found->second = m_topology.batches.size();
            m_topology.batches.emplace_back();
            m_blocks.batches.emplace_back();
        }
        m_topology.batches[found->second].push_back(int(b));
        if (model) m_blocks.batches[found->second].push_back(m_blocks.flexible[b]);
    }
}

int TopologyBuilder::findPart(int b, const std::vector<const FrameShapes*>& used) {
    // Products are formed with all frames of a group, so it may have only few more than the body.
    const auto suits = [&](const Topology::PartGroup& part) {
        if (!sharesPart(b, part.firstBlock)) return false;
        std::vector<const FrameShapes*> all = part.frames;
        for (const FrameShapes* shapes : used) addOnce(all, shapes);
        return used.empty() || all.size() <= LargestShare * used.size();
    };
    std::vector<Topology::PartGroup>& parts = m_topology.parts;
    const int index = int(std::find_if(parts.begin(), parts.end(), suits) - parts.begin());
    if (index == int(parts.size())) parts.push_back({b, {}, nullptr});
    return index;
}

void TopologyBuilder::makeParts() {
    m_topology.partOfBlock.assign(m_blocks.all.size(), -1);
    m_topology.hasOwnColumns.assign(m_blocks.all.size(), 0);
    for (int b = 0; b < int(m_blocks.flexible.size()); ++b) {
        const Block& block = *m_blocks.all[size_t(b)];
        if (m_blocks.flexible[size_t(b)]->getModel().n == 0) continue;
        // Constrained or prescribed modes have columns of their own, and so have shapes that
        // change.
        if (m_blocks.flexible[size_t(b)]->hasCurvedFrames() ||
            !m_topology.simbodyColumns[size_t(b)].empty() || hasDifferencedModes(b) ||
            (m_simbody.m_prescribed && m_simbody.m_prescribed->touches(block.firstU, block.numU))) {
            m_topology.hasOwnColumns[size_t(b)] = 1;
            m_topology.partOfBlock[size_t(b)] = findPart(b, {});
            continue;
        }
        const auto visitSides = [&](const auto& visit) {
            const auto visitSide = [&](int& partFrame, int frame) {
                visit(partFrame, m_blocks.flexible[size_t(b)]->getShapes(frame));
            };
            for (Topology::BlockSide& side : m_topology.blockSides[size_t(b)])
                visitSide(side.partFrame,
                          m_topology.joints[size_t(side.owner)].sides[size_t(side.side)].frame);
            for (Topology::BlockSide& side : m_topology.frictionSides[size_t(b)]) {
                const Topology::Friction& friction = m_topology.frictions[size_t(side.owner)];
                visitSide(side.partFrame,
                          m_topology.joints[size_t(friction.joint)].sides[size_t(side.side)].frame);
            }
            for (Topology::BlockSide& side : m_topology.elementSides[size_t(b)])
                visitSide(side.partFrame,
                          m_topology.elements[size_t(side.owner)].frames[size_t(side.side)].frame);
        };
        std::vector<const FrameShapes*> used;
        visitSides([&](int&, const FrameShapes* shapes) { addOnce(used, shapes); });
        m_topology.partOfBlock[size_t(b)] = findPart(b, used);
        std::vector<const FrameShapes*>& frames =
            m_topology.parts[size_t(m_topology.partOfBlock[size_t(b)])].frames;
        visitSides([&](int& partFrame, const FrameShapes* shapes) {
            partFrame = addOnce(frames, shapes);
        });
    }
    for (Topology::PartGroup& part : m_topology.parts) {
        const size_t n = size_t(m_blocks.flexible[size_t(part.firstBlock)]->getModel().n);
        auto shapes = std::make_shared<std::vector<double>>(6 * n * part.frames.size());
        double* column = shapes->data();
        for (const FrameShapes* frame : part.frames)
            column = std::copy(frame->columns.begin(), frame->columns.end(), column);
        part.shapes = shapes;
    }
}

void TopologyBuilder::makeForceElements() {
    if (!m_topology.guts) return;
    for (const auto& element : m_topology.guts->forceElements()) {
        if (element->getAttachments().empty()) continue;
        Topology::Element ref;
        ref.element = element.get();
        ref.timedForce = m_functions.add(*element);
        for (const Attachment& attachment : element->getAttachments())
            ref.frames.push_back(makeFrame(attachment));
        ref.numTerms = element->getNumJacobianTerms();
        ref.numPairs = element->getNumJacobianPairs();
        const int rows = ref.numRows();
        ref.firstRow = m_topology.numMultipliers + m_topology.numElementRows;
        m_topology.numElementRows += rows;
        for (size_t k = 0; k < ref.frames.size() && rows > 0; ++k) {
            const int b = ref.frames[k].block;
            if (b < 0) continue;
            std::vector<int>& blockRows = m_topology.blockRows[size_t(b)];
            m_topology.elementSides[size_t(b)].push_back(
                {int(m_topology.elements.size()), int(k), int(blockRows.size())});
            for (int i = 0; i < rows; ++i) blockRows.push_back(ref.firstRow + i);
        }
        m_topology.elements.push_back(ref);
    }
    if (!m_topology.guts->states().empty())
        m_topology.firstZ = m_topology.guts->getFirstZ(m_simbody.m_private);
    for (const auto& equation : m_topology.guts->states()) {
        Topology::StateEquationRef ref;
        ref.equation = equation.get();
        for (const Attachment& attachment : equation->getAttachments())
            ref.frames.push_back(makeFrame(attachment));
        (ref.equation->countsTurns() ? m_topology.countsTurns : m_topology.hasCoupledStates) = true;
        m_topology.states.push_back(ref);
    }
}

void TopologyBuilder::makeLoadedBlocks() {
    if (m_topology.setting != Topology::Setting::Implicit) return;
    std::vector<std::vector<int>> elements(m_blocks.all.size());
    for (size_t e = 0; e < m_topology.elements.size(); ++e) {
        const Topology::Element& element = m_topology.elements[e];
        if (element.frames.size() == 1 && element.frames[0].block >= 0 && element.isLoad())
            elements[size_t(element.frames[0].block)].push_back(int(e));
    }
    for (int b = 0; b < m_topology.numBlocks(); ++b) {
        const Block& block = *m_blocks.all[size_t(b)];
        if (elements[size_t(b)].empty() && !block.hasLoads()) continue;
        // Where Simbody's State gives the kinematics, the block cannot be moved separately.
        const int tree = b - m_topology.numFlexible;
        if (tree >= 0 && m_blocks.rigid[size_t(tree)]->needsSimbody()) continue;
        Topology::LoadedBlock loaded;
        loaded.block = b;
        loaded.elements = std::move(elements[size_t(b)]);
        m_topology.loadedBlocks.push_back(std::move(loaded));
    }
    if (m_topology.loadedBlocks.empty()) return;
    const CoordinateScales scales(m_blocks);
    for (Topology::LoadedBlock& loaded : m_topology.loadedBlocks) {
        const Block& block = *m_blocks.all[size_t(loaded.block)];
        for (int i = 0; i < block.numU; ++i)
            loaded.steps.push_back(DifferenceStep * scales.step[size_t(block.firstU + i)]);
    }
}

std::vector<ForceDifferences::Speed> TopologyBuilder::listSimbodySpeeds() const {
    const CoordinateScales scales(m_blocks);
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    std::vector<ForceDifferences::Speed> speeds;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        if (isHeld(i)) continue;
        const PrescribedMotion::Mobilizer mobilizer = findMobilizer(i);
        const int first = matter.getMobilizedBody(i).getFirstUIndex(m_simbody.m_private);
        for (int k = 0; k < mobilizer.nu; ++k) {
            const size_t own = size_t(mobilizer.u0 + k);
            speeds.push_back({i, first + k, std::max(scales.metres[own], 1e-9),
                              DifferenceStep * scales.step[own]});
        }
    }
    return speeds;
}

void TopologyBuilder::makeForceDifferences(const std::vector<ForceSelection>& selections) {
    if (selections.empty() || !m_topology.hasForeignForces) return;
    m_system.realize(m_simbody.m_private, Stage::Velocity);
    const std::vector<ForceDifferences::Speed> candidates = listSimbodySpeeds();
    for (const ForceSelection& selection : selections) {
        const GeneralForceSubsystem* owner = selection.force.isEmptyHandle()
                                                 ? nullptr
                                                 : findForceSubsystem(m_system, selection.force);
        if (owner && owner->isForceDisabled(m_simbody.m_private, selection.force.getForceIndex()))
            continue;
        ForceDifferences differences(m_system, selection, candidates, m_simbody.m_private);
        Topology::DifferencedForce forces;
        forces.firstRow = m_topology.numMultipliers + m_topology.numElementRows;
        forces.numTerms = differences.getNumTerms();
        if (differences.getSpeeds().empty()) {
            // Held modes have no stiffness.
            if (std::any_of(m_blocks.flexible.begin(), m_blocks.flexible.end(),
                            [](const FlexibleBlock* block) { return block->hasHeldModes(); }))
                continue;
            throw std::invalid_argument(
                "addForceJacobian(): " + selection.describe() +
                " acts on no body in the initial State; name the bodies that it can act on");
        }
        std::set<int> blocks;
        for (const ForceDifferences::Speed& speed : differences.getSpeeds())
            blocks.insert(m_topology.findBlock(speed.body));
        if (blocks.size() == 1 && *blocks.begin() >= m_topology.numFlexible) {
            forces.ownBlock = *blocks.begin();
            forces.ownRows = listOwnRows(differences, forces.ownBlock);
            m_topology.differenced.push_back(std::move(forces));
            m_simbody.m_differences.push_back(std::move(differences));
            continue;
        }
        const int terms = forces.numTerms;
        m_topology.numElementRows += terms;
        for (const ForceDifferences::Speed& speed : differences.getSpeeds()) {
            const int b = m_topology.findBlock(speed.body),
                      own = int(&speed - &differences.getSpeeds()[0]);
            auto side = std::find_if(forces.sides.begin(), forces.sides.end(),
                                     [b](const auto& known) { return known.block == b; });
            if (side == forces.sides.end()) {
                std::vector<int>& rows = m_topology.blockRows[size_t(b)];
                side = forces.sides.insert(side, {b, int(rows.size()), {}});
                for (int i = 0; i < terms; ++i) rows.push_back(forces.firstRow + i);
            }
            side->speeds.push_back(own);
        }
        m_topology.differenced.push_back(std::move(forces));
        m_simbody.m_differences.push_back(std::move(differences));
    }
}

bool TopologyBuilder::hasDifferencedModes(int block) const {
    const bool hasFrame = !m_topology.blockSides[size_t(block)].empty() ||
                          !m_topology.elementSides[size_t(block)].empty();
    for (size_t d = 0; d < m_topology.differenced.size(); ++d)
        for (const Topology::DifferencedForce::Side& side : m_topology.differenced[d].sides) {
            if (side.block != block) continue;
            if (!hasFrame) return true;
            const MobilizedBodyIndex frame = m_topology.guts->body(FlexibleBodyIndex(block)).frame;
            for (int k : side.speeds)
                if (m_simbody.m_differences[d].getSpeeds()[size_t(k)].body != frame) return true;
        }
    return false;
}

std::vector<int> TopologyBuilder::listOwnRows(const ForceDifferences& differences,
                                              int block) const {
    const SimbodyMatterSubsystem& matter = m_system.getMatterSubsystem();
    const RigidTree& tree = *m_blocks.rigid[size_t(block - m_topology.numFlexible)];
    std::vector<int> rows;
    for (const ForceDifferences::Speed& speed : differences.getSpeeds()) {
        const int first = matter.getMobilizedBody(speed.body).getFirstUIndex(m_simbody.m_private);
        rows.push_back(tree.findSlots(speed.body).u0 + speed.u - first);
    }
    return rows;
}

void requireTopology(const MultibodySystem& system, const State& state, const std::string& method) {
    if (!system.systemTopologyHasBeenRealized())
        throw std::invalid_argument(method + ": call realizeTopology() on the system first");
    if (state.getSystemStage() < Stage::Topology)
        throw std::invalid_argument(method + ": an empty State; take one from realizeTopology()");
    const auto require = [&](Real value, const auto& name) {
        if (!std::isfinite(value))
            throw std::invalid_argument(method + ": " + name() + " is " +
                                        (std::isnan(value) ? "not a number" : "infinite") +
                                        " in the State");
    };
    require(state.getTime(), [] { return std::string("the time"); });
    if (state.getSystemStage() < Stage::Model) return;
    const SimbodyMatterSubsystem& matter = system.getMatterSubsystem();
    const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
    const FlexibleBodySubsystem::Guts* guts = flexible ? &flexible->getGuts() : nullptr;
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& body = matter.getMobilizedBody(i);
        const auto describeAs = [&](const char* what, int k) {
            return [guts, what, i, k] {
                return what + (' ' + std::to_string(k)) + " of " + describe(guts, i);
            };
        };
        for (int k = 0; k < body.getNumQ(state); ++k)
            require(body.getOneQ(state, k), describeAs("coordinate", k));
        for (int k = 0; k < body.getNumU(state); ++k)
            require(body.getOneU(state, k), describeAs("speed", k));
    }
    for (SubsystemIndex s(0); s < state.getNumSubsystems(); ++s)
        for (int k = 0; k < state.getNZ(s); ++k)
            require(state.getZ(s)[k], [&] {
                return "variable z[" + std::to_string(k) + "] of '" + state.getSubsystemName(s) +
                       "'";
            });
}

}  // namespace simflex
