// Block elimination against dense partial pivoting on the whole matrix.

#include <gmock/gmock.h>

#include <complex>
#include <cstdlib>
#include <random>
#include <sstream>
#include <thread>

#include "simflex/forces/Bushing.h"
#include "simflex/forces/TwoPointSpringDamper.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/elimination/FrontSolver.h"
#include "simflex/solver/elimination/FrontTree.h"
#include "simflex/solver/elimination/NewtonCombination.h"
#include "simflex/solver/equations/Evaluation.h"
#include "solver/RandomNewtonSystem.h"
#include "solver/SliderCrankModel.h"
#include "support/NewtonReference.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using Eigen::VectorXd;
using test::MatrixOf;
using test::VectorOf;
using Complex = std::complex<double>;

template <class Scalar>
VectorOf<Scalar> solveByElimination(const BasicNewtonSystem<Scalar>& system, int threads = 1,
                                    int* redundant = nullptr) {
    BlockElimination<Scalar> solver(system);
    solver.setNumThreads(threads);
    solver.factor(system);
    solver.solve(system);
    if (redundant) *redundant = solver.getNumRedundant();
    VectorOf<Scalar> x(system.numSpeeds() + system.numMultipliers());
    x.head(system.numSpeeds()) =
        Eigen::Map<const VectorOf<Scalar>>(solver.getDeltaU().data(), system.numSpeeds());
    x.tail(system.numMultipliers()) =
        Eigen::Map<const VectorOf<Scalar>>(solver.getDeltaLambda(), system.numMultipliers());
    return x;
}

/** Returns Newton systems of a short slider-crank run. **/
std::vector<NewtonSystem> dumpSliderCrank(BdfIntegrator::BlockForm form) {
    std::vector<NewtonSystem> systems;
    test::FlexibleSliderCrank model;
    BdfIntegrator integrator(model.system);
    integrator.setBlockForm(form);
    int count = 0;
    integrator.setNewtonSystemObserver([&](const NewtonSystem& system) {
        if (count++ % 5 == 0) systems.push_back(system);
    });
    integrator.initialize(model.state);
    integrator.stepTo(0.03);
    return systems;
}

/** Compares speeds and multipliers, each relative to its own scale. **/
template <class Scalar>
void expectEqualSolutions(const BasicNewtonSystem<Scalar>& system, const VectorOf<Scalar>& x,
                          const VectorOf<Scalar>& reference, double tolerance) {
    const int n = system.numSpeeds(), m = system.numMultipliers();
    EXPECT_LT((x - reference).head(n).norm(), tolerance * reference.head(n).norm());
    EXPECT_LE((x - reference).tail(m).norm(), tolerance * reference.tail(m).norm());
}

TEST(BlockElimination, AgreesWithDensePivotingOnTheSliderCrank) {
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        const std::vector<NewtonSystem> systems = dumpSliderCrank(form);
        ASSERT_GT(systems.size(), 5u);
        for (const NewtonSystem& system : systems)
            expectEqualSolutions(system, solveByElimination(system), test::solveDense(system),
                                 1e-10);
    }
}

TEST(BlockElimination, GivesTheSameBitsWithAnyNumberOfThreads) {
    for (const NewtonSystem& system : dumpSliderCrank(BdfIntegrator::BlockForm::Arrow)) {
        const VectorXd one = solveByElimination(system, 1);
        for (int threads : {2, 4}) {
            const VectorXd many = solveByElimination(system, threads);
            for (int i = 0; i < one.size(); ++i) ASSERT_EQ(one[i], many[i]);
        }
    }
}

/** A strip of overlapping cliques. **/
template <class Scalar>
void expectColumnsSolvedTogetherAsOneByOne(bool isSymmetric) {
    constexpr int Cliques = 200, Size = 6, Columns = 11;
    CliquePattern pattern;
    pattern.numUnknowns = 3 * Cliques + 3;
    std::mt19937 random(7);
    std::uniform_real_distribution<double> between(-1, 1);
    std::vector<MatrixOf<Scalar>> values;
    std::vector<const Scalar*> pointers;
    for (int c = 0; c < Cliques; ++c) {
        pattern.cliques.emplace_back();
        for (int i = 0; i < Size; ++i) pattern.cliques.back().push_back(3 * c + i);
        MatrixOf<Scalar> own =
            MatrixOf<Scalar>::NullaryExpr(Size, Size, [&] { return Scalar(between(random)); });
        if (isSymmetric) own = (own + own.transpose()).eval();
        own.diagonal().array() += Scalar(8);
        values.push_back(own);
    }
    for (const MatrixOf<Scalar>& own : values) pointers.push_back(own.data());
    const MatrixOf<Scalar> B = MatrixOf<Scalar>::NullaryExpr(
        pattern.numUnknowns, Columns, [&] { return Scalar(between(random)); });
    FrontSolver<Scalar> solver(pattern);
    solver.setSymmetric(isSymmetric);
    solver.factor(pointers, 1);
    MatrixOf<Scalar> single = B, together = B;
    for (int k = 0; k < Columns; ++k) solver.solve(single.col(k).data(), 1);
    solver.solve(together.data(), Columns, 1);
    EXPECT_LT((together - single).cwiseAbs().maxCoeff(), 1e-14);
    for (const int threads : {2, 4}) {
        MatrixOf<Scalar> again = B;
        solver.solve(again.data(), Columns, threads);
        EXPECT_TRUE(again == together) << threads;
    }
}

TEST(FrontSolver, SolvesForManyColumnsAsForEachWithTheSameBitsForAnyNumberOfThreads) {
    for (const bool isSymmetric : {true, false}) {
        expectColumnsSolvedTogetherAsOneByOne<double>(isSymmetric);
        expectColumnsSolvedTogetherAsOneByOne<Complex>(isSymmetric);
    }
}

TEST(BlockElimination, PairsAddOneSidedTermsToJ) {
    // l acts on the first body, r on the second one, and both on the third.
    NewtonSystem system;
    system.blocks.resize(3);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(6, 6);
    VectorXd l(6), r(6);
    l << 3, -1, 0, 0, 2, 0.5;
    r << 0, 0, 4, 1, -1, 2;
    for (int b = 0; b < 3; ++b) {
        NewtonSystem::Block& block = system.blocks[size_t(b)];
        block.resize(2, b == 0   ? std::vector<int>{0}
                        : b == 1 ? std::vector<int>{1}
                                 : std::vector<int>{0, 1});
        block.form = NewtonBlock::Form::Symmetric;
        block.matrix = {2.0 + b, 0.3, 0.3, 1.5};
        J.block<2, 2>(2 * b, 2 * b) << 2.0 + b, 0.3, 0.3, 1.5;
        for (size_t k = 0; k < block.rows.size(); ++k)
            for (int i = 0; i < 2; ++i)
                block.Gt[2 * k + size_t(i)] = (block.rows[k] == 0 ? l : r)[2 * b + i];
    }
    system.r = {1, 2, 3, 4, 5, 6};
    system.c = {0, 0};
    system.compliance = {1, 1};
    system.pairs = {0};
    system.checkSizes();
    const VectorXd b = Eigen::Map<const VectorXd>(system.r.data(), 6);
    const VectorXd exact = -(J + l * r.transpose()).partialPivLu().solve(b);
    EXPECT_LT((solveByElimination(system).head(6) - exact).norm(), 1e-4 * exact.norm());
}

/** Returns the rank by singular values. **/
template <class Scalar>
long rankOf(const MatrixOf<Scalar>& A) {
    const VectorXd values = Eigen::BDCSVD<MatrixOf<Scalar>>(A).singularValues();
    return (values.array() > 1e-11 * values[0]).count();
}

/** Returns a system with a random multibody graph: kind, size and bodies. **/
NewtonSystem makeRandomSystem(std::mt19937& random, int mostBodies, int mostCopiedRows = 0) {
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    test::RandomSystemOptions options;
    options.graph = test::Graph(pick(0, 5));
    options.numBodies = pick(1, mostBodies);
    options.mostModes = pick(0, 60);
    options.hasGeneralBlocks = pick(0, 1);
    options.hasCompliantRows = mostCopiedRows == 0 && pick(0, 1);
    options.numCopiedRows = pick(0, mostCopiedRows);
    options.numCouplers = mostCopiedRows == 0 ? pick(0, 2) : 0;
    return test::makeRandomNewtonSystem(random, options);
}

template <class Scalar>
double relativeResidual(const BasicNewtonSystem<Scalar>& system, const VectorOf<Scalar>& x) {
    const MatrixOf<Scalar> A = test::assembleDense(system);
    const VectorOf<Scalar> b = test::assembleRightHandSide(system);
    return (A * x - b).norm() / (A.norm() * x.norm() + b.norm());
}

/** Returns the system itself, or one with random imaginary parts. **/
template <class Scalar>
BasicNewtonSystem<Scalar> makeOf(std::mt19937& random, const NewtonSystem& real) {
    if constexpr (std::is_same_v<Scalar, double>)
        return real;
    else
        return test::makeComplex(random, real);
}

template <class Scalar>
class RandomGraphs : public testing::Test {};
using Scalars = testing::Types<double, Complex>;
TYPED_TEST_SUITE(RandomGraphs, Scalars, );

TYPED_TEST(RandomGraphs, AreSolvedByTheHundred) {
    std::mt19937 random(7);
    int regular = 0;
    for (int trial = 0; trial < 300; ++trial) {
        const auto system = makeOf<TypeParam>(random, makeRandomSystem(random, 8));
        const MatrixOf<TypeParam> A = test::assembleDense(system);
        if (rankOf(A) < A.rows()) continue;
        ++regular;
        int redundant = -1;
        const VectorOf<TypeParam> x = solveByElimination(system, 1, &redundant);
        EXPECT_EQ(redundant, 0) << "trial " << trial;
        EXPECT_LT(relativeResidual(system, x), 1e-9) << "trial " << trial;
        expectEqualSolutions(system, x, test::solveDense(system), 1e-7);  // A is ill-conditioned
    }
    EXPECT_GT(regular, 200);
}

TYPED_TEST(RandomGraphs, HaveTheirRedundantConstraintsCountedAndAreSolvedStill) {
    std::mt19937 random(11);
    int found = 0;
    for (int trial = 0; trial < 100; ++trial) {
        const auto system = makeOf<TypeParam>(random, makeRandomSystem(random, 6, 4));
        if (system.numMultipliers() < 2) continue;
        int redundant = 0;
        const VectorOf<TypeParam> x = solveByElimination(system, 1, &redundant);
        const MatrixOf<TypeParam> A = test::assembleDense(system);
        EXPECT_EQ(redundant, A.rows() - rankOf(A)) << "trial " << trial;
        // Where redundant rows are consistent, the solution is exact.
        const VectorOf<TypeParam> reference = test::solveLeastNorm(system);
        if (relativeResidual(system, reference) > 1e-10) continue;
        EXPECT_LT(relativeResidual(system, x), 1e-9) << "trial " << trial;
        if (redundant > 0) ++found;
    }
    EXPECT_GT(found, 20);
}

TYPED_TEST(RandomGraphs, MayHaveBlocksThatNeedPivoting) {
    BasicNewtonSystem<TypeParam> system;
    system.blocks.resize(1);
    system.blocks[0].resize(3, {0});
    system.blocks[0].matrix = {0, 1, 2, -1, 0, 3, 2, 1, 1};
    if constexpr (!std::is_same_v<TypeParam, double>) system.blocks[0].matrix[5] = {3, 2};
    system.blocks[0].Gt = {1, 2, -1};
    system.r = {3, -1, 2};
    system.c = {0.5};
    expectEqualSolutions(system, solveByElimination(system), test::solveDense(system), 1e-12);
}

class LargeGraph : public testing::TestWithParam<test::Graph> {};

template <class Scalar>
void expectSolvedToRoundOff(const BasicNewtonSystem<Scalar>& system) {
    int redundant = -1;
    const VectorOf<Scalar> x = solveByElimination(system, 1, &redundant);
    const VectorOf<Scalar> b = test::assembleRightHandSide(system);
    EXPECT_LT((test::multiply(system, x) - b).norm(), 1e-9 * (x.norm() + b.norm()));
    EXPECT_EQ(redundant, 0);
    for (int threads : {2, 4}) EXPECT_EQ(solveByElimination(system, threads), x) << threads;
}

TEST_P(LargeGraph, IsSolvedToRoundOffWithTheSameBitsForAnyNumberOfThreads) {
    std::mt19937 random(5);
    for (bool hasGeneralBlocks : {false, true}) {
        const NewtonSystem system = test::makeRandomNewtonSystem(
            random, {GetParam(), 300, 12, hasGeneralBlocks, hasGeneralBlocks, 0, 20});
        expectSolvedToRoundOff(system);
        expectSolvedToRoundOff(test::makeComplex(random, system));
    }
}

template <class Scalar>
void expectMultipliersOfLeastNorm(const BasicNewtonSystem<Scalar>& system) {
    int redundant = -1;
    const VectorOf<Scalar> x = solveByElimination(system, 1, &redundant);
    const VectorOf<Scalar> b = test::assembleRightHandSide(system);
    EXPECT_LT((test::multiply(system, x) - b).norm(), 1e-9 * (x.norm() + b.norm()));
    EXPECT_EQ(redundant, 12);
    const int n = system.numSpeeds(), m = system.numMultipliers();
    // Minimum norm: no component in the null space of Gᵀ.
    const Eigen::MatrixXd Gt = test::assembleDense(system).topRightCorner(n, m).real();
    const Eigen::MatrixXd null = Eigen::FullPivLU<Eigen::MatrixXd>(Gt).setThreshold(1e-10).kernel();
    ASSERT_EQ(null.cols(), 12);
    EXPECT_LT((null.transpose() * x.tail(m)).norm(), 1e-9 * null.norm() * x.tail(m).norm());
}

TEST_P(LargeGraph, HasMultipliersOfLeastNormWhereRowsAreRepeated) {
    std::mt19937 random(6);
    test::RandomSystemOptions options{GetParam(), 60, 4, false, false, 12};
    const NewtonSystem system = test::makeRandomNewtonSystem(random, options);
    expectMultipliersOfLeastNorm(system);
    expectMultipliersOfLeastNorm(test::makeComplex(random, system));
}

std::string nameOf(const testing::TestParamInfo<test::Graph>& graph) {
    const char* names[] = {"Chain", "Tree", "Star", "Ring", "Grid", "Random"};
    return names[int(graph.param)];
}

INSTANTIATE_TEST_SUITE_P(Graphs, LargeGraph,
                         testing::Values(test::Graph::Chain, test::Graph::Tree, test::Graph::Star,
                                         test::Graph::Ring, test::Graph::Grid, test::Graph::Random),
                         nameOf);

/** Returns A with the rows of force elements eliminated. **/
template <class Scalar>
MatrixOf<Scalar> eliminateElements(const BasicNewtonSystem<Scalar>& system, int firstElementRow) {
    const MatrixOf<Scalar> A = test::assembleDense(system);
    const int kept = system.numSpeeds() + firstElementRow, rest = int(A.rows()) - kept;
    const MatrixOf<Scalar> g = A.topRightCorner(kept, rest);
    return A.topLeftCorner(kept, kept) -
           g * A.bottomRightCorner(rest, rest).diagonal().cwiseInverse().asDiagonal() *
               g.transpose();
}

/** Returns Δu and the constraints' Δλ of a combined system with r and c as given in its rows. **/
VectorOf<Complex> solveCombined(ComplexNewtonSystem& combined, const NewtonSystem& real,
                                int firstElementRow) {
    combined.r.assign(real.r.begin(), real.r.end());
    std::copy_n(real.c.begin(), firstElementRow, combined.c.begin());
    combined.checkSizes();
    return solveByElimination(combined).head(real.numSpeeds() + firstElementRow);
}

const Complex kWeights[3] = {{0.8, 1.1}, {0.6, -0.4}, {-0.4, -0.7}};

TEST(NewtonCombination, IsTheSumOfThreeRandomSystems) {
    std::mt19937 random(13);
    const auto uniform = [&] { return std::uniform_real_distribution<double>(-1, 1)(random); };
    int solved = 0;
    for (int trial = 0; trial < 100; ++trial) {
        NewtonSystem systems[3] = {makeRandomSystem(random, 6)};
        NewtonSystem& a = systems[0];
        a.pairs.clear();  // their sum is only accurate to the round-off of Newton's method
        // The last joints are springs.
        int first = a.numMultipliers() / 2;
        for (bool isMoved = true; isMoved;) {
            isMoved = false;
            for (const NewtonSystem::Block& block : a.blocks) {
                int column = 0;
                for (const NewtonSystem::Side& side : block.sides) {
                    const int from = block.rows[size_t(column)];
                    column += side.numColumns;
                    if (from >= first || block.rows[size_t(column) - 1] < first) continue;
                    first = from;
                    isMoved = true;
                }
            }
        }
        a.compliance.assign(a.c.size(), 0);
        for (size_t row = size_t(first); row < a.c.size(); ++row) a.compliance[row] = 1;
        for (NewtonSystem* other : {&systems[1], &systems[2]}) {
            *other = a;
            const ComplexNewtonSystem changed = test::makeComplex(random, a);
            const auto change = [](const std::vector<Complex>& by, std::vector<double>& values) {
                for (size_t i = 0; i < by.size(); ++i) values[i] += 0.05 * std::abs(by[i].imag());
            };
            for (size_t p = 0; p < a.parts.size(); ++p)
                change(changed.parts[p].diagonal, other->parts[p].diagonal);
            for (size_t b = 0; b < a.blocks.size(); ++b) {
                NewtonSystem::Block& block = other->blocks[b];
                change(changed.blocks[b].head, block.head);
                change(changed.blocks[b].coupling, block.coupling);
                change(changed.blocks[b].matrix, block.matrix);
                if (other != &systems[1]) continue;
                for (size_t column = 0; column < block.rows.size(); ++column) {
                    if (block.rows[column] < first) continue;
                    for (auto* columns : {&block.Gt, &block.coefficients}) {
                        const size_t height = columns->size() / block.rows.size();
                        for (size_t i = 0; i < height; ++i)
                            (*columns)[i + column * height] = uniform();
                    }
                }
            }
        }
        for (size_t row = size_t(first); row < a.c.size(); ++row)
            systems[1].compliance[row] = uniform() < 0 ? -1 : 1;

        ComplexNewtonSystem combined = makeCombined(a, first);
        EXPECT_EQ(combined.numMultipliers(), 2 * a.numMultipliers() - first);
        combine(a, systems[1], systems[2], kWeights, combined);
        const int n = a.numSpeeds() + first;
        MatrixOf<Complex> A = MatrixOf<Complex>::Zero(n, n);
        for (int k = 0; k < 3; ++k) A += kWeights[k] * eliminateElements(systems[k], first);
        A.bottomRows(first) = test::assembleDense(a).middleRows(a.numSpeeds(), first).leftCols(n);
        A.rightCols(first) = A.bottomRows(first).transpose();
        const MatrixOf<Complex> found = eliminateElements(combined, first);
        EXPECT_LT((found - A).norm(), 1e-13 * A.norm()) << trial;

        const VectorOf<Complex> x = solveCombined(combined, a, first);
        const VectorOf<Complex> b = test::assembleRightHandSide(a).head(n);
        if (rankOf(A) < n) continue;
        ++solved;
        EXPECT_LT((A * x - b).norm(), 1e-9 * (A.norm() * x.norm() + b.norm())) << trial;
    }
    EXPECT_GT(solved, 50);
}

/** J(γ) = M/γ + D + γK of bodies with a joint, a spring, a bushing and a lock. **/
TEST(NewtonCombination, GivesTheNewtonMatrixOfAnyStepFromThree) {
    using SimTK::Vec3;
    SimTK::MultibodySystem model;
    SimTK::SimbodyMatterSubsystem matter(model);
    FlexibleBodySubsystem flexible(model, matter);
    const auto part = test::makePointMassPart().body;
    const FlexibleBody first(flexible, part), second(flexible, part);
    const SimTK::MassProperties mass(2, Vec3(0.1, 0, 0), 2 * SimTK::UnitInertia(0.1, 0.2, 0.25));
    SimTK::MobilizedBody::Slider brick(matter.Ground(), mass);
    SimTK::MobilizedBody::Pin wheel(brick, SimTK::Transform(Vec3(0, 0.3, 0)), mass,
                                    SimTK::Transform());
    const Joint::Ball joint(flexible, matter.Ground(), first.interface("A"));
    const TwoPointSpringDamper spring(flexible, first.interface("B"),
                                      Attachment(wheel, Vec3(0.1, 0.2, 0.3)), 3e3, 20, 0.1);
    const Bushing bushing(flexible, Attachment(brick, Vec3(0.1, 0, 0)), second.interface("A"),
                          Bushing::diagonal(SimTK::Vec6(100, 200, 300, 1e5, 2e5, 3e5)),
                          Bushing::diagonal(SimTK::Vec6(1, 2, 3, 100, 200, 300)));
    SimTK::State state = model.realizeTopology();
    brick.lock(state);
    first.setPoseByInterface(state, "A", SimTK::Transform());
    second.setPoseByInterface(state, "A", SimTK::Transform(Vec3(0.1, 0.02, 0.01)));
    model.realize(state, SimTK::Stage::Velocity);
    Evaluation equations(model, state);
    const Topology& topology = equations.getTopology();
    std::vector<double> q(size_t(topology.numQ)), u(size_t(topology.numU)),
        uDot = u, r = u, lambda(size_t(topology.numMultipliers), 0);
    equations.getBlocks().getFromState(state, q.data(), u.data());
    std::mt19937 random(3);
    for (double& value : u) value = std::uniform_real_distribution<double>(-1, 1)(random);
    equations.realize(0, q.data(), u.data());
    equations.calcResidual(q.data(), u.data(), uDot.data(), lambda.data(), r.data());
    for (const bool isDense : {false, true}) {
        const auto form = [&](double massFactor, double stiffnessFactor) {
            NewtonSystem system = topology.makeNewtonSystem();
            equations.formNewtonSystem(NewtonFactors(massFactor, stiffnessFactor), isDense,
                                       q.data(), u.data(), uDot.data(), system);
            system.r = r;
            return system;
        };
        const double m[2] = {1e-3, 3e-3}, s[2] = {2e-3, 5e-4}, gamma = 1.5e-3;
        const NewtonSystem a = form(m[0], s[0]), b = form(m[0], s[1]), c = form(m[1], s[0]);
        const double ofB = (gamma - s[0]) / (s[1] - s[0]);
        const double ofC = (1 / gamma - 1 / m[0]) / (1 / m[1] - 1 / m[0]);
        const int firstElementRow = topology.numMultipliers;
        ASSERT_GT(a.numMultipliers(), firstElementRow + 6);
        ComplexNewtonSystem combined = makeCombined(a, firstElementRow);
        combine(a, b, c, {1 - ofB - ofC, ofB, ofC}, combined);
        const NewtonSystem expected = form(gamma, gamma);
        const MatrixOf<double> A = eliminateElements(expected, firstElementRow);
        EXPECT_LT((eliminateElements(combined, firstElementRow) - A).norm(), 1e-12 * A.norm());
        const VectorOf<Complex> x = solveCombined(combined, a, firstElementRow);
        const VectorXd reference = test::solveDense(expected).head(x.size());
        EXPECT_LT((x - reference).norm(), 1e-9 * reference.norm());
    }
}

TEST(BlockElimination, ASingularBlockIsNamed) {
    NewtonSystem system;
    system.blocks.resize(2);
    system.blocks[0].resize(3, {0});
    system.blocks[1].resize(3, {0});
    system.r.resize(6);
    system.c.resize(1);
    for (int i = 0; i < 3; ++i) system.blocks[0].matrix[4 * i] = 1;
    system.blocks[0].Gt = {1, 0, 0};
    system.blocks[1].Gt = {1, 0, 0};
    BlockEliminationSolver solver(system);
    EXPECT_THROW(solver.solve(system), std::logic_error);
    try {
        solver.factor(system);
        FAIL() << "a zero block was factored";
    } catch (const std::runtime_error& error) {
        EXPECT_NE(std::string(error.what()).find("block 1"), std::string::npos) << error.what();
    }
}

TEST(NewtonSystem, TextFormGivesTheSystemBackExactly) {
    std::mt19937 random(3);
    const NewtonSystem system = makeRandomSystem(random, 6);
    std::stringstream stream;
    system.write(stream);
    const NewtonSystem same = NewtonSystem::read(stream);
    ASSERT_EQ(same.blocks.size(), system.blocks.size());
    EXPECT_EQ(same.r, system.r);
    EXPECT_EQ(same.c, system.c);
    EXPECT_EQ(same.compliance, system.compliance);
    ASSERT_EQ(same.parts.size(), system.parts.size());
    for (size_t p = 0; p < system.parts.size(); ++p) {
        EXPECT_EQ(same.parts[p].diagonal, system.parts[p].diagonal);
        EXPECT_EQ(*same.parts[p].shapes, *system.parts[p].shapes);
    }
    for (size_t b = 0; b < system.blocks.size(); ++b) {
        EXPECT_EQ(same.blocks[b].form, system.blocks[b].form);
        EXPECT_EQ(same.blocks[b].rows, system.blocks[b].rows);
        EXPECT_EQ(same.blocks[b].Gt, system.blocks[b].Gt);
        EXPECT_EQ(same.blocks[b].head, system.blocks[b].head);
        EXPECT_EQ(same.blocks[b].coupling, system.blocks[b].coupling);
        EXPECT_EQ(same.blocks[b].coefficients, system.blocks[b].coefficients);
        EXPECT_EQ(same.blocks[b].matrix, system.blocks[b].matrix);
    }
    const std::string text = stream.str();
    for (size_t length : {size_t(0), size_t(5), text.size() / 3, text.rfind(' ')}) {
        std::stringstream cut(text.substr(0, length));
        EXPECT_THROW(NewtonSystem::read(cut), std::runtime_error) << length;
    }
}

/** Bodies of one part joined to each other at two mesh nodes: all at the first and last mesh node,
or each at the next two. **/
struct NodeChain {
    SimTK::MultibodySystem system;
    SimTK::SimbodyMatterSubsystem matter{system};
    SimTK::GeneralForceSubsystem forces{system};
    SimTK::Force::Gravity gravity{forces, matter, -SimTK::YAxis, 9.81};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> bodies;
    SimTK::State state;

    enum class Nodes { Same, Own };

    explicit NodeChain(int count, Nodes nodes = Nodes::Same) {
        const auto part = test::makePointMassPart().body;
        const int last = part->mesh.numNodes() - 1;
        const auto positionOf = [&](int node) {
            const auto x = part->mesh.position(node);
            return SimTK::Vec3(x[0], x[1], x[2]);
        };
        std::vector<SimTK::Vec3> places;
        SimTK::Vec3 place(0);
        Attachment before(matter.Ground(), SimTK::Transform());
        for (int k = 0; k < count; ++k) {
            const int top = nodes == Nodes::Same ? 0 : 2 * k % last;
            const int bottom = nodes == Nodes::Same ? last : top + 1;
            bodies.emplace_back(flexible, part);
            Joint::Ball(flexible, before, bodies.back().node(part->mesh.nodeNumbers[size_t(top)]));
            before = bodies.back().node(part->mesh.nodeNumbers[size_t(bottom)]);
            places.push_back(place - positionOf(top));
            place = places.back() + positionOf(bottom);
        }
        state = system.realizeTopology();
        for (int k = 0; k < count; ++k)
            bodies[size_t(k)].getFrame().setQToFitTransform(state,
                                                            SimTK::Transform(places[size_t(k)]));
    }

    /** Returns the number of frames per body of the part, after a step. **/
    std::vector<int> countFrames() {
        std::vector<int> numFrames;
        BdfIntegrator integrator(system);
        integrator.setNewtonSystemObserver([&](const NewtonSystem& newton) {
            numFrames.clear();
            for (const NewtonSystem::Block& block : newton.blocks)
                numFrames.push_back(newton.parts.at(size_t(block.part)).numFrames);
        });
        integrator.initialize(state);
        integrator.stepTo(1e-4);
        return numFrames;
    }
};

TEST(BlockElimination, BodiesShareTheShapesOfTheNodesOfTheirPart) {
    for (const int count : {2, 20}) {
        NodeChain chain(count);
        const int first = chain.bodies[0].getPart().mesh.nodeNumbers.front();
        EXPECT_EQ(chain.bodies[0].node(first).getFlexibleFrame().shapes,
                  chain.bodies[1].node(first).getFlexibleFrame().shapes);
        EXPECT_NE(chain.bodies[0].node(first).getFlexibleFrame().shapes,
                  chain.bodies[0].node(first + 1).getFlexibleFrame().shapes);
        EXPECT_THAT(chain.countFrames(), testing::AllOf(testing::SizeIs(count), testing::Each(2)));
    }
}

/** No matter how many other nodes of the part are used, each body's products take at most twice the
frames that it uses. **/
TEST(BlockElimination, BodiesMultiplyByFramesThatTheyUse) {
    NodeChain chain(40, NodeChain::Nodes::Own);
    EXPECT_THAT(chain.countFrames(),
                testing::AllOf(testing::SizeIs(40), testing::Each(testing::Le(4))));
}

/** Orders the unknowns of a grid of bodies large enough for nested dissection. **/
std::vector<int> orderGrid(int size) {
    CliquePattern pattern;
    pattern.cliques.resize(size_t(size * size));
    const auto join = [&](int a, int b) {
        for (int row = 0; row < 3; ++row, ++pattern.numUnknowns)
            for (const int body : {a, b})
                pattern.cliques[size_t(body)].push_back(pattern.numUnknowns);
    };
    for (int i = 0; i < size; ++i)
        for (int j = 0; j < size; ++j) {
            if (i + 1 < size) join(i * size + j, (i + 1) * size + j);
            if (j + 1 < size) join(i * size + j, i * size + j + 1);
        }
    return FrontTree(pattern).positions();
}

TEST(FrontTree, OrdersTheSameWhateverIsOrderedAtTheSameTime) {
    const std::vector<int> expected[2] = {orderGrid(25), orderGrid(40)};
    constexpr int kThreads = 6, kTimes = 4;
    std::vector<std::vector<int>> found(kThreads * kTimes);
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t)
        threads.emplace_back([&, t] {
            for (int k = 0; k < kTimes; ++k)
                found[size_t(t * kTimes + k)] = orderGrid((t + k) % 2 ? 40 : 25);
        });
    for (std::thread& thread : threads) thread.join();
    for (int t = 0; t < kThreads; ++t)
        for (int k = 0; k < kTimes; ++k)
            EXPECT_EQ(found[size_t(t * kTimes + k)], expected[(t + k) % 2]) << t << " " << k;
}

TEST(FrontTree, LeavesTheUsersRandomNumbersAlone) {
    std::srand(7);
    std::vector<int> expected;
    for (int k = 0; k < 20; ++k) expected.push_back(std::rand());
    std::srand(7);
    for (int k = 0; k < 20; ++k) {
        if (k % 5 == 3) orderGrid(25);
        EXPECT_EQ(std::rand(), expected[size_t(k)]) << k;
    }
}

}  // namespace
}  // namespace simflex
