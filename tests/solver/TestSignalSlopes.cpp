// Exact slopes of signals at rest are those that fourth-order differences find.

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "simflex/body/FlexibleBody.h"
#include "simflex/forces/Signal.h"
#include "simflex/solver/StateSpace.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

std::shared_ptr<const ReducedBody> makePart() {
    test::PointMassPartOptions options;
    options.stiffening = 0.2;
    return test::makePointMassPart(options).body;
}

/** A tree of rigid and flexible bodies, in a pose without symmetry, bent and at rest. **/
struct BentTree {
    BentTree() {
        flag.setStiffeningDisabledByDefault(true);
        system.realizeTopology();
        state = system.getDefaultState();
        for (const FlexibleBody& body : {flag, stiffened})
            body.setFramePose(state, Transform(Rotation(0.4, UnitVec3(1, 2, 3)), Vec3(1, 2, 3)));
        for (int i = 0; i < state.getNQ(); ++i)
            state.updQ()[i] += 0.01 * std::sin(2.3 * Real(i) + 1);
        ball.setQToFitRotation(state, Rotation(0.7, UnitVec3(2, -1, 1)));
        gimbal.setQToFitRotation(state, Rotation(1.1, UnitVec3(-1, 2, 1)));
        slider.setQToFitTranslation(state, Vec3(0.3, 0, 0));
        system.realize(state, Stage::Velocity);
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    Body::Rigid brick{MassProperties(1, Vec3(0), Inertia(0.1, 0.2, 0.25))};
    MobilizedBody::Ball ball{matter.Ground(), Vec3(0.1, 0.2, 0.3), brick, Vec3(0, 0.4, 0)};
    MobilizedBody::Gimbal gimbal{ball, Vec3(0, -0.4, 0.1), brick, Vec3(0, 0.4, 0)};
    MobilizedBody::Slider slider{gimbal, Transform(Rotation(0.3, ZAxis), Vec3(0, -0.2, 0)), brick,
                                 Vec3(0.1, 0, 0)};
    std::shared_ptr<const ReducedBody> part = makePart();
    FlexibleBody flag{flexible, part}, stiffened{flexible, part};
    State state;
};

TEST(SignalSlopes, AreThoseOfDifferences) {
    BentTree tree;
    const std::vector<Attachment> frames{
        tree.matter.Ground(),
        Attachment(tree.ball, Transform(Rotation(0.2, XAxis), Vec3(0.1, 0, 0.2))),
        Attachment(tree.slider, Vec3(0, 0.3, 0)), Attachment::onInterface(tree.flag, "A"),
        Attachment::onInterface(tree.stiffened, "B", Transform(Rotation(0.5, YAxis), Vec3(0.1)))};
    const CoordinateAxis Axes[] = {XAxis, YAxis, ZAxis};
    std::vector<Signal> signals;
    for (const Attachment& F : frames)
        for (const Attachment& M : frames) {
            if (isSame(F, M)) continue;
            signals.push_back(Signal::distance(F, M));
            signals.push_back(Signal::distanceRate(F, M));
            for (const CoordinateAxis axis : Axes) {
                signals.push_back(Signal::displacement(F, M, axis));
                signals.push_back(Signal::displacementRate(F, M, axis));
                signals.push_back(Signal::angularVelocity(F, M, axis));
            }
        }
    const OperatingPoint point{tree.state, Vector(tree.state.getNU(), Real(0)), Vector()};
    tree.system.realize(point.state, Stage::Velocity);
    const LinearOutputs outputs = differentiateOutputs(
        tree.system, point, [&](const State& state, const Vector&, const Vector&) {
            std::vector<double> values;
            for (const Signal& signal : signals)
                values.push_back(signal.calcValue(tree.flexible, state));
            return values;
        });
    for (size_t k = 0; k < signals.size(); ++k) {
        const auto slopes = signals[k].calcSlopes(tree.flexible, tree.state);
        ASSERT_TRUE(slopes);
        EXPECT_LT((~slopes->byQ - outputs.byQ[int(k)]).norm(), 1e-8) << k;
        EXPECT_LT((~slopes->byU - outputs.byU[int(k)]).norm(), 1e-8) << k;
        EXPECT_GT(slopes->byQ.norm() + slopes->byU.norm(), 0.1) << k;
    }
}

TEST(SignalSlopes, AreNotGivenWhereThereAreNone) {
    BentTree tree;
    const Attachment ball = tree.ball;
    EXPECT_FALSE(Signal::distance(ball, ball).calcSlopes(tree.flexible, tree.state));
    EXPECT_FALSE(Signal().calcSlopes(tree.flexible, tree.state));
    EXPECT_FALSE(Signal::constant(1).calcSlopes(tree.flexible, tree.state));
}

TEST(SignalSlopes, AreZeroAlongWhatIsLocked) {
    BentTree tree;
    const Signal height = Signal::displacement(tree.matter.Ground(), tree.slider, XAxis);
    State locked = tree.state;
    tree.slider.lock(locked);
    tree.system.realize(locked, Stage::Velocity);
    const Vector free = height.calcSlopes(tree.flexible, tree.state)->byQ,
                 held = height.calcSlopes(tree.flexible, locked)->byQ;
    const int own = int(tree.slider.getFirstUIndex(locked));
    for (int i = 0; i < free.size(); ++i) EXPECT_EQ(held[i], i == own ? 0 : free[i]);
    EXPECT_GT(std::abs(free[own]), 0.1);
}

}  // namespace
}  // namespace simflex
