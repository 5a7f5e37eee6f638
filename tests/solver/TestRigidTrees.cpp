// Rigid trees inside BdfIntegrator against plain Simbody: the same system with Runge–Kutta–Merson.

#include <gtest/gtest.h>

#include "simflex/body/Joint.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/elimination/NewtonCombination.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equations/TreeInertias.h"

namespace simflex {
namespace {

using namespace SimTK;

Body::Rigid makeBrick(Real mass) {
    return Body::Rigid(
        MassProperties(mass, Vec3(0.05, -0.02, 0.03),
                       Inertia(mass * Vec3(0.02, 0.03, 0.025), mass * Vec3(1e-3, -2e-3, 5e-4))));
}

/** Builds the tree under test; `matter` belongs to a system with gravity. **/
using Build = void (*)(SimbodyMatterSubsystem&, GeneralForceSubsystem&);

void buildSimpleMobilizers(SimbodyMatterSubsystem& matter, GeneralForceSubsystem&) {
    MobilizedBody::Pin pin(matter.Ground(), Transform(Rotation(0.3, XAxis), Vec3(0.1, 0, 0)),
                           makeBrick(1), Transform(Vec3(0, 0.3, 0)));
    MobilizedBody::Slider slider(pin, Transform(Rotation(0.4, YAxis), Vec3(0, -0.3, 0)),
                                 makeBrick(0.5), Transform());
    MobilizedBody::Ball ball(slider, Transform(Vec3(0.1, 0, 0)), makeBrick(0.7),
                             Transform(Vec3(0, 0.2, 0)));
    MobilizedBody::Cylinder cylinder(ball, Transform(Vec3(0, -0.2, 0)), makeBrick(0.4),
                                     Transform(Vec3(0, 0.1, 0)));
    MobilizedBody::Weld weld(pin, Transform(Rotation(0.5, ZAxis), Vec3(0.2, 0, 0)), makeBrick(0.3),
                             Transform());
    MobilizedBody::Translation translation(weld, Transform(Rotation(1, XAxis)), makeBrick(0.2),
                                           Transform());
    MobilizedBody::Free free(matter.Ground(), Transform(Rotation(0.2, YAxis)), makeBrick(1.5),
                             Transform(Vec3(0.1, 0, 0)));
}

void buildOtherMobilizers(SimbodyMatterSubsystem& matter, GeneralForceSubsystem&) {
    MobilizedBody::Universal universal(matter.Ground(), Transform(Vec3(0.1, 0, 0)), makeBrick(1),
                                       Transform(Vec3(0, 0.3, 0)));
    MobilizedBody::Gimbal gimbal(universal, Transform(Vec3(0, -0.3, 0)), makeBrick(0.8),
                                 Transform(Vec3(0, 0.2, 0)));
    MobilizedBody::Planar planar(gimbal, Transform(Rotation(0.3, YAxis)), makeBrick(0.6),
                                 Transform());
    MobilizedBody::Screw screw(matter.Ground(), Transform(Rotation(1, XAxis)), makeBrick(0.5),
                               Transform(), 0.05);
    MobilizedBody::LineOrientation line(matter.Ground(), Transform(Vec3(0, 0.2, 0)), makeBrick(0.5),
                                        Transform());
    MobilizedBody::Pin reversed(screw, Transform(Vec3(0, 0.1, 0)), makeBrick(0.4),
                                Transform(Vec3(0.3, 0, 0)), MobilizedBody::Reverse);
}

void buildWithSprings(SimbodyMatterSubsystem& matter, GeneralForceSubsystem& forces) {
    MobilizedBody::Pin pin(matter.Ground(), Transform(), makeBrick(1), Transform(Vec3(0, 0.3, 0)));
    MobilizedBody::Ball ball(pin, Transform(Vec3(0, -0.3, 0)), makeBrick(0.7),
                             Transform(Vec3(0, 0.2, 0)));
    Force::TwoPointLinearSpring(forces, matter.Ground(), Vec3(0.5, 0, 0), ball, Vec3(0), 30, 0.3);
    Force::MobilityLinearDamper(forces, pin, MobilizerUIndex(0), 0.2);
    Force::MobilityLinearSpring(forces, pin, MobilizerQIndex(0), 4, 0.1);
}

enum class Rotations { Quaternions, EulerAngles };

void expectSameMotion(Build build, Rotations rotations = Rotations::Quaternions) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, Vec3(1, -9.81, 2));
    build(matter, forces);
    State state = system.realizeTopology();
    matter.setUseEulerAngles(state, rotations == Rotations::EulerAngles);
    system.realizeModel(state);
    for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = 0.4 * std::cos(1.7 * i);
    system.realize(state, Stage::Velocity);

    RungeKuttaMersonIntegrator reference(system);
    reference.setAccuracy(1e-9);
    TimeStepper stepper(system, reference);
    stepper.initialize(state);
    stepper.stepTo(0.3);

    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-8);
    integrator.setMaximumOrder(4);
    integrator.initialize(state);

    // Initial accelerations are Simbody's.
    State start = integrator.getState();
    system.realize(start, Stage::Acceleration);
    const Vector uDot = integrator.getUDot();
    EXPECT_LT((uDot - start.getUDot()).normInf(), 1e-9 * (1 + start.getUDot().normInf()));

    integrator.stepTo(0.3);
    State ours = integrator.getState();
    State theirs = stepper.getState();
    system.realize(ours, Stage::Velocity);
    system.realize(theirs, Stage::Velocity);
    for (MobilizedBodyIndex i(1); i < matter.getNumBodies(); ++i) {
        const MobilizedBody& body = matter.getMobilizedBody(i);
        const Transform a = body.getBodyTransform(ours), b = body.getBodyTransform(theirs);
        EXPECT_LT((a.p() - b.p()).norm(), 2e-6) << "body " << int(i);
        EXPECT_LT((a.R().asMat33() - b.R().asMat33()).norm(), 2e-5) << "body " << int(i);
    }
}

TEST(RigidTrees, SimpleMobilizersMoveAsInSimbody) {
    expectSameMotion(buildSimpleMobilizers);
}
TEST(RigidTrees, EulerAnglesMoveAsInSimbody) {
    expectSameMotion(buildSimpleMobilizers, Rotations::EulerAngles);
}
TEST(RigidTrees, OtherAndReversedMobilizersMoveAsInSimbody) {
    expectSameMotion(buildOtherMobilizers);
}
TEST(RigidTrees, ForeignForceElementsActAsInSimbody) {
    expectSameMotion(buildWithSprings);
}

TEST(RigidTrees, FreeRigidPendulumOnABallJointMovesAsABallMobilizer) {
    const Vec3 hook(0, 0.4, 0.1);
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    MobilizedBody::Free free(matter.Ground(), makeBrick(1));
    const Joint::Ball joint(flexible, matter.Ground(), Attachment(free, Transform(hook)));
    State state = system.realizeTopology();
    const Rotation tilt(0.7, ZAxis);
    free.setQToFitTransform(state, Transform(tilt, -(tilt * hook)));
    BdfIntegrator integrator(system);
    integrator.setAccuracy(1e-9);
    integrator.setMaximumOrder(3);
    integrator.initialize(state);
    integrator.stepTo(0.5);

    MultibodySystem plain;
    SimbodyMatterSubsystem plainMatter(plain);
    GeneralForceSubsystem plainForces(plain);
    Force::Gravity plainGravity(plainForces, plainMatter, -YAxis, 9.81);
    MobilizedBody::Ball ball(plainMatter.Ground(), Transform(), makeBrick(1), Transform(hook));
    State plainState = plain.realizeTopology();
    ball.setQToFitRotation(plainState, tilt);
    RungeKuttaMersonIntegrator reference(plain);
    reference.setAccuracy(1e-9);
    TimeStepper stepper(plain, reference);
    stepper.initialize(plainState);
    stepper.stepTo(0.5);

    State end = stepper.getState();
    plain.realize(end, Stage::Acceleration);
    EXPECT_LT((free.getBodyOriginLocation(integrator.getState()) - ball.getBodyOriginLocation(end))
                  .norm(),
              2e-6);
    // The joint's force on the body equals the mobilizer's reaction.
    Vector_<SpatialVec> reactions;
    plainMatter.calcMobilizerReactionForces(end, reactions);
    const SpatialVec force =
        joint.calcForceOnM(integrator.getState(), integrator.getMultipliers(joint));
    EXPECT_LT((force[1] - reactions[ball.getMobilizedBodyIndex()][1]).norm(),
              1e-3 * reactions[ball.getMobilizedBodyIndex()][1].norm());
}

/** A pendulum arm driven out of its hub, from 1 mm to more than a metre. **/
TEST(RigidTrees, ATelescopeIsControlledByTheLengthThatItHas) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    // The hub's radius of gyration is 2 mm.
    MobilizedBody::Pin hub(matter.Ground(),
                           Body::Rigid(MassProperties(100, Vec3(0), Inertia(2e-4))));
    MobilizedBody::Slider arm(hub, Body::Rigid(MassProperties(1, Vec3(0), Inertia(1e-8))));
    Motion::Steady(arm, 1);
    State state = system.realizeTopology();
    arm.setLength(state, 1e-3);

    // What a step leaves in the angle and the speed goes on by the adjoint of the motion,
    //     J θ̈ = −m g r cos θ − 2 m r ṙ θ̇,  J = I + m r²,  r = 1 mm + t,
    // to a displacement r(2 s) δθ(2 s) at the end.
    constexpr int count = 200000;
    constexpr Real length = 2, h = length / count;
    const auto calcInertia = [](Real t) { return 2e-4 + 1e-8 + square(1e-3 + t); };
    const auto step = [&](Vec2 x, Real t, Real dt, const auto& derive) {
        const Vec2 a = derive(t, x), b = derive(t + dt / 2, x + dt / 2 * a),
                   c = derive(t + dt / 2, x + dt / 2 * b), d = derive(t + dt, x + dt * c);
        return Vec2(x + dt / 6 * (a + 2 * b + 2 * c + d));
    };
    std::vector<Vec2> motion(count + 1, Vec2(0)), effect(count + 1);
    for (int k = 0; k < count; ++k)
        motion[size_t(k + 1)] = step(motion[size_t(k)], k * h, h, [&](Real t, const Vec2& x) {
            const Real r = 1e-3 + t;
            return Vec2(x[1], -(9.81 * r * std::cos(x[0]) + 2 * r * x[1]) / calcInertia(t));
        });
    effect[count] = Vec2(1e-3 + length, 0);
    for (int k = count; k > 0; --k)
        effect[size_t(k - 1)] = step(effect[size_t(k)], k * h, -h, [&](Real t, const Vec2& e) {
            const Real r = 1e-3 + t, J = calcInertia(t);
            const Real angle = motion[size_t(std::min(count, int(std::lround(t / h))))][0];
            return Vec2(-9.81 * r * std::sin(angle) / J * e[1], -e[0] + 2 * r / J * e[1]);
        });
    const Real angle = motion.back()[0];
    const Vec3 exact = (1e-3 + length) * Vec3(std::cos(angle), std::sin(angle), 0);

    for (const Real accuracy : {1e-5, 1e-6, 1e-7, 1e-8}) {
        BdfIntegrator integrator(system);
        integrator.setAccuracy(accuracy);
        // A step may leave r δθ = a, and a speed that would make as much within a step.
        Real bound = 0, before = 0;
        integrator.setStepObserver([&](Real t) {
            const Vec2& e = effect[size_t(std::min(count, int(std::lround(before / h))))];
            bound += accuracy / (1e-3 + before) * (std::abs(e[0]) + std::abs(e[1]) / (t - before));
            before = t;
            return true;
        });
        integrator.initialize(state);
        integrator.stepTo(length);
        const Vec3 end = arm.getBodyOriginLocation(integrator.getState());
        EXPECT_LT((end - exact).norm(), bound) << accuracy;
    }
}

/** Bodies that hang on one another at random, with springs, dampers and two kinds of gravity. **/
struct RandomTree {
    enum class Kinds { All, Balls };

    RandomTree(int seed, int numBodies, Kinds kinds, Rotations rotations) {
        random.setSeed(seed);
        Force::UniformGravity(forces, matter, Vec3(0.3, 2, 1));
        const Force::Gravity gravity(forces, matter, Vec3(1, -9.81, 2));
        Force::GlobalDamper(forces, matter, 0.3);
        std::vector<MobilizedBody> bodies{matter.Ground()};
        for (int k = 0; k < numBodies; ++k) {
            const Real choice = 0.5 * (random.getValue() + 1) * Real(bodies.size());
            bodies.push_back(add(kinds == Kinds::All ? k % 13 : 11, bodies[size_t(choice)]));
        }
        state = system.realizeTopology();
        matter.setUseEulerAngles(state, rotations == Rotations::EulerAngles);
        system.realizeModel(state);
        gravity.setBodyIsExcluded(state, bodies[5], true);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] += 0.5 * random.getValue();
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = random.getValue();
        system.realize(state, Stage::Position);
        matter.normalizeQuaternions(state);
    }

    Vec3 pickVector() {
        const Real x = random.getValue(), y = random.getValue(), z = random.getValue();
        return {x, y, z};
    }
    Transform pickTransform() {
        const Vec3 a = pickVector();
        return {Rotation(BodyRotationSequence, a[0], XAxis, a[1], YAxis, a[2], ZAxis),
                pickVector()};
    }
    MobilizedBody add(int kind, MobilizedBody& parent) {
        const Real m = 1.5 + random.getValue();
        const Vec3 c = 0.3 * pickVector();
        const Body::Rigid body(MassProperties(
            m, c,
            Inertia(m * Vec3(0.3, 0.4, 0.35), 0.05 * m * pickVector()).shiftFromMassCenter(c, m)));
        const Transform F = pickTransform(), M = pickTransform();
        switch (kind) {
            case 0:
                return MobilizedBody::Free(parent, F, body, M);
            case 1:
                return addSpring(MobilizedBody::Pin(parent, F, body, M));
            case 2:
                return addSpring(MobilizedBody::Slider(parent, F, body, M));
            case 3:
                return MobilizedBody::Cylinder(parent, F, body, M);
            case 4:
                return addSpring(MobilizedBody::Screw(parent, F, body, M, 0.2));
            case 5:
                return addSpring(MobilizedBody::Universal(parent, F, body, M));
            case 6:
                return MobilizedBody::Planar(parent, F, body, M);
            case 7:
                return MobilizedBody::BendStretch(parent, F, body, M);
            case 8:
                return addSpring(MobilizedBody::Gimbal(parent, F, body, M));
            case 9:
                return MobilizedBody::Bushing(parent, F, body, M);
            case 10:
                return MobilizedBody::Translation(parent, F, body, M);
            case 11:
                return addSpring(MobilizedBody::Ball(parent, F, body, M));
            default:
                return MobilizedBody::Weld(parent, F, body, M);
        }
    }
    MobilizedBody addSpring(const MobilizedBody& body) {
        Force::MobilityLinearSpring(forces, body, MobilizerQIndex(0), 3, 0.2);
        Force::MobilityLinearDamper(forces, body, MobilizerUIndex(0), 2);
        return body;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Random::Uniform random{-1, 1};
    State state;
};

/** Speeds, accelerations and coordinates of a RandomTree, and evaluations of its equations. **/
class TreeEquations {
public:
    explicit TreeEquations(RandomTree& tree)
        : equations(tree.system, tree.state),
          numU(size_t(equations.getTopology().numU)),
          q(size_t(equations.getTopology().numQ)),
          u(numU),
          uDot(numU) {
        equations.getBlocks().getFromState(tree.state, q.data(), u.data());
        for (double& value : uDot) value = 3 * tree.random.getValue();
    }
    Eigen::VectorXd calcResidual(const std::vector<double>& atQ, const std::vector<double>& atU,
                                 const std::vector<double>& atUDot) {
        Eigen::VectorXd r(numU);
        equations.realize(0, atQ.data(), atU.data());
        equations.calcResidual(atQ.data(), atU.data(), atUDot.data(), nullptr, r.data());
        return r;
    }
    /** Returns J by central differences. **/
    Eigen::MatrixXd calcDifferences(const NewtonFactors& factors) {
        constexpr double h = 1e-5;
        Eigen::MatrixXd J(numU, numU);
        for (size_t j = 0; j < numU; ++j) {
            Eigen::VectorXd ends[2];
            for (int side : {0, 1}) {
                const double change = side == 0 ? -h : h;
                std::vector<double> atQ = q, atU = u, atUDot = uDot, delta(numU, 0);
                delta[j] = factors.stiffness * change;
                equations.getBlocks().displaceQ(delta.data(), atQ.data());
                atU[j] += change;
                atUDot[j] += change / factors.mass;
                ends[side] = calcResidual(atQ, atU, atUDot);
            }
            J.col(Eigen::Index(j)) = (ends[1] - ends[0]) / (2 * h);
        }
        calcResidual(q, u, uDot);
        return J;
    }
    NewtonSystem formSystem(const NewtonFactors& factors) {
        NewtonSystem system = equations.getTopology().makeNewtonSystem();
        equations.formNewtonSystem(factors, false, q.data(), u.data(), uDot.data(), system);
        return system;
    }

    Evaluation equations;
    size_t numU;
    std::vector<double> q, u, uDot;
};

TEST(RigidTrees, DerivativesAreExact) {
    const NewtonFactors factors(0.3, 0.7);
    for (const Rotations rotations : {Rotations::Quaternions, Rotations::EulerAngles})
        for (int seed = 1; seed <= 2; ++seed) {
            RandomTree tree(seed, 26, RandomTree::Kinds::All, rotations);
            TreeEquations trial(tree);
            EXPECT_FALSE(trial.equations.getTopology().hasForeignForces);
            const Eigen::MatrixXd expected = trial.calcDifferences(factors);
            const NewtonSystem system = trial.formSystem(factors);
            Eigen::MatrixXd J = Eigen::MatrixXd::Zero(expected.rows(), expected.cols());
            for (int b = 0; b < trial.equations.getTopology().numBlocks(); ++b) {
                const NewtonSystem::Block& block = system.blocks[size_t(b)];
                std::vector<double> matrix = block.matrix, workspace;
                if (block.form == NewtonBlock::Form::Tree)
                    block.tree.expand(block.size, matrix.data(), workspace);
                const int first = trial.equations.getBlock(b).firstU;
                J.block(first, first, block.size, block.size) =
                    Eigen::Map<const Eigen::MatrixXd>(matrix.data(), block.size, block.size);
            }
            EXPECT_LT((J - expected).cwiseAbs().maxCoeff(), 1e-9 * J.cwiseAbs().maxCoeff());
        }
}

TEST(RigidTrees, LongTreesAreEliminatedBodyByBody) {
    RandomTree tree(3, 60, RandomTree::Kinds::Balls, Rotations::Quaternions);
    TreeEquations trial(tree);
    trial.calcResidual(trial.q, trial.u, trial.uDot);
    NewtonSystem system = trial.formSystem(NewtonFactors(0.1));
    const NewtonSystem second = trial.formSystem(NewtonFactors(0.1, 0.2)),
                       third = trial.formSystem(NewtonFactors(0.2, 0.1));
    int numTrees = 0;
    for (const NewtonSystem::Block& block : system.blocks)
        numTrees += block.form == NewtonBlock::Form::Tree ? 1 : 0;
    EXPECT_GT(numTrees, 0);
    for (double& value : system.r) value = tree.random.getValue();
    const std::complex<double> weights[] = {{0.2, 0.3}, {0.5, -0.4}, {0.3, 0.1}};
    ComplexNewtonSystem combined = makeCombined(system, 0);
    combine(system, second, third, weights, combined);
    std::copy(system.r.begin(), system.r.end(), combined.r.begin());
    const auto expectSolution = [&](const auto& given, auto& solver) {
        solver.factor(given);
        solver.solve(given);
        for (int b = 0; b < trial.equations.getTopology().numBlocks(); ++b) {
            const auto& block = given.blocks[size_t(b)];
            if (block.form != NewtonBlock::Form::Tree) continue;
            auto product = given.r, workspace = given.r;
            const int first = trial.equations.getBlock(b).firstU;
            block.tree.multiply(solver.getDeltaU().data() + first, product.data(), workspace);
            for (int i = 0; i < block.size; ++i)
                EXPECT_LT(std::abs(product[size_t(i)] + given.r[size_t(first + i)]), 1e-10);
        }
    };
    BlockEliminationSolver real(system);
    expectSolution(system, real);
    ComplexBlockEliminationSolver complex(combined);
    expectSolution(combined, complex);
}

/** Compares with the assembled M for all kinds of mobilizers. **/
TEST(RigidTrees, ForcesAreCarriedByTheAccelerationsThatTheyGive) {
    RandomTree tree(4, 26, RandomTree::Kinds::All, Rotations::Quaternions);
    TreeEquations trial(tree);
    const Blocks& blocks = trial.equations.getBlocks();
    std::vector<double> moved = trial.q, delta(trial.numU);
    for (double& value : delta) value = 0.2 * tree.random.getValue();
    blocks.displaceQ(delta.data(), moved.data());
    TreeInertias inertias(2);
    std::vector<Eigen::MatrixXd> M[2];
    for (int place : {0, 1}) {
        trial.calcResidual(place == 0 ? trial.q : moved, trial.u, trial.uDot);
        inertias.take(place, blocks);
        NewtonSystem system = trial.equations.getTopology().makeNewtonSystem();
        trial.equations.formMassSystem(system);
        for (const NewtonSystem::Block& block : system.blocks)
            M[place].push_back(
                Eigen::Map<const Eigen::MatrixXd>(block.matrix.data(), block.size, block.size));
    }
    Eigen::VectorXd r(trial.numU);
    for (double& value : r) value = tree.random.getValue();
    Eigen::VectorXd carried = r;
    inertias.carry(0, 1, blocks, carried.data());
    for (int b = 0; b < trial.equations.getTopology().numBlocks(); ++b) {
        const Block& block = trial.equations.getBlock(b);
        const Eigen::VectorXd expected =
            M[1][size_t(b)] * M[0][size_t(b)].llt().solve(r.segment(block.firstU, block.numU));
        EXPECT_LT((carried.segment(block.firstU, block.numU) - expected).norm(),
                  1e-9 * expected.norm());
    }
}

/** M⁻¹ΔM is large in a long chain: a matrix from another position, an earlier iterate or another
stage leads away from the solution. **/
template <class Integrator>
void expectFewIterationsOfLongChain(long mostByStep) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::UniformGravity(forces, matter, Vec3(10, -9.8, 3));
    Force::GlobalDamper(forces, matter, 1);
    const Body::Rigid link(MassProperties(1, Vec3(0, -0.5, 0), UnitInertia(1)));
    MobilizedBody parent = matter.Ground();
    for (int i = 0; i < 50; ++i)
        parent =
            MobilizedBody::Ball(parent, Transform(Vec3(0, i == 0 ? 0 : -1, 0)), link, Transform());
    State state = system.realizeTopology();
    Random::Gaussian random;
    random.setSeed(3);
    for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = random.getValue();
    Integrator integrator(system);
    integrator.setAccuracy(1e-3);
    integrator.initialize(state);
    integrator.stepTo(0.2);
    const IntegratorStatistics& statistics = integrator.getStatistics();
    EXPECT_LT(statistics.newtonIterations, mostByStep * statistics.stepsAttempted);
    EXPECT_EQ(statistics.convergenceFailures, 0);
}

TEST(RigidTrees, LongChainsTakeFewIterationsAStep) {
    expectFewIterationsOfLongChain<BdfIntegrator>(3);
    expectFewIterationsOfLongChain<RadauIntegrator>(4);
}

/** Nine links on ball joints, and at the end of the last wheels that weigh next to nothing: however
many they are, the chain moves as it does. **/
struct WheeledChain {
    explicit WheeledChain(int numWheels) {
        const Body::Rigid link(MassProperties(1, Vec3(0, -0.5, 0), UnitInertia(1))),
            wheel(MassProperties(1e-12, Vec3(0), Inertia(1e-12)));
        MobilizedBody outer = matter.Ground();
        for (int i = 0; i < 9; ++i)
            outer = MobilizedBody::Ball(outer, Vec3(0, i ? -1 : 0, 0), link, Vec3(0));
        for (int i = 0; i < numWheels; ++i) MobilizedBody::Pin(outer, Vec3(0), wheel, Vec3(0));
        end = outer.getMobilizedBodyIndex();
        state = system.realizeTopology();
        for (int i = 0; i < 27; ++i) state.updU()[i] = std::cos(2.3 * i);
    }

    template <class Integrator>
    Transform calcEnd(Real accuracy) {
        Integrator integrator(system);
        integrator.setAccuracy(accuracy);
        integrator.initialize(state);
        // Simbody's own return at the start, too.
        while (integrator.getTime() < 1) integrator.stepTo(1);
        return matter.getMobilizedBody(end).getBodyTransform(integrator.getState());
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::UniformGravity gravity{forces, matter, Vec3(3, -9.8, 1)};
    Force::GlobalDamper damper{forces, matter, 0.1};
    MobilizedBodyIndex end;
    State state;
};

template <class Integrator>
void expectTheSameMotionWithMoreSpeeds(Real accuracy, Real allowed) {
    const Transform exact = WheeledChain(0).calcEnd<RungeKuttaMersonIntegrator>(1e-11);
    // Trees of up to 30 speeds are eliminated as matrices, longer ones body by body.
    for (const int numWheels : {1, 2, 3, 4, 5, 6}) {
        const Transform found = WheeledChain(numWheels).calcEnd<Integrator>(accuracy);
        EXPECT_LT((found.p() - exact.p()).norm(), allowed) << 27 + numWheels << " speeds";
        EXPECT_LT((found.R().asMat33() - exact.R().asMat33()).norm(), allowed)
            << 27 + numWheels << " speeds";
    }
}

TEST(RigidTrees, MoveAlikeOnBothSidesOfTheSizeFromWhichBodiesAreEliminated) {
    expectTheSameMotionWithMoreSpeeds<RadauIntegrator>(1e-7, 1e-5);
    expectTheSameMotionWithMoreSpeeds<BdfIntegrator>(1e-8, 1e-5);
}

}  // namespace
}  // namespace simflex
