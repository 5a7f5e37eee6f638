#include "simflex/solver/equations/FrictionTerms.h"

#include <algorithm>

#include "simflex/base/Checkpoint.h"

namespace simflex {

using SimTK::SpatialVec;
using SimTK::Vec3;

namespace {

/** Rate below which a contact is at rest where a run begins [m/s, rad/s]. **/
constexpr double RestingRate = 1e-8;
/** Relative excess over the limit at which a contact slips, above round-off. **/
constexpr double Excess = 1e-9;
/** Largest difference of a sliding contact's force from that due to its load, relative to it, and
to the largest multiplier. **/
constexpr double Unsettled = 1e-3, RoundOff = 1e-9;
/** Largest number of mode changes within a step. **/
constexpr int MostChanges = 12;
/** Compliance of sticking contacts relative to their rows' entry in S: contacts that constrain the
same motion share the load, without creep, since their rates are still driven to zero. **/
constexpr double Softness = 1e-9;

const SpatialVec NoVector(Vec3(0), Vec3(0));

}  // namespace

FrictionTerms::FrictionTerms(const Topology& topology, const Blocks& blocks,
                             const JointTerms& joints)
    : m_topology(topology), m_blocks(blocks), m_joints(joints) {
    for (const Topology::Friction& friction : topology.frictions) {
        const Topology::Joint& joint = topology.joints[size_t(friction.joint)];
        Contact contact;
        contact.equations = joint.record->friction.get();
        contact.numRates = friction.numRates;
        contact.F = joint.sides[0];
        contact.M = joint.sides[1];
        contact.loadSlope.assign(size_t(joint.numRows()), 0);
        contact.formedSlope = contact.loadSlope;
        for (auto& side : contact.slopes) std::fill_n(side, MaxRates, NoVector);
        m_contacts.push_back(std::move(contact));
    }
    m_diagonals.resize(size_t(topology.numMultipliers - topology.firstFrictionRow));
}

void FrictionTerms::update() {
    for (size_t k = 0; k < m_contacts.size(); ++k) {
        Contact& contact = m_contacts[k];
        const FrameMotion &F = m_blocks.motionOf(contact.F), &M = m_blocks.motionOf(contact.M);
        contact.equations->calcGradients(m_topology.frictions[k].contact, F.X, M.X, contact.D[0],
                                         contact.D[1]);
        for (int i = 0; i < contact.numRates; ++i) {
            const SpatialVec &onF = contact.D[0][i], &onM = contact.D[1][i];
            contact.rates[i] =
                ~onF[0] * F.V[0] + ~onF[1] * F.V[1] + ~onM[0] * M.V[0] + ~onM[1] * M.V[1];
        }
    }
}

void FrictionTerms::start() {
    const bool goesOn = isAtSwitch();
    for (Contact& contact : m_contacts) {
        const double speed = contact.rates.norm();
        bool isMoving = speed > RestingRate;
        if (goesOn)
            isMoving = contact.kept == Mode::Slip && !(contact.switches && contact.isAtRest);
        contact.mode = isMoving || !isDry(contact) ? Mode::Slip : Mode::Stick;
        contact.direction = !isMoving             ? Vector::Zero()
                            : speed > RestingRate ? Vector(contact.rates / speed)
                                                  : contact.keptDirection;
        contact.numChanges = 0;
    }
}

void FrictionTerms::keep(double h) {
    for (Contact& contact : m_contacts) {
        contact.phase = hasSwitched(contact) ? 0 : contact.phase + h;
        contact.switches = false;
        contact.kept = contact.mode;
        contact.keptDirection = contact.direction;
    }
}

void FrictionTerms::recall() {
    for (Contact& contact : m_contacts) {
        contact.mode = contact.kept;
        contact.direction = contact.keptDirection;
        contact.numChanges = 0;
    }
}

void FrictionTerms::updateLoad(int k, const double* lambda) {
    Contact& contact = m_contacts[size_t(k)];
    const Topology::Friction& friction = m_topology.frictions[size_t(k)];
    contact.load = contact.equations->calcLoad(
        friction.contact, m_blocks.motionOf(contact.F).X, m_joints.getJacobianOfM(friction.joint),
        lambda + m_topology.joints[size_t(friction.joint)].firstRow, contact.loadSlope.data());
}

FrictionTerms::Vector FrictionTerms::calcSlidingForce(const Contact& contact,
                                                      const Vector& direction) const {
    return contact.equations->getCoefficients().coulomb * contact.load * direction;
}

double FrictionTerms::calcReserve(const Contact& contact, const Vector& force) {
    const double limit = contact.equations->getCoefficients().breakaway * contact.load;
    return (1 + Excess) * limit - force.norm();
}

bool FrictionTerms::tearsOff(const Contact& contact, const Vector& force) {
    return calcReserve(contact, force) < 0;
}

FrictionTerms::Vector FrictionTerms::getForce(int k, const double* lambda) const {
    Vector force = Vector::Zero();
    for (int i = 0; i < m_contacts[size_t(k)].numRates; ++i)
        force[i] = lambda[m_topology.frictions[size_t(k)].forceRow(i)];
    return force;
}

bool FrictionTerms::hasSwitched(const Contact& contact) {
    return isDry(contact) && contact.kept != Mode::Released &&
           (contact.mode != contact.kept ||
            (contact.mode == Mode::Slip && contact.direction.dot(contact.keptDirection) < 0));
}

double FrictionTerms::calcEndedPhase() const {
    double longest = 0;
    for (const Contact& contact : m_contacts)
        if (hasSwitched(contact)) longest = std::max(longest, contact.phase);
    return longest;
}

double FrictionTerms::calcMargin(int k, const double* lambda) {
    const Contact& contact = m_contacts[size_t(k)];
    if (!isDry(contact) || contact.kept == Mode::Released) return SimTK::Infinity;
    if (contact.kept == Mode::Slip) return contact.rates.dot(contact.keptDirection);
    updateLoad(k, lambda);
    return calcReserve(contact, getForce(k, lambda));
}

void FrictionTerms::noteSwitch(int k, bool isAtRest) {
    m_contacts[size_t(k)].switches = true;
    m_contacts[size_t(k)].isAtRest = isAtRest;
}

bool FrictionTerms::isAtSwitch() const {
    return std::any_of(m_contacts.begin(), m_contacts.end(),
                       [](const Contact& contact) { return contact.switches; });
}

void FrictionTerms::forgetSwitch() {
    for (Contact& contact : m_contacts) contact.switches = false;
}

bool FrictionTerms::turnsBack(const Contact& contact, const Vector& motion) {
    return isDry(contact) && contact.load > 0 && motion.dot(contact.direction) < 0;
}

bool FrictionTerms::isDry(const Contact& contact) {
    return contact.equations->getCoefficients().breakaway > 0;
}

void FrictionTerms::writeForce(int k, const Vector& force, double* lambda) const {
    const Topology::Friction& friction = m_topology.frictions[size_t(k)];
    for (int i = 0; i < friction.numRates; ++i) lambda[friction.forceRow(i)] = force[i];
}

bool FrictionTerms::decide(By by, double* lambda) {
    bool hasChanged = false;
    for (int k = 0; k < int(m_contacts.size()); ++k) {
        Contact& contact = m_contacts[size_t(k)];
        const Topology::Friction& friction = m_topology.frictions[size_t(k)];
        updateLoad(k, lambda);
        const Vector force = getForce(k, lambda);
        for (int i = 0; i < contact.numRates; ++i) lambda[friction.slopeRow(i)] = 0;
        if (m_areHeld && isDry(contact)) {
            const double speed = contact.rates.norm();
            const bool goesOn = speed > 0 && contact.rates.dot(contact.keptDirection) > 0;
            contact.direction = goesOn ? Vector(contact.rates / speed) : contact.keptDirection;
        } else if (contact.mode == Mode::Stick && tearsOff(contact, force)) {
            contact.mode = Mode::Slip;
            contact.direction = force.normalized();
            ++contact.numChanges;
        } else if (contact.mode == Mode::Slip) {
            // A contact at rest starts in the direction of its acceleration.
            const bool isLeaving = by == By::Accelerations && contact.rates.norm() <= RestingRate;
            const Vector& motion = isLeaving ? contact.accelerations : contact.rates;
            const double speed = motion.norm();
            if (turnsBack(contact, motion)) {
                contact.mode = Mode::Stick;
                ++contact.numChanges;
            } else if (speed > 0) {
                contact.direction = motion / speed;
            }
        }
        if (contact.mode == Mode::Released)
            writeForce(k, Vector::Zero(), lambda);
        else if (contact.mode == Mode::Slip)
            writeForce(k, calcSlidingForce(contact, contact.direction), lambda);
        hasChanged = hasChanged || isOutdated(contact);
    }
    return hasChanged;
}

bool FrictionTerms::isSettled(const double* lambda) {
    double largest = 0;
    for (int i = 0; i < m_topology.numMultipliers; ++i)
        largest = std::max(largest, std::abs(lambda[i]));
    for (int k = 0; k < int(m_contacts.size()); ++k) {
        updateLoad(k, lambda);
        const Contact& contact = m_contacts[size_t(k)];
        const Vector force = getForce(k, lambda);
        if (contact.mode == Mode::Stick && !m_areHeld && tearsOff(contact, force)) return false;
        if (contact.mode != Mode::Slip || !isDry(contact)) continue;
        if (!m_areHeld && turnsBack(contact, contact.rates)) return false;
        const Vector sliding = calcSlidingForce(contact, contact.direction);
        const double size = std::max(force.norm(), sliding.norm());
        if ((force - sliding).norm() > std::max(Unsettled * size, RoundOff * largest)) return false;
    }
    return true;
}

void FrictionTerms::follow(double* lambda) {
    for (int k = 0; k < int(m_contacts.size()); ++k) {
        const Contact& contact = m_contacts[size_t(k)];
        updateLoad(k, lambda);
        if (contact.mode == Mode::Stick) continue;
        const double speed = contact.rates.norm();
        // A contact that slid the other way at the step's beginning reverses within it; one that
        // stuck does not.
        const bool hasTurned =
            contact.kept == Mode::Slip && contact.keptDirection.dot(contact.direction) < 0;
        const bool isItsOwn = speed > 0 && (hasTurned || contact.rates.dot(contact.direction) > 0);
        const Vector direction = isItsOwn ? Vector(contact.rates / speed) : contact.direction;
        writeForce(k,
                   contact.mode == Mode::Slip ? calcSlidingForce(contact, direction)
                                              : Vector(Vector::Zero()),
                   lambda);
    }
}

int FrictionTerms::findUndecided() const {
    for (size_t k = 0; k < m_contacts.size(); ++k)
        if (m_contacts[k].numChanges > MostChanges) return int(k);
    return -1;
}

bool FrictionTerms::isOutdated(const Contact& contact) {
    if (contact.mode != contact.formedMode) return true;
    if (contact.mode != Mode::Slip) return false;
    // Half a right angle in either.
    constexpr double Turned = 0.7;
    if (contact.direction.dot(contact.formedDirection) < Turned) return true;
    double product = 0, now = 0, then = 0;
    for (size_t k = 0; k < contact.loadSlope.size(); ++k) {
        product += contact.loadSlope[k] * contact.formedSlope[k];
        now += contact.loadSlope[k] * contact.loadSlope[k];
        then += contact.formedSlope[k] * contact.formedSlope[k];
    }
    // Without load, the matrix was formed without it.
    return now > 0 && (then == 0 || product < Turned * std::sqrt(now * then));
}

void FrictionTerms::calcErrors(double* c) const {
    std::fill(c + m_topology.firstFrictionRow, c + m_topology.numMultipliers, 0.0);
    for (size_t k = 0; k < m_contacts.size(); ++k)
        for (int i = 0; i < m_contacts[k].numRates; ++i)
            if (m_contacts[k].mode == Mode::Stick)
                c[m_topology.frictions[k].forceRow(i)] = m_contacts[k].rates[i];
}

void FrictionTerms::calcErrorDots(const double* u, const double* uDot, double* gDotDot) {
    std::fill(gDotDot + m_topology.firstFrictionRow, gDotDot + m_topology.numMultipliers, 0.0);
    const auto accelerate = [&](const FrameRef& ref) {
        FrameMotion motion = m_blocks.motionOf(ref);
        if (ref.block < 0) return motion;
        const Block& block = *m_blocks.all[size_t(ref.block)];
        motion.A = block.calcFrameAcceleration(ref.frame, u + block.firstU, uDot + block.firstU);
        return motion;
    };
    for (size_t k = 0; k < m_contacts.size(); ++k) {
        Contact& contact = m_contacts[k];
        const Topology::Friction& friction = m_topology.frictions[k];
        contact.equations->calcAccelerations(friction.contact, accelerate(contact.F),
                                             accelerate(contact.M), contact.accelerations.data());
        for (int i = 0; i < contact.numRates && contact.mode == Mode::Stick; ++i)
            gDotDot[friction.forceRow(i)] = contact.accelerations[i];
    }
}

void FrictionTerms::addInForces(const double* lambda, double* r) const {
    for (size_t k = 0; k < m_contacts.size(); ++k) {
        const Contact& contact = m_contacts[k];
        if (contact.mode == Mode::Released) continue;
        SpatialVec onF = NoVector, onM = NoVector;
        for (int i = 0; i < contact.numRates; ++i) {
            const double force = calcForce(int(k), i, lambda);
            onF -= force * contact.D[0][i];
            onM -= force * contact.D[1][i];
        }
        m_blocks.subtractForce(contact.F, onF, r);
        m_blocks.subtractForce(contact.M, onM, r);
    }
}

double FrictionTerms::calcForce(int k, int rate, const double* lambda) const {
    const Contact& contact = m_contacts[size_t(k)];
    return lambda[m_topology.frictions[size_t(k)].forceRow(rate)] +
           contact.equations->getCoefficients().viscous * contact.rates[rate];
}

void FrictionTerms::addInPower(const double* lambda, double& power) const {
    for (int k = 0; k < int(m_contacts.size()); ++k) {
        const Contact& contact = m_contacts[size_t(k)];
        if (contact.mode == Mode::Released) continue;
        for (int i = 0; i < contact.numRates; ++i)
            power -= calcForce(k, i, lambda) * contact.rates[i];
    }
}

void FrictionTerms::setColumns(NewtonSystem& system, bool areActive) const {
    for (int b = 0; b < m_topology.numBlocks(); ++b)
        for (const Topology::BlockSide& side : m_topology.frictionSides[size_t(b)]) {
            const Contact& contact = m_contacts[size_t(side.owner)];
            const int frame = (side.side == 0 ? contact.F : contact.M).frame;
            const bool acts = areActive && contact.hasColumns;
            for (int i = 0; i < contact.numRates; ++i) {
                m_blocks.setColumn(b, frame, side.firstColumn + i,
                                   acts ? contact.D[side.side][i] : NoVector,
                                   system.blocks[size_t(b)]);
                m_blocks.setColumn(b, frame, side.firstColumn + contact.numRates + i,
                                   acts ? contact.slopes[side.side][i] : NoVector,
                                   system.blocks[size_t(b)]);
            }
        }
}

void FrictionTerms::formReleased(NewtonSystem& system) const {
    setColumns(system, false);
    for (size_t k = 0; k < m_contacts.size(); ++k) {
        NewtonSystem::Coupling& coupling = system.couplings[k];
        const size_t size = coupling.rows.size();
        std::fill(coupling.values.begin(), coupling.values.end(), 0.0);
        for (int i = 0; i < m_topology.frictions[k].numRows(); ++i)
            coupling.values[size_t(i) * (size + 1)] = 1;
    }
}

void FrictionTerms::form(By by, NewtonSystem& system) {
    if (isEmpty()) return;
    for (Contact& contact : m_contacts) {
        for (auto& side : contact.slopes) std::fill_n(side, MaxRates, NoVector);
        contact.formedMode = contact.mode;
        contact.formedDirection = contact.direction;
        contact.formedSlope = contact.loadSlope;
        // Viscous friction alone does not affect accelerations.
        contact.hasColumns = contact.mode != Mode::Released && (by == By::Rates || isDry(contact));
        if (contact.mode != Mode::Slip || by == By::Accelerations) continue;
        const FrictionCoefficients& own = contact.equations->getCoefficients();
        const double speed = contact.rates.norm();
        const double turning =
            contact.numRates > 1 && speed > RestingRate ? own.coulomb * contact.load / speed : 0;
        for (int i = 0; i < contact.numRates; ++i)
            for (int j = 0; j < contact.numRates; ++j) {
                const double slope = (i == j ? own.viscous + turning : 0) -
                                     turning * contact.direction[i] * contact.direction[j];
                for (int side = 0; side < 2; ++side)
                    contact.slopes[side][i] += slope * contact.D[side][j];
            }
    }
    formReleased(system);
    setColumns(system, true);

    // w J⁻¹w of each row at least, by Cauchy and Schwarz: w_i²/J_ii for every i.
    std::fill(m_diagonals.begin(), m_diagonals.end(), 0.0);
    for (int b = 0; b < m_topology.numBlocks(); ++b) {
        const NewtonSystem::Block& block = system.blocks[size_t(b)];
        const bool isArrow = block.form == NewtonSystem::Block::Form::Arrow;
        const size_t height = size_t(block.heightOfGt()), size = isArrow ? 6 : size_t(block.size);
        const std::vector<double>& J = isArrow ? block.head : block.matrix;
        for (const Topology::BlockSide& side : m_topology.frictionSides[size_t(b)])
            for (int i = 0; i < m_contacts[size_t(side.owner)].numRates; ++i) {
                const size_t column = size_t(side.firstColumn + i);
                double largest = 0;
                for (size_t a = 0; a < std::min(size, height); ++a) {
                    const double w = block.Gt[column * height + a], Jaa = J[a * (size + 1)];
                    if (Jaa > 0) largest = std::max(largest, w * w / Jaa);
                }
                m_diagonals[size_t(m_topology.frictions[size_t(side.owner)].forceRow(i) -
                                   m_topology.firstFrictionRow)] += largest;
            }
    }
    for (size_t k = 0; k < m_contacts.size(); ++k) {
        const Contact& contact = m_contacts[k];
        if (!contact.hasColumns) continue;
        NewtonSystem::Coupling& coupling = system.couplings[k];
        const size_t size = coupling.rows.size(), n = size_t(contact.numRates);
        const auto at = [&](size_t row, size_t column) -> double& {
            return coupling.values[row + column * size];
        };
        for (size_t i = 0; i < n; ++i) {
            const double own = m_diagonals[size_t(m_topology.frictions[k].forceRow(int(i)) -
                                                  m_topology.firstFrictionRow)];
            const double diagonal = own > 0 ? own : 1;
            if (contact.mode == Mode::Stick) {
                at(i, i) = Softness * diagonal;
                continue;
            }
            // s is what the second row makes of it.
            at(i, i) = diagonal;
            at(i, n + i) = NewtonSystem::PairFactor * diagonal;
            at(n + i, i) = 1;
            for (size_t j = 0; j < contact.loadSlope.size(); ++j)
                at(n + i, 2 * n + j) = -contact.equations->getCoefficients().coulomb *
                                       contact.direction[Eigen::Index(i)] * contact.loadSlope[j];
        }
    }
}

void FrictionTerms::visit(Checkpoint& checkpoint) {
    for (Contact& contact : m_contacts) {
        for (Mode* mode : {&contact.mode, &contact.kept, &contact.formedMode}) {
            int number = int(*mode);
            checkpoint.visitWithin(number, int(Mode::Released), int(Mode::Slip),
                                   "what a joint's friction does");
            *mode = Mode(number);
        }
        checkpoint.visit(contact.phase, contact.switches, contact.isAtRest);
        for (Vector* vector :
             {&contact.direction, &contact.keptDirection, &contact.formedDirection})
            for (double& entry : *vector) checkpoint.visit(entry);
        checkpoint.visit(contact.formedSlope);
    }
}

}  // namespace simflex
