// Accelerations and multipliers at any time match the State and the loads at that time.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

/** A force along Ground's x axis at a body's origin. **/
class Shake : public Force::Custom::Implementation {
public:
    Shake(const MobilizedBody& body, std::function<Real(Real)> force)
        : m_body(body), m_force(std::move(force)) {}
    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        m_body.applyForceToBodyPoint(state, Vec3(0), Vec3(m_force(state.getTime()), 0, 0),
                                     bodyForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }
    bool dependsOnlyOnPositions() const override { return false; }

private:
    const MobilizedBody& m_body;
    std::function<Real(Real)> m_force;
};

/** A block of 2 kg on a slope of 20 degrees, held by a joint. **/
struct HeldBlock {
    HeldBlock()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter),
          block(matter.Ground(), Body::Rigid(MassProperties(2, Vec3(0), Inertia(0.01)))),
          guide(flexible, Attachment(matter.Ground(), Transform(slope)),
                Attachment(block, Transform(slope)), "guide"),
          lock(flexible, guide, "hold") {
        Force::Custom(forces, new Shake(block, [](Real t) { return 0.5 * std::sin(2 * Pi * t); }));
    }
    static Real calcHolding(Real t) {
        return 2 * 9.81 * std::sin(angle) - 0.5 * std::sin(2 * Pi * t) * std::cos(angle);
    }
    static constexpr Real angle = 0.3490658503988659;
    const Rotation slope{angle, ZAxis};
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    MobilizedBody::Free block;
    Joint::Slider guide;
    Joint::Lock lock;
};

template <class Integrator>
void expectHoldingForce() {
    HeldBlock model;
    State state = model.system.realizeTopology();
    model.system.realize(state, Stage::Velocity);
    model.lock.lock(state);
    Integrator integrator(model.system);
    integrator.setMaximumStepSize(5);
    integrator.initialize(state);
    for (const Real interval : {1.0, 0.35, 0.01})
        for (int k = 0; k < 4; ++k) {
            const Real t = integrator.getTime() + interval;
            integrator.stepTo(t);
            EXPECT_NEAR(std::abs(integrator.getMultipliers(model.lock)[0]),
                        HeldBlock::calcHolding(t), 1e-8)
                << integrator.getMethodName() << " " << t;
            EXPECT_LT(integrator.getUDot().normInf(), 1e-9);
        }
}

TEST(RowForces, OfWhatIsHeldAreThoseOfTheLoadAtTheirTime) {
    expectHoldingForce<RadauIntegrator>();
    expectHoldingForce<BdfIntegrator>();
    expectHoldingForce<GeneralizedAlphaIntegrator>();
}

/** A rod swinging on a pin: λ and u̇ from its angle and rate, at times inside steps. **/
struct Swing {
    Swing()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter),
          rod(matter.Ground(), Body::Rigid(MassProperties(2, Vec3(0), Inertia(1.0 / 6)))),
          pivot(flexible, matter.Ground(), Attachment(rod, Vec3(0, 0.5, 0)), "pivot") {}
    /** Largest errors of reaction [N] and angular acceleration relative to the returned State, and
    of its angle relative to `exact`. **/
    struct Errors {
        Real reaction = 0, acceleration = 0;
    };
    template <class Integrator>
    Errors run(Real h) {
        State state = system.realizeTopology();
        rod.setQToFitTransform(
            state, Transform(Rotation(1.0, ZAxis), Rotation(1.0, ZAxis) * Vec3(0, -0.5, 0)));
        Integrator integrator(system);
        integrator.setFixedStep(h);
        integrator.initialize(state);
        Errors errors;
        for (int k = 1; k <= 20; ++k) {
            integrator.stepTo(0.0437 * k);
            const State& now = integrator.getState();
            const Real angle = pivot.calcCoordinates(now)[0],
                       rate = pivot.calcCoordinateDots(now)[0];
            const Real alpha = -9.81 * 0.5 * 2 * std::sin(angle) / (1.0 / 6 + 0.5);
            const Vec3 along(std::sin(angle), -std::cos(angle), 0),
                across(std::cos(angle), std::sin(angle), 0);
            const Vec3 force =
                2 * (0.5 * alpha * across - 0.5 * rate * rate * along + Vec3(0, 9.81, 0));
            const Vector lambda = integrator.getMultipliers(pivot);
            const Vec3 found = pivot.calcReaction(now, lambda, Joint::Side::M, Joint::Side::M)[1];
            errors.reaction = std::max(errors.reaction, (found - force).norm());
            errors.acceleration =
                std::max(errors.acceleration, std::abs(integrator.getUDot()[2] - alpha));
        }
        return errors;
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    MobilizedBody::Free rod;
    Joint::Pin pivot;
};

TEST(RowForces, OfRigidBodiesFollowFromStateAndTimeAlone) {
    for (const Real h : {0.05, 0.0125}) {
        Swing model;
        const Swing::Errors radau = model.run<RadauIntegrator>(h),
                            bdf = model.run<BdfIntegrator>(h),
                            alpha = model.run<GeneralizedAlphaIntegrator>(h);
        for (const Swing::Errors& errors : {radau, bdf, alpha}) {
            EXPECT_LT(errors.reaction, 1e-7) << h;
            EXPECT_LT(errors.acceleration, 1e-7) << h;
        }
    }
}

/** Unresolved motion of a stiff body adds no noise to rows between steps: an error of 1e-7 m in a 3
kHz mode would be an acceleration of 36 m/s². **/
TEST(RowForces, OfStiffBodiesAreNoRougherThanTheSteps) {
    for (const Real accuracy : {1e-5, 1e-7}) {
        test::PointMassPartOptions options;
        options.lowestFrequency = 3000;
        options.highestFrequency = 20000;
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        GeneralForceSubsystem forces(system);
        Force::Gravity gravity(forces, matter, -YAxis, 9.81);
        FlexibleBodySubsystem flexible(system, matter);
        FlexibleBody rod(flexible, test::makePointMassPart(options).body, "rod");
        Joint::Ball root(flexible, matter.Ground(), rod.interface("A"), "root");
        State state = system.realizeTopology();
        rod.setPoseByInterface(state, "A", Transform());
        State rigid = state;
        const auto run = [&](const State& start, Real tolerance) {
            RadauIntegrator integrator(system);
            integrator.setAccuracy(tolerance);
            integrator.initialize(start);
            std::vector<Vec3> reactions;
            for (int k = 1; k <= 100; ++k) {
                integrator.stepTo(0.00517 * k);
                const Vector lambda = integrator.getMultipliers(root);
                reactions.push_back(root.calcReaction(integrator.getState(), lambda, Joint::Side::M,
                                                      Joint::Side::M)[1]);
            }
            return reactions;
        };
        rod.setRigid(rigid);
        const std::vector<Vec3> flexibleOnes = run(state, accuracy), rigidOnes = run(rigid, 1e-9);
        Real largest = 0;
        for (size_t i = 10; i < rigidOnes.size(); ++i)
            largest = std::max(largest, (flexibleOnes[i] - rigidOnes[i]).norm());
        EXPECT_LT(largest, 0.01 * 2 * 9.81) << accuracy;
    }
}

}  // namespace
}  // namespace simflex
