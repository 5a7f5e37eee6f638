/** @file
Joint errors, their derivatives and Jacobians along random motions of two frames, against finite
differences. **/

#include <gtest/gtest.h>

#include <random>

#include "simflex/body/JointEquations.h"

namespace simflex::test {
namespace {

using SimTK::Real;
using SimTK::Rotation;
using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::UnitVec3;
using SimTK::Vec3;

/** A frame that rotates about two axes at varying rates and moves along a cubic, with exact
velocity and acceleration. **/
class MovingFrame {
public:
    explicit MovingFrame(std::mt19937& random)
        : m_first(makeVec3(random)),
          m_second(makeVec3(random)),
          m_R0(0.8, UnitVec3(makeVec3(random))),
          m_phi(makeVec3(random)),
          m_psi(makeVec3(random)) {
        for (Vec3& coefficient : m_p) coefficient = makeVec3(random);
    }

    FrameMotion at(Real t) const {
        const Real phi = evaluate(m_phi, t), phiDot = evaluateRate(m_phi, t),
                   phiDotDot = 2 * m_phi[2];
        const Real psi = evaluate(m_psi, t), psiDot = evaluateRate(m_psi, t),
                   psiDotDot = 2 * m_psi[2];
        const Rotation outer(phi, m_first);
        const Vec3 n1(m_first), n2 = outer * Vec3(m_second);
        FrameMotion frame;
        frame.X = Transform(outer * Rotation(psi, m_second) * m_R0,
                            m_p[0] + t * (m_p[1] + t * (m_p[2] + t * m_p[3])));
        frame.V = {n1 * phiDot + n2 * psiDot, m_p[1] + t * (2 * m_p[2] + 3 * t * m_p[3])};
        frame.A = {n1 * phiDotDot + n2 * psiDotDot + (n1 * phiDot) % (n2 * psiDot),
                   2 * m_p[2] + 6 * t * m_p[3]};
        return frame;
    }

private:
    static Vec3 makeVec3(std::mt19937& random) {
        std::uniform_real_distribution<double> unit(-1, 1);
        const double x = unit(random), y = unit(random), z = unit(random);
        return {x, y, z};
    }
    static Real evaluate(const Vec3& c, Real t) { return c[0] + t * (c[1] + t * c[2]); }
    static Real evaluateRate(const Vec3& c, Real t) { return c[1] + 2 * t * c[2]; }

    UnitVec3 m_first, m_second;
    Rotation m_R0;
    Vec3 m_phi, m_psi, m_p[4];
};

/** F and M, or more frames for a coupler. **/
class Frames {
public:
    Frames(std::initializer_list<FrameMotion> motions) : Frames(std::vector(motions)) {}
    explicit Frames(std::vector<FrameMotion> motions) : m_motions(std::move(motions)) {
        for (const FrameMotion& motion : m_motions) m_frames.push_back(&motion);
    }
    Frames(const Transform& F, const Transform& M) : Frames({FrameMotion{F}, FrameMotion{M}}) {}
    Frames(const Frames&) = delete;
    Frames& operator=(const Frames&) = delete;

    operator JointEquations::Frames() const { return m_frames.data(); }
    const FrameMotion& operator[](int i) const { return m_motions[size_t(i)]; }

private:
    std::vector<FrameMotion> m_motions;
    std::vector<const FrameMotion*> m_frames;
};

struct JointCase {
    const char* name;
    JointEquations equations;
    int numEquations;
    Real period = 0;  ///< jump period of an error
};

void PrintTo(const JointCase& tested, std::ostream* out) {
    *out << tested.name;
}

JointEquations makeRotation() {
    // A rate, and so an angle, that grows beyond half a turn.
    return JointEquations::makePrescribedRotation(
        [](Real t) { return Vec3(1 + 40 * t + 0.5 * t * t, 40 + t, 1); });
}

JointEquations makeGear(int teethA, int teethB) {
    const auto angle = JointCoordinate::makeAngleAboutZ();
    return JointEquations::makeCoupler("Gear", {angle, angle}, {1, Real(teethB) / teethA}, 0.05,
                                       2 * SimTK::Pi / teethA);
}

/** Every kind of coordinate, each between separate frames. **/
JointEquations makeCoupler() {
    const JointEquations universal = JointEquations::makeUniversal();
    return JointEquations::makeCoupler(
        "Coupler",
        {universal.getCoordinate(0), JointCoordinate::makeDisplacement(1),
         JointEquations::makeScrew(0.3).getCoordinate(0), universal.getCoordinate(1)},
        {2, 0.7, -3, 1}, 0.4, 2 * SimTK::Pi);
}

/** Rotates at a growing rate about a fixed axis, not aligned with the frame, and translates. **/
FrameMotion poseAt(Real t) {
    const UnitVec3 axis(1, -2, 0.5);
    FrameMotion pose;
    pose.X = Transform(Rotation(0.3 + 2 * t + t * t, axis) * Rotation(0.4, SimTK::XAxis),
                       Vec3(t * t, std::cos(t), 1 - 2 * t));
    pose.V = {(2 + 2 * t) * Vec3(axis), Vec3(2 * t, -std::sin(t), -2)};
    pose.A = {2 * Vec3(axis), Vec3(2, -std::cos(t), 0)};
    return pose;
}

class JointEquationsTest : public ::testing::TestWithParam<JointCase> {
protected:
    using Values = std::array<Real, JointEquations::MaxEquations>;

    JointEquationsTest() {
        for (int i = 0; i < GetParam().equations.getNumFrames(); ++i) moving.emplace_back(random);
    }

    Frames framesAt(Real t) const {
        std::vector<FrameMotion> motions;
        for (const MovingFrame& frame : moving) motions.push_back(frame.at(t));
        return Frames(std::move(motions));
    }
    std::vector<SpatialVec> jacobianAt(Real t) const {
        std::vector<SpatialVec> D(moving.size() * size_t(m));
        GetParam().equations.calcJacobian(GetParam().equations.calcDrive(t), framesAt(t), D.data());
        return D;
    }
    Values errorsAt(Real t) const {
        Values values{};
        GetParam().equations.calcErrors(GetParam().equations.calcDrive(t), framesAt(t),
                                        values.data());
        return values;
    }
    Values errorDotsAt(Real t) const {
        Values values{};
        GetParam().equations.calcErrorDots(GetParam().equations.calcDrive(t), framesAt(t),
                                           values.data());
        return values;
    }

    std::mt19937 random{2024};
    std::vector<MovingFrame> moving;
    const int m = GetParam().equations.getNumEquations();
    const std::vector<Real> times{-0.7, -0.2, 0.05, 0.4, 0.9};
};

constexpr Real Pitch = 0.3;

INSTANTIATE_TEST_SUITE_P(
    Joints, JointEquationsTest,
    ::testing::Values(
        JointCase{"Ball", JointEquations::makeBall(), 3},
        JointCase{"Pin", JointEquations::makePin(), 5},
        JointCase{"Slider", JointEquations::makeSlider(), 5},
        JointCase{"Weld", JointEquations::makeWeld(), 6},
        JointCase{"Cylinder", JointEquations::makeCylinder(), 4},
        JointCase{"Universal", JointEquations::makeUniversal(), 4},
        JointCase{"Planar", JointEquations::makePlanar(), 3},
        JointCase{"Screw", JointEquations::makeScrew(Pitch), 5, 2 * SimTK::Pi* Pitch},
        JointCase{"PointOnLine", JointEquations::makePointOnLine(), 2},
        JointCase{"PointInPlane", JointEquations::makePointInPlane(), 1},
        JointCase{"Rod", JointEquations::makeRod(0.7), 1},
        JointCase{"PrescribedRotation", makeRotation(), 1, 2 * SimTK::Pi},
        JointCase{"PrescribedTranslation",
                  JointEquations::makePrescribedTranslation(SimTK::YAxis,
                                                            [](Real time) {
                                                                return Vec3(
                                                                    std::sin(3 * time),
                                                                    3 * std::cos(3 * time),
                                                                    -9 * std::sin(3 * time));
                                                            }),
                  1},
        JointCase{"PrescribedPosition", JointEquations::makePrescribedPosition([](Real time) {
                      return std::array<Vec3, 3>{Vec3(time * time, std::cos(time), 1 - 2 * time),
                                                 Vec3(2 * time, -std::sin(time), -2),
                                                 Vec3(2, -std::cos(time), 0)};
                  }),
                  3},
        JointCase{"PrescribedPose", JointEquations::makePrescribedPose(poseAt), 6},
        JointCase{"Gear", makeGear(17, -43), 1, 2 * SimTK::Pi / 17},
        JointCase{"Coupler", makeCoupler(), 1, 2 * SimTK::Pi}),
    [](const auto& tested) { return std::string(tested.param.name); });

TEST_P(JointEquationsTest, HasItsNumberOfEquations) {
    EXPECT_EQ(m, GetParam().numEquations);
    EXPECT_STREQ(GetParam().equations.getKind(), GetParam().name);
}

TEST_P(JointEquationsTest, ErrorDotsAreDerivativesOfErrors) {
    const Real h = 3e-4;
    for (const Real t : times) {
        const Values dots = errorDotsAt(t);
        for (int k = 0; k < m; ++k) {
            const auto wrap = [&](Real difference) {  // an angle may jump by a turn in between
                const Real period = GetParam().period;
                return period > 0 ? std::remainder(difference, period) : difference;
            };
            const Real expected = (8 * wrap(errorsAt(t + h)[k] - errorsAt(t - h)[k]) -
                                   wrap(errorsAt(t + 2 * h)[k] - errorsAt(t - 2 * h)[k])) /
                                  (12 * h);
            EXPECT_NEAR(dots[k], expected, 1e-9 * (1 + std::abs(expected)))
                << "t " << t << " row " << k;
        }
    }
}

TEST_P(JointEquationsTest, ErrorDotDotsAreDerivativesOfErrorDots) {
    const Real h = 3e-4;
    for (const Real t : times) {
        Values dotDots{};
        GetParam().equations.calcErrorDotDots(GetParam().equations.calcDrive(t), framesAt(t),
                                              dotDots.data());
        for (int k = 0; k < m; ++k) {
            const Real expected = (8 * (errorDotsAt(t + h)[k] - errorDotsAt(t - h)[k]) -
                                   (errorDotsAt(t + 2 * h)[k] - errorDotsAt(t - 2 * h)[k])) /
                                  (12 * h);
            EXPECT_NEAR(dotDots[k], expected, 1e-9 * (1 + std::abs(expected)))
                << "t " << t << " row " << k;
        }
    }
}

TEST_P(JointEquationsTest, JacobianTimesVelocitiesAndTimeRateGiveErrorDots) {
    for (const Real t : times) {
        const Frames frames = framesAt(t);
        const std::vector<SpatialVec> D = jacobianAt(t);
        const Values expected = errorDotsAt(t);
        Values actual{};
        for (int i = 0; i < int(moving.size()); ++i)
            for (int k = 0; k < m; ++k) {
                const SpatialVec& d = D[size_t(i * m + k)];
                actual[k] += ~d[0] * frames[i].V[0] + ~d[1] * frames[i].V[1];
            }
        GetParam().equations.addInTimeRate(GetParam().equations.calcDrive(t), frames,
                                           actual.data());
        for (int k = 0; k < m; ++k)
            EXPECT_NEAR(actual[k], expected[k], 1e-13 * (1 + std::abs(expected[k])))
                << "t " << t << " row " << k;
    }
}

/** A rigid motion of both frames changes no joint error and no coordinate: their forces
balance. **/
TEST_P(JointEquationsTest, ForcesOnBothFramesAreInBalance) {
    for (const Real t : times) {
        const Frames frames = framesAt(t);
        const std::vector<SpatialVec> D = jacobianAt(t);
        for (int pair = 0; pair < int(moving.size()); pair += 2)
            for (int k = 0; k < m; ++k) {
                const SpatialVec &D_F = D[size_t(pair * m + k)],
                                 &D_M = D[size_t((pair + 1) * m + k)];
                const Vec3 f = frames[pair].X.p(), g = frames[pair + 1].X.p();
                const Vec3 force = D_F[1] + D_M[1];
                const Vec3 torque = D_F[0] + f % D_F[1] + D_M[0] + g % D_M[1];
                EXPECT_LT(force.norm(), 1e-15);
                // A coincidence row pushes two points apart: the forces balance once the points
                // coincide.
                const bool coincides = D_F[0].norm() == 0 && D_M[0].norm() == 0;
                const Vec3 leverage = coincides ? (g - f) % D_M[1] : Vec3(0);
                EXPECT_LT((torque - leverage).norm(), 2e-14);
            }
    }
}

TEST(JointBranchTest, ErrorsVanishForTheMotionEachJointAllows) {
    const Transform F(Rotation(0.6, UnitVec3(1, 2, 3)), Vec3(1, -2, 0.5));
    const auto largestError = [&](const JointEquations& equations, const Transform& X_FM) {
        Real errors[JointEquations::MaxEquations], largest = 0;
        equations.calcErrors({}, Frames(F, F * X_FM), errors);
        for (int k = 0; k < equations.getNumEquations(); ++k)
            largest = std::max(largest, std::abs(errors[k]));
        return largest;
    };
    const Rotation aboutZ(1.1, SimTK::ZAxis), any(1.1, UnitVec3(1, -1, 2));
    EXPECT_LT(largestError(JointEquations::makeBall(), Transform(any)), 1e-15);
    EXPECT_LT(largestError(JointEquations::makePin(), Transform(aboutZ)), 1e-15);
    EXPECT_GT(largestError(JointEquations::makePin(), Transform(any)), 0.1);
    EXPECT_LT(largestError(JointEquations::makeSlider(), Transform(Vec3(0.7, 0, 0))), 1e-15);
    EXPECT_GT(largestError(JointEquations::makeSlider(), Transform(Vec3(0, 0.7, 0))), 0.1);
    EXPECT_GT(largestError(JointEquations::makeSlider(), Transform(aboutZ)), 0.1);
    EXPECT_LT(largestError(JointEquations::makeWeld(), Transform()), 1e-15);
    EXPECT_GT(largestError(JointEquations::makeWeld(), Transform(Vec3(0.7, 0, 0))), 0.1);

    const auto cylinder = JointEquations::makeCylinder(), planar = JointEquations::makePlanar();
    EXPECT_LT(largestError(cylinder, Transform(aboutZ, Vec3(0, 0, 0.7))), 1e-15);
    EXPECT_GT(largestError(cylinder, Transform(Vec3(0.7, 0, 0))), 0.1);
    EXPECT_LT(largestError(planar, Transform(aboutZ, Vec3(0.7, -2, 0))), 1e-15);
    EXPECT_GT(largestError(planar, Transform(Vec3(0, 0, 0.7))), 0.1);
    const Rotation crossed(SimTK::BodyRotationSequence, 2.5, SimTK::XAxis, -1.9, SimTK::YAxis);
    EXPECT_LT(largestError(JointEquations::makeUniversal(), Transform(crossed)), 1e-15);
    EXPECT_GT(largestError(JointEquations::makeUniversal(), Transform(aboutZ)), 0.1);
    EXPECT_FALSE(JointEquations::makeUniversal().isFlipped({}, Frames(F, F * Transform(crossed))));
    const Transform along(any, Vec3(0, 0, 0.7)), across(any, Vec3(0.3, 0.4, 0));
    EXPECT_LT(largestError(JointEquations::makePointOnLine(), along), 1e-15);
    EXPECT_GT(largestError(JointEquations::makePointOnLine(), across), 0.1);
    EXPECT_LT(largestError(JointEquations::makePointInPlane(), across), 1e-15);
    EXPECT_GT(largestError(JointEquations::makePointInPlane(), along), 0.1);
    EXPECT_LT(largestError(JointEquations::makeRod(0.5), across), 1e-15);
    EXPECT_GT(largestError(JointEquations::makeRod(0.5), along), 0.1);
}

TEST(JointBranchTest, ScrewHoldsAndCountsAnyTurn) {
    for (const Real pitch : {0.02, -0.3})
        for (const Real angle : {-200.0, -3.2, 0.4, 3.1, 6.5, 1000.0}) {
            const auto screw = JointEquations::makeScrew(pitch);
            const Transform M(Rotation(angle, SimTK::ZAxis), Vec3(0, 0, pitch * angle));
            Real errors[JointEquations::MaxEquations], counted = 0;
            screw.calcErrors({}, Frames(Transform(), M), errors);
            EXPECT_NEAR(errors[4], 0, 1e-12) << pitch << " " << angle;
            screw.calcCoordinates(Frames(Transform(), M), &counted);
            EXPECT_NEAR(counted, angle, 1e-10);
            // A gap of half a millimetre gives an error of half a millimetre.
            screw.calcErrors({}, Frames(Transform(), Transform(M.R(), M.p() + Vec3(0, 0, 5e-4))),
                             errors);
            EXPECT_NEAR(errors[4], 5e-4, 1e-12);
        }
}

/** The coordinates and rates match those of Simbody's mobilizers of the same names. **/
TEST(JointCoordinates, AreSimbodysMobilizers) {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter(system);
    const SimTK::Body::Rigid body(SimTK::MassProperties(1, Vec3(0), SimTK::Inertia(1)));
    auto& ground = matter.Ground();
    const std::vector<std::pair<JointEquations, SimTK::MobilizedBody>> pairs{
        {JointEquations::makePin(), SimTK::MobilizedBody::Pin(ground, body)},
        {JointEquations::makeSlider(), SimTK::MobilizedBody::Slider(ground, body)},
        {JointEquations::makeCylinder(), SimTK::MobilizedBody::Cylinder(ground, body)},
        {JointEquations::makeUniversal(), SimTK::MobilizedBody::Universal(ground, body)},
        {JointEquations::makePlanar(), SimTK::MobilizedBody::Planar(ground, body)},
        {JointEquations::makeScrew(Pitch), SimTK::MobilizedBody::Screw(ground, body, Pitch)}};
    SimTK::State state = system.realizeTopology();
    for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 1.1 - 0.31 * i;
    for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = std::sin(7.0 * i + 1);
    system.realize(state, SimTK::Stage::Velocity);
    for (const auto& [equations, mobod] : pairs) {
        FrameMotion M;
        M.X = mobod.getBodyTransform(state);
        M.V = mobod.getBodyVelocity(state);
        const Frames frames{FrameMotion(), M};
        Real errors[JointEquations::MaxEquations], q[3], qDot[3];
        equations.calcErrors({}, frames, errors);
        for (int k = 0; k < equations.getNumEquations(); ++k) EXPECT_NEAR(errors[k], 0, 1e-15);
        ASSERT_EQ(equations.getNumCoordinates(), mobod.getNumQ(state)) << equations.getKind();
        EXPECT_EQ(equations.getNumEquations(), 6 - mobod.getNumU(state));
        equations.calcCoordinates(frames, q);
        equations.calcCoordinateDots(frames, qDot);
        for (int i = 0; i < mobod.getNumQ(state); ++i) {
            EXPECT_NEAR(q[i], mobod.getOneQ(state, i), 1e-14) << equations.getKind() << i;
            EXPECT_NEAR(qDot[i], mobod.getQDotAsVector(state)[i], 1e-14) << equations.getKind();
        }
    }
}

/** Every rotation with vanishing errors, found among the 24 that map axes onto axes, is
distinguished from the correct one. **/
TEST(JointBranchTest, WrongBranchesAreFlipped) {
    const Transform F(Rotation(0.6, UnitVec3(1, 2, 3)), Vec3(1, -2, 0.5));
    const JointEquations joints[] = {
        JointEquations::makePin(), JointEquations::makeSlider(), JointEquations::makeWeld(),
        JointEquations::makePrescribedPose([](Real) { return FrameMotion(); })};
    for (const JointEquations& joint : joints)
        for (int x = 0; x < 6; ++x)
            for (int y = 0; y < 6; ++y) {
                if (x % 3 == y % 3) continue;
                Vec3 columnX(0), columnY(0);
                columnX[x % 3] = x < 3 ? 1 : -1;
                columnY[y % 3] = y < 3 ? 1 : -1;
                const Rotation R(UnitVec3(columnX), SimTK::XAxis, columnY, SimTK::YAxis);
                Real errors[JointEquations::MaxEquations], largest = 0;
                joint.calcErrors({}, Frames(F, F * Transform(R)), errors);
                for (int k = 0; k < joint.getNumEquations(); ++k)
                    largest = std::max(largest, std::abs(errors[k]));
                if (largest > 1e-12) continue;
                const bool isRight = joint.getKind() == std::string("Pin")
                                         ? R.col(2)[2] > 0.5
                                         : R.col(0)[0] > 0.5 && R.col(1)[1] > 0.5;
                EXPECT_EQ(joint.isFlipped({}, Frames(F, F * Transform(R))), !isRight)
                    << joint.getKind() << R;
            }
}

TEST(JointBranchTest, PrescribedRotationErrorIsWrappedToHalfATurn) {
    const JointEquations equations =
        JointEquations::makePrescribedRotation([](Real t) { return Vec3(10 * t, 10, 0); });
    for (const Real t : {0.0, 0.3, 0.31416, 1.0, 100.0}) {
        Real error = 7;
        equations.calcErrors(equations.calcDrive(t),
                             Frames(Transform(), Transform(Rotation(10 * t + 0.25, SimTK::ZAxis))),
                             &error);
        EXPECT_NEAR(error, 0.25, 1e-12);
    }
}

/** Wheels that have rotated by any number of turns in the ratio of their teeth mesh; a lead by a
fraction of a tooth is the error. **/
TEST(CouplerEquations, GearsCountTeethThroughAnyNumberOfTurns) {
    const JointEquations gear = makeGear(17, 43);
    const auto errorAt = [&](Real a, Real b) {
        Real error = 7;
        const FrameMotion F, A{Rotation(a, SimTK::ZAxis)}, B{Rotation(b, SimTK::ZAxis)};
        gear.calcErrors({}, Frames{F, A, F, B}, &error);
        return error;
    };
    const Real tooth = 2 * SimTK::Pi / 17;
    for (const Real a : {0.0, 1.5, -40.0, 777.7, 5000.0}) {
        const Real b = (0.05 * 17 - 17 * a) / 43;
        EXPECT_NEAR(errorAt(a, b), 0, 1e-11) << a;
        EXPECT_NEAR(errorAt(a + 0.3 * tooth, b), 0.3 * tooth, 1e-11) << a;
        EXPECT_NEAR(errorAt(a - 0.7 * tooth, b), 0.3 * tooth, 1e-11) << a;
    }
}

}  // namespace
}  // namespace simflex::test
