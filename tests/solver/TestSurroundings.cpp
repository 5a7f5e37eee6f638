// Results are bit-identical for any number of threads, any floating-point mode of the caller and
// any load on the machine.

#include <gtest/gtest.h>
#include <omp.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <set>
#include <thread>

#include "simflex/base/FlushDenormals.h"
#include "simflex/base/ParallelFor.h"
#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/DistributedLoad.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/integration/ThreadChoice.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using namespace SimTK;

#ifdef __SSE2__

const unsigned modes[] = {ArithmeticMode::Standard, 0x8000, 0x0040, ArithmeticMode::Flushing};

TEST(ArithmeticMode, ThatOfTheCallerHoldsInEveryThreadOfALoopAndNoLonger) {
    // The team of four is used for other work before and after.
    const auto collect = [](std::set<unsigned>& found) {
#pragma omp parallel num_threads(4)
        {
            const unsigned mode = ArithmeticMode::get();
#pragma omp critical
            found.insert(mode);
        }
    };
    for (const unsigned outside : modes) {
        const ArithmeticMode callers(outside);
        std::set<unsigned> before, after, inside;
        collect(before);
        for (const int threads : {1, 2, 4}) {
            const FlushDenormals flush;
            std::vector<unsigned> seen(64);
            parallelFor(64, threads, [&](int i) { seen[size_t(i)] = ArithmeticMode::get(); });
            inside.insert(seen.begin(), seen.end());
            parallelFor(64, threads, Schedule::WhoeverIsFree,
                        [&](int i) { seen[size_t(i)] = ArithmeticMode::get(); });
            inside.insert(seen.begin(), seen.end());
        }
        collect(after);
        EXPECT_EQ(inside, std::set<unsigned>{ArithmeticMode::Flushing});
        // Threads created in between have the caller's mode.
        for (const unsigned mode : after)
            EXPECT_TRUE(mode == outside || before.count(mode)) << mode;
        EXPECT_EQ(ArithmeticMode::get(), outside);
    }
}

/** Links released from rest in a row: the forces that first move the far ones are denormal.
Flexible bodies beside them provide work for two threads; the squares of their speeds are
denormal. **/
struct Chain {
    Chain() {
        const Body::Rigid link(MassProperties(1, Vec3(0), Inertia(1)));
        MobilizedBody before = matter.Ground();
        for (int i = 0; i < 40; ++i) {
            MobilizedBody::Slider next(matter.Ground(), link);
            Force::TwoPointLinearSpring(forces, before, Vec3(Real(i), 1e-100, 0), next,
                                        Vec3(Real(i + 1), 0, 0), 1, 1);
            before = next;
        }
        test::PointMassPartOptions options;
        options.numModes = 60;
        options.cells = {6, 2, 1};
        const auto part = test::makePointMassPart(options).body;
        for (int i = 0; i < 8; ++i)
            bodies.emplace_back(flexible, part, "body " + std::to_string(i));
        state = system.realizeTopology();
        state.updU()[0] = 1e-290;
        state.updU()[1] = 0.1;
        for (const FlexibleBody& body : bodies)
            body.setFrameVelocity(state, SpatialVec(Vec3(1e-160, 2e-160, 0), Vec3(0)));
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::vector<FlexibleBody> bodies;
    State state;
};

TEST(Surroundings, TheCallersArithmeticChangesNoBitAndStays) {
    const Chain model;
    Vector q, u;
    for (const unsigned outside : modes) {
        const ArithmeticMode callers(outside);
        for (const int threads : {1, 2}) {
            BdfIntegrator integrator(model.system);
            integrator.setNumThreads(threads);
            integrator.initialize(model.state);
            integrator.stepTo(0.3);
            EXPECT_EQ(ArithmeticMode::get(), outside);
            Evaluation equations(model.system, model.state);
            equations.updBlocks().chooseNumThreads(threads);
            if (omp_get_num_procs() > 1) {
                EXPECT_EQ(equations.getBlocks().numThreads, threads);
            }
            const StandardArithmetic standard;
            const State& state = integrator.getState();
            if (q.size() == 0) {
                q = state.getQ();
                u = state.getU();
            }
            for (int i = 0; i < q.size(); ++i) ASSERT_EQ(q[i], state.getQ()[i]) << i;
            for (int i = 0; i < u.size(); ++i) ASSERT_EQ(u[i], state.getU()[i]) << i;
        }
    }
}

TEST(Surroundings, FunctionsOfTimeAreAskedByOneThread) {
    Chain model;
    const std::thread::id caller = std::this_thread::get_id();
    std::atomic<bool> isOnlyCaller{true};
    for (const FlexibleBody& body : model.bodies)
        DistributedLoad(model.flexible, body, LoadShape::fromModalForces(Vector(60, 0.0)),
                        [&](Real) -> Real {
                            if (std::this_thread::get_id() != caller) isOnlyCaller = false;
                            return 0;
                        });
    BdfIntegrator integrator(model.system);
    integrator.setNumThreads(2);
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.1);
    EXPECT_TRUE(isOnlyCaller);
}

/** Independent masses: on a spring, displaced; on one under a tiny load; on a tiny spring. **/
struct Faint {
    explicit Faint(bool hasFaintSpring) {
        for (MobilizedBody* mass : {&displaced, &loaded})
            Force::MobilityLinearSpring(forces, *mass, MobilizerQIndex(0), 100, 0);
        Force::MobilityConstantForce(forces, loaded, MobilizerUIndex(0), 1e-308);
        if (hasFaintSpring) {
            MobilizedBody::Slider soft(matter.Ground(), link);
            Force::MobilityLinearSpring(forces, soft, MobilizerQIndex(0), 1e-310, 0);
        }
        state = system.realizeTopology();
        state.updQ()[0] = 0.1;
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    FlexibleBodySubsystem flexible{system, matter};
    Body::Rigid link{MassProperties(1, Vec3(0), Inertia(1))};
    MobilizedBody::Slider displaced{matter.Ground(), link}, loaded{matter.Ground(), link};
    State state;
};

/** Compares the results of work() in all modes of the caller. **/
template <class Work>
void expectTheSameBitsInAllModes(Work work, const char* what) {
    const std::vector<Real> standard = work();
    for (const unsigned outside : modes) {
        const ArithmeticMode callers(outside);
        const std::vector<Real> numbers = work();
        EXPECT_EQ(ArithmeticMode::get(), outside);
        ASSERT_EQ(numbers.size(), standard.size());
        EXPECT_EQ(std::memcmp(numbers.data(), standard.data(), standard.size() * sizeof(Real)), 0)
            << what << " with mode " << outside;
    }
}

TEST(Surroundings, TheCallersArithmeticChangesNoBitOfEquilibriaAndModes) {
    const Faint model(false), soft(true);
    const auto takeAll = [](const Vector& values) {
        std::vector<Real> numbers;
        for (int i = 0; i < values.size(); ++i) numbers.push_back(values[i]);
        return numbers;
    };
    expectTheSameBitsInAllModes(
        [&] {
            StaticEquilibrium equilibrium(model.system);
            equilibrium.solve(model.state);
            return takeAll(equilibrium.getState().getQ());
        },
        "an equilibrium");
    StaticEquilibrium equilibrium(model.system);
    equilibrium.solve(model.state);
    const Real faint = equilibrium.getState().getQ()[1];
    EXPECT_TRUE(faint > 0 && faint < 1e-307) << faint;

    expectTheSameBitsInAllModes(
        [&] {
            const Matrix K = calcLinearization(soft.system, soft.state).K;
            return std::vector<Real>{K(0, 0), K(1, 1), K(2, 2)};
        },
        "a stiffness");
    EXPECT_GT(calcLinearization(soft.system, soft.state).K(2, 2), 0);

    // Modes of a pencil whose masses are very weakly coupled.
    Linearization linear = calcLinearization(model.system, model.state);
    linear.K(0, 1) = linear.K(1, 0) = 1e-308;
    linear.K(1, 1) = 150;
    expectTheSameBitsInAllModes(
        [&] {
            std::vector<Real> numbers;
            for (const Eigenmode& mode : calcEigenmodes(linear)) {
                numbers.push_back(mode.frequency);
                for (int i = 0; i < 2; ++i) numbers.push_back(mode.shape[i].real());
            }
            return numbers;
        },
        "a mode");
    const Eigenmode mode = calcEigenmodes(linear)[0];
    expectTheSameBitsInAllModes(
        [&] { return takeAll(calcModeStates(model.system, linear, mode, 1e-309, 4)[1].getQ()); },
        "a mode's motion");
}

#endif

/** Times of a task with one thread and with many, and the time with a ThreadChoice. **/
struct Machine {
    double alone, many;
    double run(ThreadChoice& choice, int pieces) const {
        double sum = 0;
        for (int i = 0; i < pieces; ++i) {
            const double seconds = choice.get() > 1 ? many : alone;
            choice.add(seconds);
            sum += seconds;
        }
        return sum;
    }
};

TEST(ThreadChoice, TakesWhatIsFasterAndTriesTheOtherSeldom) {
    const int pieces = 100000;
    for (const Machine& machine :
         {Machine{1, 0.5}, Machine{1, 0.9}, Machine{1, 2}, Machine{1, 100}}) {
        ThreadChoice choice(8);
        const double best = std::min(machine.alone, machine.many);
        EXPECT_LT(machine.run(choice, pieces), 1.05 * best * pieces) << machine.many;
    }
}

TEST(ThreadChoice, FollowsWhenTheMachineBecomesBusyOrFree) {
    const Machine isFree{1, 0.5}, isBusy{1, 20};
    ThreadChoice choice(8);
    isFree.run(choice, 1000);
    EXPECT_EQ(choice.get(), 8);
    EXPECT_LT(isBusy.run(choice, 50), 50 + 40 * 20) << "a window or two";
    isBusy.run(choice, 1000);
    EXPECT_EQ(choice.get(), 1);
    isFree.run(choice, 20000);
    EXPECT_EQ(choice.get(), 8);
}

TEST(ThreadChoice, OneThreadIsOne) {
    ThreadChoice choice(1);
    for (int i = 0; i < 100; ++i) {
        EXPECT_EQ(choice.get(), 1);
        choice.add(1);
    }
}

}  // namespace
}  // namespace simflex
