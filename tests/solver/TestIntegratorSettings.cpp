// Settings of accuracy take effect at initialize(), the others at the next step, whoever sets them;
// a checkpoint holds those in use.

#include <gtest/gtest.h>

#include <sstream>

#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

/** A four-bar of pins closed by a ball, and a driven pin, because of which equations are built anew
after each event. A handler slows the crank every 0.05 s. **/
struct SlowedFourBar {
    class Brake : public PeriodicEventHandler {
    public:
        explicit Brake(const SlowedFourBar& model) : PeriodicEventHandler(0.05), m_model(model) {}
        void handleEvent(State& state, Real, bool&) const override {
            m_model.crank.setOneU(state, 0, 0.9 * m_model.crank.getOneU(state, 0));
            if (m_model.onEvent) m_model.onEvent(state.getTime());
        }

    private:
        const SlowedFourBar& m_model;
    };

    SlowedFourBar() {
        Motion::Sinusoid(driven, Motion::Position, 0.4, 9, 0.1);
        system.addEventHandler(new Brake(*this));
        start = system.realizeTopology();
        crank.setAngle(start, 1.1);
        coupler.setAngle(start, -0.8);
        follower.setAngle(start, 1.6);
        crank.setRate(start, 5);
    }
    SlowedFourBar(const SlowedFourBar&) = delete;
    static Body::Rigid makeBar(Real mass, Real length) {
        return Body::Rigid(
            MassProperties(mass, Vec3(length / 2, 0, 0),
                           mass * Inertia(0.01, length * length / 3, length * length / 3)));
    }

    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Pin crank{matter.Ground(), Transform(), makeBar(3, 0.5), Transform()};
    MobilizedBody::Pin coupler{crank, Transform(Vec3(0.5, 0, 0)), makeBar(1, 2), Transform()};
    MobilizedBody::Pin follower{matter.Ground(), Transform(Vec3(2, 0, 0)), makeBar(7, 1),
                                Transform()};
    Constraint::Ball joint{coupler, Vec3(2, 0, 0), follower, Vec3(1, 0, 0)};
    MobilizedBody::Pin driven{matter.Ground(), Transform(), makeBar(1, 1), Transform()};
    std::function<void(Real time)> onEvent;
    State start;
};

using Set = std::function<void(ImplicitIntegrator&)>;
struct Setting {
    const char* name;
    Set set;
};

enum class Place { BetweenCalls, Handler, Observer };
constexpr Place Places[] = {Place::BetweenCalls, Place::Handler, Place::Observer};

/** A run in which a setting is changed at 0.12 s, or in the next event. **/
struct ChangedRun {
    static constexpr Real Change = 0.12, Event = 0.15, Later = 0.17, End = 0.4;

    explicit ChangedRun(const Set& setBefore = {}) {
        if (setBefore) setBefore(integrator);
        integrator.setStepObserver([this](Real time) {
            if (time > Change && onStep) std::exchange(onStep, {})();
            return true;
        });
    }
    /** Runs until after the change. **/
    void pass(const Setting& setting, Place place) {
        const auto set = [this, &setting] { setting.set(integrator); };
        if (place == Place::Observer) onStep = set;
        if (place == Place::Handler)
            model.onEvent = [set](Real time) {
                if (std::abs(time - Event) < 1e-9) set();
            };
        integrator.initialize(model.start);
        integrator.stepTo(Change);
        if (place == Place::BetweenCalls) set();
        // An event builds equations anew.
        integrator.stepTo(place == Place::Handler ? Later : Change + 0.01);
        EXPECT_FALSE(onStep) << "the observer has set it";
    }
    std::string write() {
        std::ostringstream stream;
        integrator.writeCheckpoint(stream);
        return stream.str();
    }
    void read(const std::string& bytes) {
        std::istringstream stream(bytes);
        integrator.readCheckpoint(stream, model.start);
    }
    std::vector<Real> finish() {
        integrator.stepTo(End);
        std::vector<Real> numbers{integrator.getLastStepSize(),
                                  Real(integrator.getLastOrder()),
                                  integrator.getWork(),
                                  integrator.getConstraintToleranceInUse(),
                                  Real(integrator.getNumStepsTaken()),
                                  Real(integrator.getNumStepsAttempted()),
                                  Real(integrator.getNumIterations()),
                                  Real(integrator.getNumQProjections())};
        const Vector y = integrator.getState().getY(), lambda = integrator.getMultipliers();
        for (const Vector* vector : {&y, &lambda})
            for (int i = 0; i < vector->size(); ++i) numbers.push_back((*vector)[i]);
        return numbers;
    }

    SlowedFourBar model;
    BdfIntegrator integrator{model.system};
    std::function<void()> onStep;
};

const Setting OfTheNextRun[] = {
    {"setAccuracy", [](ImplicitIntegrator& i) { i.setAccuracy(1e-7); }},
    {"setConstraintTolerance", [](ImplicitIntegrator& i) { i.setConstraintTolerance(1e-12); }},
    {"setInitialStepSize", [](ImplicitIntegrator& i) { i.setInitialStepSize(1e-5); }},
    {"setUseInfinityNorm", [](ImplicitIntegrator& i) { i.setUseInfinityNorm(true); }},
};

TEST(IntegratorSettings, OfTheNextRunChangeNoBitOfThisOneAndNoCheckpointOfIt) {
    ChangedRun unchanged;
    unchanged.integrator.initialize(unchanged.model.start);
    const std::vector<Real> expected = unchanged.finish();
    for (const Setting& setting : OfTheNextRun)
        for (const Place place : Places) {
            SCOPED_TRACE(setting.name + std::string(" at place ") + std::to_string(int(place)));
            ChangedRun run, resumed;
            run.pass(setting, place);
            const std::string checkpoint = run.write();
            EXPECT_EQ(run.finish(), expected);
            ASSERT_NO_THROW(resumed.read(checkpoint));
            EXPECT_EQ(resumed.finish(), expected);

            ChangedRun fromTheStart(setting.set);
            fromTheStart.integrator.initialize(fromTheStart.model.start);
            const std::vector<Real> other = fromTheStart.finish();
            run.integrator.initialize(run.model.start);
            EXPECT_EQ(run.finish(), other);
            EXPECT_NE(other, expected);
        }
}

const Setting OfTheNextStep[] = {
    {"setMaximumStepSize", [](ImplicitIntegrator& i) { i.setMaximumStepSize(1e-3); }},
    {"setMinimumStepSize", [](ImplicitIntegrator& i) { i.setMinimumStepSize(1e-5); }},
    {"setFixedStepSize", [](ImplicitIntegrator& i) { i.setFixedStepSize(1e-3); }},
    {"setForceFullNewton", [](ImplicitIntegrator& i) { i.setForceFullNewton(true); }},
    {"setAllowInterpolation", [](ImplicitIntegrator& i) { i.setAllowInterpolation(false); }},
    {"setProjectInterpolatedStates",
     [](ImplicitIntegrator& i) { i.setProjectInterpolatedStates(false); }},
    {"setNumThreads", [](ImplicitIntegrator& i) { i.setNumThreads(2); }},
};

TEST(IntegratorSettings, OfTheNextStepGoOnFromACheckpointWithTheSameBits) {
    for (const Setting& setting : OfTheNextStep)
        for (const Place place : Places) {
            SCOPED_TRACE(setting.name + std::string(" at place ") + std::to_string(int(place)));
            ChangedRun run, resumed(setting.set);
            run.pass(setting, place);
            ASSERT_NO_THROW(resumed.read(run.write()));
            EXPECT_EQ(resumed.finish(), run.finish());
        }
}

TEST(IntegratorSettings, ThatDetermineStepsAreThoseOfTheCheckpoint) {
    const std::string checkpoint = [] {
        ChangedRun run;
        run.integrator.initialize(run.model.start);
        return run.write();
    }();
    const Setting all[] = {
        {"setInitialStepSize", OfTheNextRun[2].set},
        {"setTriggerSamples", [](ImplicitIntegrator& i) { i.setTriggerSamples(3); }},
        {"setProjectionNorm",
         [](ImplicitIntegrator& i) {
             i.setProjectionNorm(ImplicitIntegrator::ProjectionNorm::Inertia);
         }},
        {"setProjectInterpolatedStates", OfTheNextStep[5].set},
        {"setNewtonTolerances", [](ImplicitIntegrator& i) { i.setNewtonTolerances({}); }},
    };
    for (const Setting& setting : all) {
        ChangedRun other(setting.set);
        try {
            other.read(checkpoint);
            ADD_FAILURE() << setting.name << " was not compared";
        } catch (const std::runtime_error& error) {
            EXPECT_NE(std::string(error.what()).find(setting.name), std::string::npos)
                << error.what();
        }
    }
}

TEST(IntegratorSettings, OfTheNextRunAreNotTakenByACheckpointThatIsRefused) {
    ChangedRun run;
    run.integrator.initialize(run.model.start);
    ChangedRun unchanged;
    unchanged.integrator.initialize(unchanged.model.start);
    const std::string checkpoint = run.write();
    run.integrator.setConstraintTolerance(1e-12);
    EXPECT_THROW(run.read(checkpoint), std::runtime_error);
    EXPECT_EQ(run.finish(), unchanged.finish());
}

}  // namespace
}  // namespace simflex
