#include "simflex/forces/Signal.h"

#include <cmath>
#include <set>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/TurnState.h"

namespace simflex {

using namespace SimTK;

class Signal::Implementation {
public:
    virtual ~Implementation() = default;

    /** @param places  indices of its frames **/
    virtual Real calc(const ElementInputs& now, const Frames& frames, const int* places) const = 0;
    virtual void addInGradient(const ElementInputs& now, const Frames& frames, const int* places,
                               Real gamma, Real factor, const Gradient& gradient) const = 0;
    virtual void addStatesTo(std::set<int>& /*states*/) const {}
    /** True if the gradient at these poses, without velocities, is the complete derivative. **/
    virtual bool hasExactGradient(const Frames& /*frames*/) const { return false; }

    Array_<Attachment> attachments;
};

namespace {

using Frames = Signal::Frames;
using Gradient = Signal::Gradient;

class Distance : public Signal::Implementation {
public:
    Distance(const Attachment& from, const Attachment& to, bool isRate) : m_isRate(isRate) {
        attachments.push_back(from);
        attachments.push_back(to);
    }

    Real calc(const ElementInputs&, const Frames& frames, const int* places) const override {
        const Line line(frames, places);
        return m_isRate ? line.rate : line.length;
    }

    void addInGradient(const ElementInputs&, const Frames& frames, const int* places, Real gamma,
                       Real factor, const Gradient& gradient) const override {
        const Line line(frames, places);
        Vec3 d = gamma * line.direction;
        if (m_isRate)
            d = line.direction + (line.length > 0 ? gamma / line.length : 0) * line.across;
        gradient.frames[places[0]][1] -= factor * d;
        gradient.frames[places[1]][1] += factor * d;
    }

    bool hasExactGradient(const Frames& frames) const override {
        constexpr int Places[] = {0, 1};
        return Line(frames, Places).length > 0;
    }

private:
    struct Line {
        Line(const Frames& frames, const int* places) {
            const FrameMotion &from = frames[unsigned(places[0])],
                              &to = frames[unsigned(places[1])];
            const Vec3 apart = to.X.p() - from.X.p(), parting = to.V[1] - from.V[1];
            length = apart.norm();
            direction = length > 0 ? apart / length : Vec3(0);
            rate = ~direction * parting;
            across = parting - rate * direction;
        }
        Real length, rate;
        Vec3 direction, across;
    };

    bool m_isRate;
};

class Coordinate : public Signal::Implementation {
public:
    enum class Kind { Value, Rate };

    Coordinate(const JointCoordinate& coordinate, const Attachment& F, const Attachment& M,
               Kind kind)
        : m_coordinate(coordinate), m_kind(kind) {
        attachments.push_back(F);
        attachments.push_back(M);
    }
    /** An angle with its turns. @param state  index of the TurnState **/
    Coordinate(const FlexibleBodySubsystem& subsystem, int state, const Attachment& F,
               const Attachment& M)
        : m_turns(std::static_pointer_cast<const TurnState>(
              subsystem.getGuts().states()[size_t(state)])),
          m_coordinate(m_turns->getCoordinate()),
          m_kind(Kind::Value),
          m_state(state) {
        attachments.push_back(F);
        attachments.push_back(M);
    }

    Real calc(const ElementInputs& now, const Frames& frames, const int* places) const override {
        const FrameMotion &F = frames[unsigned(places[0])], &M = frames[unsigned(places[1])];
        if (m_kind == Kind::Rate) return m_coordinate.calcMotion(F, M)[1];
        return m_turns ? m_turns->calcAngle(now.time, now.states[m_state], F.X, M.X)
                       : m_coordinate.calcValue(F.X, M.X);
    }

    void addInGradient(const ElementInputs&, const Frames& frames, const int* places, Real gamma,
                       Real factor, const Gradient& gradient) const override {
        SpatialVec D_F, D_M;
        m_coordinate.calcGradient(frames[unsigned(places[0])].X, frames[unsigned(places[1])].X, D_F,
                                  D_M);
        const Real scale = m_kind == Kind::Rate ? factor : gamma * factor;
        gradient.frames[places[0]] += scale * D_F;
        gradient.frames[places[1]] += scale * D_M;
    }
    bool hasExactGradient(const Frames&) const override { return true; }

private:
    std::shared_ptr<const TurnState> m_turns;  ///< null: turns are not counted
    JointCoordinate m_coordinate;
    Kind m_kind;
    int m_state = -1;
};

class AngularVelocity : public Signal::Implementation {
public:
    AngularVelocity(const Attachment& F, const Attachment& M, int axis) : m_axis(axis) {
        attachments.push_back(F);
        attachments.push_back(M);
    }

    Real calc(const ElementInputs&, const Frames& frames, const int* places) const override {
        const FrameMotion &F = frames[unsigned(places[0])], &M = frames[unsigned(places[1])];
        return ~F.X.R().col(m_axis) * (M.V[0] - F.V[0]);
    }

    void addInGradient(const ElementInputs&, const Frames& frames, const int* places, Real,
                       Real factor, const Gradient& gradient) const override {
        const Vec3 axis = frames[unsigned(places[0])].X.R().col(m_axis);
        gradient.frames[places[0]][0] -= factor * axis;
        gradient.frames[places[1]][0] += factor * axis;
    }
    bool hasExactGradient(const Frames&) const override { return true; }

private:
    int m_axis;
};

class StateValue : public Signal::Implementation {
public:
    explicit StateValue(int index) : m_index(index) {}
    Real calc(const ElementInputs& now, const Frames&, const int*) const override {
        return now.states[m_index];
    }
    void addInGradient(const ElementInputs&, const Frames&, const int*, Real, Real factor,
                       const Gradient& gradient) const override {
        if (gradient.states) gradient.states[m_index] += factor;
    }
    void addStatesTo(std::set<int>& states) const override { states.insert(m_index); }

private:
    int m_index;
};

class FunctionOfSignals : public Signal::Implementation {
public:
    FunctionOfSignals(const std::vector<Signal>& arguments, Signal::Function function)
        : m_function(std::move(function)), m_arguments(arguments) {
        for (const Signal& argument : arguments) {
            m_places.push_back(argument.addFramesTo(attachments));
        }
    }

    Real calc(const ElementInputs& now, const Frames& frames, const int* places) const override {
        Buffer values(m_arguments.size());
        calcArguments(now, frames, places, values.get());
        return m_function(now.time, values.get(), nullptr);
    }

    void addStatesTo(std::set<int>& states) const override {
        for (const Signal& argument : m_arguments) argument.addStatesTo(states);
    }

    void addInGradient(const ElementInputs& now, const Frames& frames, const int* places,
                       Real gamma, Real factor, const Gradient& gradient) const override {
        Buffer values(m_arguments.size()), slopes(m_arguments.size());
        calcArguments(now, frames, places, values.get());
        m_function(now.time, values.get(), slopes.get());
        for (size_t i = 0; i < m_arguments.size(); ++i)
            if (slopes.get()[i] != 0 && !m_arguments[i].isZero())
                m_arguments[i].getImplementation()->addInGradient(
                    now, frames, Places(m_places[i], places).get(), gamma, factor * slopes.get()[i],
                    gradient);
    }

private:
    /** An array on the stack, or on the heap if it is long. **/
    template <class Number>
    class Few {
    public:
        explicit Few(size_t size) {
            if (size > Most) m_many.resize(size);
            m_begin = size > Most ? m_many.data() : m_few;
            std::fill_n(m_begin, size, Number(0));
        }
        Number* get() { return m_begin; }

    private:
        static constexpr size_t Most = 16;
        Number m_few[Most];
        std::vector<Number> m_many;
        Number* m_begin;
    };
    using Buffer = Few<Real>;

    /** Indices of an argument's frames among those of the element. **/
    class Places : public Few<int> {
    public:
        Places(const std::vector<int>& own, const int* places) : Few<int>(own.size()) {
            for (size_t k = 0; k < own.size(); ++k) get()[k] = places[own[k]];
        }
    };

    void calcArguments(const ElementInputs& now, const Frames& frames, const int* places,
                       Real* values) const {
        for (size_t i = 0; i < m_arguments.size(); ++i)
            if (!m_arguments[i].isZero())
                values[i] = m_arguments[i].getImplementation()->calc(
                    now, frames, Places(m_places[i], places).get());
    }

    Signal::Function m_function;
    std::vector<Signal> m_arguments;
    std::vector<std::vector<int>> m_places;  ///< of each argument's frames, in `attachments`
};

}  // namespace

Signal Signal::distance(const Attachment& from, const Attachment& to) {
    return Signal(std::make_shared<Distance>(from, to, false));
}

Signal Signal::distanceRate(const Attachment& from, const Attachment& to) {
    return Signal(std::make_shared<Distance>(from, to, true));
}

Signal Signal::displacement(const Attachment& F, const Attachment& M, CoordinateAxis axis) {
    return coordinate(JointCoordinate::makeDisplacement(int(axis)), F, M);
}

Signal Signal::displacementRate(const Attachment& F, const Attachment& M, CoordinateAxis axis) {
    return coordinateRate(JointCoordinate::makeDisplacement(int(axis)), F, M);
}

Signal Signal::angularVelocity(const Attachment& F, const Attachment& M, CoordinateAxis axis) {
    return Signal(std::make_shared<AngularVelocity>(F, M, int(axis)));
}

Signal Signal::coordinate(const JointCoordinate& coordinate, const Attachment& F,
                          const Attachment& M) {
    return Signal(std::make_shared<Coordinate>(coordinate, F, M, Coordinate::Kind::Value));
}

Signal Signal::coordinateRate(const JointCoordinate& coordinate, const Attachment& F,
                              const Attachment& M) {
    return Signal(std::make_shared<Coordinate>(coordinate, F, M, Coordinate::Kind::Rate));
}

JointCoordinateFrames findCoordinate(const Joint& joint, int number) {
    const int count = joint.getNumCoordinates();
    if (number >= 0 && number < count) {
        const int pair = joint.getEquations().getNumFrames() > 2 ? number : 0;
        return {joint.getEquations().getCoordinate(number), joint.getFrameF(pair),
                joint.getFrameM(pair)};
    }
    throw std::out_of_range("joint '" + joint.getName() + "' has no coordinate " +
                            std::to_string(number) +
                            (count == 0 ? "; joints of its type have none"
                                        : "; it has " + std::to_string(count) + ", from 0"));
}

Signal Signal::coordinate(const Joint& joint, int number) {
    const JointCoordinateFrames found = findCoordinate(joint, number);
    return coordinate(found.coordinate, found.F, found.M);
}

Signal Signal::coordinateRate(const Joint& joint, int number) {
    const JointCoordinateFrames found = findCoordinate(joint, number);
    return coordinateRate(found.coordinate, found.F, found.M);
}

Signal Signal::turnedAngle(FlexibleBodySubsystem& subsystem, const Joint& joint, int number,
                           Real start, const Joint::MotionFunction& lead) {
    const JointCoordinateFrames found = findCoordinate(joint, number);
    if (!found.coordinate.isPeriodic()) return coordinate(found.coordinate, found.F, found.M);
    const int state = subsystem.updGuts().countTurns(joint.getIndex(), number, start, lead);
    return Signal(std::make_shared<Coordinate>(subsystem, state, found.F, found.M));
}

Signal Signal::turnedAngle(FlexibleBodySubsystem& subsystem, const JointCoordinate& angle,
                           const Attachment& F, const Attachment& M, const std::string& name,
                           Real start) {
    if (!angle.isPeriodic()) return coordinate(angle, F, M);
    int state = 0;
    while (state < subsystem.getNumStates() && subsystem.getStateName(state) != name) ++state;
    if (state == subsystem.getNumStates())
        subsystem.adoptState(std::make_unique<TurnState>(name, angle, F, M, start));
    return Signal(std::make_shared<Coordinate>(subsystem, state, F, M));
}

Signal Signal::state(int index) {
    return Signal(std::make_shared<StateValue>(index));
}

Signal Signal::constant(Real value) {
    return function({}, [value](Real, const Real*, Real*) { return value; });
}

Signal Signal::function(const std::vector<Signal>& arguments, Function function) {
    if (!function) throw std::invalid_argument("Signal::function(): no function given");
    return Signal(std::make_shared<FunctionOfSignals>(arguments, std::move(function)));
}

const Array_<Attachment>& Signal::getAttachments() const {
    static const Array_<Attachment> none;
    return m_implementation ? m_implementation->attachments : none;
}

Real Signal::calcValue(const FlexibleBodySubsystem& subsystem, const State& state) const {
    const FlexibleBodySubsystem::Guts& guts = subsystem.getGuts();
    std::vector<int> places;
    for (unsigned k = 0; k < getAttachments().size(); ++k) places.push_back(int(k));
    return calc(guts.getInputs(state), guts.calcMotions(state, getAttachments()), places);
}

std::optional<Signal::Slopes> Signal::calcSlopes(const FlexibleBodySubsystem& subsystem,
                                                 const State& state) const {
    const FlexibleBodySubsystem::Guts& guts = subsystem.getGuts();
    const SimbodyMatterSubsystem& matter = guts.getMatter();
    const Array_<Attachment>& attachments = getAttachments();
    const Frames frames = guts.calcMotions(state, attachments);
    if (!m_implementation || !m_implementation->hasExactGradient(frames)) return {};
    std::vector<int> places;
    for (unsigned k = 0; k < attachments.size(); ++k) places.push_back(int(k));
    // The slope is the generalized force of forces that equal the gradient.
    const auto calcAlong = [&](Real gamma) {
        Array_<SpatialVec> gradient(attachments.size(), SpatialVec(Vec3(0), Vec3(0)));
        addInGradient(guts.getInputs(state), frames, places, gamma, 1, {gradient.data()});
        Vector_<SpatialVec> bodyForces(matter.getNumBodies(), SpatialVec(Vec3(0), Vec3(0)));
        Vector mobilityForces(state.getNU(), Real(0)), slopes;
        for (unsigned k = 0; k < attachments.size(); ++k)
            guts.addInAttachmentForce(state, attachments[k], gradient[k], bodyForces,
                                      mobilityForces);
        matter.multiplyBySystemJacobianTranspose(state, bodyForces, slopes);
        slopes += mobilityForces;
        Vector free(state.getNU(), Real(0));
        for (const UIndex i : matter.getFreeUDotIndex(state)) free[i] = slopes[i];
        return free;
    };
    const Vector byU = calcAlong(0);
    return Slopes{calcAlong(1) - byU, byU};
}

std::vector<int> Signal::addFramesTo(Array_<Attachment>& attachments) const {
    std::vector<int> places;
    for (const Attachment& own : getAttachments()) {
        unsigned place = 0;
        while (place < attachments.size() && !isSame(attachments[place], own)) ++place;
        if (place == attachments.size()) attachments.push_back(own);
        places.push_back(int(place));
    }
    return places;
}

Real Signal::calc(const ElementInputs& now, const Frames& frames,
                  const std::vector<int>& places) const {
    return m_implementation ? m_implementation->calc(now, frames, places.data()) : 0;
}

void Signal::addInGradient(const ElementInputs& now, const Frames& frames,
                           const std::vector<int>& places, Real gamma, Real factor,
                           const Gradient& gradient) const {
    if (m_implementation)
        m_implementation->addInGradient(now, frames, places.data(), gamma, factor, gradient);
}

void Signal::addStatesTo(std::set<int>& states) const {
    if (m_implementation) m_implementation->addStatesTo(states);
}

void SignalState::addInStateSlopes(const ElementInputs& now, const Array_<FrameMotion>& frames,
                                   Real* slopes) const {
    Array_<SpatialVec> unused(frames.size());
    m_rate.addInGradient(now, frames, m_places, 0, 1, {unused.data(), slopes});
}

}  // namespace simflex
