// Assembly of joints from far away: a free body moves to its joint without bending.

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

/** Initial angle from the assembled position, about F's axis (0) or any axis (1). **/
using Start = std::tuple<double, int>;

class DistantJoint : public ::testing::TestWithParam<Start> {
protected:
    DistantJoint() : matter(system), flexible(system, matter) {}

    Rotation getTurn() const {
        const auto [angle, which] = GetParam();
        return Rotation(angle * Pi / 180, which ? UnitVec3(1, -2, 0.7) : UnitVec3(XAxis));
    }

    State assemble(const State& start) {
        BdfIntegrator integrator(system);
        integrator.initialize(start);
        State state = integrator.getState();
        system.realize(state, Stage::Velocity);
        return state;
    }

    static void expectUnbent(const FlexibleBody& body, const State& state) {
        EXPECT_LT(body.getModalCoordinates(state).normInf(), 1e-9);
    }

    static void expectSame(const Transform& a, const Transform& b) {
        EXPECT_LT((a.p() - b.p()).norm(), 1e-9);
        EXPECT_LT((~a.R() * b.R()).convertRotationToAngleAxis()[0], 1e-9);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    FlexibleBodySubsystem flexible;
    std::shared_ptr<const ReducedBody> part = test::makePointMassPart().body;
    const Transform X_GF{Rotation(0.6, UnitVec3(3, 1, 2)), Vec3(1, -2, 0.5)};
};

TEST_P(DistantJoint, WeldHoldsAllAxes) {
    const FlexibleBody body(flexible, part);
    Joint::Weld(flexible, Attachment(matter.Ground(), X_GF), body.interface("A"));
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", X_GF * Transform(getTurn(), Vec3(0.4, 0.9, -0.6)));
    state = assemble(state);
    expectSame(body.interface("A").calcMotion(state).X, X_GF);
    expectUnbent(body, state);
}

TEST_P(DistantJoint, PinHoldsItsAxis) {
    const FlexibleBody body(flexible, part);
    Joint::Pin(flexible, Attachment(matter.Ground(), X_GF), body.interface("A"));
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", X_GF * Transform(getTurn(), Vec3(0.4, 0.9, -0.6)));
    state = assemble(state);
    const Transform M = body.interface("A").calcMotion(state).X;
    EXPECT_LT((M.p() - X_GF.p()).norm(), 1e-9);
    EXPECT_LT((M.z() - X_GF.z()).norm(), 1e-9);
    expectUnbent(body, state);
}

TEST_P(DistantJoint, ChainsComeToTheirPlaces) {
    // Neither body is placed.
    const FlexibleBody first(flexible, part), second(flexible, part);
    const Transform X(getTurn());
    Joint::Weld(flexible, Attachment(matter.Ground(), X_GF), first.interface("A", X));
    Joint::Slider(flexible, first.interface("B", X), second.interface("A"));
    const State state = assemble(system.realizeTopology());
    expectSame(first.interface("A", X).calcMotion(state).X, X_GF);
    const Transform F = first.interface("B", X).calcMotion(state).X,
                    M = second.interface("A").calcMotion(state).X;
    EXPECT_LT((~F.R() * M.R()).convertRotationToAngleAxis()[0], 1e-9);
    EXPECT_LT((~F * M.p()).getSubVec<2>(1).norm(), 1e-9);
    expectUnbent(first, state);
    expectUnbent(second, state);
}

// Excessive stretching by an assembly is refused, as is a State that already has it.
TEST(Assembly, ThatDeformsABodyBeyondItsRangeIsRefusedByTheJointInTheWrongPlace) {
    for (const Real gap : {-3.0, 0.3}) {
        MultibodySystem system;
        SimbodyMatterSubsystem matter(system);
        FlexibleBodySubsystem flexible(system, matter);
        const FlexibleBody body(flexible, test::makePointMassPart().body, "bone");
        Joint::Pin hip(flexible, matter.Ground(), body.interface("A"), "hip");
        const auto& A = body.getPart().getInterface("A").position;
        const auto& B = body.getPart().getInterface("B").position;
        const Vec3 reach(B[0] - A[0], B[1] - A[1], B[2] - A[2]);
        Joint::Ball(flexible, Attachment(matter.Ground(), (1 + gap / reach.norm()) * reach),
                    body.interface("B"), "anchor");
        State state = system.realizeTopology();
        body.setPoseByInterface(state, "A", Transform());
        BdfIntegrator integrator(system);
        try {
            integrator.initialize(state);
            ADD_FAILURE() << "was not refused";
        } catch (const std::runtime_error& error) {
            for (const char* part : {"'bone'", "linear range", "'anchor'"})
                EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
        }
        integrator.setProjectInitialState(false);
        EXPECT_NO_THROW(integrator.initialize(state));
    }
}

INSTANTIATE_TEST_SUITE_P(Turned, DistantJoint,
                         ::testing::Combine(::testing::Values(30, 58, 90, 135, 179, 180),
                                            ::testing::Values(0, 1)),
                         [](const auto& tested) {
                             return std::to_string(int(std::get<0>(tested.param))) +
                                    (std::get<1>(tested.param) ? "AboutAnyAxis" : "AboutX");
                         });

}  // namespace
}  // namespace simflex
