// Generalized-α: order, damping of high frequencies, rotations, constraints.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

/** A body with soft modes, free or on a ball joint under gravity. **/
struct SoftBody {
    explicit SoftBody(bool isPendulum, bool hasGravity = true)
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, hasGravity ? 9.81 : 0),
          flexible(system, matter) {
        test::PointMassPartOptions options;
        options.numModes = 4;
        options.lowestFrequency = 2;
        options.highestFrequency = 5;
        body = std::make_unique<FlexibleBody>(flexible, test::makePointMassPart(options).body);
        if (isPendulum) Joint::Ball(flexible, matter.Ground(), body->interface("A"));
        state = system.realizeTopology();
        if (isPendulum)
            body->setPoseByInterface(state, "A", Transform());
        else
            body->setFrameVelocity(state, SpatialVec(Vec3(3, 1, -2), Vec3(0.3, -0.2, 0.1)));
    }

    /** Integrates with the integrator's settings and returns the final State. **/
    State integrate(ImplicitIntegrator& integrator, Real time) const {
        integrator.initialize(state);
        integrator.stepTo(time);
        return integrator.getState();
    }

    Real calcDistance(const State& a, const State& b) const {
        system.realize(a, Stage::Velocity);
        system.realize(b, Stage::Velocity);
        const Transform difference = ~body->getFramePose(a) * body->getFramePose(b);
        return std::max({difference.p().norm(), difference.R().convertRotationToAngleAxis()[0],
                         (body->getModalCoordinates(a) - body->getModalCoordinates(b)).norm()});
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    std::unique_ptr<FlexibleBody> body;
    State state;
};

void expectSecondOrder(const SoftBody& model, Real rho, ImplicitIntegrator::Formulation formulation,
                       Real coarsest) {
    const Real span = 0.4;
    BdfIntegrator exact(model.system);
    exact.setMaximumOrder(5);
    exact.setAccuracy(1e-12);
    exact.setConstraintTolerance(1e-13);
    const State reference = model.integrate(exact, span);
    std::vector<Real> errors;
    for (int level = 0; level < 3; ++level) {
        GeneralizedAlphaIntegrator integrator(model.system);
        integrator.setSpectralRadius(rho);
        integrator.setFixedStep(coarsest / (1 << level));
        integrator.setFormulation(formulation);
        integrator.setAccuracy(1e-11);
        integrator.setConstraintTolerance(1e-13);
        const State end = model.integrate(integrator, span);
        errors.push_back(model.calcDistance(end, reference));
        EXPECT_LT(integrator.getLargestConstraintError(), 1e-9);
    }
    for (size_t level = 1; level < errors.size(); ++level)
        EXPECT_NEAR(std::log2(errors[level - 1] / errors[level]), 2, 0.1)
            << "rho " << rho << ", errors " << errors[level - 1] << " " << errors[level];
}

TEST(GeneralizedAlpha, ErrorOfASpinningVibratingBodyFallsWithOrder2FromTheFirstStepOn) {
    const SoftBody model(false);
    for (Real rho : {0.0, 0.5, 0.8, 1.0})
        expectSecondOrder(model, rho, ImplicitIntegrator::Formulation::StabilizedIndex2, 4e-3);
}

TEST(GeneralizedAlpha, ErrorOfAPendulumFallsWithOrder2InBothFormulations) {
    const SoftBody model(true);
    for (auto formulation : {ImplicitIntegrator::Formulation::StabilizedIndex2,
                             ImplicitIntegrator::Formulation::Index3})
        for (Real rho : {0.3, 0.8}) expectSecondOrder(model, rho, formulation, 4e-3);
}

TEST(GeneralizedAlpha, GlobalErrorFallsAsAccuracyToTheTwoThirds) {
    const SoftBody model(true);
    BdfIntegrator exact(model.system);
    exact.setMaximumOrder(5);
    exact.setAccuracy(1e-12);
    const State reference = model.integrate(exact, 0.3);
    std::vector<Real> errors;
    for (Real accuracy : {1e-4, 1e-5, 1e-6, 1e-7}) {
        GeneralizedAlphaIntegrator integrator(model.system);
        integrator.setAccuracy(accuracy);
        errors.push_back(model.calcDistance(model.integrate(integrator, 0.3), reference));
    }
    for (size_t i = 1; i < errors.size(); ++i) EXPECT_LT(errors[i], errors[i - 1]);
    EXPECT_LT(errors.back(), errors.front() / 50);
}

/** Returns the amplification of the pair (x, ẋ/ω) of ẍ = −ω²x in one step: eigenvalues of the
scheme's 3×3 matrix in (x, hẋ, h²a), from its definition. **/
Real calcSpectralRadius(Real rho, Real omegaH) {
    const Real am = (2 * rho - 1) / (rho + 1), af = rho / (rho + 1), gamma = 0.5 - am + af,
               beta = 0.25 * square(gamma + 0.5), w2 = square(omegaH);
    // Rows: x' − βA' = x + v + (½−β)A;  v' − γA' = v + (1−γ)A;  (1−am)A' + (1−af)w²x' = −am A − af
    // w²x.
    const Mat33 left(1, 0, -beta, 0, 1, -gamma, (1 - af) * w2, 0, 1 - am);
    const Mat33 right(1, 1, 0.5 - beta, 0, 1, 1 - gamma, -af * w2, 0, -am);
    const Mat33 A = left.invert() * right;
    // Power iteration by repeated squaring: ‖A^(2^k)‖^(1/2^k).
    Mat33 power = A;
    Real logNorm = 0, weight = 1;
    for (int k = 0; k < 40; ++k) {
        const Real norm = power.norm();
        logNorm += weight * std::log(norm);
        power = (power / norm) * (power / norm);
        weight *= 0.5;
    }
    return std::exp(logNorm);
}

/** Returns the amplitude ratio per step of a single mode over many fixed steps. **/
Real measureAmplification(Real rho, Real frequency, Real h, int steps) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    MobilizedBody::Slider mass(matter.Ground(),
                               Body::Rigid(MassProperties(1, Vec3(0), Inertia(1))));
    FlexibleBodySubsystem flexible(system, matter);
    test::PointMassPartOptions options;
    options.numModes = 1;
    options.lowestFrequency = options.highestFrequency = frequency;
    const FlexibleBody body(flexible, test::makePointMassPart(options).body);
    State state = system.realizeTopology();
    body.setModalCoordinates(state, Vector(1, 1e-6));
    GeneralizedAlphaIntegrator integrator(system);
    integrator.setSpectralRadius(rho);
    integrator.setFixedStep(h);
    integrator.setAccuracy(1e-14);
    integrator.initialize(state);
    const Real omega = 2 * Pi * frequency;
    const auto amplitude = [&] {
        const State& now = integrator.getState();
        return std::hypot(body.getModalCoordinates(now)[0], body.getModalSpeeds(now)[0] / omega);
    };
    integrator.stepTo(10 * h);
    const Real before = amplitude();
    integrator.stepTo((10 + steps) * h);
    return std::pow(amplitude() / before, 1.0 / steps);
}

TEST(GeneralizedAlpha, AmplificationOfAModeIsTheSchemesOwn) {
    const Real frequency = 100, omega = 2 * Pi * frequency;
    // In the high-frequency limit it is ρ itself.
    for (Real rho : {0.0, 0.5, 0.8}) EXPECT_NEAR(calcSpectralRadius(rho, 1e4), rho, 2e-2) << rho;
    for (Real omegaH : {0.3, 1.0}) {
        EXPECT_NEAR(measureAmplification(0.8, frequency, omegaH / omega, 400),
                    calcSpectralRadius(0.8, omegaH), 3e-3)
            << omegaH;
        EXPECT_NEAR(measureAmplification(0.0, frequency, omegaH / omega, 40),
                    calcSpectralRadius(0.0, omegaH), 2e-2)
            << omegaH;
        EXPECT_NEAR(measureAmplification(1.0, frequency, omegaH / omega, 400), 1, 1e-5) << omegaH;
    }
    // Far above 1/h, ρ = 0 removes everything and ρ = 1 nothing.
    EXPECT_LT(measureAmplification(0.0, frequency, 1e3 / omega, 5), 0.1);
    EXPECT_NEAR(measureAmplification(1.0, frequency, 1e3 / omega, 20), 1, 1e-3);
}

TEST(GeneralizedAlpha, QuaternionsKeepLengthOne) {
    const SoftBody model(false);
    GeneralizedAlphaIntegrator integrator(model.system);
    integrator.setFixedStep(1e-2);
    integrator.initialize(model.state);
    for (int i = 1; i <= 20; ++i) {
        integrator.stepTo(1e-2 * i);
        const State& now = integrator.getState();
        const Vector q = model.matter.getMobilizedBody(MobilizedBodyIndex(1)).getQAsVector(now);
        EXPECT_NEAR(q(0, 4).norm(), 1, 4e-16);
    }
}

TEST(GeneralizedAlpha, ATumblingRigidBodyHasOrder2WithQuaternionsAndWithEulerAngles) {
    for (bool usesAngles : {false, true}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        MobilizedBody::Ball top(matter.Ground(),
                                Body::Rigid(MassProperties(1, Vec3(0), Inertia(1, 2, 2.5))));
        State state = system.realizeTopology();
        matter.setUseEulerAngles(state, usesAngles);
        system.realizeModel(state);
        top.setUToFitAngularVelocity(state, Vec3(1, 2, -0.5));
        const auto integrate = [&](ImplicitIntegrator& integrator) {
            integrator.initialize(state);
            integrator.stepTo(0.4);
            system.realize(integrator.getState(), Stage::Position);
            return top.getBodyRotation(integrator.getState());
        };
        RungeKuttaMersonIntegrator exact(system);
        exact.setAccuracy(1e-12);
        TimeStepper stepper(system, exact);
        stepper.initialize(state);
        stepper.stepTo(0.4);
        system.realize(exact.getState(), Stage::Position);
        const Rotation reference = top.getBodyRotation(exact.getState());
        std::vector<Real> errors;
        for (Real h : {8e-3, 4e-3, 2e-3}) {
            GeneralizedAlphaIntegrator integrator(system);
            integrator.setFixedStep(h);
            integrator.setAccuracy(1e-11);
            errors.push_back((~reference * integrate(integrator)).convertRotationToAngleAxis()[0]);
        }
        for (size_t i = 1; i < errors.size(); ++i)
            EXPECT_NEAR(std::log2(std::abs(errors[i - 1] / errors[i])), 2, 0.1)
                << (usesAngles ? "angles " : "quaternions ") << errors[i];
    }
}

TEST(GeneralizedAlpha, SpectralRadiiOutsideZeroToOneAreRefused) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralizedAlphaIntegrator integrator(system);
    EXPECT_THROW(integrator.setSpectralRadius(-0.1), std::invalid_argument);
    EXPECT_THROW(integrator.setSpectralRadius(1.1), std::invalid_argument);
    EXPECT_THROW(integrator.setSpectralRadius(NaN), std::invalid_argument);
}

}  // namespace
}  // namespace simflex
