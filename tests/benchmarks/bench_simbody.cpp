// Sixteen systems without flexible bodies, run by each of Simbody's integrators and by ours, BDF
// and Radau: processor time and steps of the cheapest run whose error, anywhere on a body at any of
// five instants, is at most 1e-3 m and 1e-6 m. Accuracies are tried from 1e-1 down by half decades.
// The reference is RungeKuttaMerson at 1e-11.
//
//   bench_simbody [--verbose] [SYSTEM...]      default: all systems

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <memory>
#include <optional>

#include "simflex/solver/BdfIntegrator.h"
#include "simflex/solver/RadauIntegrator.h"

namespace simflex {
namespace {

using namespace SimTK;

constexpr int NumSamples = 5;
constexpr double Targets[] = {1e-3, 1e-6};  // [m]
constexpr double LoosestAccuracy = 0.1, TightestAccuracy = 1e-10, ReferenceAccuracy = 1e-11;
/** Runs that take longer than the best one by this factor are abandoned. **/
constexpr double Hopeless = 6;
constexpr double ShortRun = 0.1;  // [s]: runs shorter than this are timed three times

struct Problem {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    GeneralForceSubsystem forces{system};
    std::unique_ptr<ContactTrackerSubsystem> tracker;
    std::unique_ptr<CompliantContactSubsystem> contacts;
    State state;
    double duration = 1;
};

using ProblemPtr = std::unique_ptr<Problem>;

Body::Rigid makeRod(double mass, double length) {
    return Body::Rigid(
        MassProperties(mass, Vec3(0), UnitInertia::cylinderAlongY(0.02, length / 2) * mass));
}

/** A chain of pinned rods, released straight at 45 degrees from one end. **/
ProblemPtr makeChain(int links, double duration) {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    const double length = 2.0 / links;
    MobilizedBody parent = p->matter.Ground();
    std::vector<MobilizedBody::Pin> pins;
    for (int i = 0; i < links; ++i) {
        pins.emplace_back(parent, i == 0 ? Transform() : Transform(Vec3(0, -length / 2, 0)),
                          makeRod(2.0 / links, length), Transform(Vec3(0, length / 2, 0)));
        parent = pins.back();
    }
    p->state = p->system.realizeTopology();
    pins[0].setAngle(p->state, Pi / 4);
    p->duration = duration;
    return p;
}

ProblemPtr makeChain10() {
    return makeChain(10, 1);
}
ProblemPtr makeChain40() {
    return makeChain(40, 0.5);
}

/** Links of 1 m on balls that fall sideways, each with different initial speeds, under global
damping. **/
ProblemPtr makeBallChain(int links) {
    auto p = std::make_unique<Problem>();
    Force::UniformGravity(p->forces, p->matter, Vec3(10, -9.8, 3));
    Force::GlobalDamper(p->forces, p->matter, 1);
    const Body::Rigid link(MassProperties(1, Vec3(0, -0.5, 0), UnitInertia(1)));
    MobilizedBody parent = p->matter.Ground();
    for (int i = 0; i < links; ++i)
        parent =
            MobilizedBody::Ball(parent, Transform(Vec3(0, i == 0 ? 0 : -1, 0)), link, Transform());
    p->state = p->system.realizeTopology();
    Random::Gaussian random;
    random.setSeed(3);
    for (int i = 0; i < p->state.getNU(); ++i) p->state.updU()[i] = random.getValue();
    return p;
}

ProblemPtr makeBalls10() {
    return makeBallChain(10);
}
ProblemPtr makeBalls20() {
    return makeBallChain(20);
}
ProblemPtr makeBalls50() {
    return makeBallChain(50);
}
ProblemPtr makeBalls100() {
    return makeBallChain(100);
}

/** A chain in a heat bath: Simbody's thermostat adds variables z and scales all speeds. **/
ProblemPtr makeThermostat() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    MobilizedBody parent = p->matter.Ground();
    const double length = 0.3;
    for (int i = 0; i < 20; ++i)
        parent = MobilizedBody::Pin(parent, Transform(Vec3(0, i == 0 ? 0 : -length / 2, 0)),
                                    makeRod(0.5, length), Transform(Vec3(0, length / 2, 0)));
    const Force::Thermostat bath(p->forces, p->matter, 1, 2, 0.2, 0);
    p->state = p->system.realizeTopology();
    bath.initializeChainState(p->state);
    bath.setBathTemperature(p->state, 5);
    p->state.updQ()[0] = 0.5;
    p->state.updU()[2] = 3;
    return p;
}

/** A backbone of 20 bodies on balls, each with two side groups on pins, with torsional springs and
dampers throughout, as in coarse-grained molecules. **/
ProblemPtr makeMolecule() {
    auto p = std::make_unique<Problem>();
    Force::GlobalDamper(p->forces, p->matter, 0.02);
    const Body::Rigid group(MassProperties(0.1, Vec3(0), UnitInertia::sphere(0.1) * 0.1));
    MobilizedBody backbone = p->matter.Ground();
    const auto addPin = [&](MobilizedBody& parent, const Rotation& turned) {
        const MobilizedBody::Pin pin(parent, Transform(turned, Vec3(0)), group,
                                     Transform(Vec3(0, 0.2, 0)));
        Force::MobilityLinearSpring(p->forces, pin, MobilizerQIndex(0), 5, 0.5);
        Force::MobilityLinearDamper(p->forces, pin, MobilizerUIndex(0), 0.01);
        return pin;
    };
    for (int i = 0; i < 20; ++i) {
        backbone = MobilizedBody::Ball(backbone, Transform(Vec3(0, -0.2, 0)), group,
                                       Transform(Vec3(0, 0.2, 0)));
        MobilizedBody side = addPin(backbone, Rotation(0.7 * i, YAxis));
        addPin(side, Rotation(1, XAxis));
    }
    p->state = p->system.realizeTopology();
    Random::Gaussian random;
    random.setSeed(1);
    for (int i = 0; i < p->state.getNU(); ++i) p->state.updU()[i] = random.getValue();
    return p;
}

/** Crank, coupler and rocker under gravity; a ball closes the loop. **/
ProblemPtr makeFourBar() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    MobilizedBody::Pin crank(p->matter.Ground(), Transform(), makeRod(1, 0.3),
                             Transform(Vec3(0, -0.15, 0)));
    MobilizedBody::Pin coupler(crank, Transform(Vec3(0, 0.15, 0)), makeRod(1, 0.9),
                               Transform(Vec3(0, -0.45, 0)));
    MobilizedBody::Pin rocker(p->matter.Ground(), Transform(Vec3(0.8, 0, 0)), makeRod(1, 0.6),
                              Transform(Vec3(0, -0.3, 0)));
    Constraint::Ball(coupler, Vec3(0, 0.45, 0), rocker, Vec3(0, 0.3, 0));
    p->state = p->system.realizeTopology();
    // The crank points up: its tip is at (0, 0.3), from which the coupler and rocker meet at the
    // intersection of two circles.
    const Vec2 from(0, 0.3), to(0.8, 0);
    const double span = (to - from).norm(),
                 along = (span * span + 0.9 * 0.9 - 0.6 * 0.6) / (2 * span);
    const Vec2 direction = (to - from) / span, normal(-direction[1], direction[0]);
    const Vec2 meet = from + along * direction + std::sqrt(0.9 * 0.9 - along * along) * normal;
    const auto angleOf = [](const Vec2& d) { return std::atan2(-d[0], d[1]); };
    coupler.setAngle(p->state, angleOf(meet - from));
    rocker.setAngle(p->state, angleOf(meet - to));
    crank.setRate(p->state, -8);
    p->system.realize(p->state, Stage::Position);
    p->system.projectU(p->state, 1e-12);
    p->duration = 2;
    return p;
}

/** A slider-crank behind a gear pair, whose wheel is driven by a motor with falling torque. **/
ProblemPtr makeGearedSliderCrank() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    const Body::Rigid wheel(
        MassProperties(0.5, Vec3(0), UnitInertia::cylinderAlongZ(0.05, 0.02) * 0.5));
    MobilizedBody::Pin motor(p->matter.Ground(), Transform(Vec3(-0.15, 0, 0)), wheel, Transform());
    MobilizedBody::Pin crank(p->matter.Ground(), Transform(), makeRod(1, 0.2),
                             Transform(Vec3(0, -0.1, 0)));
    MobilizedBody::Pin rod(crank, Transform(Vec3(0, 0.1, 0)), makeRod(1, 0.5),
                           Transform(Vec3(0, -0.25, 0)));
    MobilizedBody::Slider piston(p->matter.Ground(), Transform(),
                                 Body::Rigid(MassProperties(0.8, Vec3(0), Inertia(1e-3))),
                                 Transform());
    const double ratio = 3;
    Array_<MobilizedBodyIndex> geared;
    geared.push_back(motor);
    geared.push_back(crank);
    Array_<MobilizerQIndex> first(2, MobilizerQIndex(0));
    Vector coefficients(3, Real(0));
    coefficients[0] = 1;
    coefficients[1] = ratio;
    Constraint::CoordinateCoupler(p->matter, new Function::Linear(coefficients), geared, first);
    Constraint::Ball(rod, Vec3(0, 0.25, 0), piston, Vec3(0));
    Force::MobilityConstantForce(p->forces, motor, MobilizerUIndex(0), -4);
    Force::MobilityLinearDamper(p->forces, motor, MobilizerUIndex(0), 0.1);
    p->state = p->system.realizeTopology();
    // Crank up, piston to the right.
    rod.setAngle(p->state, -Pi / 2 - std::asin(0.2 / 0.5));
    piston.setLength(p->state, std::sqrt(0.5 * 0.5 - 0.2 * 0.2));
    p->duration = 1;
    return p;
}

/** Four storeys of crossed bars, the lowest one on a slider with a spring and a damper. **/
ProblemPtr makeScissorLift() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    constexpr int storeys = 4;
    const double half = 0.5, angle = Pi / 4;
    const Body::Rigid bar(MassProperties(1, Vec3(0), UnitInertia::cylinderAlongX(0.02, half)));
    const Body::Rigid shoe(MassProperties(0.5, Vec3(0), Inertia(1e-3)));
    // Each rising bar is pinned to the end of a falling one, and vice versa; their middles are
    // joined.
    MobilizedBody::Slider foot(p->matter.Ground(), Transform(), shoe, Transform());
    MobilizedBody::Pin rising(p->matter.Ground(), Transform(), bar, Transform(Vec3(-half, 0, 0)));
    MobilizedBody::Pin falling(foot, Transform(), bar, Transform(Vec3(half, 0, 0)));
    std::vector<MobilizedBody::Pin> ups{rising}, downs{falling};
    for (int k = 1; k < storeys; ++k) {
        MobilizedBody::Pin up(downs.back(), Transform(Vec3(-half, 0, 0)), bar,
                              Transform(Vec3(-half, 0, 0)));
        MobilizedBody::Pin down(ups.back(), Transform(Vec3(half, 0, 0)), bar,
                                Transform(Vec3(half, 0, 0)));
        ups.push_back(up);
        downs.push_back(down);
    }
    for (int k = 0; k < storeys; ++k) {
        // Constrained in the plane only; the pins already prevent out-of-plane motion.
        Constraint::PointInPlane(ups[size_t(k)], XAxis, 0, downs[size_t(k)], Vec3(0));
        Constraint::PointInPlane(ups[size_t(k)], YAxis, 0, downs[size_t(k)], Vec3(0));
    }
    Force::MobilityLinearSpring(p->forces, foot, MobilizerQIndex(0), 4000, 0.75);
    Force::MobilityLinearDamper(p->forces, foot, MobilizerUIndex(0), 5);
    p->state = p->system.realizeTopology();
    foot.setLength(p->state, 2 * half * std::cos(angle));
    for (int k = 0; k < storeys; ++k) {
        // Relative angles: each bar's angle minus that of its parent.
        ups[size_t(k)].setAngle(p->state, k == 0 ? angle : 2 * angle);
        downs[size_t(k)].setAngle(p->state, k == 0 ? -angle : -2 * angle);
    }
    p->duration = 1;
    return p;
}

/** Balls thrown on the floor and at each other that bounce, slide and roll. **/
ProblemPtr makeContact() {
    auto p = std::make_unique<Problem>();
    p->tracker = std::make_unique<ContactTrackerSubsystem>(p->system);
    p->contacts = std::make_unique<CompliantContactSubsystem>(p->system, *p->tracker);
    p->contacts->setTransitionVelocity(1e-2);
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    const ContactMaterial material(1e6, 0.4, 0.5, 0.4, 0.1);
    p->matter.Ground().updBody().addContactSurface(
        Transform(Rotation(-Pi / 2, ZAxis), Vec3(0)),
        ContactSurface(ContactGeometry::HalfSpace(), material));
    constexpr double radius = 0.1;
    Body::Rigid ball(MassProperties(1, Vec3(0), UnitInertia::sphere(radius)));
    ball.addContactSurface(Transform(), ContactSurface(ContactGeometry::Sphere(radius), material));
    std::vector<MobilizedBody::Free> balls;
    for (int i = 0; i < 4; ++i)
        balls.emplace_back(p->matter.Ground(), Transform(), ball, Transform());
    p->state = p->system.realizeTopology();
    for (int i = 0; i < 4; ++i) {
        balls[size_t(i)].setQToFitTranslation(p->state, Vec3(0.5 * i, 0.12 + 0.05 * i, 0.03 * i));
        balls[size_t(i)].setUToFitVelocity(
            p->state, SpatialVec(Vec3(2, -1, 5.0 * i), Vec3(2.0 - i, 0, 0.1 * i)));
    }
    p->duration = 1;
    return p;
}

/** Sets the torque of a digital controller, held until the next sample. **/
class Controller : public PeriodicEventHandler {
public:
    Controller(const Force::DiscreteForces& forces, const MobilizedBody::Pin& pin)
        : PeriodicEventHandler(1e-3), m_forces(forces), m_pin(pin) {}
    void handleEvent(State& state, Real, bool&) const override {
        m_forces.setOneMobilityForce(
            state, m_pin, MobilizerUIndex(0),
            -40 * (m_pin.getAngle(state) - 0.3) - 4 * m_pin.getRate(state));
    }

private:
    const Force::DiscreteForces m_forces;
    const MobilizedBody::Pin m_pin;
};

/** An arm of three links, the first of which is controlled at 1 kHz. **/
ProblemPtr makeControlled() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    MobilizedBody parent = p->matter.Ground();
    std::vector<MobilizedBody::Pin> pins;
    for (int i = 0; i < 3; ++i) {
        pins.emplace_back(parent, i == 0 ? Transform() : Transform(Vec3(0, -0.25, 0)),
                          makeRod(1, 0.5), Transform(Vec3(0, 0.25, 0)));
        parent = pins.back();
    }
    Force::DiscreteForces torque(p->forces, p->matter);
    p->system.addEventHandler(new Controller(torque, pins[0]));
    p->state = p->system.realizeTopology();
    pins[0].setAngle(p->state, 1);
    p->duration = 1;
    return p;
}

/** A nutating heavy top on a ball. **/
ProblemPtr makeTop() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    const Body::Rigid body(MassProperties(
        1, Vec3(0, 0.3, 0), Inertia(2e-2, 1e-2, 2e-2).shiftFromMassCenter(Vec3(0, 0.3, 0), 1)));
    MobilizedBody::Ball top(p->matter.Ground(), Transform(), body, Transform());
    p->state = p->system.realizeTopology();
    top.setQToFitRotation(p->state, Rotation(0.4, ZAxis));
    top.setUToFitAngularVelocity(p->state, Rotation(0.4, ZAxis) * Vec3(0, 100, 0));
    p->duration = 2;
    return p;
}

/** A leg of three segments with pairs of point-to-point springs and dampers. **/
ProblemPtr makeLeg() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    MobilizedBody::Ball thigh(p->matter.Ground(), Transform(), makeRod(8, 0.45),
                              Transform(Vec3(0, 0.225, 0)));
    MobilizedBody::Pin shank(thigh, Transform(Vec3(0, -0.225, 0)), makeRod(4, 0.45),
                             Transform(Vec3(0, 0.225, 0)));
    MobilizedBody::Universal foot(shank, Transform(Vec3(0, -0.225, 0)), makeRod(1, 0.2),
                                  Transform(Vec3(0, 0.1, 0)));
    const auto addMuscle = [&](const MobilizedBody& a, Vec3 from, const MobilizedBody& b, Vec3 to,
                               double stiffness, double length) {
        Force::TwoPointLinearSpring(p->forces, a, from, b, to, stiffness, length);
        Force::TwoPointLinearDamper(p->forces, a, from, b, to, 0.01 * stiffness);
    };
    for (const double side : {-1.0, 1.0}) {
        const Vec3 out(0.05 * side, 0, 0), across(0, 0, 0.05 * side);
        addMuscle(p->matter.Ground(), 2 * out, thigh, out - Vec3(0, 0.1, 0), 2000, 0.3);
        addMuscle(p->matter.Ground(), 2 * across, thigh, across - Vec3(0, 0.1, 0), 2000, 0.3);
        addMuscle(thigh, out, shank, out + Vec3(0, 0.1, 0), 3000, 0.3);
        addMuscle(shank, out, foot, out, 2000, 0.25);
        addMuscle(shank, across, foot, across, 2000, 0.25);
    }
    p->state = p->system.realizeTopology();
    thigh.setQToFitRotation(p->state, Rotation(0.5, ZAxis));
    shank.setAngle(p->state, -0.8);
    foot.setOneQ(p->state, 0, 0.3);
    foot.setOneQ(p->state, 1, 0.4);
    p->duration = 1;
    return p;
}

/** Masses on a line with stiff springs and dampers (time constants down to 0.1 ms), on a softly
swinging cart. **/
ProblemPtr makeStiff() {
    auto p = std::make_unique<Problem>();
    Force::Gravity(p->forces, p->matter, -YAxis, 9.81);
    const Body::Rigid mass(MassProperties(1, Vec3(0), Inertia(0.01)));
    MobilizedBody::Slider cart(p->matter.Ground(), Transform(), mass, Transform());
    Force::MobilityLinearSpring(p->forces, cart, MobilizerQIndex(0), 50, 0);
    MobilizedBody::Pin arm(cart, Transform(), mass, Transform(Vec3(0, 0.5, 0)));
    MobilizedBody parent = arm;
    std::vector<MobilizedBody::Slider> masses;
    for (int i = 0; i < 4; ++i) {
        masses.emplace_back(parent, Transform(Rotation(-Pi / 2, ZAxis), Vec3(0)), mass,
                            Transform(Rotation(-Pi / 2, ZAxis), Vec3(0)));
        Force::MobilityLinearSpring(p->forces, masses.back(), MobilizerQIndex(0), 1e6, 0.1);
        Force::MobilityLinearDamper(p->forces, masses.back(), MobilizerUIndex(0), 1e4);
        parent = masses.back();
    }
    p->state = p->system.realizeTopology();
    arm.setAngle(p->state, 1);
    for (MobilizedBody::Slider& slider : masses) slider.setLength(p->state, 0.1);
    p->duration = 2;
    return p;
}

struct Solution {
    std::vector<double> samples;  ///< positions of two points of each body
    double seconds = 0;
    long steps = 0;
};

double getProcessorTime() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

void addSamples(const Problem& problem, const State& state, std::vector<double>& samples) {
    problem.system.realize(state, Stage::Position);
    for (MobilizedBodyIndex i(1); i < problem.matter.getNumBodies(); ++i)
        for (const Vec3& station : {Vec3(0), Vec3(0.1, 0.1, 0.1)}) {
            const Vec3 point =
                problem.matter.getMobilizedBody(i).findStationLocationInGround(state, station);
            for (int a = 0; a < 3; ++a) samples.push_back(point[a]);
        }
}

bool isVerbose = false;

/** Runs with either kind of stepper; returns nothing if the run fails or takes too long. **/
template <class Start, class Advance>
std::optional<Solution> run(const Problem& problem, double longest, const Start& start,
                            const Advance& advance) {
    constexpr int Looks = 20;  // checks of the time limit between two samples
    Solution solution;
    try {
        double begin = getProcessorTime();
        start();
        for (int k = 1; k <= NumSamples; ++k) {
            const State* state = nullptr;
            for (int look = 1; look <= Looks; ++look) {
                // Without a time limit, stop at the samples only: each stop costs interpolation.
                if (look < Looks && longest == Infinity) continue;
                state = &advance((k - 1 + double(look) / Looks) * problem.duration / NumSamples);
                if (getProcessorTime() - begin > longest) return {};
            }
            const double pause = getProcessorTime();
            addSamples(problem, *state, solution.samples);
            begin += getProcessorTime() - pause;
        }
        solution.seconds = getProcessorTime() - begin;
    } catch (const std::exception& error) {
        if (isVerbose) std::printf("%s\n", error.what());
        return {};
    }
    return solution;
}

struct Method {
    const char* name;
    bool isOurs;
    std::function<std::optional<Solution>(const Problem&, double accuracy, double longest)> run;
};

template <class Native>
Method makeNative(const char* name) {
    return {name, false, [](const Problem& problem, double accuracy, double longest) {
                Native integrator(problem.system);
                integrator.setAccuracy(accuracy);
                TimeStepper stepper(problem.system, integrator);
                auto solution = run(
                    problem, longest, [&] { stepper.initialize(problem.state); },
                    [&](double time) -> const State& {
                        stepper.stepTo(time);
                        return stepper.getState();
                    });
                if (solution) solution->steps = integrator.getNumStepsTaken();
                return solution;
            }};
}

template <class Integrator>
Method makeOurs(const char* name) {
    return {name, true, [](const Problem& problem, double accuracy, double longest) {
                Integrator integrator(problem.system);
                integrator.setAccuracy(accuracy);
                integrator.setNumThreads(1);
                auto solution = run(
                    problem, longest, [&] { integrator.initialize(problem.state); },
                    [&](double time) -> const State& {
                        integrator.stepTo(time);
                        return integrator.getState();
                    });
                if (solution) solution->steps = integrator.getStatistics().stepsTaken;
                return solution;
            }};
}

double calcError(const Solution& solution, const Solution& reference) {
    double error = 0;
    for (size_t i = 0; i < reference.samples.size(); ++i) {
        const double distance = std::abs(solution.samples[i] - reference.samples[i]);
        error = distance <= error ? error : distance;  // keeps NaN
    }
    return error;
}

struct Best {
    std::string method;
    double seconds = Infinity, accuracy = 0, error = 0;
    long steps = 0;
};

/** Best runs of both sides for one target. **/
struct Comparison {
    Best native, ours;
};

std::vector<Comparison> compare(const Problem& problem) {
    const std::vector<Method> methods = {
        makeNative<RungeKuttaMersonIntegrator>("RungeKuttaMerson"),
        makeNative<RungeKutta3Integrator>("RungeKutta3"),
        makeNative<RungeKuttaFeldbergIntegrator>("RungeKuttaFeldberg"),
        makeNative<CPodesIntegrator>("CPodes"),
        makeNative<SemiExplicitEuler2Integrator>("SemiExplicitEuler2"),
        makeNative<VerletIntegrator>("Verlet"),
        makeOurs<BdfIntegrator>("BDF"),
        makeOurs<RadauIntegrator>("Radau")};
    const std::optional<Solution> reference = methods[0].run(problem, ReferenceAccuracy, Infinity);
    if (!reference) throw std::runtime_error("the reference cannot be computed");
    std::vector<Comparison> comparisons(std::size(Targets));
    for (const Method& method : methods) {
        const auto bestOf = [&](size_t k) -> Best& {
            return method.isOurs ? comparisons[k].ours : comparisons[k].native;
        };
        const size_t last = std::size(Targets) - 1;
        const double factor = std::sqrt(0.1);
        for (double accuracy = LoosestAccuracy; accuracy > TightestAccuracy; accuracy *= factor) {
            double longest = Infinity;
            for (size_t k = 0; k <= last; ++k)
                longest = std::min(longest, std::isinf(bestOf(last).seconds)
                                                ? std::max(60.0, Hopeless)
                                                : Hopeless * bestOf(last).seconds);
            std::optional<Solution> solution = method.run(problem, accuracy, longest);
            if (!solution) {
                if (isVerbose) std::printf("%-20s %8.1e failed\n", method.name, accuracy);
                if (!method.isOurs && !std::isinf(longest)) break;
                continue;
            }
            // Repeat a promising short run without the clock checks.
            double error = calcError(*solution, *reference);
            for (int again = 0; again < 2 && error <= Targets[0] && solution->seconds < ShortRun;
                 ++again) {
                const auto repeated = method.run(problem, accuracy, Infinity);
                solution->seconds = std::min(solution->seconds, repeated->seconds);
                solution->steps = repeated->steps;
                // Clock checks may shorten steps and so reduce the error.
                error = std::max(error, calcError(*repeated, *reference));
            }
            if (isVerbose)
                std::printf("%-20s %8.1e error %8.1e %10.3f ms %8ld steps\n", method.name, accuracy,
                            error, 1e3 * solution->seconds, solution->steps);
            for (size_t k = 0; k <= last; ++k)
                if (error <= Targets[k] && solution->seconds < bestOf(k).seconds)
                    bestOf(k) = {method.name, solution->seconds, accuracy, error, solution->steps};
            if (error <= 0.1 * Targets[last]) break;
        }
    }
    return comparisons;
}

}  // namespace
}  // namespace simflex

int main(int argc, char** argv) {
    using namespace simflex;
    const std::vector<std::pair<std::string, ProblemPtr (*)()>> problems = {
        {"chain10", makeChain10},
        {"chain40", makeChain40},
        {"balls10", makeBalls10},
        {"balls20", makeBalls20},
        {"balls50", makeBalls50},
        {"balls100", makeBalls100},
        {"thermostat", makeThermostat},
        {"molecule", makeMolecule},
        {"four_bar", makeFourBar},
        {"geared_slider_crank", makeGearedSliderCrank},
        {"scissor_lift", makeScissorLift},
        {"contact", makeContact},
        {"controlled", makeControlled},
        {"top", makeTop},
        {"leg", makeLeg},
        {"stiff", makeStiff}};
    std::vector<std::string> names;
    for (int i = 1; i < argc; ++i) {
        const std::string argument = argv[i];
        const bool isKnown = std::any_of(problems.begin(), problems.end(), [&](const auto& known) {
            return known.first == argument;
        });
        if (argument == "--verbose") {
            isVerbose = true;
        } else if (isKnown) {
            names.push_back(argument);
        } else {
            std::fprintf(stderr, "bench_simbody [--verbose] [SYSTEM...]; systems:");
            for (const auto& known : problems) std::fprintf(stderr, " %s", known.first.c_str());
            std::fprintf(stderr, "\n");
            return 2;
        }
    }
    std::vector<double> ratios;
    std::printf("%-20s %7s | %-18s %7s %10s %8s | %-5s %7s %10s %8s %7s\n", "system", "error",
                "best of Simbody", "acc.", "time [ms]", "steps", "ours", "acc.", "time [ms]",
                "steps", "ratio");
    for (const auto& [name, make] : problems) {
        if (!names.empty() && std::count(names.begin(), names.end(), name) == 0) continue;
        const ProblemPtr problem = make();
        const std::vector<Comparison> comparisons = compare(*problem);
        for (size_t k = 0; k < comparisons.size(); ++k) {
            const Best &native = comparisons[k].native, &ours = comparisons[k].ours;
            const double ratio = ours.seconds / native.seconds;
            ratios.push_back(ratio);
            std::printf("%-20s %7.0e | %-18s %7.0e %10.3f %8ld | %-5s %7.0e %10.3f %8ld %7.2f\n",
                        name.c_str(), Targets[k], native.method.c_str(), native.accuracy,
                        1e3 * native.seconds, native.steps, ours.method.c_str(), ours.accuracy,
                        1e3 * ours.seconds, ours.steps, ratio);
            std::fflush(stdout);
        }
    }
    std::sort(ratios.begin(), ratios.end());
    const size_t n = ratios.size();
    const auto print = [](double value) {
        if (std::isfinite(value))
            std::printf("%.2f", value);
        else
            std::printf("null");
    };
    std::printf("\n{\"worst_ratio\": ");
    print(ratios.back());
    std::printf(", \"median_ratio\": ");
    print(0.5 * (ratios[(n - 1) / 2] + ratios[n / 2]));
    std::printf("}\n");
    return 0;
}
