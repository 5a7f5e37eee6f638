// Newton's loop allocates no heap memory, as counted by the program's malloc().

#include <gtest/gtest.h>

#include <atomic>
#include <cstddef>
#include <limits>

#include "simflex/body/StressRecovery.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/RadauIntegrator.h"
#include "simflex/solver/elimination/NewtonCombination.h"
#include "solver/SliderCrankModel.h"
#include "support/PointMassPart.h"

// Sanitizers bring their own malloc().
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SIMFLEX_COUNTS_ALLOCATIONS 1
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef SIMFLEX_COUNTS_ALLOCATIONS
#endif
#endif
#endif

#ifdef SIMFLEX_COUNTS_ALLOCATIONS

namespace {
std::atomic<bool> isCounting{false};
std::atomic<long> numAllocations{0};

void count() {
    if (isCounting) ++numAllocations;
}
}  // namespace

extern "C" {
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* block, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);

void* malloc(std::size_t size) {
    count();
    return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
    count();
    return __libc_calloc(number, size);
}
void* realloc(void* block, std::size_t size) {
    count();
    return __libc_realloc(block, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    count();
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
    count();
    *block = __libc_memalign(alignment, size);
    return *block ? 0 : 12;  // ENOMEM
}
}

namespace simflex {
namespace {

using namespace SimTK;

/** Returns the allocations from the 20th Newton system of a run to the last, by BDF and by Radau.
@param iterations  receives the smaller number of counted iterations **/
long countAllocations(const MultibodySystem& system, const State& state,
                      BdfIntegrator::BlockForm form, long* iterations) {
    BdfIntegrator bdf(system);
    RadauIntegrator radau(system);
    *iterations = std::numeric_limits<long>::max();
    long counted = 0;
    const auto run = [&](ImplicitIntegrator& integrator, Real end) {
        integrator.setBlockForm(form);
        integrator.setNumThreads(1);
        long systems = 0;
        integrator.setNewtonSystemObserver(
            [&](const NewtonSystem&) { isCounting = ++systems > 20; });
        integrator.initialize(state);
        numAllocations = 0;
        integrator.stepTo(end);
        isCounting = false;
        counted += numAllocations;
        *iterations = std::min(*iterations, systems - 20);
    };
    run(bdf, 0.02);
    run(radau, 0.2);
    return counted;
}

TEST(Allocation, TheCounterCounts) {
    numAllocations = 0;
    isCounting = true;
    double* volatile block = new double[100];  // volatile keeps the compiler from removing both
    delete[] block;
    isCounting = false;
    EXPECT_EQ(numAllocations, 1);
}

TEST(Allocation, NewtonLoopAndStepsAllocateNothing) {
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        const test::FlexibleSliderCrank model;
        long iterations = 0;
        EXPECT_EQ(countAllocations(model.system, model.state, form, &iterations), 0);
        EXPECT_GT(iterations, 30);
    }
}

TEST(Allocation, NorDoComplexSystems) {
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        const test::FlexibleSliderCrank model;
        BdfIntegrator integrator(model.system);
        integrator.setBlockForm(form);
        std::vector<NewtonSystem> systems;
        integrator.setNewtonSystemObserver(
            [&](const NewtonSystem& system) { systems.push_back(system); });
        integrator.initialize(model.state);
        integrator.stepTo(1e-3);
        ASSERT_GT(systems.size(), 4u);
        ComplexNewtonSystem combined = makeCombined(systems[0], systems[0].numMultipliers());
        ComplexBlockEliminationSolver solver(combined);
        numAllocations = 0;
        for (size_t k = 0; k + 2 < systems.size(); ++k) {
            isCounting = k > 0;
            combine(systems[k], systems[k + 1], systems[k + 2], {{1, 2}, {0.5, -0.5}, {-0.5, -1.5}},
                    combined);
            solver.factor(combined);
            solver.solve(combined);
            isCounting = false;
        }
        EXPECT_EQ(numAllocations, 0);
    }
}

TEST(Allocation, NorDoBodiesWithGeometricStiffening) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    test::PointMassPartOptions options;
    options.stiffening = 1;
    const FlexibleBody body(flexible, test::makePointMassPart(options).body);
    Joint::Pin(flexible, matter.Ground(), body.interface("A"));
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", Transform());
    body.setModalSpeeds(state, Vector(body.getNumModes(), 0.1));
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        long iterations = 0;
        EXPECT_EQ(countAllocations(system, state, form, &iterations), 0);
        EXPECT_GT(iterations, 30);
    }
}

TEST(Allocation, NorDoLoads) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    MobilizedBody::Free brick(matter.Ground(), MassProperties(2, Vec3(0), 2 * UnitInertia(0.1)));
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, test::makePointMassPart().body);
    Joint::Pin(flexible, matter.Ground(), body.interface("A"));
    for (const Attachment& place : {body.interface("B"), Attachment(brick, Vec3(0.1, 0, 0))})
        AttachmentForce(flexible, place, SpatialVec(Vec3(0), Vec3(3, 2, 1)),
                        AttachmentForce::Axes::Attachment);
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", Transform());
    body.setModalSpeeds(state, Vector(body.getNumModes(), 0.1));
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        long iterations = 0;
        EXPECT_EQ(countAllocations(system, state, form, &iterations), 0);
        EXPECT_GT(iterations, 30);
    }
}

TEST(Allocation, NorDoGearsAndPrescribedMotions) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const auto part = test::makePointMassPart().body;
    std::vector<FlexibleBody> bodies;
    std::vector<Joint::Pin> bearings;
    for (int k = 0; k < 2; ++k) {
        bodies.emplace_back(flexible, part);
        bearings.emplace_back(flexible, matter.Ground(), bodies.back().interface("A"));
    }
    Joint::Gear(flexible, bearings[0], 17, bearings[1], 23);
    Joint::PrescribedRotation(flexible, matter.Ground(), bodies[0].interface("A"),
                              std::make_shared<Function::Sinusoid>(0.3, 20, 0.1));
    bodies.emplace_back(flexible, part);
    Joint::PrescribedPose(flexible, matter.Ground(), bodies[2].interface("A"), [](Real t) {
        FrameMotion pose;
        pose.X = Transform(Rotation(t * t, ZAxis), Vec3(t * t, 0, 0));
        pose.V = {Vec3(0, 0, 2 * t), Vec3(2 * t, 0, 0)};
        pose.A = {Vec3(0, 0, 2), Vec3(2, 0, 0)};
        return pose;
    });
    State state = system.realizeTopology();
    for (const FlexibleBody& body : bodies) body.setPoseByInterface(state, "A", Transform());
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        long iterations = 0;
        EXPECT_EQ(countAllocations(system, state, form, &iterations), 0);
        EXPECT_GT(iterations, 30);
    }
}

TEST(Allocation, NorDoRigidBodiesOrSmallerPartsBesideLargeOnes) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    test::PointMassPartOptions options;
    const FlexibleBody large(flexible, test::makePointMassPart(options).body);
    options.numModes = 5;
    const FlexibleBody small(flexible, test::makePointMassPart(options).body);
    const FlexibleBody rigid(flexible, large.getPartHandle());
    Joint::Pin(flexible, matter.Ground(), large.interface("A"));
    Joint::Ball(flexible, large.interface("B"), rigid.interface("A"));
    Joint::Ball(flexible, rigid.interface("B"), small.interface("A"));
    State state = system.realizeTopology();
    large.setModalSpeeds(state, Vector(11, 0.1));
    rigid.setRigid(state);
    for (auto form : {BdfIntegrator::BlockForm::Arrow, BdfIntegrator::BlockForm::Dense}) {
        long iterations = 0;
        EXPECT_EQ(countAllocations(system, state, form, &iterations), 0);
        EXPECT_GT(iterations, 30);
    }
}

TEST(Allocation, StressOfManyNodesNeedsNoneOnceItsResultsHaveTheirSize) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    ReducedBody part = *test::makePointMassPart().body;
    part.modalStress.emplace();
    for (int node = 0; node < part.mesh.numNodes(); ++node) part.modalStress->nodes.push_back(node);
    part.modalStress->stress.assign(6 * part.modalStress->nodes.size() * size_t(part.numModes), 1);
    part.modalStress->strain = part.modalStress->stress;
    const FlexibleBody body(flexible, std::make_shared<const ReducedBody>(std::move(part)));
    const State state = [&] {
        State start = system.realizeTopology();
        body.setModalCoordinates(start, Vector(body.getNumModes(), 0.1));
        system.realize(start, Stage::Velocity);
        return start;
    }();
    std::vector<int> numbers;  // enough for several threads
    for (int k = 0; k < 20000; ++k)
        numbers.push_back(body.getPart().mesh.nodeNumbers[size_t(k % 8)]);
    StressRecovery nodes(body, numbers);
    Array_<SymMat33> stress, strain;
    Array_<Vec3> principal, velocity;
    Vector vonMises;
    // The first run sizes the results. With few threads available, OpenMP may allocate memory
    // itself.
    constexpr int Most = 5;
    for (int run = 0; run < Most && (run <= 1 || numAllocations > 0); ++run) {
        numAllocations = 0;
        isCounting = run > 0;
        nodes.calcStress(state, stress, StressRecovery::Axes::Ground);
        nodes.calcStrain(state, strain);
        nodes.calcVonMises(state, vonMises);
        nodes.calcPrincipalStress(state, principal);
        nodes.calcVelocity(state, velocity);
        isCounting = false;
    }
    EXPECT_EQ(numAllocations, 0);
    EXPECT_GT(vonMises.normInf() + principal[0].norm(), 0);
}

}  // namespace
}  // namespace simflex

#endif
