#include "simflex/model/builders/InitialValues.h"

#include <algorithm>
#include <cmath>

#include "simflex/base/NumberText.h"
#include "simflex/body/JointGoals.h"
#include "simflex/body/StateCopy.h"
#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

constexpr double PlaceTolerance = 1e-7;  ///< of a mobilizer's body [m, rad]

Vector readMobilities(const ModelValue& value, const Mobilizer& mobilizer, int count) {
    if (mobilizer.isFree() || mobilizer.type == "ball" || mobilizer.type == "weld") {
        const std::string what = value.getName();
        value.fail("a body on a mobilizer of type " + mobilizer.type + " has no " + what +
                   " to set: use " +
                   (what == "coordinates" ? "place"
                    : mobilizer.isFree()  ? "velocity and angular_velocity"
                                          : "angular_velocity"));
    }
    const std::vector<double> numbers = value.getNumbers();
    if (int(numbers.size()) != count)
        value.fail("a mobilizer of type " + mobilizer.type + " has " + std::to_string(count) +
                   " of them; there are " + std::to_string(numbers.size()));
    return Vector(count, numbers.data());
}

void setBodySpeeds(const ModelValue& value, const Model::BodyEntry& body, State& state) {
    if (!value.has("velocity") && !value.has("angular_velocity")) return;
    const Vec3 omega = readVec3(value.get("angular_velocity"));
    const Vec3 v = readVec3(value.get("velocity"));  // of the origin of coordinates D
    const Transform X_GB = body.mobod.getBodyTransform(state);
    const Vec3 fromOrigin = X_GB.R() * -body.X_BP.p();
    body.mobod.setUToFitVelocity(state, [&] {
        const MobilizedBody& parent = body.mobod.getParentMobilizedBody();
        const Transform X_GF = parent.getBodyTransform(state) * body.mobod.getInboardFrame(state);
        const Vec3 p = X_GB * body.mobod.getOutboardFrame(state).p();  // of the outboard frame
        const SpatialVec V_GP = parent.getBodyVelocity(state);
        const Vec3 vM = v + omega % (fromOrigin + p - X_GB.p());
        const Vec3 vF = V_GP[1] + V_GP[0] % (p - parent.getBodyTransform(state).p());
        return SpatialVec(~X_GF.R() * (omega - V_GP[0]), ~X_GF.R() * (vM - vF));
    }());
}

void placeBody(const ModelValue& bodies, int i, const ModelFrames& frames,
               const Placement& placement, const ModelSystem& system, State& state) {
    const Model::BodyEntry& body = system.bodies[size_t(i)];
    const Transform X_GB = placement.getPose(i) * frames.calcBodyFrame(i);
    if (body.flexible) {
        body.flexible->setFramePose(state, X_GB);
        return;
    }
    system.system.realize(state, Stage::Position);
    const MobilizedBody& parent = body.mobod.getParentMobilizedBody();
    const Transform X_GF = parent.getBodyTransform(state) * body.mobod.getInboardFrame(state);
    body.mobod.setQToFitTransform(state, ~X_GF * X_GB * body.mobod.getOutboardFrame(state));
    system.system.realize(state, Stage::Position);
    const Transform off = ~X_GB * body.mobod.getBodyTransform(state);
    const double angle = std::abs(off.R().convertRotationToAngleAxis()[0]);
    const ModelValue place = bodies.get(body.name).get("place");
    if (place.isGiven() && off.p().norm() + angle > PlaceTolerance)
        place.fail("its mobilizer of type " + placement.getMobilizer(i).type +
                   " cannot put it there: it comes as near as " + std::to_string(off.p().norm()) +
                   " m and " + std::to_string(angle) + " rad");
}

Joint findStartingJoint(const JointStart& start, const ModelValue& file,
                        const ModelSystem& system) {
    const std::string& name = start.joint.getName();
    const char* what = start.rate ? "rates" : "coordinates";
    const auto isCalledSo = [&](const auto& entry) { return entry.name == name; };
    if (std::none_of(system.joints.begin(), system.joints.end(), isCalledSo) &&
        std::any_of(system.bodies.begin(), system.bodies.end(), isCalledSo))
        start.joint.fail("'" + name + "' is a body: its " + what + " stand in initial.bodies." +
                         name);
    const Joint joint = findEntry(system.joints, "joint", name, start.joint).joint;
    if (!file.get("joints").get(name).has("between"))
        start.joint.fail("'" + name + "' is a gear or coupler: name a joint it turns");
    if (joint.getNumCoordinates() == 0)
        start.joint.fail("joints of its type have no " + std::string(what) +
                         (start.rate ? ": give a body 'angular_velocity' in initial.bodies"
                                     : ": 'place' its bodies as they should be"));
    withPlace(start.joint, [&] { checkCoordinate(joint, start.coordinate); });
    return joint;
}

/** Upper bound on the displacement that a body's modes cause anywhere. **/
double calcLargestSum(const FlexibleBody& body, const Vector& xi) {
    const ReducedBody& part = body.getPart();
    double sum = 0;
    for (int mode = 0; mode < xi.size(); ++mode) {
        double largest = 0;
        for (int node = 0; node < part.mesh.numNodes(); ++node) {
            const double* shape =
                &part.Phi[3 * size_t(node) + 3 * size_t(part.mesh.numNodes()) * size_t(mode)];
            largest = std::max(largest, std::hypot(shape[0], shape[1], shape[2]));
        }
        sum += std::abs(xi[mode]) * largest;
    }
    return sum;
}

/** Describes bodies whose shapes, or their rates, differ between `now` and `before`. **/
std::vector<std::string> describeBending(const ModelSystem& system, const State& before,
                                         const State& now) {
    constexpr double Bent = 1e-9, Fast = 1e-6;  // [m], [m/s]
    std::vector<std::string> texts;
    for (const Model::BodyEntry& body : system.bodies) {
        if (!body.flexible || body.flexible->getNumModes() == 0) continue;
        const FlexibleBody& flexible = *body.flexible;
        const double bend = calcLargestSum(flexible, flexible.getModalCoordinates(now) -
                                                         flexible.getModalCoordinates(before)),
                     speed = calcLargestSum(
                         flexible, flexible.getModalSpeeds(now) - flexible.getModalSpeeds(before));
        if (bend > Bent)
            texts.push_back("'" + body.name + "' is bent from the start, by up to " +
                            writeGeneral(bend, 2) +
                            " m: with its shape held the joints do not close with the coordinates "
                            "under 'initial'");
        if (speed > Fast)
            texts.push_back("'" + body.name + "' vibrates from the start, with up to " +
                            writeGeneral(speed, 2) +
                            " m/s: with its shape held the joints do not allow the rates under "
                            "'initial'");
    }
    return texts;
}

}  // namespace

Vector readModes(const ModelValue& modes, int count) {
    Vector values(count, 0.0);
    for (const std::string& key : modes.getKeys()) {
        const int mode = std::stoi(key);  // the schema ensures a whole number
        if (mode < 1 || mode > count)
            modes.get(key).fail("'" + key +
                                "' is not one of its modes, which are numbered from 1 to " +
                                std::to_string(count));
        values[mode - 1] = modes.get(key).getNumber();
    }
    return values;
}

std::vector<JointStart> readJointStarts(const ModelValue& file) {
    const ModelValue initial = file.get("initial");
    std::vector<JointStart> starts;
    const auto read = [&](const ModelValue& map, std::optional<double> JointStart::*member) {
        for (const std::string& name : map.getKeys()) {
            const ModelValue value = map.get(name);
            const std::vector<double> numbers = value.getNumbers();
            for (size_t i = 0; i < numbers.size(); ++i) {
                auto found = std::find_if(starts.begin(), starts.end(), [&](const JointStart& s) {
                    return s.joint.getName() == name && s.coordinate == int(i);
                });
                if (found == starts.end())
                    found = starts.insert(starts.end(), {value, int(i), {}, {}});
                *found.*member = numbers[i];
            }
        }
    };
    read(initial.get("joints"), &JointStart::value);
    read(initial.get("rates"), &JointStart::rate);
    return starts;
}

double findStartValue(const ModelValue& file, const std::string& joint, int coordinate) {
    for (const JointStart& start : readJointStarts(file))
        if (start.value && start.joint.getName() == joint && start.coordinate == coordinate)
            return *start.value;
    return 0;
}

void placeBodies(const ModelValue& file, const ModelFrames& frames, const Placement& placement,
                 const ModelSystem& system, State& state) {
    const ModelValue bodies = file.get("bodies"), initial = file.get("initial").get("bodies");
    for (const std::string& name : initial.getKeys())
        findEntry(system.bodies, "body", name, initial.get(name));
    for (const int i : placement.getOrder()) placeBody(bodies, i, frames, placement, system, state);
    for (const int i : placement.getOrder()) {
        const Model::BodyEntry& body = system.bodies[size_t(i)];
        if (!initial.has(body.name)) continue;
        const ModelValue value = initial.get(body.name);
        if (value.has("coordinates")) {
            const ModelValue q = value.get("coordinates");
            body.mobod.setQFromVector(
                state, readMobilities(q, placement.getMobilizer(i), body.mobod.getNumQ(state)));
        }
    }
    system.system.realize(state, Stage::Position);
    for (const int i : placement.getOrder()) {
        const Model::BodyEntry& body = system.bodies[size_t(i)];
        if (!initial.has(body.name)) continue;
        const ModelValue value = initial.get(body.name);
        system.system.realize(state, Stage::Velocity);
        setBodySpeeds(value, body, state);
        if (value.has("rates")) {
            const ModelValue u = value.get("rates");
            body.mobod.setUFromVector(
                state, readMobilities(u, placement.getMobilizer(i), body.mobod.getNumU(state)));
        }
        for (const char* key : {"modes", "modal_speeds"}) {
            if (!value.has(key)) continue;
            if (!body.flexible) value.get(key).fail("'" + body.name + "' is rigid");
            const Vector xi = readModes(value.get(key), body.flexible->getNumModes());
            if (body.flexible->isRigid(state)) continue;
            if (key == std::string("modes"))
                body.flexible->setModalCoordinates(state, xi);
            else
                body.flexible->setModalSpeeds(state, xi);
        }
    }
    system.system.realize(state, Stage::Velocity);
}

/** Fails at the likely cause: joints that cannot be closed, or one of the starts. **/
[[noreturn]] void failStart(const ModelValue& file, const ModelSystem& system, const State& given,
                            const std::vector<JointStart>& starts, const std::string& reason) {
    State closed = copyState(given);
    try {
        system.flexible.closeJoints(closed);
    } catch (const std::runtime_error& error) {
        file.get("joints").fail(
            std::string("the model cannot be assembled, whatever 'initial' asks of its joints: ") +
            error.what());
    }
    const std::string what = "the model cannot be assembled with these coordinates or rates: ";
    for (const JointStart& start : starts) {  // find one that cannot be met even alone
        if (!start.value) continue;
        State alone = copyState(given);
        try {
            setJointCoordinates(
                system.flexible, alone,
                {{findStartingJoint(start, file, system), start.coordinate, *start.value}},
                AngleWay::Whole);
        } catch (const std::runtime_error& error) {
            start.joint.fail(what + error.what());
        }
    }
    auto blamed = std::find_if(starts.begin(), starts.end(), [&](const JointStart& start) {
        return reason.rfind("'" + start.joint.getName() + "' ", 0) == 0;
    });
    if (blamed == starts.end()) blamed = starts.begin();
    blamed->joint.fail(what + reason);
}

std::vector<std::string> setJointStarts(const ModelValue& file, const ModelSystem& system,
                                        State& state) {
    const State given = copyState(state);
    const std::vector<JointStart> starts = readJointStarts(file);
    std::vector<JointGoal> coordinates, rates;
    for (const JointStart& start : starts) {
        const Joint joint = findStartingJoint(start, file, system);
        if (start.value) coordinates.push_back({joint, start.coordinate, *start.value});
        rates.push_back({joint, start.coordinate, start.rate.value_or(0)});
    }
    const bool hasRates = std::any_of(starts.begin(), starts.end(),
                                      [](const JointStart& start) { return bool(start.rate); });
    try {
        // Set positions first, keeping the bodies' speeds; then rates at these positions.
        if (!coordinates.empty())
            setJointCoordinates(system.flexible, state, coordinates, AngleWay::Whole);
        if (hasRates) setJointRates(system.flexible, state, rates);
    } catch (const std::runtime_error& error) {
        failStart(file, system, given, starts, error.what());
    }
    system.system.realize(state, Stage::Velocity);
    return describeBending(system, given, state);
}

}  // namespace model
}  // namespace simflex
