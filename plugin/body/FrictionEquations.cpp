#include "simflex/body/FrictionEquations.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "simflex/body/TurningAxis.h"

namespace simflex {

using SimTK::Real;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;

namespace {

[[noreturn]] void refuseFriction(const char* what, Real found, const char* allowed) {
    std::ostringstream text;
    text << what << " is " << found << "; " << allowed;
    throw std::invalid_argument(text.str());
}

void refuseUnlessNotNegative(const char* what, Real found) {
    if (!(found >= 0 && std::isfinite(found)))
        refuseFriction(what, found, "it must be finite and not negative");
}

}  // namespace

FrictionEquations::FrictionEquations(std::shared_ptr<const JointEquations> joint,
                                     const FrictionCoefficients& coefficients)
    : m_joint(std::move(joint)), m_coefficients(coefficients) {
    FrictionCoefficients& own = m_coefficients;
    refuseUnlessNotNegative("the coefficient of Coulomb friction", own.coulomb);
    if (SimTK::isNaN(own.breakaway)) own.breakaway = own.coulomb;
    refuseUnlessNotNegative("the coefficient of static friction", own.breakaway);
    if (own.breakaway < own.coulomb)
        refuseFriction("the coefficient of static friction", own.breakaway,
                       "it must not be below that of Coulomb friction");
    refuseUnlessNotNegative("the coefficient of viscous friction", own.viscous);
    refuseUnlessNotNegative("the radius", own.radius);
    refuseUnlessNotNegative("the axial radius", own.axialRadius);
    makeContacts();
}

void FrictionEquations::makeContacts() {
    constexpr int X = 0, Z = 2, None = -1;
    const std::string kind = m_joint->getKind();
    const FrictionCoefficients& own = m_coefficients;
    const Real r = own.radius;
    const bool isDry = own.breakaway > 0;
    const auto alone = [&](int coordinate) {
        return Rate{{{m_joint->getCoordinate(coordinate), 1}}};
    };
    if (kind == "Slider") {
        if (r > 0) refuseFriction("the radius", r, "a Slider has none");
        m_contacts = {{{alone(0)}, X, 1, 0}};
    } else if (kind == "Pin") {
        if (isDry && r == 0 && own.axialRadius == 0)
            refuseFriction("the radius", r, "a Pin with dry friction needs that of its bearing");
        m_contacts = {{{alone(0)}, Z, r, own.axialRadius}};
    } else if (kind == "Ball") {
        if (isDry && r == 0) refuseFriction("the radius", r, "a Ball with dry friction needs one");
        m_contacts = {{{Rate{{}, 0}, Rate{{}, 1}, Rate{{}, 2}}, None, r, 0}};
    } else if (kind == "Universal") {
        if (isDry && r == 0)
            refuseFriction("the radius", r, "a Universal with dry friction needs one");
        m_contacts = {{{alone(0)}, None, r, 0}, {{alone(1)}, None, r, 0}};
    } else if (kind == "Cylinder") {
        if (r == 0) refuseFriction("the radius", r, "a Cylinder with friction needs one");
        m_contacts = {{{Rate{{{m_joint->getCoordinate(0), r}}}, alone(1)}, Z, 1, 0}};
    } else if (kind == "Screw") {
        if (r == 0)
            refuseFriction("the radius", r, "a Screw with friction needs that of its thread");
        // The flanks' normal is (cos β axial, −sin β circumferential), their tangent (sin β, cos
        // β).
        const Real beta = std::atan(m_joint->getPitch() / r);
        m_contacts = {{{Rate{{{JointCoordinate::makeAngleAboutZ(), r * std::cos(beta)},
                              {JointCoordinate::makeDisplacement(Z), std::sin(beta)}}}},
                       Z,
                       0,
                       1 / std::cos(beta)}};
    } else {
        throw std::invalid_argument("a " + kind +
                                    " has no friction; only Pin, Ball, Slider, Cylinder, Universal "
                                    "and Screw have");
    }
    if (own.axialRadius > 0 && kind != "Pin")
        refuseFriction("the axial radius", own.axialRadius, "only a Pin has one");
}

void FrictionEquations::calcGradients(int contact, const Transform& F, const Transform& M,
                                      SpatialVec* D_F, SpatialVec* D_M) const {
    for (const Rate& rate : m_contacts[size_t(contact)].rates) {
        if (rate.turnAxis >= 0) {
            *D_M = {axisOf(F, rate.turnAxis), Vec3(0)};
            *D_F = -*D_M;
        } else {
            *D_F = *D_M = SpatialVec(Vec3(0), Vec3(0));
            for (const Rate::Term& term : rate.terms) {
                SpatialVec onF, onM;
                term.coordinate.calcGradient(F, M, onF, onM);
                *D_F += term.weight * onF;
                *D_M += term.weight * onM;
            }
        }
        ++D_F;
        ++D_M;
    }
}

void FrictionEquations::calcAccelerations(int contact, const FrameMotion& F, const FrameMotion& M,
                                          Real* accelerations) const {
    for (const Rate& rate : m_contacts[size_t(contact)].rates) {
        // Axes rotate, but the terms from their rotation vanish with the rates.
        *accelerations = rate.turnAxis < 0 ? 0 : ~axisOf(F.X, rate.turnAxis) * (M.A[0] - F.A[0]);
        for (const Rate::Term& term : rate.terms)
            *accelerations += term.weight * term.coordinate.calcMotion(F, M)[2];
        ++accelerations;
    }
}

Real FrictionEquations::calcLoad(int contact, const Transform& F, const SpatialVec* D_M,
                                 const Real* lambda, Real* gradient) const {
    const Contact& own = m_contacts[size_t(contact)];
    const int count = m_joint->getNumEquations();
    Vec3 force(0);
    for (int k = 0; k < count; ++k) force -= lambda[k] * D_M[k][1];
    const Vec3 axis = own.axis < 0 ? Vec3(0) : axisOf(F, own.axis);
    const Real axial = ~axis * force;
    const Vec3 across = force - axial * axis;
    const Real size = across.norm();
    Vec3 slope = axial < 0 ? Vec3(-own.axialArm * axis) : Vec3(own.axialArm * axis);
    if (size > 0) slope += own.acrossArm / size * across;
    for (int k = 0; k < count; ++k) gradient[k] = -(~slope * D_M[k][1]);
    return own.acrossArm * size + own.axialArm * std::abs(axial);
}

}  // namespace simflex
