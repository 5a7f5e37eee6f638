#include "validation/HeavyTop.h"

#include <cmath>

#include "validation/Beam.h"

namespace simflex::test {

using namespace SimTK;

namespace {

constexpr Real kDiscMass = 0.5, kDiscRadius = 0.08;

const ReducedBody& getStem() {
    static const auto stem = [] {
        BeamOptions options;
        options.length = HeavyTop::Length;
        options.height = options.width = 0.004;
        options.E = 200e9;
        options.density = 7800;
        options.numElements = 10;
        options.numModes = 20;
        return makeBeam(options);
    }();
    return *stem;
}

}  // namespace

HeavyTop::HeavyTop(Real stiffening)
    : m_stem(flexible,
             std::make_shared<const ReducedBody>(getStem().withScaledStiffness(stiffening)),
             "stem"),
      m_foot(flexible, matter.Ground(), m_stem.interface("root"), "foot"),
      m_disc(flexible, matter, m_stem.interface("tip"),
             Body::Rigid(MassProperties(kDiscMass, Vec3(0),
                                        kDiscMass * UnitInertia::cylinderAlongX(kDiscRadius, 0))),
             "disc") {}

Vec3 HeavyTop::calcRigidProperties() {
    const ReducedBody& stem = getStem();
    const Real half = -stem.interfaces[0].position[0];
    const Real along = kDiscMass * square(kDiscRadius) / 2 + stem.inertia[0];
    const Real across = kDiscMass * (square(kDiscRadius) / 4 + square(Length)) + stem.inertia[1] +
                        stem.mass * square(half);
    return {along, across, kDiscMass * Length + stem.mass * half};
}

Real HeavyTop::calcWeightMoment() {
    return calcRigidProperties()[2] * Gravity;
}

Real HeavyTop::calcPrecession() {
    const Vec3 rigid = calcRigidProperties();
    const Real a = rigid[1] * std::cos(Tilt), b = rigid[0] * Spin, c = calcWeightMoment();
    return 2 * c / (b + std::sqrt(b * b - 4 * a * c));
}

Real HeavyTop::calcLowestTilt() {
    const Vec3 rigid = calcRigidProperties();
    // βu² − αu + α cos θ₀ − β = 0
    const Real alpha = square(rigid[0] * Spin / rigid[1]), beta = 2 * calcWeightMoment() / rigid[1];
    const Real c = alpha * std::cos(Tilt) - beta;
    return std::acos(2 * c / (alpha + std::sqrt(alpha * alpha - 4 * beta * c)));
}

State HeavyTop::makeSteadyState() {
    return makeState(calcPrecession());
}

State HeavyTop::makeReleasedState() {
    return makeState(0);
}

State HeavyTop::makeState(Real precession) {
    State state = system.realizeTopology();
    const UnitVec3 axis(std::sin(Tilt), std::cos(Tilt), 0);
    m_stem.setPoseByInterface(state, "root", Transform(Rotation(axis, XAxis)));
    const Vec3 omega = Vec3(0, precession, 0) + (Spin - precession * axis[1]) * Vec3(axis);
    system.realize(state, Stage::Position);
    const Vec3 center = m_stem.getFramePose(state).p();
    m_stem.setFrameVelocity(state, SpatialVec(omega, omega % center));
    m_disc.setStateToFit(state);
    return state;
}

Vec3 HeavyTop::calcDisc(const State& state) const {
    system.realize(state, Stage::Position);
    return m_disc.getBody().getBodyOriginLocation(state);
}

Real HeavyTop::calcAzimuth(const State& state) const {
    const Vec3 p = calcDisc(state);
    return std::atan2(-p[2], p[0]);
}

Real HeavyTop::calcSpin(const State& state) const {
    system.realize(state, Stage::Velocity);
    const MobilizedBody& disc = m_disc.getBody();
    return dot(disc.getBodyAngularVelocity(state), disc.getBodyRotation(state).x());
}

}  // namespace simflex::test
