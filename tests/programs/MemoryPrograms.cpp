// Forces with memory: discrete, auto-update and auxiliary variables, Measures.

#include "programs/Program.h"

namespace simflex::test {
namespace {

using namespace SimTK;

/** A mass on a line with a force that depends on its history. **/
struct Line : Basics {
    explicit Line(Model& model) : Basics(model), mass(matter.Ground(), ball(1)) {}
    MobilizedBody::Slider mass;
};

/** Base of forces on the mass of a Line. **/
class LineForce : public Force::Custom::Implementation {
public:
    LineForce(const Model& model, const Line& line)
        : LineForce(line.mass, findOwned(model.system, line.forces)) {}
    LineForce(const MobilizedBody& mass, const Subsystem& forces)
        : m_mass(mass), m_forces(forces) {}
    bool dependsOnlyOnPositions() const override { return false; }
    void calcForce(const State& state, Vector_<SpatialVec>&, Vector_<Vec3>&,
                   Vector& mobilityForces) const override {
        m_mass.applyOneMobilityForce(state, 0, calcForceOnMass(state), mobilityForces);
    }
    Real calcPotentialEnergy(const State&) const override { return 0; }

protected:
    virtual Real calcForceOnMass(const State& state) const = 0;
    Real getX(const State& state) const { return m_mass.getOneQ(state, 0); }
    Real getV(const State& state) const { return m_mass.getOneU(state, 0); }
    const Subsystem& getForces() const { return m_forces; }

private:
    MobilizedBody m_mass;
    const Subsystem& m_forces;
};

/** A force with one numeric auto-update variable, whose next value depends on positions. **/
class RememberingForce : public LineForce {
public:
    RememberingForce(const Model& model, const Line& line, Real first)
        : LineForce(model, line), m_first(first) {}
    void realizeTopology(State& state) const override {
        m_memory = getForces().allocateAutoUpdateDiscreteVariable(
            state, Stage::Dynamics, new Value<Real>(m_first), Stage::Position);
    }
    void realizeVelocity(const State& state) const override { getNext(state); }

protected:
    /** Returns the value from the previous step. **/
    Real getMemory(const State& state) const {
        return Value<Real>::downcast(getForces().getDiscreteVariable(state, m_memory)).get();
    }
    /** Returns the value stored if the step ends here. **/
    Real getNext(const State& state) const {
        if (!getForces().isDiscreteVarUpdateValueRealized(state, m_memory)) {
            Value<Real>::updDowncast(getForces().updDiscreteVarUpdateValue(state, m_memory)) =
                calcNext(state);
            getForces().markDiscreteVarUpdateValueRealized(state, m_memory);
        }
        return Value<Real>::downcast(getForces().getDiscreteVarUpdateValue(state, m_memory)).get();
    }
    virtual Real calcNext(const State& state) const = 0;

private:
    Real m_first;
    mutable DiscreteVariableIndex m_memory;
};

/** A second spring that hooks permanently where the mass passes 0.2 m, unstretched there. **/
class HookForce : public RememberingForce {
public:
    HookForce(const Model& model, const Line& line) : RememberingForce(model, line, 0) {}
    Real calcNext(const State& state) const override {
        return getMemory(state) > 0 || getX(state) > 0.2 ? 1 : 0;
    }
    Real calcForceOnMass(const State& state) const override {
        return getMemory(state) * -30 * (getX(state) - 0.2);
    }
};

std::unique_ptr<Model> makeLatch() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 20, 0);
    Force::Custom(line.forces, new HookForce(*model, line));
    model->state = model->system.realizeTopology();
    line.mass.setOneQ(model->state, 0, -0.5);
    model->duration = 3;
    return model;
}

/** An ideally plastic spring: k = 100 N/m up to 8 N; the memory is its anchor position. **/
class YieldingForce : public RememberingForce {
public:
    YieldingForce(const Model& model, const Line& line) : RememberingForce(model, line, 0) {}
    Real calcNext(const State& state) const override {
        const Real x = getX(state), stretch = x - getMemory(state);
        return x - clamp(-0.08, stretch, 0.08);
    }
    Real calcForceOnMass(const State& state) const override {
        return -100 * (getX(state) - getNext(state));
    }
};

std::unique_ptr<Model> makeYieldingSpring() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    Force::MobilityLinearDamper(line.forces, line.mass, MobilizerUIndex(0), 1);
    Force::Custom(line.forces, new YieldingForce(*model, line));
    model->state = model->system.realizeTopology();
    line.mass.setOneU(model->state, 0, 3);
    return model;
}

/** LuGre bristles between the mass and a belt moving at 0.3 m/s: z is their deflection. **/
class BristleForce : public LineForce {
public:
    using LineForce::LineForce;
    void realizeTopology(State& state) const override {
        m_z = getForces().allocateZ(state, Vector(1, Real(0)));
    }
    void realizeAcceleration(const State& state) const override {
        getForces().updZDot(state)[m_z] = calcZDot(state);
    }
    Real calcForceOnMass(const State& state) const override {
        const Real z = getForces().getZ(state)[m_z];
        return -stiffness * z - 20 * calcZDot(state) - 0.4 * calcSlip(state);
    }

private:
    static constexpr Real stiffness = 2000;
    Real calcSlip(const State& state) const { return getV(state) - 0.3; }
    Real calcZDot(const State& state) const {
        const Real slip = calcSlip(state), z = getForces().getZ(state)[m_z];
        const Real limit = 3 + 2 * std::exp(-square(slip / 0.1));
        return slip - stiffness * std::abs(slip) / limit * z;
    }
    mutable ZIndex m_z;
};

std::unique_ptr<Model> makeBristleFriction() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 30, 0);
    Force::Custom(line.forces, new BristleForce(*model, line));
    model->state = model->system.realizeTopology();
    return model;
}

/** A Measure of the mass's position. **/
class Position : public Measure::Implementation {
public:
    explicit Position(const MobilizedBody& mass) : Measure::Implementation(1), m_mass(mass) {}
    Implementation* cloneVirtual() const override { return new Position(*this); }
    int getNumTimeDerivativesVirtual() const override { return 0; }
    Stage getDependsOnStageVirtual(int) const override { return Stage::Position; }
    void calcCachedValueVirtual(const State& state, int, Real& value) const override {
        value = m_mass.getOneQ(state, 0);
    }

private:
    MobilizedBody m_mass;
};

struct PositionMeasure : Measure {
    explicit PositionMeasure(Line& line)
        : Measure(line.forces, new Position(line.mass), SetHandle()) {}
};

/** A force proportional to a Measure's value. **/
class MeasuredForce : public LineForce {
public:
    MeasuredForce(const Model& model, const Line& line, const Measure& measure, Real factor)
        : LineForce(model, line), m_measure(measure), m_factor(factor) {}
    Real calcForceOnMass(const State& state) const override {
        return m_factor * m_measure.getValue(state);
    }

private:
    Measure m_measure;
    Real m_factor;
};

std::unique_ptr<Model> makeDelayedFeedback() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    const Measure::Delay delayed(line.forces, PositionMeasure(line), 0.4);
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 25, 0);
    Force::Custom(line.forces, new MeasuredForce(*model, line, delayed, -10));
    model->state = model->system.realizeTopology();
    line.mass.setOneQ(model->state, 0, 1);
    model->observe = [delayed, &system = model->system](const State& state) {
        system.realize(state, Stage::Position);
        return Vector(1, delayed.getValue(state));
    };
    return model;
}

// Pulled back by a spring that is unstretched 0.3 m before the farthest position so far.
std::unique_ptr<Model> makeExtremeFeedback() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    const Measure::Extreme farthest(line.forces, PositionMeasure(line), Measure::Extreme::Maximum);
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 40, -0.3);
    Force::Custom(line.forces, new MeasuredForce(*model, line, farthest, 30));
    Force::MobilityLinearDamper(line.forces, line.mass, MobilizerUIndex(0), 0.5);
    model->state = model->system.realizeTopology();
    line.mass.setOneU(model->state, 0, 1);
    model->observe = [farthest, &system = model->system](const State& state) {
        system.realize(state, Stage::Position);
        return Vector(1, farthest.getValue(state));
    };
    return model;
}

std::unique_ptr<Model> makeIntegralControl() {
    auto model = std::make_unique<Model>();
    Line& line = model->make<Line>();
    const Measure::Integrate sum(line.forces, PositionMeasure(line),
                                 Measure::Constant(line.forces, -0.2));
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 30, 0);
    Force::MobilityLinearDamper(line.forces, line.mass, MobilizerUIndex(0), 2);
    Force::Custom(line.forces, new MeasuredForce(*model, line, sum, -40));
    model->state = model->system.realizeTopology();
    line.mass.setOneQ(model->state, 0, 0.5);
    return model;
}

/** Three bars in a heat bath, whose chain of z acts on all of them. **/
struct Chain : Basics {
    explicit Chain(Model& model) : Basics(model) {
        const Body::Rigid bar(MassProperties(1, Vec3(0, -0.5, 0), Inertia(0.34, 0.01, 0.34)));
        for (int i = 0; i < 3; ++i)
            bars.push_back(MobilizedBody::Pin(i == 0 ? matter.Ground() : bars.back(),
                                              Vec3(0, i == 0 ? 0 : -1, 0), bar, Vec3(0)));
    }
    Force::Gravity gravity{forces, matter, -YAxis, 9.81};
    std::vector<MobilizedBody> bars;
};

std::unique_ptr<Model> makeThermostat() {
    auto model = std::make_unique<Model>();
    Chain& chain = model->make<Chain>();
    const Force::Thermostat bath(chain.forces, chain.matter, 1, 2, 0.2, 0);
    model->state = model->system.realizeTopology();
    bath.initializeChainState(model->state);
    bath.setBathTemperature(model->state, 5);
    chain.bars[0].setOneQ(model->state, 0, 0.5);
    chain.bars[2].setOneU(model->state, 0, 3);
    model->duration = 1;
    return model;
}

/** A user-defined subsystem with its own named z. **/
class Tank : public Subsystem {
public:
    class Guts;
    explicit Tank(System& system);
};

class Tank::Guts : public Subsystem::Guts {
public:
    Guts() : Subsystem::Guts("tank", "1") {}
    Guts* cloneImpl() const override { return new Guts(*this); }
    int realizeSubsystemTopologyImpl(State& state) const override {
        m_level = allocateZ(state, Vector(1, Real(1)));
        m_valve = allocateDiscreteVariable(state, Stage::Acceleration, new Value<Real>(0.8));
        return 0;
    }
    int realizeSubsystemAccelerationImpl(const State& state) const override {
        const Real opening = Value<Real>::downcast(getDiscreteVariable(state, m_valve)).get();
        updZDot(state)[m_level] = -opening * getLevel(state);
        return 0;
    }
    Real getLevel(const State& state) const { return getZ(state)[m_level]; }

private:
    mutable ZIndex m_level;
    mutable DiscreteVariableIndex m_valve;
};

Tank::Tank(System& system) {
    adoptSubsystemGuts(new Guts);
    system.adoptSubsystem(*this);
}

class TankForce : public LineForce {
public:
    TankForce(const Model& model, const Line& line, const Tank& tank)
        : LineForce(model, line), m_tank(findOwned(model.system, tank)) {}
    Real calcForceOnMass(const State& state) const override {
        return static_cast<const Tank::Guts&>(m_tank.getSubsystemGuts()).getLevel(state);
    }

private:
    const Subsystem& m_tank;
};

struct LineWithTank : Line {
    explicit LineWithTank(Model& model) : Line(model), tank(model.system) {}
    Tank tank;
};

std::unique_ptr<Model> makeCustomSubsystem() {
    auto model = std::make_unique<Model>();
    LineWithTank& line = model->make<LineWithTank>();
    Force::MobilityLinearSpring(line.forces, line.mass, MobilizerQIndex(0), 10, 0);
    Force::Custom(line.forces, new TankForce(*model, line, line.tank));
    model->state = model->system.realizeTopology();
    return model;
}

/** Defined on [−2, 2] m only. **/
class TableForce : public LineForce {
public:
    using LineForce::LineForce;
    Real calcForceOnMass(const State& state) const override {
        if (std::abs(getX(state)) > 2) throw std::out_of_range("the table ends at 2 m");
        return -20 * getX(state) * (1 + square(getX(state)));
    }
};

// None of its forces refers to the handle of their subsystem, so the handle may go, too.
std::unique_ptr<Model> makeForceOfLimitedRange() {
    struct LooseLine {
        explicit LooseLine(Model& model)
            : forces(model.system), mass(model.matter.Ground(), ball(1)) {}
        GeneralForceSubsystem forces;
        MobilizedBody::Slider mass;
    };
    auto model = std::make_unique<Model>();
    LooseLine& line = model->make<LooseLine>();
    Force::Custom(line.forces, new TableForce(line.mass, findOwned(model->system, line.forces)));
    Force::TwoPointLinearSpring(line.forces, model->matter.Ground(), Vec3(0, 1, 0), line.mass,
                                Vec3(0), 5, 1);
    model->state = model->system.realizeTopology();
    line.mass.setOneQ(model->state, 0, 1);
    return model;
}

}  // namespace

std::vector<Program> getMemoryPrograms() {
    return {{"Latch", makeLatch},
            {"YieldingSpring", makeYieldingSpring},
            {"BristleFriction", makeBristleFriction},
            {"DelayedFeedback", makeDelayedFeedback},
            {"ExtremeFeedback", makeExtremeFeedback},
            {"IntegralControl", makeIntegralControl},
            {"Thermostat", makeThermostat},
            {"CustomSubsystem", makeCustomSubsystem},
            {"ForceOfLimitedRange", makeForceOfLimitedRange}};
}

}  // namespace simflex::test
