// Block elimination against dense partial pivoting on the whole matrix.

#include <gtest/gtest.h>

#include <random>
#include <sstream>

#include "simflex/solver/BlockEliminationSolver.h"
#include "solver/SliderCrankModel.h"
#include "support/NewtonReference.h"

namespace simflex {
namespace {

using Eigen::VectorXd;

VectorXd solveByElimination(const NewtonSystem& system, int threads = 1, int* redundant = nullptr) {
    BlockEliminationSolver solver(system);
    solver.setNumThreads(threads);
    solver.factor(system);
    solver.solve(system);
    if (redundant) *redundant = solver.getNumRedundant();
    VectorXd x(system.numSpeeds() + system.numMultipliers());
    int first = 0;
    for (size_t b = 0; b < system.blocks.size(); ++b) {
        x.segment(first, system.blocks[b].size) =
            Eigen::Map<const VectorXd>(solver.getDeltaU(int(b)), system.blocks[b].size);
        first += system.blocks[b].size;
    }
    x.tail(system.numMultipliers()) =
        Eigen::Map<const VectorXd>(solver.getDeltaLambda(), system.numMultipliers());
    return x;
}

/** Newton systems of a short slider-crank run. **/
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

/** Relative difference of the speeds and of the multipliers, each in its own scale. **/
void expectEqualSolutions(const NewtonSystem& system, const VectorXd& x, const VectorXd& reference,
                          double tolerance) {
    const int n = system.numSpeeds(), m = system.numMultipliers();
    EXPECT_LT((x - reference).head(n).norm(), tolerance * reference.head(n).norm());
    EXPECT_LT((x - reference).tail(m).norm(), tolerance * reference.tail(m).norm());
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

/** Rank by singular values. **/
long rankOf(const Eigen::MatrixXd& A) {
    const VectorXd values = Eigen::BDCSVD<Eigen::MatrixXd>(A).singularValues();
    return (values.array() > 1e-9 * values[0]).count();
}

/** A random system: blocks with and without modes, joints between random pairs or to Ground. **/
NewtonSystem makeRandomSystem(std::mt19937& random, bool makeRedundant) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    const auto pick = [&](int low, int high) {
        return std::uniform_int_distribution<int>(low, high)(random);
    };
    NewtonSystem system;
    const int blocks = pick(1, 6), joints = pick(1, 2 * blocks);
    std::vector<std::vector<int>> rows(blocks);
    std::vector<int> sizes(blocks);
    int totalSize = 0;
    for (int& size : sizes) {
        size = pick(0, 2) ? 6 + pick(1, 30) : pick(1, 6);
        totalSize += size;
    }
    int multipliers = 0;
    for (int j = 0; j < joints && multipliers + 3 < totalSize / 2; ++j) {
        const int first = pick(0, blocks - 1), second = pick(-1, blocks - 1);
        const int equations = pick(1, std::min(3, sizes[first]));
        for (int k = 0; k < equations; ++k, ++multipliers) {
            rows[first].push_back(multipliers);
            if (second >= 0 && second != first) rows[second].push_back(multipliers);
        }
    }
    system.c.resize(multipliers);
    for (double& value : system.c) value = uniform(random);
    system.blocks.resize(blocks);
    for (int b = 0; b < blocks; ++b) {
        NewtonSystem::Block& block = system.blocks[b];
        block.resize(sizes[b], rows[b]);
        for (double& value : block.Gt) value = uniform(random);
        for (double& value : block.r) value = uniform(random);
        const int n = sizes[b];
        if (n > 6) {
            block.form = NewtonSystem::Block::Form::Arrow;
            Eigen::MatrixXd root =
                Eigen::MatrixXd::NullaryExpr(6, 6, [&] { return uniform(random); });
            Eigen::Map<Eigen::MatrixXd>(block.head.data(), 6, 6) =
                root * root.transpose() + 5 * Eigen::MatrixXd::Identity(6, 6);
            for (double& value : block.coupling) value = 0.2 * uniform(random);
            for (double& value : block.diagonal) value = 2 + uniform(random);
        } else {
            Eigen::Map<Eigen::MatrixXd> dense(block.dense.data(), n, n);
            dense = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return uniform(random); });
            dense.diagonal().array() += 4;
        }
    }
    if (makeRedundant && multipliers >= 2) {
        // The last row repeats the first, on every block, with the same right-hand side.
        for (NewtonSystem::Block& block : system.blocks) {
            auto& list = block.rows;
            const auto position = [&](int row) {
                return std::find(list.begin(), list.end(), row) - list.begin();
            };
            std::vector<double> first(block.size, 0.0);
            if (position(0) < long(list.size()))
                std::copy_n(block.Gt.begin() + position(0) * block.size, block.size, first.begin());
            if (position(multipliers - 1) == long(list.size())) {
                list.push_back(multipliers - 1);
                block.Gt.resize(block.Gt.size() + block.size);
            }
            std::copy(first.begin(), first.end(),
                      block.Gt.begin() + position(multipliers - 1) * block.size);
        }
        system.c.back() = system.c.front();
    }
    return system;
}

TEST(BlockElimination, AgreesWithDensePivotingOnRandomSystems) {
    std::mt19937 random(7);
    int regular = 0;
    for (int trial = 0; trial < 200; ++trial) {
        const NewtonSystem system = makeRandomSystem(random, false);
        const Eigen::MatrixXd A = test::assembleDense(system);
        const VectorXd b = test::assembleRightHandSide(system);
        if (rankOf(A) < A.rows()) continue;
        ++regular;
        const VectorXd x = solveByElimination(system);
        EXPECT_LT((A * x - b).norm(), 1e-10 * (A.norm() * x.norm() + b.norm()))
            << "trial " << trial;
    }
    EXPECT_GT(regular, 100);
}

TEST(BlockElimination, RedundantConstraintsAreCountedAndStillSolved) {
    std::mt19937 random(11);
    int found = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const NewtonSystem system = makeRandomSystem(random, true);
        if (system.numMultipliers() < 2) continue;
        int redundant = 0;
        const VectorXd x = solveByElimination(system, 1, &redundant);
        const Eigen::MatrixXd A = test::assembleDense(system);
        const VectorXd b = test::assembleRightHandSide(system);
        EXPECT_EQ(redundant, A.rows() - rankOf(A)) << "trial " << trial;
        // Where the redundant rows do not contradict each other, the solution is exact.
        const VectorXd reference = test::solveLeastNorm(system);
        if ((A * reference - b).norm() > 1e-9 * (A.norm() * reference.norm() + b.norm())) continue;
        EXPECT_LT((A * x - b).norm(), 1e-8 * (A.norm() * x.norm() + b.norm())) << "trial " << trial;
        if (redundant > 0) ++found;
    }
    EXPECT_GT(found, 20);
}

TEST(BlockElimination, ASingularBlockIsNamed) {
    NewtonSystem system;
    system.blocks.resize(2);
    system.blocks[0].resize(3, {0});
    system.blocks[1].resize(3, {0});
    system.c.resize(1);
    for (int i = 0; i < 3; ++i) system.blocks[0].dense[4 * i] = 1;
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
    const NewtonSystem system = makeRandomSystem(random, false);
    std::stringstream stream;
    system.write(stream);
    const NewtonSystem same = NewtonSystem::read(stream);
    ASSERT_EQ(same.blocks.size(), system.blocks.size());
    EXPECT_EQ(same.c, system.c);
    for (size_t b = 0; b < system.blocks.size(); ++b) {
        EXPECT_EQ(same.blocks[b].form, system.blocks[b].form);
        EXPECT_EQ(same.blocks[b].rows, system.blocks[b].rows);
        EXPECT_EQ(same.blocks[b].Gt, system.blocks[b].Gt);
        EXPECT_EQ(same.blocks[b].head, system.blocks[b].head);
        EXPECT_EQ(same.blocks[b].coupling, system.blocks[b].coupling);
        EXPECT_EQ(same.blocks[b].diagonal, system.blocks[b].diagonal);
        EXPECT_EQ(same.blocks[b].dense, system.blocks[b].dense);
        EXPECT_EQ(same.blocks[b].r, system.blocks[b].r);
    }
    const std::string text = stream.str();
    for (size_t length : {size_t(0), size_t(5), text.size() / 3, text.rfind(' ')}) {
        std::stringstream cut(text.substr(0, length));
        EXPECT_THROW(NewtonSystem::read(cut), std::runtime_error) << length;
    }
}

}  // namespace
}  // namespace simflex
