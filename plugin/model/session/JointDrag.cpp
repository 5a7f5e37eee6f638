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

constexpr Real ModalWeight = 1e3;       // where bodies have to deform
constexpr Real LargestStep = 0.1;       // [rad] in one step
constexpr Real JointTolerance = 1e-11;  // of joints and the coordinate [m, rad]
constexpr Real Conditioning = 1e-9;     // rows that follow from others
constexpr Real RateTolerance = 1e-9;    // [m/s, rad/s]
constexpr int MostCorrections = 40;     // after the last step of the way

enum class Shapes { Held, Free };

class Drag {
public:
    Drag(const Model& model, const State& start, const Joint& joint, int coordinate, Shapes shapes)
        : m_model(model),
          m_matter(model.getMatter()),
          m_joint(joint),
          m_coordinate(coordinate),
          m_state(start) {
        model.getFlexibleBodies().closeJoints(m_state);
        m_weights = m_state.getUWeights();
        for (const Model::BodyEntry& body : model.getBodies()) {
            if (!body.flexible) continue;
            for (int k = 0; k < body.flexible->getNumModalMobilizers(); ++k) {
                const MobilizedBody& mobod = body.flexible->getModalMobilizer(k);
                scale(mobod, shapes == Shapes::Held ? Infinity : ModalWeight);
                for (int i = 0; i < mobod.getNumU(m_state); ++i)
                    m_modes.push_back({int(mobod.getFirstUIndex(m_state)) + i,
                                       int(mobod.getFirstQIndex(m_state)) + i, 0});
            }
        }
        // What a lock or a Motion holds does not move.
        for (MobilizedBodyIndex i(1); i < m_matter.getNumBodies(); ++i) {
            const MobilizedBody& mobod = m_matter.getMobilizedBody(i);
            if (mobod.isLocked(m_state) ||
                (mobod.hasMotion() && !mobod.getMotion().isDisabled(m_state)))
                scale(mobod, Infinity);
        }
        for (Mode& mode : m_modes) mode.start = m_state.getQ()[mode.q];
    }

    const State& getState() const { return m_state; }
    Real calcCoordinate() const { return m_joint.calcCoordinates(m_state)[m_coordinate]; }
    Real calcRate() const { return m_joint.calcCoordinateDots(m_state)[m_coordinate]; }

    Real calcLargestError() const {
        Real largest = 0;
        for (int i = 0; i < getNumPositionRows(); ++i)
            largest = std::max(largest, std::abs(m_state.getQErr()[i]));
        return largest;
    }

    /** Moves the coordinate by `change` to first order, and the joints together. **/
    void move(Real change) {
        const int m = getNumPositionRows();
        Vector right(m + 1);
        for (int i = 0; i < m; ++i) right[i] = -m_state.getQErr()[i];
        right[m] = change;
        Vector deformed(m_state.getNU(), Real(0));  // since the start
        for (const Mode& mode : m_modes) deformed[mode.u] = m_state.getQ()[mode.q] - mode.start;
        Vector dq(m_state.getNQ());
        m_matter.multiplyByN(m_state, false, solve(m, right, deformed), dq);
        m_state.updQ() += dq;
        m_matter.normalizeQuaternions(m_state);
        realize();
    }

    /** Leads the coordinate to `value`. @returns false if the joints do not allow it. **/
    bool leadTo(Real value) {
        const JointCoordinate& kind = m_joint.getEquations().getCoordinate(m_coordinate);
        const auto calcRest = [&] {
            const Real rest = value - calcCoordinate();
            return kind.isPeriodic() ? std::remainder(rest, 2 * Pi) : rest;
        };
        const Real way = std::abs(calcRest());
        const Real longest = kind.isAngle() ? LargestStep : way / 10;
        const int mostSteps = MostCorrections + (way > 0 ? int(std::ceil(2 * way / longest)) : 0);
        for (int step = 0; step < mostSteps; ++step) {
            const Real rest = calcRest();
            if (std::abs(rest) < JointTolerance * (1 + std::abs(value)) &&
                calcLargestError() < JointTolerance)
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
            const int m = m_state.getNUErr();
            Vector right(m + 1);
            for (int k = 0; k < m; ++k) right[k] = -m_state.getUErr()[k];
            right[m] = rate - calcRate();
            m_state.updU() += solve(m, right, Vector(m_state.getNU(), Real(0)));
            realize();
        }
        Real largest = std::abs(calcRate() - rate);
        for (int k = 0; k < m_state.getNUErr(); ++k)
            largest = std::max(largest, std::abs(m_state.getUErr()[k]));
        return largest < RateTolerance * (1 + std::abs(rate));
    }

    std::string findWorstJoint() const {
        std::string worst = "a constraint";
        Real largest = JointTolerance;
        for (int i = 0; i < m_model.getFlexibleBodies().getNumJoints(); ++i) {
            const Joint other = m_model.getFlexibleBodies().getJoint(JointIndex(i));
            const Vector errors = other.calcPositionErrors(m_state);
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
        for (int i = 0; i < mobod.getNumU(m_state); ++i)
            m_weights[mobod.getFirstUIndex(m_state) + i] *= factor;
    }

    void realize() { m_model.getSystem().realize(m_state, Stage::Velocity); }

    /** Without those of quaternions. **/
    int getNumPositionRows() const {
        return m_state.getNQErr() - m_matter.getNumQuaternionsInUse(m_state);
    }

    /** Speeds that move the joint's frames. **/
    std::vector<int> findSpeeds() const {
        std::vector<int> speeds;
        const auto add = [&](const MobilizedBody& mobod) {
            for (int i = 0; i < mobod.getNumU(m_state); ++i)
                speeds.push_back(mobod.getFirstUIndex(m_state) + i);
        };
        for (const Attachment* frame :
             {&m_joint.getFrameF(m_coordinate), &m_joint.getFrameM(m_coordinate)}) {
            for (MobilizedBodyIndex at = frame->getMobilizedBodyIndex(); at != GroundIndex;) {
                const MobilizedBody& mobod = m_matter.getMobilizedBody(at);
                add(mobod);
                at = mobod.getParentMobilizedBody().getMobilizedBodyIndex();
            }
            if (!frame->isFlexible()) continue;
            const FlexibleBody body =
                m_model.getFlexibleBodies().getBody(frame->getFlexibleBodyIndex());
            for (int k = 0; k < body.getNumModalMobilizers(); ++k) add(body.getModalMobilizer(k));
        }
        std::sort(speeds.begin(), speeds.end());
        speeds.erase(std::unique(speeds.begin(), speeds.end()), speeds.end());
        return speeds;
    }

    /** ∂c/∂u: rates are linear in the speeds. **/
    Vector calcGradient() const {
        Vector gradient(m_state.getNU(), Real(0));
        State moving = m_state;
        for (const int j : findSpeeds()) {
            moving.updU() = 0;
            moving.updU()[j] = 1;
            m_model.getSystem().realize(moving, Stage::Velocity);
            gradient[j] = m_joint.calcCoordinateDots(moving)[m_coordinate];
        }
        return gradient;
    }

    /** The δ with these right-hand sides of m rows of G and of the coordinate for which
    `before` + δ is smallest. **/
    Vector solve(int m, Vector right, const Vector& before) const {
        const int n = m_state.getNU();
        Matrix G;
        m_matter.calcG(m_state, G);
        Matrix A(m + 1, n);
        const Vector gradient = calcGradient();
        for (int j = 0; j < n; ++j) {
            for (int i = 0; i < m; ++i) {
                A(i, j) = G(i, j) / m_weights[j];
                right[i] += G(i, j) * before[j];
            }
            A(m, j) = gradient[j] / m_weights[j];
            right[m] += gradient[j] * before[j];
        }
        Vector change;
        FactorQTZ(A, Conditioning).solve(right, change);
        for (int j = 0; j < n; ++j) change[j] = change[j] / m_weights[j] - before[j];
        return change;
    }

    struct Mode {
        int u, q;
        Real start;
    };

    const Model& m_model;
    const SimbodyMatterSubsystem& m_matter;
    const Joint& m_joint;
    int m_coordinate;
    State m_state;
    Vector m_weights;
    std::vector<Mode> m_modes;
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
