/** @file
Probes of joints and prescribed motions. **/

#include "simflex/body/JointEquations.h"
#include "simflex/forces/JointFriction.h"
#include "simflex/model/probes/ProbeKinds.h"

namespace simflex {
namespace model {

using SimTK::SpatialVec;
using SimTK::Transform;
using SimTK::Vec3;
using SimTK::Vector;

namespace {

enum class Order { Value, Rate };

Probe makeCoordinates(const std::shared_ptr<const Model>& model, const Joint& joint, int number,
                      Order order) {
    Probe probe;
    const JointEquations& equations = joint.getEquations();
    const int first = number >= 0 ? number : 0;
    const int count = number >= 0 ? 1 : joint.getNumCoordinates();
    bool isAngle = false, isDisplacement = false;
    for (int k = first; k < first + count; ++k) {
        (equations.getCoordinate(k).isAngle() ? isAngle : isDisplacement) = true;
        probe.columns.push_back(count == 1 ? "" : std::to_string(k));
        probe.signals.push_back(order == Order::Value ? Signal::coordinate(joint, k)
                                                      : Signal::coordinateRate(joint, k));
    }
    probe.unit = isAngle && isDisplacement ? "rad, m" : isAngle ? "rad" : "m";
    if (order == Order::Rate)
        probe.unit = isAngle && isDisplacement ? "rad/s, m/s" : probe.unit + "/s";
    probe.calc = [model, joint, first, count, order](const Moment& moment, double* values) {
        const Vector all = order == Order::Value ? joint.calcCoordinates(moment.state)
                                                 : joint.calcCoordinateDots(moment.state);
        for (int k = 0; k < count; ++k) values[k] = all[first + k];
    };
    return probe;
}

/** Coordinates of a mobilizer: all, or one (number ≥ 0). **/
Probe makeMobilizerCoordinates(const std::shared_ptr<const Model>& model,
                               const Model::BodyEntry& body, int number, Order order) {
    const SimTK::State state = model->getSystem().getDefaultState();
    const int all = order == Order::Value ? body.mobod.getNumQ(state) : body.mobod.getNumU(state);
    const int first = number >= 0 ? number : 0, count = number >= 0 ? 1 : all;
    Probe probe;
    for (int k = first; k < first + count; ++k)
        probe.columns.push_back(count == 1 ? "" : std::to_string(k));
    // Coordinates of other types may have different units.
    const ModelValue mobilizer = model->getFile().get("bodies").get(body.name).get("mobilizer");
    const std::string type = mobilizer.isGiven() ? mobilizer.get("type").getText() : "free";
    if (type == "pin" || type == "universal") probe.unit = "rad";
    if (type == "slider") probe.unit = "m";
    if (order == Order::Rate && !probe.unit.empty()) probe.unit += "/s";
    probe.calc = [model, mobod = body.mobod, first, count, order](const Moment& moment,
                                                                  double* values) {
        for (int k = 0; k < count; ++k)
            values[k] = order == Order::Value ? mobod.getOneQ(moment.state, first + k)
                                              : mobod.getOneU(moment.state, first + k);
    };
    return probe;
}

/** Returns the number `coordinate` of a map; −1, all, without it. @param owner  "joint 'pin'" **/
int readCoordinate(const ModelValue& what, const std::string& owner, int count) {
    if (!what.isMap() || !what.has("coordinate")) return -1;
    const ModelValue wanted = what.get("coordinate");
    const int number = wanted.getInteger();
    if (number < 0 || number >= count)
        wanted.fail("there is no coordinate " + std::to_string(number) + "; " + owner + " has " +
                    std::to_string(count) + ", numbered from 0");
    return number;
}

/** For {body: NAME, coordinate: n}; all coordinates without `coordinate`. **/
Probe makeMobilizerProbe(const ProbeSource& source, const ModelValue& map, Order order) {
    const Model::BodyEntry& body = source.model->findBody(map.get("body"));
    const SimTK::State state = source.model->getSystem().getDefaultState();
    const int count = order == Order::Value ? body.mobod.getNumQ(state) : body.mobod.getNumU(state);
    if (count == 0) map.get("body").fail("'" + body.name + "' has no coordinates");
    return makeMobilizerCoordinates(source.model, body,
                                    readCoordinate(map, "'" + body.name + "'", count), order);
}

/** For `key: JOINT`, {joint: JOINT, coordinate: n} or {body: BODY, coordinate: n}. **/
Probe makeAnyCoordinate(const ProbeSource& source, const char* key, Order order) {
    const ModelValue what = source.entry.get(key);
    if (what.isMap() && what.has("body")) return makeMobilizerProbe(source, what, order);
    const ModelValue name = what.isMap() ? what.get("joint") : what;
    const Joint& joint = source.model->findJoint(name).joint;
    const int count = joint.getNumCoordinates();
    if (count == 0)
        name.fail("joint '" + joint.getName() +
                  "' has no coordinates; probe 'orientation' or "
                  "'position' of a frame instead");
    return makeCoordinates(source.model, joint,
                           readCoordinate(what, "joint '" + joint.getName() + "'", count), order);
}

}  // namespace

Vector getMultipliers(const Model& model, const Joint& joint, const Moment& moment) {
    const FlexibleBodySubsystem& subsystem = model.getFlexibleBodies();
    // Released joints have no multipliers.
    const auto isReleased = [&](const Joint& other) {
        return model.getMatter().getConstraint(other.getConstraintIndex()).isDisabled(moment.state);
    };
    int first = 0;
    for (JointIndex other(0); other < joint.getIndex(); ++other)
        if (!isReleased(subsystem.getJoint(other)))
            first += subsystem.getJoint(other).getNumEquations();
    Vector multipliers(joint.getNumEquations(), 0.0);
    if (isReleased(joint)) return multipliers;
    for (int k = 0; k < multipliers.size(); ++k) multipliers[k] = moment.multipliers[first + k];
    return multipliers;
}

Vector getFrictionForces(const Model& model, const Joint& joint, const Moment& moment) {
    // They are last: for each contact one force per rate, then as many numbers that are no forces.
    const FlexibleBodySubsystem& subsystem = model.getFlexibleBodies();
    const auto countRates = [&](const Joint& other) {
        const bool rubs =
            JointFriction::exists(subsystem, other) &&
            !model.getMatter().getConstraint(other.getConstraintIndex()).isDisabled(moment.state);
        return rubs ? JointFriction(subsystem, other).getNumRates() : 0;
    };
    int first = moment.multipliers.size();
    for (JointIndex other = joint.getIndex(); other < subsystem.getNumJoints(); ++other)
        first -= 2 * countRates(subsystem.getJoint(other));
    const JointFriction friction(subsystem, joint);
    Vector forces(friction.getNumRates(), 0.0);
    if (countRates(joint) == 0) return forces;
    for (int k = 0, done = 0; k < friction.getNumContacts(); ++k) {
        const int rates = friction.getNumRates(k);
        for (int i = 0; i < rates; ++i) forces[done + i] = -moment.multipliers[first + i];
        done += rates;
        first += 2 * rates;
    }
    return forces;
}

Probe makeJointCoordinates(const std::shared_ptr<const Model>& model, const Joint& joint,
                           int number) {
    return makeCoordinates(model, joint, number, Order::Value);
}

Probe makeBodyCoordinates(const std::shared_ptr<const Model>& model, const Model::BodyEntry& body) {
    return makeMobilizerCoordinates(model, body, -1, Order::Value);
}

Probe makeJointRates(const std::shared_ptr<const Model>& model, const Joint& joint, int number) {
    return makeCoordinates(model, joint, number, Order::Rate);
}

Probe makeCoordinateProbe(const ProbeSource& source) {
    return makeAnyCoordinate(source, "coordinate", Order::Value);
}

Probe makeRateProbe(const ProbeSource& source) {
    return makeAnyCoordinate(source, "rate", Order::Rate);
}

Probe makeJointErrorProbe(const ProbeSource& source) {
    const Joint joint = source.model->findJoint(source.entry.get("joint_error")).joint;
    Probe probe;
    for (int k = 0; k < joint.getNumEquations(); ++k)
        probe.columns.push_back(joint.getNumEquations() == 1 ? "" : std::to_string(k));
    probe.calc = [model = source.model, joint](const Moment& moment, double* values) {
        const Vector errors = joint.calcPositionErrors(moment.state);
        for (int k = 0; k < errors.size(); ++k) values[k] = errors[k];
    };
    return probe;
}

Probe makeReactionProbe(const ProbeSource& source) {
    const ModelValue& entry = source.entry;
    const Joint joint = source.model->findJoint(entry.get("reaction")).joint;
    const std::string on = entry.get("on").getText(), axes = entry.get("axes").getText(),
                      part = entry.get("part").getText();
    const Joint::Side side = on == "F" ? Joint::Side::F : Joint::Side::M;
    const Joint::Axes inAxes = axes == "F"   ? Joint::Axes::F
                               : axes == "M" ? Joint::Axes::M
                                             : Joint::Axes::Ground;
    const int row = part == "torque" ? 0 : 1;
    const Vec3 p_FG =
        side == Joint::Side::F ? source.model->findNamedOrigin(joint.getName()) : Vec3(0);
    Probe probe;
    probe.unit = part == "torque" ? "N m" : "N";
    probe.columns = {"x", "y", "z"};
    probe.calc = [model = source.model, joint, side, inAxes, row, p_FG](const Moment& moment,
                                                                        double* values) {
        SpatialVec reaction = joint.calcReaction(
            moment.state, getMultipliers(*model, joint, moment), side, side, inAxes);
        const FlexibleBodySubsystem& subsystem = model->getFlexibleBodies();
        if (JointFriction::exists(subsystem, joint))
            reaction += JointFriction(subsystem, joint)
                            .calcForce(moment.state, getFrictionForces(*model, joint, moment), side,
                                       inAxes);
        for (const Joint::Lock& lock : model->getLocks(joint.getName()))
            reaction += lock.calcReaction(moment.state, getMultipliers(*model, lock, moment), side,
                                          side, inAxes);
        if (row == 0 && p_FG.norm() > 0) {
            const Transform X_GF = joint.getFrameF().calcMotion(moment.state).X;
            Vec3 arm = X_GF.R() * p_FG;
            if (inAxes == Joint::Axes::F) arm = p_FG;
            if (inAxes == Joint::Axes::M)
                arm = ~joint.getFrameM().calcMotion(moment.state).X.R() * arm;
            reaction[0] -= arm % reaction[1];
        }
        for (int k = 0; k < 3; ++k) values[k] = reaction[row][k];
    };
    return selectComponent(entry, std::move(probe));
}

Probe makeFrictionProbe(const ProbeSource& source) {
    const ModelValue named = source.entry.get("friction");
    const Joint joint = source.model->findJoint(named).joint;
    const FlexibleBodySubsystem& subsystem = source.model->getFlexibleBodies();
    if (!JointFriction::exists(subsystem, joint))
        named.fail("joint '" + joint.getName() + "' has no friction");
    const JointFriction friction(subsystem, joint);
    const std::string what = source.entry.get("what").getText();
    Probe probe;
    int columns = friction.getNumRates();
    if (what == "load") columns = friction.getNumContacts();
    if (what == "power") columns = 1;
    const bool turns = friction.turns();
    probe.unit = what == "power"  ? "W"
                 : what == "rate" ? (turns ? "rad/s" : "m/s")
                                  : (turns ? "N m" : "N");
    for (int k = 0; k < columns; ++k)
        probe.columns.push_back(columns == 1 ? "" : std::to_string(k));
    probe.calc = [model = source.model, friction, what](const Moment& moment, double* values) {
        const Joint& rubbing = friction.getJoint();
        const Vector multipliers = getMultipliers(*model, rubbing, moment),
                     forces = getFrictionForces(*model, rubbing, moment);
        if (what == "power") *values = 0;
        for (int k = 0; k < friction.getNumContacts(); ++k) {
            const JointFriction::Contact contact =
                friction.calcContact(moment.state, multipliers, forces, k);
            if (what == "power") *values += contact.power;
            if (what == "load") *values++ = contact.load;
            if (what != "force" && what != "rate") continue;
            for (int i = 0; i < friction.getNumRates(k); ++i)
                *values++ = what == "force" ? contact.force[i] : contact.rates[i];
        }
    };
    return probe;
}

Probe makeDrivingProbe(const ProbeSource& source) {
    const Joint joint = source.model->findMotion(source.entry.get("driving")).joint;
    Probe probe;
    const int count = joint.getNumEquations();
    for (int k = 0; k < count; ++k) probe.columns.push_back(count == 1 ? "" : std::to_string(k));
    const bool isAngle =
        joint.getNumCoordinates() == 1 && joint.getEquations().getCoordinate(0).isAngle();
    probe.unit = isAngle ? "N m" : "N";
    probe.calc = [model = source.model, joint](const Moment& moment, double* values) {
        const Vector forces = joint.calcDrivingForces(getMultipliers(*model, joint, moment));
        for (int k = 0; k < forces.size(); ++k) values[k] = forces[k];
    };
    return probe;
}

}  // namespace model
}  // namespace simflex
