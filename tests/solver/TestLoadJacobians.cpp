// Derivatives of loads with respect to the body's own motion, in the dense form of the Newton
// matrix.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/equations/Evaluation.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A flexible body and a rigid one with loads on both. **/
struct LoadedBodies {
    using Adder = std::function<void(LoadedBodies&)>;

    explicit LoadedBodies(const Adder& addLoads)
        : body(flexible, part, "body"),
          brick(matter.updGround(), Body::Rigid(MassProperties(
                                        2, Vec3(0.1, 0, 0), 2 * UnitInertia(0.02, 0.04, 0.05)))) {
        addLoads(*this);
    }

    State makeState() {
        State state = system.realizeTopology();
        body.setFramePose(state, Transform(Rotation(0.7, UnitVec3(1, 2, 3)), Vec3(1, 2, 3)));
        brick.setQToFitTransform(state,
                                 Transform(Rotation(-0.4, UnitVec3(2, 0, 1)), Vec3(1, 0, 0)));
        Vector xi(body.getNumModes());
        for (int i = 0; i < xi.size(); ++i) xi[i] = 1e-3 * std::cos(1.0 + i);
        body.setModalCoordinates(state, xi);
        return state;
    }

    const std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody body;
    MobilizedBody::Free brick;
};

/** A user-defined spring and damper to a point in Ground. **/
SpatialVec pull(Real, const FrameMotion& motion) {
    return {Vec3(0), -3e4 * (motion.X.p() - Vec3(0.5, 1, 2)) - 40 * motion.V[1]};
}

struct LoadCase {
    const char* name;
    LoadedBodies::Adder add;
};
void PrintTo(const LoadCase& load, std::ostream* stream) {
    *stream << load.name;
}

const SpatialVec kForce(Vec3(300, -200, 100), Vec3(-1000, 2000, 1500));

const LoadCase loadCases[] = {
    {"FixedInGround",
     [](LoadedBodies& model) {
         AttachmentForce(model.flexible, model.body.interface("B"), kForce);
         AttachmentForce(model.flexible, Attachment(model.brick, Vec3(0.1, 0.2, 0.3)), kForce);
     }},
    {"FixedInTheBody",
     [](LoadedBodies& model) {
         AttachmentForce(model.flexible, model.body.interface("B", Transform(Vec3(0.05, 0, 0.1))),
                         kForce, AttachmentForce::Axes::Attachment);
         AttachmentForce(model.flexible, Attachment(model.brick, Vec3(0.1, 0.2, 0.3)), kForce,
                         AttachmentForce::Axes::Attachment);
     }},
    {"LawOfMotion",
     [](LoadedBodies& model) {
         AttachmentForce(model.flexible, model.body.interface("A"), pull);
         AttachmentForce(model.flexible, model.body.node(3), pull);
         AttachmentForce(model.flexible, Attachment(model.brick, Vec3(0.1, 0.2, 0.3)), pull);
     }},
    {"Distributed",
     [](LoadedBodies& model) {
         const int n = model.body.getNumModes();
         LoadShape shape;
         shape.force = Vec3(1000, -500, 300);
         shape.torque = Vec3(20, 30, -10);
         shape.modal.resize(n);
         shape.torquePerMode.resize(3, n);
         for (int i = 0; i < n; ++i) {
             shape.modal[i] = 10 * std::cos(2.0 + i);
             for (int a = 0; a < 3; ++a)
                 shape.torquePerMode(a, i) = 100 * std::sin(1.0 + 3 * i + a);
         }
         DistributedLoad(model.flexible, model.body, shape, 2.0);
     }},
};

class LoadJacobian : public ::testing::TestWithParam<LoadCase> {};
INSTANTIATE_TEST_SUITE_P(Loads, LoadJacobian, ::testing::ValuesIn(loadCases),
                         [](const auto& test) { return std::string(test.param.name); });

// At rest and without accelerations, inertia forces have no derivatives: the residual's derivatives
// are those of elasticity, damping and loads.
TEST_P(LoadJacobian, IsTheDerivativeOfTheResidual) {
    LoadedBodies model(GetParam().add), bare([](LoadedBodies&) {});
    const State state = model.makeState(), bareState = bare.makeState();
    model.system.realize(state, Stage::Velocity);
    bare.system.realize(bareState, Stage::Velocity);
    Evaluation loaded(model.system, state), unloaded(bare.system, bareState);
    const int n = loaded.getTopology().numU;
    ASSERT_EQ(unloaded.getTopology().numU, n);
    const Real gamma = 2e-3;
    const std::vector<double> u(size_t(n), 0), uDot(size_t(n), 0), lambda;
    std::vector<double> q(size_t(loaded.getTopology().numQ));
    std::vector<double> stateU = u;
    loaded.getBlocks().getFromState(state, q.data(), stateU.data());

    const auto calcForm = [&](Evaluation& equations) {
        std::vector<double> r(size_t(n), 0);
        equations.realize(0, q.data(), u.data());
        equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), r.data());
        NewtonSystem system = equations.getTopology().makeNewtonSystem();
        equations.formNewtonSystem(NewtonFactors(gamma), true, q.data(), u.data(), uDot.data(),
                                   system);
        // The loads leave the evaluation point unchanged.
        std::vector<double> after(size_t(n), 0);
        equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), after.data());
        EXPECT_EQ(after, r);
        return system;
    };
    const NewtonSystem with = calcForm(loaded), without = calcForm(unloaded);

    const auto calcLoads = [&](int speed, double step) {
        std::vector<double> moved = q, movedU = u, delta(size_t(n), 0), r(size_t(n), 0), bareR = r;
        delta[size_t(speed)] = step;
        movedU[size_t(speed)] += step / gamma;
        loaded.realize(0, q.data(), u.data());
        loaded.getBlocks().moveQ(delta.data(), moved.data());
        loaded.realize(0, moved.data(), movedU.data());
        loaded.calcResidual(moved.data(), movedU.data(), uDot.data(), lambda.data(), r.data());
        unloaded.realize(0, moved.data(), movedU.data());
        unloaded.calcResidual(moved.data(), movedU.data(), uDot.data(), lambda.data(),
                              bareR.data());
        Vector loads(n);
        for (int i = 0; i < n; ++i) loads[i] = r[size_t(i)] - bareR[size_t(i)];
        return loads;
    };
    Real largest = 0, worst = 0;
    int first = 0;
    for (size_t b = 0; b < with.blocks.size(); ++b) {
        const int size = with.blocks[b].size;
        for (int j = 0; j < size; ++j) {
            const double h = 1e-4;
            const Vector column = gamma / (12 * h) *
                                  (8.0 * (calcLoads(first + j, h) - calcLoads(first + j, -h)) -
                                   (calcLoads(first + j, 2 * h) - calcLoads(first + j, -2 * h)));
            for (int i = 0; i < size; ++i) {
                const size_t entry = size_t(i + j * size);
                const Real found = with.blocks[b].matrix[entry] - without.blocks[b].matrix[entry];
                largest = std::max(largest, std::abs(column[first + i]));
                worst = std::max(worst, std::abs(found - column[first + i]));
            }
        }
        first += size;
    }
    EXPECT_GT(largest, 1);
    EXPECT_LT(worst, 1e-5 * largest);
}

/** A law so stiff that Newton's iteration needs its derivatives: they are added automatically when
the arrow fails. **/
TEST(LoadJacobian, StiffLawsTakeStepsThatTheArrowCouldNotTake) {
    const auto run = [](ImplicitIntegrator::BlockForm form) {
        const auto law = [](Real, const FrameMotion& motion) -> SpatialVec {
            return {Vec3(0), -1e7 * (motion.X.p() - Vec3(1, 2, 3)) - 1e3 * motion.V[1]};
        };
        LoadedBodies model([&](LoadedBodies& own) {
            AttachmentForce(own.flexible, own.body.interface("A"), law);
            AttachmentForce(own.flexible, Attachment(own.brick, Vec3(0.1, 0.2, 0.3)), law);
        });
        State state = model.system.realizeTopology();
        model.body.setPoseByInterface(state, "A", Transform(Vec3(1, 2, 3.0001)));
        model.brick.setQToFitTransform(state, Transform(Vec3(0.9, 1.8, 2.7001)));
        BdfIntegrator integrator(model.system);
        integrator.setBlockForm(form);
        integrator.setFixedStep(1e-3);
        integrator.initialize(state);
        integrator.stepTo(0.1);
        return integrator.getStatistics().newtonIterations;
    };
    EXPECT_LT(run(ImplicitIntegrator::BlockForm::Dense), 4 * 100);
    EXPECT_LT(run(ImplicitIntegrator::BlockForm::Automatic), 4.5 * 100);
    EXPECT_THROW(run(ImplicitIntegrator::BlockForm::Arrow), std::runtime_error);
}

}  // namespace
}  // namespace simflex::test
