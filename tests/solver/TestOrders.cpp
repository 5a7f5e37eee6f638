// Orders of BDF and Radau on a smooth constrained problem: a soft flexible pendulum on a ball
// joint. The reference is classical Runge–Kutta on the index-1 equations (accelerations and
// multipliers by one elimination with M for J).

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

class SoftPendulum : public ::testing::Test {
protected:
    SoftPendulum()
        : m_matter(m_system),
          m_forces(m_system),
          m_gravity(m_forces, m_matter, -YAxis, 9.81),
          m_flexible(m_system, m_matter) {
        test::PointMassPartOptions options;
        options.numModes = 4;
        options.lowestFrequency = 2;
        options.highestFrequency = 5;
        m_body = std::make_unique<FlexibleBody>(m_flexible, test::makePointMassPart(options).body);
        Joint::Ball(m_flexible, m_matter.Ground(), m_body->interface("A"));
        m_start = m_system.realizeTopology();
        m_body->setPoseByInterface(m_start, "A", Transform());
        BdfIntegrator integrator(m_system);
        integrator.initialize(m_start);
        m_start = integrator.getState();
    }

    /** Returns the States every `spacing` from 0 to `count·spacing` by Runge–Kutta with steps of
    about 1e-4 s.
    **/
    Array_<State> integrateReference(Real spacing, int count) {
        Evaluation equations(m_system, m_start);
        IntegratorStatistics statistics;
        ImplicitStep step(equations, statistics);
        std::vector<double> q(equations.getTopology().numQ), u(equations.getTopology().numU),
            lambda(equations.getTopology().numMultipliers);
        m_system.realize(m_start, Stage::Velocity);
        equations.getBlocks().getFromState(m_start, q.data(), u.data());
        const int substeps = int(std::ceil(spacing / 2e-4));
        const double h = spacing / substeps;

        Array_<State> states;
        const auto store = [&](double t) {
            State state = m_start;
            equations.getBlocks().putIntoState(t, q.data(), u.data(), state);
            m_system.realize(state, Stage::Velocity);
            states.push_back(state);
        };
        // Speeds and quasi-displacements are combined; each stage moves q once from the step's
        // start.
        const auto combine = [](const std::vector<double>& a, double factor,
                                const std::vector<double>& b) {
            std::vector<double> sum = a;
            for (size_t i = 0; i < a.size(); ++i) sum[i] += factor * b[i];
            return sum;
        };
        const auto qDotOf = [&](const std::vector<double>& at, const std::vector<double>& speeds) {
            // q̇ = N(q)u, exact column by column: (q_hist + γNu − q_hist)/γ of the linear map q ↦ q
            // + N(q)u.
            std::vector<double> qDot(at.size());
            qDot.assign(at.size(), 0);
            const Eigen::Vector4d quaternion = Eigen::Map<const Eigen::Vector4d>(at.data());
            Eigen::Map<Eigen::Vector4d>(qDot.data()) =
                0.5 * multiplyQuaternion(quaternion,
                                         Eigen::Map<const Eigen::Vector3d>(speeds.data()), true);
            for (size_t i = 4; i < at.size(); ++i) qDot[i] = speeds[i - 1];
            return qDot;
        };
        store(0);
        std::vector<double> uDot[4], qDot[4];
        for (int i = 0; i < count; ++i) {
            for (int s = 0; s < substeps; ++s) {
                const double t = i * spacing + s * h;
                const double fractions[4] = {0, 0.5, 0.5, 1};
                for (int stage = 0; stage < 4; ++stage) {
                    const double f = fractions[stage] * h;
                    const std::vector<double> qs = stage ? combine(q, f, qDot[stage - 1]) : q;
                    const std::vector<double> us = stage ? combine(u, f, uDot[stage - 1]) : u;
                    uDot[stage].resize(u.size());
                    step.calcAccelerations(t + f, qs, us, uDot[stage], lambda);
                    qDot[stage] = qDotOf(qs, us);
                }
                for (int stage = 0; stage < 4; ++stage) {
                    const double weight = (stage == 0 || stage == 3 ? 1.0 : 2.0) * h / 6;
                    q = combine(q, weight, qDot[stage]);
                    u = combine(u, weight, uDot[stage]);
                }
            }
            store((i + 1) * spacing);
        }
        return states;
    }

    Real calcDistance(const State& a, const State& b) const {
        m_system.realize(a, Stage::Velocity);
        m_system.realize(b, Stage::Velocity);
        return std::max((m_body->getFramePose(a).p() - m_body->getFramePose(b).p()).norm(),
                        (m_body->getModalCoordinates(a) - m_body->getModalCoordinates(b)).norm());
    }

    Real calcSpeedDistance(const State& a, const State& b) const {
        m_system.realize(a, Stage::Velocity);
        m_system.realize(b, Stage::Velocity);
        return std::max((m_body->getFrameVelocity(a) - m_body->getFrameVelocity(b)).norm(),
                        (m_body->getModalSpeeds(a) - m_body->getModalSpeeds(b)).norm());
    }

    void expectOrder(int order, BdfIntegrator::Formulation formulation) {
        // Steps are small enough for the asymptotic range (ωh ≤ 0.13, order 5: 0.06) and large
        // enough to stay above round-off.
        const Real coarsest = order >= 5 ? 2e-3 : 4e-3;
        const Real span = 0.32;
        const int levels = order >= 5 ? 2 : 3;
        std::vector<Real> errors, speedErrors;
        for (int level = 0; level < levels; ++level) {
            const Real h = coarsest / (1 << level);
            const Array_<State> reference = integrateReference(h, int(std::lround(span / h)));
            Array_<State> history;
            for (int i = 0; i <= order; ++i) history.push_back(reference[unsigned(i)]);
            BdfIntegrator integrator(m_system);
            integrator.setFixedStep(h);
            integrator.setFixedOrder(order);
            integrator.setFormulation(formulation);
            integrator.setAccuracy(1e-12);
            integrator.setConstraintTolerance(1e-13);
            integrator.initialize(history);
            integrator.stepTo(span);
            EXPECT_EQ(integrator.getLastOrder(), order);
            errors.push_back(calcDistance(integrator.getState(), reference.back()));
            speedErrors.push_back(calcSpeedDistance(integrator.getState(), reference.back()));
        }
        for (int level = 1; level < levels; ++level) {
            EXPECT_NEAR(std::log2(errors[level - 1] / errors[level]), order, 0.2)
                << "errors " << errors[level - 1] << " " << errors[level];
            EXPECT_NEAR(std::log2(speedErrors[level - 1] / speedErrors[level]), order, 0.2)
                << "errors " << speedErrors[level - 1] << " " << speedErrors[level];
        }
    }

    void expectRadausOrder() {
        const Real span = 0.32, coarsest = 0.02;
        const State reference = integrateReference(span, 1).back();
        std::vector<Real> errors, speedErrors;
        for (int level = 0; level < 3; ++level) {
            RadauIntegrator integrator(m_system);
            integrator.setFixedStep(coarsest / (1 << level));
            integrator.setAccuracy(1e-10);
            integrator.setConstraintTolerance(1e-13);
            integrator.initialize(m_start);
            integrator.stepTo(span);
            errors.push_back(calcDistance(integrator.getState(), reference));
            speedErrors.push_back(calcSpeedDistance(integrator.getState(), reference));
        }
        for (int level = 1; level < 3; ++level) {
            EXPECT_NEAR(std::log2(errors[level - 1] / errors[level]), 5, 0.2)
                << "errors " << errors[level - 1] << " " << errors[level];
            EXPECT_NEAR(std::log2(speedErrors[level - 1] / speedErrors[level]), 5, 0.2)
                << "errors " << speedErrors[level - 1] << " " << speedErrors[level];
        }
    }

    /** Output times lie at 0.2, 0.4, 0.6 and 0.8 of steps, for any step length. **/
    void expectRadausOrderInsideOfSteps() {
        const Real spacing = 0.008, coarsest = 0.02;
        const int count = 40;
        const Array_<State> reference = integrateReference(spacing, count);
        std::vector<Real> errors, speedErrors;
        for (int level = 0; level < 3; ++level) {
            RadauIntegrator integrator(m_system);
            integrator.setFixedStep(coarsest / (1 << level));
            integrator.setAccuracy(1e-10);
            integrator.setConstraintTolerance(1e-13);
            integrator.initialize(m_start);
            errors.push_back(0);
            speedErrors.push_back(0);
            for (int i = 1; i <= count; ++i) {
                integrator.stepTo(i * spacing);
                if (!integrator.isStateInterpolated()) continue;
                const State &found = integrator.getState(), &exact = reference[unsigned(i)];
                errors.back() = std::max(errors.back(), calcDistance(found, exact));
                speedErrors.back() = std::max(speedErrors.back(), calcSpeedDistance(found, exact));
            }
        }
        for (int level = 1; level < 3; ++level) {
            EXPECT_NEAR(std::log2(errors[level - 1] / errors[level]), 4, 0.3)
                << "errors " << errors[level - 1] << " " << errors[level];
            EXPECT_NEAR(std::log2(speedErrors[level - 1] / speedErrors[level]), 4, 0.3)
                << "errors " << speedErrors[level - 1] << " " << speedErrors[level];
        }
    }

    MultibodySystem m_system;
    SimbodyMatterSubsystem m_matter;
    GeneralForceSubsystem m_forces;
    Force::Gravity m_gravity;
    FlexibleBodySubsystem m_flexible;
    std::unique_ptr<FlexibleBody> m_body;
    State m_start;
};

class BdfOrder : public SoftPendulum, public ::testing::WithParamInterface<int> {};

TEST_P(BdfOrder, ErrorFallsWithTheOrderInStabilizedIndex2) {
    expectOrder(GetParam(), BdfIntegrator::Formulation::StabilizedIndex2);
}

TEST_P(BdfOrder, ErrorFallsWithTheOrderInIndex3) {
    expectOrder(GetParam(), BdfIntegrator::Formulation::Index3);
}

INSTANTIATE_TEST_SUITE_P(Orders, BdfOrder, ::testing::Values(1, 2, 3, 4, 5));

TEST_F(SoftPendulum, RadauHasOrder5) {
    expectRadausOrder();
}

TEST_F(SoftPendulum, RadausErrorInsideOfStepsFallsWithTheFourthPower) {
    expectRadausOrderInsideOfSteps();
}

TEST_F(SoftPendulum, GlobalErrorFallsMonotonicallyWithAccuracy) {
    const Real span = 0.3;
    const Array_<State> reference = integrateReference(span, 1);
    std::vector<Real> errors;
    for (Real accuracy : {1e-4, 1e-5, 1e-6, 1e-7}) {
        BdfIntegrator integrator(m_system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(m_start);
        integrator.stepTo(span);
        errors.push_back(calcDistance(integrator.getState(), reference.back()));
    }
    // Order 2 promises accuracy^(2/3): a factor of 100 over three decades.
    for (size_t i = 1; i < errors.size(); ++i) EXPECT_LT(errors[i], errors[i - 1]);
    EXPECT_LT(errors.back(), errors.front() / 50);
}

}  // namespace
}  // namespace simflex
