// Bodies with geometric stiffening in the solver: the constraints are Simbody's; energy and
// momentum are conserved.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "support/NewtonReference.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** Two soft bodies hinged to each other, free in space. **/
struct HingedPair {
    explicit HingedPair(double stiffening = 1) {
        PointMassPartOptions options;
        options.numModes = 7;
        options.lowestFrequency = 8;
        options.highestFrequency = 30;
        options.stiffening = stiffening;
        const auto part = makePointMassPart(options).body;
        first = std::make_unique<FlexibleBody>(flexible, part, "first");
        second = std::make_unique<FlexibleBody>(flexible, part, "second");
        joint = std::make_unique<Joint::Pin>(flexible, first->interface("B"),
                                             second->interface("A"), "hinge");
        state = system.realizeTopology();
        // Assembled except for a small error that the integrator removes.
        const auto place = [&](const char* name) {
            const auto& s = part->getInterface(name).position;
            return Vec3(s[0], s[1], s[2]);
        };
        second->setFramePose(state, Transform(place("B") - place("A")));
        first->setFrameVelocity(state, SpatialVec(Vec3(3, 1, -2), Vec3(0.3, -0.2, 0.1)));
        second->setFrameVelocity(state, SpatialVec(Vec3(-1, 2, 2), Vec3(-0.3, 0, 0.4)));
        for (FlexibleBody* body : {first.get(), second.get()}) {
            Vector xi(7), xiDot(7);
            for (int i = 0; i < 7; ++i) {
                xi[i] = 0.03 * std::cos(1.0 + i);
                xiDot[i] = 0.2 * std::sin(2.0 + i);
            }
            body->setModalCoordinates(state, xi);
            body->setModalSpeeds(state, xiDot);
        }
    }

    SpatialVec calcMomentum(const State& at) const {
        return first->calcMomentum(at) + second->calcMomentum(at);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::unique_ptr<FlexibleBody> first, second;
    std::unique_ptr<Joint> joint;
    State state;
};

struct Drift {
    Real momentum = 0, energy = 0;
};

Drift calcDrift(Real accuracy, BdfIntegrator::BlockForm form) {
    HingedPair pair;
    BdfIntegrator integrator(pair.system);
    integrator.setAccuracy(accuracy);
    integrator.setBlockForm(form);
    integrator.initialize(pair.state);
    pair.system.realize(integrator.getState(), Stage::Dynamics);
    const SpatialVec momentum = pair.calcMomentum(integrator.getState());
    const Real energy = pair.flexible.calcEnergy(integrator.getState());
    Drift drift;
    for (int i = 1; i <= 8; ++i) {
        integrator.stepTo(0.05 * i);
        const State& now = integrator.getState();
        pair.system.realize(now, Stage::Dynamics);
        const SpatialVec change = pair.calcMomentum(now) - momentum;
        drift.momentum = std::max(drift.momentum, change[0].norm() / momentum[0].norm());
        drift.energy =
            std::max(drift.energy, std::abs(pair.flexible.calcEnergy(now) - energy) / energy);
    }
    return drift;
}

// With the arrow, and with all gyroscopic terms in J.
TEST(StiffenedBodies, MomentumAndEnergyErrorsFallWithAccuracy) {
    for (const auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        std::vector<Drift> drifts;
        for (Real accuracy : {1e-5, 1e-6, 1e-7, 1e-8}) drifts.push_back(calcDrift(accuracy, form));
        for (size_t i = 1; i < drifts.size(); ++i) {
            // accuracy^(2/3): a factor of 4.6 per decade; 2.5 leaves room for the step size's
            // granularity.
            EXPECT_LT(drifts[i].momentum, drifts[i - 1].momentum / 2.5);
            EXPECT_LT(drifts[i].energy, drifts[i - 1].energy / 2.5);
        }
        EXPECT_LT(drifts.back().momentum, 1e-4);
        EXPECT_LT(drifts.back().energy, 1e-3);
    }
}

TEST(StiffenedBodies, SolverHasTheConstraintsThatSimbodyHas) {
    HingedPair pair;
    pair.system.realize(pair.state, Stage::Velocity);
    Evaluation equations(pair.system, pair.state);
    const int nq = equations.getTopology().numQ, nu = equations.getTopology().numU,
              m = equations.getTopology().numMultipliers;
    std::vector<double> q(size_t(nq), 0), u(size_t(nu), 0), uDot(size_t(nu), 0);
    equations.getBlocks().getFromState(pair.state, q.data(), u.data());
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (double& value : uDot) value = unit(random);
    equations.realize(0, q.data(), u.data());

    const Constraint& constraint = pair.matter.getConstraint(pair.joint->getConstraintIndex());
    Vector errors(m);
    equations.calcPositionErrors(&errors[0]);
    EXPECT_LT((errors - constraint.getPositionErrorsAsVector(pair.state)).normInf(), 1e-14);
    EXPECT_GT(errors.normInf(), 1e-3);
    equations.calcVelocityErrors(&errors[0]);
    EXPECT_LT((errors - constraint.getVelocityErrorsAsVector(pair.state)).normInf(), 1e-13);
    equations.calcAccelerationErrors(q.data(), u.data(), uDot.data(), &errors[0]);
    Vector simbody;
    pair.matter.calcConstraintAccelerationErrors(
        pair.state, equations.getBlocks().calcSimbodyUDot(q.data(), uDot.data()), simbody);
    EXPECT_LT((errors - simbody).normInf(), 1e-12);

    // Velocity errors are linear in u: their differences are G, and Gᵀ multiplies λ.
    std::vector<double> lambda(size_t(m), 0), r(size_t(nu), 0);
    equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), r.data());
    NewtonSystem system = equations.getTopology().makeNewtonSystem();
    equations.formMassSystem(system);
    Vector before(m), after(m);
    equations.calcVelocityErrors(&before[0]);
    int first = 0;
    for (const NewtonSystem::Block& block : system.blocks) {
        EXPECT_EQ(block.form, NewtonSystem::Block::Form::Arrow);
        EXPECT_EQ(block.columns, NewtonSystem::Block::Columns::Own);
        const Eigen::MatrixXd Gt = assembleGt(system, block);
        for (int j = 0; j < block.size; ++j) {
            std::vector<double> moved = u;
            moved[size_t(first + j)] += 1;
            equations.realize(0, q.data(), moved.data());
            equations.calcVelocityErrors(&after[0]);
            for (int k = 0; k < block.numColumns(); ++k)
                EXPECT_NEAR(Gt(j, k), after[block.rows[size_t(k)]] - before[block.rows[size_t(k)]],
                            1e-13);
        }
        first += block.size;
    }
}

// Simbody's solution with its own constraints equals the solver's.
TEST(StiffenedBodies, NativeAccelerationsAndMultipliersAreTheSolvers) {
    HingedPair pair;
    for (const bool isEnabled : {true, false, true}) {
        if (isEnabled) {
            pair.first->enableStiffening(pair.state);
        } else {
            pair.first->disableStiffening(pair.state);
        }
        BdfIntegrator integrator(pair.system);
        integrator.setConstraintTolerance(1e-12);
        integrator.initialize(pair.state);
        const State& start = integrator.getState();
        pair.system.realize(start, Stage::Acceleration);
        const Vector uDot = integrator.getUDot();
        EXPECT_LT((start.getUDot() - uDot).normInf(), 1e-9 * uDot.normInf());
        const Vector lambda = integrator.getMultipliers();
        EXPECT_LT((pair.matter.getConstraint(pair.joint->getConstraintIndex())
                       .getMultipliersAsVector(start) -
                   lambda)
                      .normInf(),
                  1e-9 * lambda.normInf());
    }
}

TEST(StiffenedBodies, DisabledStiffeningIsAsIfThePartHadNone) {
    const auto end = [](HingedPair& pair) {
        BdfIntegrator integrator(pair.system);
        integrator.setAccuracy(1e-7);
        integrator.initialize(pair.state);
        integrator.stepTo(0.1);
        return Vector(integrator.getState().getQ());
    };
    HingedPair without(0), with, disabled;
    disabled.first->disableStiffening(disabled.state);
    disabled.second->disableStiffening(disabled.state);
    const Vector expected = end(without);
    EXPECT_EQ((end(disabled) - expected).normInf(), 0);
    EXPECT_GT((end(with) - expected).normInf(), 1e-4);
}

TEST(StiffenedBodies, TheSameBitsForAnyNumberOfThreads) {
    std::vector<Vector> ends;
    for (int threads : {1, 2, 3}) {
        HingedPair pair;
        BdfIntegrator integrator(pair.system);
        integrator.setNumThreads(threads);
        integrator.initialize(pair.state);
        integrator.stepTo(0.05);
        ends.push_back(integrator.getState().getQ());
    }
    EXPECT_EQ((ends[1] - ends[0]).normInf(), 0);
    EXPECT_EQ((ends[2] - ends[0]).normInf(), 0);
}

}  // namespace
}  // namespace simflex::test
