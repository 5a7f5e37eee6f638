// An integration interrupted anywhere and continued from a checkpoint by another integrator is
// bit-identical; invalid checkpoints are refused.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <functional>
#include <sstream>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/AttachmentForce.h"
#include "simflex/forces/ContactStop.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"
#include "solver/SliderCrankModel.h"
#include "support/DoublePendulum.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using Formulation = ImplicitIntegrator::Formulation;
using MakeIntegrator = std::function<std::unique_ptr<ImplicitIntegrator>(int threads)>;

void append(std::vector<double>& numbers, const Vector& vector) {
    for (int i = 0; i < vector.size(); ++i) numbers.push_back(vector[i]);
}

/** Returns everything that a user can observe of an integration except wall times. **/
std::vector<double> describe(const ImplicitIntegrator& integrator) {
    const State& state = integrator.getState();
    const IntegratorStatistics& s = integrator.getStatistics();
    std::vector<double> numbers{state.getTime(),
                                integrator.getTime(),
                                integrator.getWork(),
                                integrator.getLargestConstraintError(),
                                integrator.getLastStepSize(),
                                double(integrator.getLastOrder()),
                                s.smallestStep,
                                s.largestStep,
                                s.timeCovered,
                                s.sumOfSquaredLogRatios};
    for (const long count :
         {s.stepsTaken, s.stepsAttempted, s.errorTestFailures, s.convergenceFailures,
          s.projectionFailures, s.nonFiniteFailures, s.stepRatios, s.newtonIterations,
          s.linearSolves, s.factorizations, s.denseFactorizations, s.projections,
          long(s.redundantConstraints), s.starts, s.reports, s.scheduledEvents, s.triggeredEvents,
          s.timeAdvancedEvents})
        numbers.push_back(double(count));
    for (const long steps : s.stepsAtOrder) numbers.push_back(double(steps));
    for (const Vector& vector : {state.getQ(), state.getU(), state.getZ(), integrator.getUDot(),
                                 integrator.getMultipliers()})
        append(numbers, vector);
    return numbers;
}

/** Takes two internal steps, then advances to a time inside the next one. **/
void advance(ImplicitIntegrator& integrator, int count) {
    if (count % 3 < 2)
        integrator.stepOnce();
    else
        integrator.stepTo(integrator.getTime() + 0.4 * integrator.getLastStepSize());
}

std::string write(ImplicitIntegrator& integrator) {
    std::ostringstream stream;
    integrator.writeCheckpoint(stream);
    return stream.str();
}

void read(ImplicitIntegrator& integrator, const std::string& bytes, const State& start) {
    std::istringstream stream(bytes);
    integrator.readCheckpoint(stream, start);
}

/** Returns the index of the first difference, or −1 for none. NaN equals NaN. **/
int findDifference(const std::vector<double>& a, const std::vector<double>& b) {
    if (a.size() != b.size()) return int(std::min(a.size(), b.size()));
    for (size_t i = 0; i < a.size(); ++i)
        if (std::memcmp(&a[i], &b[i], sizeof a[i]) != 0) return int(i);
    return -1;
}

/** Runs `numAdvances` advances without interruption, again with a checkpoint after each advance,
and from every `stride`-th checkpoint to the end. @returns statistics of the run **/
IntegratorStatistics expectSameBits(const MakeIntegrator& make, const State& start, int numAdvances,
                                    int stride = 1) {
    const auto whole = make(1);
    whole->initialize(start);
    std::vector<std::vector<double>> expected{describe(*whole)};
    for (int i = 0; i < numAdvances; ++i) {
        advance(*whole, i);
        expected.push_back(describe(*whole));
    }
    const auto written = make(1);
    written->initialize(start);
    std::vector<std::string> checkpoints{write(*written)};
    for (int i = 0; i < numAdvances; ++i) {
        advance(*written, i);
        EXPECT_EQ(findDifference(describe(*written), expected[size_t(i + 1)]), -1)
            << "after writing " << i + 1 << " checkpoints";
        checkpoints.push_back(write(*written));
    }
    for (int from = 0; from < numAdvances; from += stride) {
        const auto resumed = make(from / stride % 4 == 1 ? 3 : 1);
        read(*resumed, checkpoints[size_t(from)], start);
        EXPECT_EQ(findDifference(describe(*resumed), expected[size_t(from)]), -1)
            << "right after reading checkpoint " << from;
        for (int i = from; i < numAdvances; ++i) {
            advance(*resumed, i);
            const int place = findDifference(describe(*resumed), expected[size_t(i + 1)]);
            if (place < 0) continue;
            ADD_FAILURE() << "continued from checkpoint " << from << ", number " << place
                          << " differs after advance " << i + 1 << " of " << numAdvances;
            return whole->getStatistics();
        }
    }
    return whole->getStatistics();
}

MakeIntegrator makeBdf(const MultibodySystem& system, int maximumOrder = 2,
                       Formulation formulation = Formulation::StabilizedIndex2,
                       Real accuracy = 1e-6) {
    return [=, &system](int threads) {
        auto integrator = std::make_unique<BdfIntegrator>(system);
        integrator->setMaximumOrder(maximumOrder);
        integrator->setFormulation(formulation);
        integrator->setAccuracy(accuracy);
        integrator->setNumThreads(threads);
        return integrator;
    };
}

MakeIntegrator makeRadau(const MultibodySystem& system, Real accuracy = 1e-6) {
    return [=, &system](int threads) {
        auto integrator = std::make_unique<RadauIntegrator>(system);
        integrator->setAccuracy(accuracy);
        integrator->setNumThreads(threads);
        return integrator;
    };
}

MakeIntegrator makeGeneralizedAlpha(const MultibodySystem& system,
                                    Formulation formulation = Formulation::StabilizedIndex2) {
    return [=, &system](int threads) {
        auto integrator = std::make_unique<GeneralizedAlphaIntegrator>(system);
        integrator->setFormulation(formulation);
        integrator->setNumThreads(threads);
        return integrator;
    };
}

//---------------------------------------------------------------------------------------------------------
// schemes, formulations and orders

TEST(Checkpoint, SchemesInTheirFormulationsGoOnWithTheSameBits) {
    const FlexibleSliderCrank model;
    expectSameBits(makeRadau(model.system), model.state, 20, 3);
    for (const Formulation formulation : {Formulation::StabilizedIndex2, Formulation::Index3}) {
        SCOPED_TRACE(formulation == Formulation::Index3 ? "Index3" : "StabilizedIndex2");
        expectSameBits(makeBdf(model.system, 2, formulation), model.state, 20, 3);
        SCOPED_TRACE("generalized-alpha");
        expectSameBits(makeGeneralizedAlpha(model.system, formulation), model.state, 20, 3);
    }
}

TEST(Checkpoint, ChangesOfOrderGoOnWithTheSameBits) {
    DoublePendulum model;
    const IntegratorStatistics statistics = expectSameBits(
        makeBdf(model.system, 5, Formulation::StabilizedIndex2, 1e-8), model.makeState(), 80, 3);
    int orders = 0;
    for (const long steps : statistics.stepsAtOrder) orders += steps > 0;
    EXPECT_GE(orders, 3);
}

TEST(Checkpoint, FixedStepsGoOnWithTheSameBits) {
    DoublePendulum model;
    const MakeIntegrator make = [&](int threads) {
        auto integrator = std::make_unique<BdfIntegrator>(model.system);
        integrator->setFixedStep(1e-3);
        integrator->setFixedOrder(3);
        integrator->setNumThreads(threads);
        return integrator;
    };
    expectSameBits(make, model.makeState(), 15);
}

//---------------------------------------------------------------------------------------------------------
// all kinds of moments

/** Two booms on ball joints, end to end, over a stop onto which the outer one falls; a load that
jumps, two times at which the inner boom becomes rigid and flexible again, and a reporter. **/
struct Boom {
    class Switch : public ScheduledEventHandler {
    public:
        explicit Switch(const FlexibleBody& body) : m_body(body) {}
        Real getNextEventTime(const State& state, bool includeCurrent) const override {
            for (const Real time : {0.02, 0.06})
                if (state.getTime() < time || (includeCurrent && state.getTime() == time))
                    return time;
            return Infinity;
        }
        void handleEvent(State& state, Real, bool&) const override {
            if (state.getTime() < 0.04)
                m_body.setRigid(state);
            else
                m_body.setFlexible(state);
        }

    private:
        FlexibleBody m_body;
    };
    /** Reverses the stone's speed where it passes 0.05 m. **/
    class Wall : public TriggeredEventHandler {
    public:
        explicit Wall(const MobilizedBody& stone)
            : TriggeredEventHandler(Stage::Position), m_stone(stone) {
            getTriggerInfo().setTriggerOnFallingSignTransition(false);
        }
        Real getValue(const State& state) const override {
            return m_stone.getOneQ(state, 0) - 0.05;
        }
        void handleEvent(State& state, Real, bool&) const override {
            m_stone.setOneU(state, 0, -std::abs(m_stone.getOneU(state, 0)));
        }

    private:
        const MobilizedBody& m_stone;
    };
    class Reporter : public PeriodicEventReporter {
    public:
        Reporter() : PeriodicEventReporter(0.013) {}
        void handleEvent(const State&) const override {}
    };

    explicit Boom(double stiffening = 0)
        : matter(system),
          forces(system),
          gravity(forces, matter, -ZAxis, 9.81),
          flexible(system, matter),
          inner(flexible, makePart(4, stiffening), "inner"),
          outer(flexible, makePart(7, stiffening), "outer"),
          stone(matter.Ground(), Body::Rigid(MassProperties(1, Vec3(0), Inertia(1)))) {
        Joint::Ball(flexible, matter.Ground(), inner.interface("A"), "root");
        Joint::Pin(flexible, inner.interface("B"), outer.interface("A"), "knee");
        ContactStop(flexible, Attachment(matter.Ground(), Transform(Vec3(0, 0, -0.03))),
                    outer.interface("B"), 3e4, 0.1);
        AttachmentForce(flexible, outer.interface("B"), [](Real t) {
            return SpatialVec(Vec3(0), Vec3(0, t > 0.035 && t < 0.05 ? 40 : 0, 0));
        });
        ModalDamping(flexible, outer, 0.02);
        system.addEventHandler(new Switch(inner));
        system.addEventHandler(new Wall(stone));
        system.addEventReporter(new Reporter());
    }
    State makeState() {
        State state = system.realizeTopology();
        inner.setPoseByInterface(state, "A", Transform());
        system.realize(state, Stage::Velocity);
        outer.setPoseByInterface(state, "A", inner.interface("B").calcMotion(state).X);
        stone.setOneU(state, 0, 1.3);
        return state;
    }
    static std::shared_ptr<const ReducedBody> makePart(unsigned seed, double stiffening) {
        PointMassPartOptions options;
        options.seed = seed;
        options.numModes = 5;
        options.highestFrequency = 80;
        options.stiffening = stiffening;
        return makePointMassPart(options).body;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    FlexibleBody inner, outer;
    MobilizedBody::Slider stone;
};

TEST(Checkpoint, EventsContactsFailedStepsAndRigidSwitchesGoOnWithTheSameBits) {
    for (const double stiffening : {0.0, 20.0}) {
        Boom model(stiffening);
        const IntegratorStatistics statistics =
            expectSameBits(makeBdf(model.system, 4, Formulation::StabilizedIndex2, 1e-5),
                           model.makeState(), 240, 7);
        // All of these occurred in the run.
        EXPECT_EQ(statistics.scheduledEvents, 2);
        EXPECT_EQ(statistics.triggeredEvents, 1);
        EXPECT_GT(statistics.reports, 5);
        EXPECT_GT(statistics.errorTestFailures, 0);
        expectSameBits(makeGeneralizedAlpha(model.system), model.makeState(), 100, 9);
        expectSameBits(makeRadau(model.system, 1e-8), model.makeState(), 100, 9);
    }
}

TEST(Checkpoint, DenseBlocksAndAReturnToArrowsGoOnWithTheSameBits) {
    // The spin is fast and the accuracy loose enough for arrow iterations to fail now and then.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    FlexibleBody body(flexible, Boom::makePart(4, 0), "rotor");
    State state = system.realizeTopology();
    body.setFrameVelocity(state, SpatialVec(Vec3(3, 5, 200), Vec3(0)));
    for (const auto form :
         {ImplicitIntegrator::BlockForm::Dense, ImplicitIntegrator::BlockForm::Automatic}) {
        const MakeIntegrator make = [&](int threads) {
            auto integrator = makeBdf(system, 2, Formulation::StabilizedIndex2, 1e-2)(threads);
            integrator->setBlockForm(form);
            return integrator;
        };
        const IntegratorStatistics statistics = expectSameBits(make, state, 120, 7);
        EXPECT_GT(statistics.denseFactorizations, 0);
        EXPECT_TRUE(form == ImplicitIntegrator::BlockForm::Dense ||
                    statistics.denseFactorizations < statistics.factorizations);
    }
}

//---------------------------------------------------------------------------------------------------------
// evaluated by Simbody

/** Simbody's own mobilizers, Motions, locks, constraints, forces and Measures. **/
struct Foreign {
    Foreign()
        : matter(system),
          forces(system),
          gravity(forces, matter, -YAxis, 9.81),
          flexible(system, matter),
          base(matter.Ground(), makeBody(1)),
          arm(base, Transform(Vec3(0.2, 0, 0)), makeBody(0.5), Transform(Vec3(-0.3, 0, 0)),
              MobilizedBody::Reverse),
          free(matter.Ground(), makeBody(0.7)),
          locked(matter.Ground(), makeBody(1)),
          boom(flexible, makePointMassPart().body, "boom"),
          sine(forces, 1.5, 4, 0.3),
          integral(forces, sine, Measure::Constant(forces, 0.7)),
          largest(forces, sine, Measure::Extreme::Maximum) {
        Motion::Sinusoid(base, Motion::Position, 0.4, 9, 0.1);
        Constraint::Rod(arm, Vec3(0.1, 0, 0), free, Vec3(0), 0.6);
        Constraint::ConstantSpeed(free, MobilizerUIndex(4), 0.2);
        spring = Force::TwoPointLinearSpring(forces, matter.Ground(), Vec3(0, 1, 0), free,
                                             Vec3(0.1, 0, 0), 4000, 0.5);
        Force::MobilityLinearDamper(forces, arm, MobilizerUIndex(0), 0.3);
        Joint::Ball(flexible, Attachment(locked, Transform()), boom.interface("A"), "hook");
    }
    static Body::Rigid makeBody(Real mass) {
        return Body::Rigid(
            MassProperties(mass, Vec3(0.01, 0.02, 0), mass * Inertia(0.1, 0.2, 0.25)));
    }
    State makeState() {
        State state = system.realizeTopology();
        system.realizeModel(state);
        free.setQToFitTranslation(state, Vec3(0.5, -0.3, 0.1));
        arm.setQToFitRotation(state, Rotation(0.3, XAxis));
        locked.lockAt(state, Vector(Vec3(0.2, -0.4, 0)), Motion::Acceleration);
        return state;
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    FlexibleBodySubsystem flexible;
    MobilizedBody::Pin base;
    MobilizedBody::Gimbal arm;
    MobilizedBody::Free free;
    MobilizedBody::Translation locked;
    FlexibleBody boom;
    Measure::Sinusoid sine;
    Measure::Integrate integral;
    Measure::Extreme largest;
    Force spring;
};

TEST(Checkpoint, WhatSimbodyEvaluatesGoesOnWithTheSameBits) {
    Foreign model;
    const State state = model.makeState();
    for (const bool usesEulerAngles : {false, true}) {
        State start = state;
        model.matter.setUseEulerAngles(start, usesEulerAngles);
        model.system.realizeModel(start);
        if (usesEulerAngles) model.matter.convertToEulerAngles(state, start);
        model.free.setQToFitTranslation(start, Vec3(0.5, -0.3, 0.1));
        for (const bool isDifferenced : {false, true}) {
            const MakeIntegrator make = [&](int threads) {
                auto integrator = makeBdf(model.system, 3)(threads);
                if (isDifferenced) integrator->addForceJacobian(model.spring);
                return integrator;
            };
            expectSameBits(make, start, 25, 3);
        }
        expectSameBits(makeGeneralizedAlpha(model.system), start, 25, 3);
    }
}

TEST(Checkpoint, RedundantConstraintsBesideALateBlockGoOnWithTheSameBits) {
    // One axle on twenty pins: with so many columns its speeds remain unknowns of the last step, a
    // scheme that is dropped where redundancies are found.
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    GeneralForceSubsystem forces(system);
    Force::Gravity gravity(forces, matter, -YAxis, 9.81);
    FlexibleBodySubsystem flexible(system, matter);
    const Body::Rigid axle(MassProperties(2, Vec3(0.1, 0, 0), Inertia(1, 1, 2)));
    MobilizedBody::Free body(matter.Ground(), axle);
    for (int k = 0; k < 20; ++k) {
        const Transform bearing(Vec3(0, 0, 0.1 * k));
        Joint::Pin(flexible, Attachment(matter.Ground(), bearing), Attachment(body, bearing),
                   "bearing " + std::to_string(k));
    }
    const State start = system.realizeTopology();
    const IntegratorStatistics statistics = expectSameBits(makeBdf(system), start, 20);
    EXPECT_EQ(statistics.redundantConstraints, 95);
    const auto resumed = makeBdf(system)(1), whole = makeBdf(system)(1);
    whole->initialize(start);
    whole->stepTo(0.05);
    read(*resumed, write(*whole), start);
    EXPECT_EQ(resumed->getRedundantConstraints(), whole->getRedundantConstraints());
}

//---------------------------------------------------------------------------------------------------------
// refusals

template <class F>
std::string messageOf(F f) {
    try {
        f();
    } catch (const std::exception& error) {
        return error.what();
    }
    return "";
}

void expectContains(const std::string& message, std::initializer_list<const char*> words) {
    for (const char* word : words)
        EXPECT_NE(message.find(word), std::string::npos) << "'" << word << "' in: " << message;
}

/** Falling stones of mass `mass`. **/
struct Stone {
    explicit Stone(Real mass = 1, int count = 1)
        : matter(system), forces(system), gravity(forces, matter, -YAxis, 9.81) {
        for (int i = 0; i < count; ++i)
            stone = MobilizedBody::Slider(matter.Ground(),
                                          Body::Rigid(MassProperties(mass, Vec3(0), Inertia(1))));
    }
    MultibodySystem system;
    SimbodyMatterSubsystem matter;
    GeneralForceSubsystem forces;
    Force::Gravity gravity;
    MobilizedBody::Slider stone;
};

TEST(Checkpoint, ACutOrDamagedFileIsRefusedAtEveryByte) {
    Stone model;
    const State start = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.initialize(start);
    integrator.stepTo(0.01);
    const std::string whole = write(integrator);
    for (size_t size = 0; size < whole.size(); ++size) {
        const std::string message =
            messageOf([&] { read(integrator, whole.substr(0, size), start); });
        expectContains(message, {"the checkpoint cannot be used"});
    }
    for (size_t at = 0; at < whole.size(); at += 3) {
        std::string damaged = whole;
        damaged[at] = char(damaged[at] ^ 0x20);
        EXPECT_NE(messageOf([&] { read(integrator, damaged, start); }), "") << "byte " << at;
    }
    // None of this changed the integrator.
    EXPECT_EQ(write(integrator), whole);
}

TEST(Checkpoint, ForeignAndNewerFilesAreRefused) {
    Stone model;
    const State start = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    expectContains(messageOf([&] { read(integrator, "simflex: 1\ntitle: a model\n", start); }),
                   {"no simflex checkpoint"});
    integrator.initialize(start);
    std::string newer = write(integrator);
    newer[newer.find('\n') + 5] = 99;
    expectContains(messageOf([&] { read(integrator, newer, start); }),
                   {"version 99", "newer simflex is needed"});
}

TEST(Checkpoint, AnotherModelIsRefusedByWhatDiffers) {
    Stone model, heavier(1.5), two(1, 2);
    BdfIntegrator integrator(model.system);
    integrator.initialize(model.system.realizeTopology());
    const std::string checkpoint = write(integrator);
    for (Stone* other : {&heavier, &two}) {
        const State start = other->system.realizeTopology();
        BdfIntegrator resumed(other->system);
        expectContains(messageOf([&] { read(resumed, checkpoint, start); }),
                       {"another model", other == &heavier ? "mass or frames of mobilized body 1"
                                                           : "2 mobilized bodies instead of 3"});
        EXPECT_THROW(resumed.getState(), std::logic_error);
    }
    Boom soft, stiffened(20);
    const auto boom = makeBdf(soft.system)(1), other = makeBdf(stiffened.system)(1);
    boom->initialize(soft.makeState());
    const State start = stiffened.makeState();
    EXPECT_NE(messageOf([&] { read(*other, write(*boom), start); }), "");
}

TEST(Checkpoint, OtherNumbersOfEventTriggersAreRefused) {
    Stone models[3];
    State starts[3];
    std::string checkpoints[3];
    for (int numTriggers = 0; numTriggers < 3; ++numTriggers) {
        Stone& model = models[numTriggers];
        for (int k = 0; k < numTriggers; ++k)
            model.system.addEventHandler(new Boom::Wall(model.stone));
        starts[numTriggers] = model.system.realizeTopology();
        model.stone.setOneU(starts[numTriggers], 0, 1);
        BdfIntegrator integrator(model.system);
        integrator.initialize(starts[numTriggers]);
        integrator.stepTo(0.01);
        checkpoints[numTriggers] = write(integrator);
    }
    for (int written = 0; written < 3; ++written)
        for (int numTriggers = 0; numTriggers < 3; ++numTriggers) {
            BdfIntegrator resumed(models[numTriggers].system);
            const std::string message =
                messageOf([&] { read(resumed, checkpoints[written], starts[numTriggers]); });
            if (written == numTriggers)
                EXPECT_EQ(message, "");
            else
                expectContains(message, {"event triggers"});
        }
}

TEST(Checkpoint, OtherSettingsAreRefusedByName) {
    Stone model;
    const State start = model.system.realizeTopology();
    BdfIntegrator integrator(model.system);
    integrator.setAccuracy(1e-5);
    integrator.initialize(start);
    const std::string checkpoint = write(integrator);
    BdfIntegrator finer(model.system);
    finer.setAccuracy(1e-7);
    expectContains(messageOf([&] { read(finer, checkpoint, start); }),
                   {"setAccuracy 1e-05 instead of 1e-07", "initialize()"});
    BdfIntegrator nearly(model.system);
    nearly.setAccuracy(1e-5 * (1 + 1e-9));
    expectContains(messageOf([&] { read(nearly, checkpoint, start); }),
                   {"setAccuracy 1e-05 instead of 1.000000001e-05"});
    GeneralizedAlphaIntegrator alpha(model.system);
    alpha.setAccuracy(1e-5);
    expectContains(messageOf([&] { read(alpha, checkpoint, start); }),
                   {"GeneralizedAlphaIntegrator", "BdfIntegrator"});
}

TEST(Checkpoint, AFinishedRunGoesOnToALaterFinalTime) {
    Stone model;
    const State start = model.system.realizeTopology();
    BdfIntegrator shorter(model.system), longer(model.system);
    shorter.setFinalTime(0.1);
    longer.setFinalTime(0.3);
    shorter.initialize(start);
    EXPECT_EQ(shorter.stepTo(1), BdfIntegrator::StepStatus::ReachedFinalTime);
    read(longer, write(shorter), start);
    EXPECT_EQ(longer.stepTo(1), BdfIntegrator::StepStatus::ReachedFinalTime);
    EXPECT_NEAR(longer.getTime(), 0.3, 1e-12);
}

TEST(Checkpoint, VariablesThatCannotBeKeptAreNamed) {
    {
        Stone model;
        const Measure::Sinusoid sine(model.forces, 1.5, 4, 0.3);
        const Measure::Delay delayed(model.forces, sine, 0.05);
        BdfIntegrator integrator(model.system);
        integrator.initialize(model.system.realizeTopology());
        expectContains(messageOf([&] { write(integrator); }),
                       {"no checkpoint can be written", "GeneralForceSubsystem", "Delay",
                        "changes with every step"});
    }
    class LessGravity : public PeriodicEventHandler {
    public:
        explicit LessGravity(const Force::Gravity& gravity)
            : PeriodicEventHandler(0.1), m_gravity(gravity) {}
        void handleEvent(State& state, Real, bool&) const override {
            if (state.getTime() > 0) m_gravity.setMagnitude(state, 1.6);
        }

    private:
        const Force::Gravity& m_gravity;
    };
    Stone model;
    model.system.addEventHandler(new LessGravity(model.gravity));
    State start = model.system.realizeTopology();
    model.gravity.setMagnitude(start, 3.7);  // the value in the State given to both is kept
    BdfIntegrator integrator(model.system), resumed(model.system);
    integrator.initialize(start);
    integrator.stepTo(0.05);
    read(resumed, write(integrator), start);
    resumed.stepTo(0.09);
    EXPECT_NEAR(model.stone.getOneU(resumed.getState(), 0), 0, 1e-12);
    integrator.stepTo(0.15);
    expectContains(messageOf([&] { write(integrator); }),
                   {"no checkpoint can be written", "Gravity", "handler has changed"});
}

TEST(Checkpoint, AReporterMayNotWriteOne) {
    class Writer : public PeriodicEventReporter {
    public:
        Writer() : PeriodicEventReporter(0.1) {}
        void handleEvent(const State&) const override {
            message = messageOf([&] { write(*of); });
        }
        ImplicitIntegrator* of = nullptr;
        mutable std::string message;
    };
    Stone model;
    auto* writer = new Writer();
    model.system.addEventReporter(writer);
    BdfIntegrator integrator(model.system);
    writer->of = &integrator;
    integrator.initialize(model.system.realizeTopology());
    integrator.stepTo(0.05);
    expectContains(writer->message, {"writeCheckpoint", "between"});
    EXPECT_THROW(write(*makeBdf(model.system)(1)), std::logic_error);
}

}  // namespace
}  // namespace simflex::test
