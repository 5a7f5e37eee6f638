// Reactions of statically determinate structures of flexible parts. For stiff parts they match
// rigid statics; for flexible parts they balance the loads at their displaced positions.

#include <gtest/gtest.h>

#include "validation/BrickParts.h"
#include "validation/SimplySupportedBeam.h"

namespace simflex::test {
namespace {

using namespace SimTK;

constexpr Real kPrecision = 1e-9;

const std::shared_ptr<const ReducedBody>& getBeam() {
    static const auto part = reduceBrick({}, 30);
    return part;
}

std::shared_ptr<const ReducedBody> makeStiff(const std::shared_ptr<const ReducedBody>& part) {
    return std::make_shared<const ReducedBody>(part->withScaledStiffness(1e8));
}

/** Returns (torque, force) about the origin of a load at p. **/
SpatialVec shiftToOrigin(const SpatialVec& load, const Vec3& p) {
    return {load[0] + p % load[1], load[1]};
}

const Vec3 kGravity(3, -9, 2);
const SpatialVec kLoad(Vec3(0.7, -0.4, 1.1), Vec3(4, -11, 6));

// Weight W at L/2, load P and moment M at r. About the pin: LB + ½L Wy + (r × P + M)z = 0.
TEST(Reactions, SimplySupportedBeamCarriesItsLoadByTheLever) {
    const std::vector<int>& nodes = getBeam()->mesh.nodeNumbers;
    for (const size_t which : {nodes.size() / 5, nodes.size() / 2, nodes.size() - 1}) {
        SimplySupportedBeam model(makeStiff(getBeam()), kGravity, nodes[which], kLoad);
        model.solve();
        const Vec3 W = getBeam()->mass * kGravity, P = kLoad[1];
        const Real L = 0.2;
        const Vec3 r = model.calcUndeformedNode(nodes[which]);
        const SpatialVec total(r % P + kLoad[0] + Vec3(L / 2, 0, 0) % W, P + W);
        const Vec3 B(0, -total[0][2] / L, 0);
        const Vec3 A = -total[1] - B, moment = -total[0] - Vec3(L, 0, 0) % B;

        const SpatialVec pin = model.calcReaction(model.pin),
                         roller = model.calcReaction(model.roller);
        const Real force = P.norm() + W.norm();
        EXPECT_LT((roller[1] - B).norm(), kPrecision * force);
        EXPECT_LT((pin[1] - A).norm(), kPrecision * force);
        EXPECT_LT(roller[0].norm(), kPrecision * force * L);
        EXPECT_LT((pin[0] - moment).norm(), kPrecision * force * L);
    }
}

TEST(Reactions, OfABentBeamBalanceTheLoadsWhereTheyHaveMovedTo) {
    const int node = getBeam()->mesh.nodeNumbers[getBeam()->mesh.nodeNumbers.size() / 2];
    const SpatialVec load = 100 * kLoad;
    SimplySupportedBeam model(getBeam(), kGravity, node, load);
    model.equilibrium.setTolerance(1e-13);
    model.solve();
    const State& state = model.equilibrium.getState();
    EXPECT_GT(model.beam.calcLargestDisplacement(state), 1e-4);
    const auto placeOf = [&](const Attachment& frame) { return frame.calcMotion(state).X.p(); };
    const SpatialVec total =
        shiftToOrigin(load, placeOf(model.beam.node(node))) +
        shiftToOrigin(SpatialVec(Vec3(0), getBeam()->mass * kGravity),
                      model.beam.getFramePose(state).p()) +
        shiftToOrigin(model.calcReaction(model.pin), placeOf(model.pin.getFrameM())) +
        shiftToOrigin(model.calcReaction(model.roller), placeOf(model.roller.getFrameM()));
    EXPECT_LT(total[1].norm(), kPrecision * load[1].norm());
    EXPECT_LT(total[0].norm(), kPrecision * load[0].norm());
    EXPECT_LT(std::abs(model.calcReaction(model.pin)[0][2]), kPrecision * load[0].norm());
}

/** A wall crane: a level jib on a pin at the wall, held at its end by a stay from the wall above.

    B (0, h)
    |  \   stay
    |     \
    A ----- C (L, 0), load
       jib                     **/
struct WallCrane {
    static constexpr Real L = 0.2, h = 0.15;
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody jib, stay;
    Joint::Pin wall, end;
    Joint::PointOnLine top;  ///< free along z: the pins hold the stay upright
    StaticEquilibrium equilibrium{system};

    explicit WallCrane(const Vec3& load)
        : jib(flexible, makeStiff(getBeam()), "jib"),
          stay(flexible, makeStiff(getStay()), "stay"),
          wall(flexible, matter.Ground(), jib.interface("left"), "wall"),
          end(flexible, jib.interface("right"), stay.interface("right"), "end"),
          top(flexible, Attachment(matter.Ground(), Transform(Vec3(0, h, -0.03))),
              stay.interface("left"), "top") {
        AttachmentForce(flexible, jib.interface("right"), SpatialVec(Vec3(0), load));
        State state = system.realizeTopology();
        jib.setPoseByInterface(state, "left", Transform());
        stay.setPoseByInterface(state, "left",
                                Transform(Rotation(-std::atan2(h, L), ZAxis), Vec3(0, h, 0)));
        equilibrium.solve(state);
    }

    static const std::shared_ptr<const ReducedBody>& getStay() {
        static const auto part = [] {
            simflex::testing::Brick brick;
            brick.size = {std::hypot(L, h), 0.01, 0.01};
            return reduceBrick(brick, 30);
        }();
        return part;
    }

    SpatialVec calcReaction(const Joint& joint, Joint::Side on, Joint::Side at,
                            Joint::Axes axes = Joint::Axes::Ground) const {
        return joint.calcReaction(equilibrium.getState(), equilibrium.getMultipliers(joint), on, at,
                                  axes);
    }
};

TEST(Reactions, WallCraneIsHeldAsByRigidStatics) {
    using Side = Joint::Side;
    const Real P = 40, Q = 5;  // down, and across
    const WallCrane crane(Vec3(0, -P, Q));
    const Real L = crane.L, h = crane.h, jib = getBeam()->mass * 9.81,
               stay = crane.getStay()->mass * 9.81;
    // Moments of the whole about A; of the stay about C; forces on the whole.
    const Real Bx = -(P * L + (jib + stay) * L / 2) / h, By = stay / 2 - Bx * h / L;
    const Real force = P + jib;
    const auto expectNear = [&](const SpatialVec& found, const Vec3& torque, const Vec3& expected) {
        EXPECT_LT((found[1] - expected).norm(), kPrecision * force) << found[1];
        EXPECT_LT((found[0] - torque).norm(), kPrecision * force * L) << found[0];
    };
    expectNear(crane.calcReaction(crane.top, Side::M, Side::M), Vec3(0), Vec3(Bx, By, 0));
    expectNear(crane.calcReaction(crane.wall, Side::M, Side::M), Vec3(0, Q * L, 0),
               Vec3(-Bx, P + jib + stay - By, -Q));
    expectNear(crane.calcReaction(crane.end, Side::M, Side::M), Vec3(0), Vec3(-Bx, stay - By, 0));
    // The jib carries half its own weight at the wall.
    EXPECT_NEAR(P + jib + stay - By, jib / 2, 1e-12 * force);
}

TEST(Reactions, AreOppositeOnBothSidesAndTheSameInEveryFrame) {
    using Side = Joint::Side;
    using Axes = Joint::Axes;
    const WallCrane crane(Vec3(3, -40, 5));
    for (const Joint& joint : {Joint(crane.wall), Joint(crane.end), Joint(crane.top)}) {
        const FrameMotion F = joint.getFrameF().calcMotion(crane.equilibrium.getState()),
                          M = joint.getFrameM().calcMotion(crane.equilibrium.getState());
        const SpatialVec onM = crane.calcReaction(joint, Side::M, Side::M);
        const Real force = onM[1].norm(), moment = force * crane.L;
        for (const Side at : {Side::F, Side::M}) {
            const Vec3 arm = M.X.p() - (at == Side::F ? F.X.p() : M.X.p());
            const SpatialVec expected(onM[0] + arm % onM[1], onM[1]);
            for (const Axes axes : {Axes::Ground, Axes::F, Axes::M}) {
                const Rotation R = axes == Axes::F   ? F.X.R()
                                   : axes == Axes::M ? M.X.R()
                                                     : Rotation();
                const SpatialVec a = crane.calcReaction(joint, Side::M, at, axes),
                                 b = crane.calcReaction(joint, Side::F, at, axes);
                EXPECT_LT((R * a[1] - expected[1]).norm(), kPrecision * force);
                EXPECT_LT((R * a[0] - expected[0]).norm(), kPrecision * moment);
                EXPECT_LT((a[1] + b[1]).norm(), kPrecision * force);
                EXPECT_LT((a[0] + b[0]).norm(), kPrecision * moment);
            }
        }
    }
}

}  // namespace
}  // namespace simflex::test
