#include "simflex/solver/equations/SimbodyConstraints.h"

#include <algorithm>

namespace simflex {

using namespace SimTK;

namespace {

const char* kindOf(const Constraint& constraint) {
    if (Constraint::Rod::isInstanceOf(constraint)) return "Rod";
    if (Constraint::Ball::isInstanceOf(constraint)) return "Ball";
    if (Constraint::Weld::isInstanceOf(constraint)) return "Weld";
    if (Constraint::PointInPlane::isInstanceOf(constraint)) return "PointInPlane";
    if (Constraint::PointOnLine::isInstanceOf(constraint)) return "PointOnLine";
    if (Constraint::ConstantAngle::isInstanceOf(constraint)) return "ConstantAngle";
    if (Constraint::ConstantOrientation::isInstanceOf(constraint)) return "ConstantOrientation";
    if (Constraint::NoSlip1D::isInstanceOf(constraint)) return "NoSlip1D";
    if (Constraint::ConstantCoordinate::isInstanceOf(constraint)) return "ConstantCoordinate";
    if (Constraint::ConstantSpeed::isInstanceOf(constraint)) return "ConstantSpeed";
    if (Constraint::ConstantAcceleration::isInstanceOf(constraint)) return "ConstantAcceleration";
    if (Constraint::PointOnPlaneContact::isInstanceOf(constraint)) return "PointOnPlaneContact";
    if (Constraint::SphereOnPlaneContact::isInstanceOf(constraint)) return "SphereOnPlaneContact";
    if (Constraint::SphereOnSphereContact::isInstanceOf(constraint)) return "SphereOnSphereContact";
    if (Constraint::LineOnLineContact::isInstanceOf(constraint)) return "LineOnLineContact";
    return "Custom";  // CoordinateCoupler, SpeedCoupler and PrescribedMotion among them
}

void insertOnce(std::vector<MobilizedBodyIndex>& list, MobilizedBodyIndex index) {
    if (index != GroundIndex && std::find(list.begin(), list.end(), index) == list.end())
        list.push_back(index);
}

}  // namespace

std::string SimbodyConstraints::describe(const Constraint& constraint) {
    std::vector<MobilizedBodyIndex> mobods;
    std::string bodies;
    const auto append = [&](MobilizedBodyIndex index) {
        if (std::find(mobods.begin(), mobods.end(), index) != mobods.end()) return;
        mobods.push_back(index);
        bodies += (bodies.empty() ? "" : ", ") + std::to_string(int(index));
    };
    for (ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b)
        append(constraint.getMobilizedBodyFromConstrainedBody(b).getMobilizedBodyIndex());
    for (ConstrainedMobilizerIndex m(0); m < constraint.getNumConstrainedMobilizers(); ++m)
        append(constraint.getMobilizedBodyFromConstrainedMobilizer(m).getMobilizedBodyIndex());
    return "Simbody constraint " + std::to_string(int(constraint.getConstraintIndex())) + " (" +
           kindOf(constraint) + ") on bodies (" + bodies + ")";
}

SimbodyConstraints::SimbodyConstraints(const SimbodyMatterSubsystem& matter,
                                       std::vector<ConstraintIndex> constraints, const State& state)
    : m_matter(matter) {
    for (ConstraintIndex index : constraints) {
        const Constraint& constraint = matter.getConstraint(index);
        Entry entry;
        entry.index = index;
        entry.name = describe(constraint);
        entry.firstRow = numRows();
        constraint.getNumConstraintEquationsInUse(state, entry.numPosition, entry.numVelocity,
                                                  entry.numAcceleration);
        for (ConstrainedBodyIndex b(0); b < constraint.getNumConstrainedBodies(); ++b) {
            entry.bodies.push_back(
                constraint.getMobilizedBodyFromConstrainedBody(b).getMobilizedBodyIndex());
            insertOnce(entry.mobods, entry.bodies.back());
        }
        for (ConstrainedMobilizerIndex m(0); m < constraint.getNumConstrainedMobilizers(); ++m)
            insertOnce(
                entry.mobods,
                constraint.getMobilizedBodyFromConstrainedMobilizer(m).getMobilizedBodyIndex());
        for (ConstrainedUIndex u(0); u < constraint.getNumConstrainedU(state); ++u)
            entry.speeds.push_back(int(constraint.getUIndexOfConstrainedU(state, u)));
        if (!entry.bodies.empty())
            entry.ancestor = constraint.getAncestorMobilizedBody().getMobilizedBodyIndex();
        m_levels.insert(m_levels.end(), size_t(entry.numPosition), MotionLevel::Position);
        m_levels.insert(m_levels.end(), size_t(entry.numVelocity), MotionLevel::Velocity);
        m_levels.insert(m_levels.end(), size_t(entry.numAcceleration), MotionLevel::Acceleration);
        m_hasAccelerationRows = m_hasAccelerationRows || entry.numAcceleration > 0;
        m_owner.resize(m_levels.size(), m_constraints.size());
        m_constraints.push_back(std::move(entry));
    }
}

std::pair<int, int> SimbodyConstraints::findRows(ConstraintIndex constraint) const {
    for (const Entry& entry : m_constraints)
        if (entry.index == constraint) return {entry.firstRow, entry.numRows()};
    return {0, 0};
}

void SimbodyConstraints::calcPositionErrors(const State& state, double* g) const {
    std::fill_n(g, numRows(), 0.0);
    for (const Entry& entry : m_constraints) {
        if (entry.numPosition == 0) continue;
        const Vector errors = m_matter.getConstraint(entry.index).getPositionErrorsAsVector(state);
        for (int k = 0; k < entry.numPosition; ++k) g[entry.firstRow + k] = errors[k];
    }
}

void SimbodyConstraints::calcVelocityErrors(const State& state, double* gDot) const {
    std::fill_n(gDot, numRows(), 0.0);
    for (const Entry& entry : m_constraints) {
        const int rows = entry.numPosition + entry.numVelocity;
        if (rows == 0) continue;
        const Vector errors = m_matter.getConstraint(entry.index).getVelocityErrorsAsVector(state);
        for (int k = 0; k < rows; ++k) gDot[entry.firstRow + k] = errors[k];
    }
}

void SimbodyConstraints::calcAccelerationErrors(const State& state, const Vector& uDot,
                                                double* gDotDot) const {
    Vector errors;
    m_matter.calcConstraintAccelerationErrors(state, uDot, errors);
    for (const Entry& entry : m_constraints) {
        MultiplierIndex position, velocity, acceleration;
        m_matter.getConstraint(entry.index)
            .getIndexOfMultipliersInUse(state, position, velocity, acceleration);
        double* row = gDotDot + entry.firstRow;
        for (int k = 0; k < entry.numPosition; ++k) *row++ = errors[int(position) + k];
        for (int k = 0; k < entry.numVelocity; ++k) *row++ = errors[int(velocity) + k];
        for (int k = 0; k < entry.numAcceleration; ++k) *row++ = errors[int(acceleration) + k];
    }
}

void SimbodyConstraints::calcForces(const State& state, const Entry& entry, const Vector& lambda,
                                    Vector_<SpatialVec>& bodyForces, Vector& mobilityForces) const {
    bodyForces.resize(int(entry.bodies.size()));
    mobilityForces.resize(int(entry.speeds.size()));
    m_matter.getConstraint(entry.index)
        .calcConstraintForcesFromMultipliers(state, lambda, bodyForces, mobilityForces);
    if (entry.bodies.empty() || entry.ancestor == GroundIndex) return;
    const Rotation& R_GA = m_matter.getMobilizedBody(entry.ancestor).getBodyTransform(state).R();
    for (int b = 0; b < bodyForces.size(); ++b) bodyForces[b] = R_GA * bodyForces[b];
}

void SimbodyConstraints::calcRowForces(const State& state, std::vector<RowForces>& rows) const {
    rows.resize(size_t(numRows()));
    Vector_<SpatialVec> bodyForces;
    Vector mobilityForces;
    for (const Entry& entry : m_constraints) {
        Vector lambda(entry.numRows(), Real(0));
        for (int k = 0; k < entry.numRows(); ++k) {
            lambda[k] = 1;
            calcForces(state, entry, lambda, bodyForces, mobilityForces);
            lambda[k] = 0;
            RowForces& row = rows[size_t(entry.firstRow + k)];
            row.bodies.clear();
            row.speeds.clear();
            for (size_t b = 0; b < entry.bodies.size(); ++b)
                row.bodies.emplace_back(entry.bodies[b], bodyForces[int(b)]);
            for (size_t i = 0; i < entry.speeds.size(); ++i)
                row.speeds.emplace_back(entry.speeds[i], mobilityForces[int(i)]);
        }
    }
}

void SimbodyConstraints::addInForces(const State& state, const double* lambda,
                                     Vector_<SpatialVec>& bodyForces,
                                     Vector& mobilityForces) const {
    Vector_<SpatialVec> ownBodyForces;
    Vector ownMobilityForces;
    for (const Entry& entry : m_constraints) {
        const Vector multipliers(entry.numRows(), lambda + entry.firstRow);
        calcForces(state, entry, multipliers, ownBodyForces, ownMobilityForces);
        for (size_t b = 0; b < entry.bodies.size(); ++b)
            bodyForces[entry.bodies[b]] -= ownBodyForces[int(b)];
        for (size_t i = 0; i < entry.speeds.size(); ++i)
            mobilityForces[entry.speeds[i]] -= ownMobilityForces[int(i)];
    }
}

double SimbodyConstraints::calcPower(const State& state, const double* lambda) const {
    Vector_<SpatialVec> bodyForces;
    Vector mobilityForces;
    double power = 0;
    for (const Entry& entry : m_constraints) {
        const Vector multipliers(entry.numRows(), lambda + entry.firstRow);
        calcForces(state, entry, multipliers, bodyForces, mobilityForces);
        for (size_t b = 0; b < entry.bodies.size(); ++b) {
            const SpatialVec& V = m_matter.getMobilizedBody(entry.bodies[b]).getBodyVelocity(state);
            power -= dot(bodyForces[int(b)][0], V[0]) + dot(bodyForces[int(b)][1], V[1]);
        }
        for (size_t i = 0; i < entry.speeds.size(); ++i)
            power -= mobilityForces[int(i)] * state.getU()[entry.speeds[i]];
    }
    return power;
}

}  // namespace simflex
