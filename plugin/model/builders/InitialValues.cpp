#include "simflex/model/builders/InitialValues.h"

#include <algorithm>
#include <cmath>

#include "simflex/model/builders/ModelGeometry.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

constexpr double PlaceTolerance = 1e-7;  ///< of a mobilizer's body [m, rad]
constexpr double LargestTurn = 0.15;     ///< of one assembly [rad]
constexpr double LargestShift = 0.05;    ///< of one assembly [m]

int readMode(const ModelValue& modes, const std::string& key, int count) {
    const int mode = std::stoi(key);  // the schema lets whole numbers pass
    if (mode < 1 || mode > count)
        modes.get(key).fail("'" + key + "' is none of its modes, which are numbered from 1 to " +
                            std::to_string(count));
    return mode - 1;
}

Vector readModes(const ModelValue& modes, int count) {
    Vector values(count, 0.0);
    for (const std::string& key : modes.getKeys())
        values[readMode(modes, key, count)] = modes.get(key).getNumber();
    return values;
}

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

}  // namespace

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

void JointLeader::addTo(ModelSystem& system, const std::vector<JointStart>& starts,
                        const ModelFrames& frames, const JointBuilder& joints) {
    for (const JointStart& start : starts) {
        const std::string& name = start.joint.getName();
        const char* what = start.rate ? "rates" : "coordinates";
        const auto isCalledSo = [&](const auto& entry) { return entry.name == name; };
        if (std::none_of(system.joints.begin(), system.joints.end(), isCalledSo) &&
            std::any_of(system.bodies.begin(), system.bodies.end(), isCalledSo))
            start.joint.fail("'" + name + "' is a body: its " + what + " stand in initial.bodies." +
                             name);
        const Joint joint = findEntry(system.joints, "joint", name, start.joint).joint;
        if (joint.getNumCoordinates() == 0)
            start.joint.fail("joints of its type have no " + std::string(what) +
                             (start.rate ? ": give a body 'angular_velocity' in initial.bodies"
                                         : ": 'place' its bodies as they should be"));
        const FramePair* pair = joints.findFrames(name);
        if (!pair) start.joint.fail("'" + name + "' is a gear or coupler: name a joint it turns");
        const auto course = std::make_shared<Course>();
        const auto motion = [course](Real) {
            return Vec3(course->from + course->done * (course->to - course->from), course->rate, 0);
        };
        withPlace(start.joint, [&] {
            addJointMotion(joint, *pair, start.coordinate, motion, "start of " + name, frames,
                           system);
        });
        m_entries.push_back({start, joint, course});
    }
}

void JointLeader::lead(const ModelSystem& system, State& state) const {
    system.system.realize(state, Stage::Velocity);
    int steps = 1;
    for (const Entry& entry : m_entries) {
        Course& course = *entry.course;
        course.from = entry.joint.calcCoordinates(state)[entry.start.coordinate];
        course.to = entry.start.value.value_or(course.from);
        course.rate = entry.start.rate.value_or(0);
        const bool isAngle =
            Joint::Coordinate(entry.joint, entry.start.coordinate).getCoordinate().isAngle();
        const double most = isAngle ? LargestTurn : LargestShift;
        steps = std::max(steps, int(std::ceil(std::abs(course.to - course.from) / most)));
    }
    steps = std::min(steps, 10000);
    for (int i = 1; i <= steps; ++i) {
        for (const Entry& entry : m_entries) entry.course->done = double(i) / steps;
        state.updTime();  // what depends on the courses is no longer valid
        try {
            system.flexible.closeJoints(state);
        } catch (const std::runtime_error& error) {
            m_entries.front().start.joint.fail(
                std::string("the model cannot be assembled with these coordinates or rates: ") +
                error.what());
        }
    }
}

}  // namespace model
}  // namespace simflex
