#include "simflex/model/session/JointDrag.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/body/JointEquations.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

constexpr Real kModalWeight = 1e3;       // where bodies have to deform
constexpr Real kLargestStep = 0.1;       // [rad] in one step
constexpr Real kJointTolerance = 1e-11;  // of joints and the coordinate [m, rad]
constexpr Real kConditioning = 1e-9;     // rows that follow from others
constexpr Real kRateTolerance = 1e-9;    // [m/s, rad/s]
constexpr int kMostCorrections = 40;     // after the last step of the way

enum class Shapes { Held, Free };

class Drag {
public:
    Drag(const Model& model, const State& start, const Joint& joint, int coordinate, Shapes shapes)
        : _model(model),
          _matter(model.getMatter()),
          _joint(joint),
          _coordinate(coordinate),
          _state(start) {
        model.getFlexibleBodies().initializeNative(_state);
        _weights = _state.getUWeights();
        for (const Model::BodyEntry& body : model.getBodies()) {
            if (!body.flexible) continue;
            for (int k = 0; k < body.flexible->getNumModalMobilizers(); ++k) {
                const MobilizedBody& mobod = body.flexible->getModalMobilizer(k);
                scale(mobod, shapes == Shapes::Held ? Infinity : kModalWeight);
                for (int i = 0; i < mobod.getNumU(_state); ++i)
                    _modes.push_back({int(mobod.getFirstUIndex(_state)) + i,
                                      int(mobod.getFirstQIndex(_state)) + i, 0});
            }
        }
        // What a lock or a Motion holds does not move.
        for (MobilizedBodyIndex i(1); i < _matter.getNumBodies(); ++i) {
            const MobilizedBody& mobod = _matter.getMobilizedBody(i);
            if (mobod.isLocked(_state) ||
                (mobod.hasMotion() && !mobod.getMotion().isDisabled(_state)))
                scale(mobod, Infinity);
        }
        for (Mode& mode : _modes) mode.start = _state.getQ()[mode.q];
    }

    const State& getState() const { return _state; }
    Real calcCoordinate() const { return _joint.calcCoordinates(_state)[_coordinate]; }
    Real calcRate() const { return _joint.calcCoordinateDots(_state)[_coordinate]; }

    Real calcLargestError() const {
        Real largest = 0;
        for (int i = 0; i < getNumPositionRows(); ++i)
            largest = std::max(largest, std::abs(_state.getQErr()[i]));
        return largest;
    }

    /** Moves the coordinate by `change` to first order, and the joints together. **/
    void move(Real change) {
        const int m = getNumPositionRows();
        Vector right(m + 1);
        for (int i = 0; i < m; ++i) right[i] = -_state.getQErr()[i];
        right[m] = change;
        Vector deformed(_state.getNU(), Real(0));  // since the start
        for (const Mode& mode : _modes) deformed[mode.u] = _state.getQ()[mode.q] - mode.start;
        Vector dq(_state.getNQ());
        _matter.multiplyByN(_state, false, solve(m, right, deformed), dq);
        _state.updQ() += dq;
        _matter.normalizeQuaternions(_state);
        realize();
    }

    /** Leads the coordinate to `value`. @returns false if the joints do not allow it. **/
    bool leadTo(Real value) {
        const JointCoordinate& kind = _joint.getEquations().getCoordinate(_coordinate);
        const auto calcRest = [&] {
            const Real rest = value - calcCoordinate();
            return kind.isPeriodic() ? std::remainder(rest, 2 * Pi) : rest;
        };
        const Real way = std::abs(calcRest());
        const Real longest = kind.isAngle() ? kLargestStep : way / 10;
        const int mostSteps = kMostCorrections + (way > 0 ? int(std::ceil(2 * way / longest)) : 0);
        for (int step = 0; step < mostSteps; ++step) {
            const Real rest = calcRest();
            if (std::abs(rest) < kJointTolerance * (1 + std::abs(value)) &&
                calcLargestError() < kJointTolerance)
                return true;
            move(std::clamp(rest, -longest, longest));
            if (!std::isfinite(calcLargestError())) break;
        }
        return false;
    }

    /** Speeds consistent with the joints at which the coordinate's rate is `rate`. @returns false
    if there are none. **/
    bool changeRateTo(Real rate) {
        for (int i = 0; i < 2; ++i) {
            const int m = _state.getNUErr();
            Vector right(m + 1);
            for (int k = 0; k < m; ++k) right[k] = -_state.getUErr()[k];
            right[m] = rate - calcRate();
            _state.updU() += solve(m, right, Vector(_state.getNU(), Real(0)));
            realize();
        }
        Real largest = std::abs(calcRate() - rate);
        for (int k = 0; k < _state.getNUErr(); ++k)
            largest = std::max(largest, std::abs(_state.getUErr()[k]));
        return largest < kRateTolerance * (1 + std::abs(rate));
    }

    std::string findWorstJoint() const {
        std::string worst = "a constraint";
        Real largest = kJointTolerance;
        for (int i = 0; i < _model.getFlexibleBodies().getNumJoints(); ++i) {
            const Joint other = _model.getFlexibleBodies().getJoint(JointIndex(i));
            const Vector errors = other.calcPositionErrors(_state);
            for (int row = 0; row < errors.size(); ++row) {
                if (std::abs(errors[row]) <= largest) continue;
                largest = std::abs(errors[row]);
                worst = "'" + other.getName() + "'";
            }
        }
        return worst;
    }

private:
    void scale(const MobilizedBody& mobod, Real factor) {
        for (int i = 0; i < mobod.getNumU(_state); ++i)
            _weights[mobod.getFirstUIndex(_state) + i] *= factor;
    }

    void realize() { _model.getSystem().realize(_state, Stage::Velocity); }

    /** Without those of quaternions. **/
    int getNumPositionRows() const {
        return _state.getNQErr() - _matter.getNumQuaternionsInUse(_state);
    }

    /** Speeds that move the joint's frames. **/
    std::vector<int> findSpeeds() const {
        std::vector<int> speeds;
        const auto add = [&](const MobilizedBody& mobod) {
            for (int i = 0; i < mobod.getNumU(_state); ++i)
                speeds.push_back(mobod.getFirstUIndex(_state) + i);
        };
        for (const Attachment* frame :
             {&_joint.getFrameF(_coordinate), &_joint.getFrameM(_coordinate)}) {
            for (MobilizedBodyIndex at = frame->getMobilizedBodyIndex(); at != GroundIndex;) {
                const MobilizedBody& mobod = _matter.getMobilizedBody(at);
                add(mobod);
                at = mobod.getParentMobilizedBody().getMobilizedBodyIndex();
            }
            if (!frame->isFlexible()) continue;
            const FlexibleBody body =
                _model.getFlexibleBodies().getBody(frame->getFlexibleBodyIndex());
            for (int k = 0; k < body.getNumModalMobilizers(); ++k) add(body.getModalMobilizer(k));
        }
        std::sort(speeds.begin(), speeds.end());
        speeds.erase(std::unique(speeds.begin(), speeds.end()), speeds.end());
        return speeds;
    }

    /** ∂c/∂u: rates are linear in the speeds. **/
    Vector calcGradient() const {
        Vector gradient(_state.getNU(), Real(0));
        State moving = _state;
        for (const int j : findSpeeds()) {
            moving.updU() = 0;
            moving.updU()[j] = 1;
            _model.getSystem().realize(moving, Stage::Velocity);
            gradient[j] = _joint.calcCoordinateDots(moving)[_coordinate];
        }
        return gradient;
    }

    /** The δ with these right-hand sides of m rows of G and of the coordinate for which
    `before` + δ is smallest. **/
    Vector solve(int m, Vector right, const Vector& before) const {
        const int n = _state.getNU();
        Matrix G;
        _matter.calcG(_state, G);
        Matrix A(m + 1, n);
        const Vector gradient = calcGradient();
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < m; ++i) {
                A(i, j) = G(i, j) / _weights[j];
                right[i] += G(i, j) * before[j];
            }
            A(m, j) = gradient[j] / _weights[j];
            right[m] += gradient[j] * before[j];
        }
        Vector change;
        FactorQTZ(A, kConditioning).solve(right, change);
        for (int j = 0; j < n; ++j) change[j] = change[j] / _weights[j] - before[j];
        return change;
    }

    struct Mode {
        int u, q;
        Real start;
    };

    const Model& _model;
    const SimbodyMatterSubsystem& _matter;
    const Joint& _joint;
    int _coordinate;
    State _state;
    Vector _weights;
    std::vector<Mode> _modes;
};

std::string format(Real value, const std::string& unit) {
    return writeGeneral(value == 0 ? 0 : value, 6) + ' ' + unit;
}

/** What cannot be given the value, from here. **/
struct DragWish {
    const Model& model;
    const Joint& joint;
    int coordinate;
    std::string what, unit;
    Real value, now;

    [[noreturn]] void refuse(const std::string& reason) const {
        throw std::runtime_error("the " + what + " of '" + joint.getName() +
                                 "' cannot be brought to " + format(value, unit) + ": " + reason +
                                 "; it stays at " + format(now, unit));
    }

    void checkThatNoMotionLeads() const {
        const ModelValue motions = model.getFile().get("motions");
        for (const std::string& name : motions.getKeys()) {
            const ModelValue motion = motions.get(name), number = motion.get("coordinate");
            if (!motion.has("joint") || motion.get("joint").getText() != joint.getName()) continue;
            if ((number.isGiven() ? number.getInteger() : 0) != coordinate) continue;
            const char* key = motion.has("angle") ? ".angle" : ".position";
            refuse("motion '" + name + "' leads it (set motions." + name + key + " instead)");
        }
    }
};

DragWish makeWish(const Model& model, const State& state, const Joint& joint, int coordinate,
                  bool isRate, Real value) {
    const JointCoordinate& kind = joint.getEquations().getCoordinate(coordinate);
    const Vector now = isRate ? joint.calcCoordinateDots(state) : joint.calcCoordinates(state);
    return {model,
            joint,
            coordinate,
            getCoordinateNames(joint)[size_t(coordinate)] + (isRate ? "'s rate" : ""),
            std::string(kind.isAngle() ? "rad" : "m") + (isRate ? "/s" : ""),
            value,
            now[coordinate]};
}

}  // namespace

State dragJoint(const Model& model, const State& state, const Joint& joint, int coordinate,
                double value) {
    const DragWish wish = makeWish(model, state, joint, coordinate, false, value);
    wish.checkThatNoMotionLeads();
    const Real rate = joint.calcCoordinateDots(state)[coordinate];
    std::string culprit;
    for (const Shapes shapes : {Shapes::Held, Shapes::Free}) {
        Drag drag(model, state, joint, coordinate, shapes);
        if (drag.leadTo(value)) {
            const State moved = drag.getState();
            return drag.changeRateTo(rate) ? drag.getState() : moved;
        }
        culprit = drag.findWorstJoint();
    }
    wish.refuse(culprit + " does not allow it");
}

State setJointRate(const Model& model, const State& state, const Joint& joint, int coordinate,
                   double rate) {
    const DragWish wish = makeWish(model, state, joint, coordinate, true, rate);
    wish.checkThatNoMotionLeads();
    for (const Shapes shapes : {Shapes::Held, Shapes::Free}) {
        Drag drag(model, state, joint, coordinate, shapes);
        if (drag.changeRateTo(rate)) return drag.getState();
    }
    wish.refuse("the joints do not allow it");
}

std::vector<std::string> getCoordinateNames(const Joint& joint) {
    const JointEquations& equations = joint.getEquations();
    int numAngles = 0, numDisplacements = 0;
    for (int i = 0; i < joint.getNumCoordinates(); ++i)
        ++(equations.getCoordinate(i).isAngle() ? numAngles : numDisplacements);
    std::vector<std::string> names;
    int angle = 0, displacement = 0;
    for (int i = 0; i < joint.getNumCoordinates(); ++i) {
        const JointCoordinate& coordinate = equations.getCoordinate(i);
        const auto axisName = std::string(1, "xyz"[coordinate.sine[0]]);
        if (coordinate.isAngle())
            names.push_back(numAngles == 1 ? "angle" : "angle_" + std::to_string(++angle));
        else if (numDisplacements == 1)
            names.emplace_back("displacement");
        else if (equations.getNumFrames() == 2)
            names.push_back(axisName);
        else
            names.push_back("displacement_" + std::to_string(++displacement));
    }
    return names;
}

}  // namespace model
}  // namespace simflex
