// Handlers and reporters: their changes and call times.

#include "programs/Program.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A bar on a pin under gravity, with a force set by handlers. **/
struct Pendulum : Basics {
    explicit Pendulum(Model& model)
        : Basics(model),
          bar(matter.Ground(), Vec3(0),
              Body::Rigid(MassProperties(1, Vec3(0, -0.5, 0), Inertia(0.34, 0.01, 0.34))), Vec3(0)),
          motor(forces, bar, MobilizerUIndex(0)) {}
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Pin bar;
    Force::MobilityDiscreteForce motor;
};

/** Samples angle and speed every 0.05 s and holds the torque until the next sample. **/
class DigitalControl : public PeriodicEventHandler {
public:
    DigitalControl(Model& model, const Pendulum& pendulum)
        : PeriodicEventHandler(0.05),
          m_model(model),
          m_bar(pendulum.bar),
          m_motor(pendulum.motor) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_model.note("control", state);
        m_motor.setMobilityForce(state,
                                 -12 * (m_bar.getAngle(state) - 1) - 2 * m_bar.getRate(state));
    }

private:
    Model& m_model;
    MobilizedBody::Pin m_bar;
    Force::MobilityDiscreteForce m_motor;
};

std::unique_ptr<Model> makeDigitalControl() {
    auto model = std::make_unique<Model>();
    Pendulum& pendulum = model->make<Pendulum>();
    model->system.addEventHandler(new DigitalControl(*model, pendulum));
    model->state = model->system.realizeTopology();
    model->duration = 2;  // a sample is due here: the next call of stepTo() takes it
    return model;
}

/** Calls a function where a function of the State passes zero. **/
class Trigger : public TriggeredEventHandler {
public:
    using Function = std::function<Real(const State&)>;
    using Action = std::function<void(State&)>;
    Trigger(Model& model, const std::string& name, Stage stage, const Function& function,
            const Action& action)
        : TriggeredEventHandler(stage),
          m_model(model),
          m_name(name),
          m_function(function),
          m_action(action) {}
    Trigger* onlyRising() {
        getTriggerInfo().setTriggerOnFallingSignTransition(false);
        return this;
    }
    Trigger* onlyFalling() {
        getTriggerInfo().setTriggerOnRisingSignTransition(false);
        return this;
    }
    Real getValue(const State& state) const override { return m_function(state); }
    void handleEvent(State& state, Real, bool&) const override {
        m_model.note(m_name, state);
        m_action(state);
    }

private:
    Model& m_model;
    std::string m_name;
    Function m_function;
    Action m_action;
};

// The motor pushes from the first passage of 0.3 rad, and stops at −0.4 rad.
std::unique_ptr<Model> makeSwitchedMotor() {
    auto model = std::make_unique<Model>();
    Pendulum& pendulum = model->make<Pendulum>();
    const MobilizedBody::Pin bar = pendulum.bar;
    const Force::MobilityDiscreteForce motor = pendulum.motor;
    const auto setTorque = [motor](Real torque) {
        return [motor, torque](State& state) { motor.setMobilityForce(state, torque); };
    };
    model->system.addEventHandler(
        (new Trigger(
             *model, "push", Stage::Position,
             [bar](const State& s) { return bar.getAngle(s) - 0.3; }, setTorque(-2)))
            ->onlyRising());
    model->system.addEventHandler(
        (new Trigger(
             *model, "let go", Stage::Position,
             [bar](const State& s) { return bar.getAngle(s) + 0.4; }, setTorque(0)))
            ->onlyFalling());
    model->state = model->system.realizeTopology();
    pendulum.bar.setRate(model->state, 3);
    model->duration = 3;
    return model;
}

// Heats below 20 degrees, cools above 22; z is the temperature. Many events in sequence.
struct Heated : Basics {
    explicit Heated(Model& model)
        : Basics(model), mass(matter.Ground(), ball(1)), heater(forces, mass, MobilizerUIndex(0)) {}
    MobilizedBody::Slider mass;
    Force::MobilityDiscreteForce heater;
};

std::unique_ptr<Model> makeTwoPointControl() {
    auto model = std::make_unique<Model>();
    Heated& room = model->make<Heated>();
    Force::MobilityLinearDamper(room.forces, room.mass, MobilizerUIndex(0), 1.5);
    const MobilizedBody::Slider mass = room.mass;
    const Force::MobilityDiscreteForce heater = room.heater;
    model->system.addEventHandler((new Trigger(
                                       *model, "on", Stage::Velocity,
                                       [mass](const State& s) { return mass.getRate(s) - 0.95; },
                                       [heater](State& s) { heater.setMobilityForce(s, 4); }))
                                      ->onlyFalling());
    model->system.addEventHandler((new Trigger(
                                       *model, "off", Stage::Velocity,
                                       [mass](const State& s) { return mass.getRate(s) - 1.05; },
                                       [heater](State& s) { heater.setMobilityForce(s, 0); }))
                                      ->onlyRising());
    model->state = model->system.realizeTopology();
    room.heater.setMobilityForce(model->state, 4);
    return model;
}

// A ball that bounces lower and lower until it is slow enough to stay.
std::unique_ptr<Model> makeBouncingBall() {
    auto model = std::make_unique<Model>();
    struct Fall : Basics {
        explicit Fall(Model& model)
            : Basics(model), mass(matter.Ground(), Rotation(Pi / 2, ZAxis), ball(1), Rotation()) {}
        Force::Gravity gravity{forces, matter, -YAxis, 9.81};
        MobilizedBody::Slider mass;
    };
    Fall& fall = model->make<Fall>();
    const MobilizedBody::Slider mass = fall.mass;
    model->system.addEventHandler(
        (new Trigger(
             *model, "bounce", Stage::Position,
             [mass](const State& s) { return mass.isLocked(s) ? 1 : mass.getLength(s); },
             [mass, &system = model->system](State& s) {
                 const Real rate = -0.6 * mass.getRate(s);
                 if (rate > 0.2) return mass.setOneU(s, 0, rate);
                 mass.setOneU(s, 0, 0);
                 mass.lock(s);
             }))
            ->onlyFalling());
    model->state = model->system.realizeTopology();
    fall.mass.setLength(model->state, 1);
    model->longestStep = 0.02;  // resolves where it rises above the floor
    return model;
}

/** A block pulled along a floor, pressed onto it and lifted off: u in x, y. **/
struct Block : Basics {
    explicit Block(Model& model)
        : Basics(model),
          block(matter.Ground(), Vec3(0), ball(1), Vec3(0)),
          floor(matter.updGround(), YAxis, 0, block, Vec3(0)) {
        floor.setDisabledByDefault(true);
    }
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    MobilizedBody::Translation block;
    Constraint::PointInPlane floor;
};

/** Lifts and presses: 20 sin(5t) up, 3 N along. **/
class Lifting : public Force::Custom::Implementation {
public:
    explicit Lifting(const MobilizedBody& body) : m_body(body) {}
    bool dependsOnlyOnPositions() const override { return false; }
    void calcForce(const State& state, Vector_<SpatialVec>& bodyForces, Vector_<Vec3>&,
                   Vector&) const override {
        m_body.applyBodyForce(
            state, SpatialVec(Vec3(0), Vec3(3, 20 * std::sin(5 * state.getTime()), 0)), bodyForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

private:
    MobilizedBody m_body;
};

// As in Simbody's unilateral examples: a constraint enabled at contact and disabled when its
// multiplier would pull.
std::unique_ptr<Model> makeUnilateralContact() {
    auto model = std::make_unique<Model>();
    Block& block = model->make<Block>();
    Force::Custom(block.forces, new Lifting(block.block));
    const MobilizedBody::Translation body = block.block;
    const Constraint::PointInPlane floor = block.floor;
    model->system.addEventHandler((new Trigger(
                                       *model, "touch down", Stage::Position,
                                       [=](const State& s) {
                                           return floor.isDisabled(s)
                                                      ? body.getBodyOriginLocation(s)[1]
                                                      : 1;
                                       },
                                       [=](State& s) {
                                           Vec3 v = body.getBodyOriginVelocity(s);
                                           v[1] = 0;
                                           body.setUToFitLinearVelocity(s, v);
                                           floor.enable(s);
                                       }))
                                      ->onlyFalling());
    model->system.addEventHandler(
        (new Trigger(
             *model, "lift off", Stage::Acceleration,
             [=](const State& s) { return floor.isDisabled(s) ? 1 : -floor.getMultiplier(s); },
             [=](State& s) { floor.disable(s); }))
            ->onlyFalling());
    model->state = model->system.realizeTopology();
    block.block.setTranslation(model->state, Vec3(0, 0.3, 0));
    model->duration = 3;
    return model;
}

// A bar is locked until its lock carries more than 3 N m, and is caught where it reverses.
std::unique_ptr<Model> makeUnlockingByForce() {
    auto model = std::make_unique<Model>();
    Pendulum& pendulum = model->make<Pendulum>();
    const MobilizedBody::Pin bar = pendulum.bar;
    struct Ramp : Force::Custom::Implementation {
        explicit Ramp(const MobilizedBody& b) : body(b) {}
        bool dependsOnlyOnPositions() const override { return false; }
        void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                       Vector& mobilityForces) const override {
            body.applyOneMobilityForce(state, 0, 6 * std::sin(4 * state.getTime()), mobilityForces);
        }
        Real calcPotentialEnergy(const State&) const override { return 0; }
        MobilizedBody body;
    };
    Force::Custom(pendulum.forces, new Ramp(pendulum.bar));
    const SimbodyMatterSubsystem& matter = model->system.getMatterSubsystem();
    model->system.addEventHandler((new Trigger(
                                       *model, "slips", Stage::Acceleration,
                                       [bar, &matter](const State& s) {
                                           if (!bar.isLocked(s)) return Real(-1);
                                           Vector forces;
                                           matter.findMotionForces(s, forces);
                                           return std::abs(forces[0]) - 3;
                                       },
                                       [bar](State& s) { bar.unlock(s); }))
                                      ->onlyRising());
    model->system.addEventHandler(new Trigger(
        *model, "is caught", Stage::Velocity,
        [bar](const State& s) {
            // Not where it has just started to slip from rest.
            return bar.isLocked(s) ? Real(1) : bar.getRate(s);
        },
        [bar](State& s) { bar.lock(s); }));
    model->state = model->system.realizeTopology();
    pendulum.bar.setAngle(model->state, 0.2);
    pendulum.bar.lock(model->state);
    return model;
}

/** Records the time and the current sign of the torque. **/
class TorqueReport : public PeriodicEventReporter {
public:
    TorqueReport(Model& model, const Pendulum& pendulum, Real interval)
        : PeriodicEventReporter(interval), m_model(model), m_motor(pendulum.motor) {}
    void handleEvent(const State& state) const override {
        const Real torque = m_motor.getMobilityForce(state);
        m_model.note(torque > 0 ? "pushed" : torque < 0 ? "pulled" : "free", state);
    }

private:
    Model& m_model;
    Force::MobilityDiscreteForce m_motor;
};

/** Reverses the torque every 0.3 s, which is not three times 0.1 s in binary. **/
class Turning : public PeriodicEventHandler {
public:
    Turning(Model& model, const Pendulum& pendulum)
        : PeriodicEventHandler(0.3), m_model(model), m_motor(pendulum.motor) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_model.note("turn", state);
        m_motor.setMobilityForce(state, m_motor.getMobilityForce(state) > 0 ? -1 : 1);
    }

private:
    Model& m_model;
    Force::MobilityDiscreteForce m_motor;
};

std::unique_ptr<Model> makeReportsAtHandlers() {
    auto model = std::make_unique<Model>();
    Pendulum& pendulum = model->make<Pendulum>();
    model->system.addEventHandler(new Turning(*model, pendulum));
    model->system.addEventReporter(new TorqueReport(*model, pendulum, 0.1));
    model->system.addEventReporter(new TorqueReport(*model, pendulum, 0.15));
    model->state = model->system.realizeTopology();
    return model;
}

/** Kicks the bar once, at a time set by the previous kick. **/
class Kick : public ScheduledEventHandler {
public:
    Kick(Model& model, const Pendulum& pendulum) : m_model(model), m_bar(pendulum.bar) {}
    Real getNextEventTime(const State& state, bool includeCurrent) const override {
        for (Real time = 0.1; time < 10; time *= 1.6)
            if (time > state.getTime() || (includeCurrent && time == state.getTime())) return time;
        return Infinity;
    }
    void handleEvent(State& state, Real, bool& shouldTerminate) const override {
        m_model.note("kick", state);
        m_bar.setOneU(state, 0, 1 - 0.5 * m_bar.getRate(state));
        shouldTerminate = state.getTime() > 1.5;
    }

private:
    Model& m_model;
    MobilizedBody::Pin m_bar;
};

std::unique_ptr<Model> makeKicksUntilTheEnd() {
    auto model = std::make_unique<Model>();
    Pendulum& pendulum = model->make<Pendulum>();
    model->system.addEventHandler(new Kick(*model, pendulum));
    model->state = model->system.realizeTopology();
    pendulum.bar.setAngle(model->state, 0.7);
    return model;
}

}  // namespace

std::vector<Program> getEventPrograms() {
    return {
        {"DigitalControl", makeDigitalControl},       {"SwitchedMotor", makeSwitchedMotor},
        {"TwoPointControl", makeTwoPointControl},     {"BouncingBall", makeBouncingBall},
        {"UnilateralContact", makeUnilateralContact}, {"UnlockingByForce", makeUnlockingByForce},
        {"ReportsAtHandlers", makeReportsAtHandlers}, {"KicksUntilTheEnd", makeKicksUntilTheEnd}};
}

}  // namespace simflex::test
