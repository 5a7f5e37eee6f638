#include "simflex/model/session/JointDrag.h"

#include <stdexcept>

#include "simflex/base/NumberText.h"
#include "simflex/body/JointEquations.h"
#include "simflex/body/JointGoals.h"
#include "simflex/body/StateCopy.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

std::string format(Real value, const std::string& unit) {
    return writeGeneral(value == 0 ? 0 : value, 6) + ' ' + unit;
}

/** A requested value, for messages if it cannot be set. **/
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
            refuse("motion '" + name + "' drives it (set motions." + name + key + " instead)");
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
    DragWish wish = makeWish(model, state, joint, coordinate, false, value);
    wish.checkThatNoMotionLeads();
    State moved = copyState(state);
    try {
        setJointCoordinates(model.getFlexibleBodies(), moved, {{joint, coordinate, value}},
                            AngleWay::Whole);
    } catch (const std::runtime_error& error) {
        wish.refuse(error.what());
    }
    try {
        const Real rate = joint.calcCoordinateDots(state)[coordinate];
        setJointRates(model.getFlexibleBodies(), moved, {{joint, coordinate, rate}});
    } catch (const std::runtime_error&) {
        // The rate is impossible at this position.
    }
    return moved;
}

State setJointRate(const Model& model, const State& state, const Joint& joint, int coordinate,
                   double rate) {
    const DragWish wish = makeWish(model, state, joint, coordinate, true, rate);
    wish.checkThatNoMotionLeads();
    State moved = copyState(state);
    try {
        setJointRates(model.getFlexibleBodies(), moved, {{joint, coordinate, rate}});
    } catch (const std::runtime_error&) {
        wish.refuse("the joints do not allow it");
    }
    return moved;
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
