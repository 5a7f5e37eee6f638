#include "simflex/model/session/Quantities.h"

#include <algorithm>
#include <cstdlib>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/body/JointEquations.h"
#include "simflex/model/analyses/StateNumbers.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/session/JointDrag.h"

namespace simflex {
namespace model {

using namespace SimTK;

namespace {

using Values = std::vector<double>;
using PathParts = std::vector<std::string>;

Vec3 toVec3(const Values& values) {
    return {values[0], values[1], values[2]};
}

/** An element of what is a list as a whole. **/
Quantity pickElement(const Quantity& whole, int index, const std::string& name) {
    Quantity element;
    element.path = whole.path + '.' + name;
    element.unit = whole.unit;
    element.get = [whole, index] { return Values{whole.get()[size_t(index)]}; };
    if (whole.calcStateWith)
        element.calcStateWith = [whole, index](const Values& values) {
            Values all = whole.get();
            all[size_t(index)] = values[0];
            return whole.calcStateWith(all);
        };
    return element;
}

// ---- joints

std::optional<Quantity> findJointQuantity(const Session& session, const PathParts& parts) {
    const Joint& joint = findNamed(session.getModel().getJoints(), "joint", parts[1]).joint;
    const std::vector<std::string> names = getCoordinateNames(joint);
    Quantity quantity;
    quantity.path = "joints." + parts[1];
    if (parts.size() == 2 && names.size() == 1)
        return findJointQuantity(session, {parts[0], parts[1], names[0]});
    if (parts.size() == 2 && !names.empty()) {
        quantity.get = [&session, &joint] {
            return toNumbers(joint.calcCoordinates(session.getState()));
        };
        return quantity;
    }
    if (parts.size() != 3) return {};
    for (size_t i = 0; i < names.size(); ++i) {
        const int c = int(i);
        const bool isAngle = joint.getEquations().getCoordinate(c).isAngle();
        const bool isOnly = names.size() == 1;
        if (parts[2] == names[i] || parts[2] == std::to_string(i)) {
            quantity.path += '.' + names[i];
            quantity.unit = isAngle ? "rad" : "m";
            quantity.get = [&session, &joint, c] {
                return Values{joint.calcCoordinates(session.getState())[c]};
            };
            quantity.calcStateWith = [&session, &joint, c](const Values& values) {
                return dragJoint(session.getModel(), session.copyState(), joint, c, values[0]);
            };
            return quantity;
        }
        if (parts[2] == names[i] + "_rate" || (isOnly && parts[2] == "rate")) {
            quantity.path += '.' + names[i] + "_rate";
            quantity.unit = isAngle ? "rad/s" : "m/s";
            quantity.get = [&session, &joint, c] {
                return Values{joint.calcCoordinateDots(session.getState())[c]};
            };
            quantity.calcStateWith = [&session, &joint, c](const Values& values) {
                return setJointRate(session.getModel(), session.copyState(), joint, c, values[0]);
            };
            return quantity;
        }
    }
    return {};
}

// ---- bodies

using BodyEntry = Model::BodyEntry;

Transform calcPose(const Session& session, const BodyEntry& body) {
    return body.mobod.getBodyTransform(session.getState()) * body.X_BP;
}

/** The State with the body's own frame (of a flexible one: of its part) at X_GP. **/
State place(const Session& session, const BodyEntry& body, const Transform& X_GP) {
    State state = session.copyState();
    const SimbodyMatterSubsystem& matter = session.getModel().getMatter();
    matter.getSystem().realize(state, Stage::Position);
    const Transform X_GB = X_GP * ~body.X_BP;
    const MobilizedBody& parent = body.mobod.getParentMobilizedBody();
    const Transform X_PB = ~parent.getBodyTransform(state) * X_GB;
    body.mobod.setQToFitTransform(
        state, ~body.mobod.getInboardFrame(state) * X_PB * body.mobod.getOutboardFrame(state));
    return state;
}

/** The State with these velocities of the body's own frame's origin, in Ground. **/
State setVelocity(const Session& session, const BodyEntry& body, const SpatialVec& V_GP) {
    State state = session.copyState();
    session.getModel().getSystem().realize(state, Stage::Velocity);
    const Rotation& R_GB = body.mobod.getBodyRotation(state);
    const Vec3 v_GB = V_GP[1] - V_GP[0] % (R_GB * body.X_BP.p());
    const MobilizedBody& parent = body.mobod.getParentMobilizedBody();
    if (parent.getMobilizedBodyIndex() != GroundIndex)
        throw std::runtime_error("'" + body.name +
                                 "' is carried by another body: set its 'rates' instead");
    const Transform X_GF = parent.getBodyTransform(state) * body.mobod.getInboardFrame(state);
    const Vec3 v_GM = v_GB + V_GP[0] % (R_GB * body.mobod.getOutboardFrame(state).p());
    body.mobod.setUToFitVelocity(state, SpatialVec(~X_GF.R() * V_GP[0], ~X_GF.R() * v_GM));
    return state;
}

SpatialVec calcVelocity(const Session& session, const BodyEntry& body) {
    const State& state = session.getState();
    const SpatialVec V_GB = body.mobod.getBodyVelocity(state);
    const Vec3 p = body.mobod.getBodyRotation(state) * body.X_BP.p();
    return {V_GB[0], V_GB[1] + V_GB[0] % p};
}

std::optional<Quantity> makeFlexibleQuantity(const Session& session, const BodyEntry& body,
                                             const std::string& name) {
    if (!body.flexible) return {};
    const FlexibleBody& flexible = *body.flexible;
    Quantity quantity;
    if (name == "modes") {
        quantity.unit = "m kg^0.5";
        quantity.get = [&] { return toNumbers(flexible.getModalCoordinates(session.getState())); };
        quantity.calcStateWith = [&](const Values& values) {
            State state = session.copyState();
            flexible.setModalCoordinates(state, toVector(values));
            return state;
        };
    } else if (name == "modal_speeds") {
        quantity.unit = "m kg^0.5/s";
        quantity.get = [&] { return toNumbers(flexible.getModalSpeeds(session.getState())); };
        quantity.calcStateWith = [&](const Values& values) {
            State state = session.copyState();
            flexible.setModalSpeeds(state, toVector(values));
            return state;
        };
    } else if (name == "rigid") {
        quantity.get = [&] { return Values{flexible.isRigid(session.getState()) ? 1. : 0.}; };
        quantity.calcStateWith = [&](const Values& values) {
            State state = session.copyState();
            if (values[0] != 0)
                flexible.setRigid(state);
            else
                flexible.setFlexible(state);
            return state;
        };
    } else {
        return {};
    }
    return quantity;
}

std::optional<Quantity> makeMobilizerQuantity(const Session& session, const BodyEntry& body,
                                              const std::string& name) {
    if (body.flexible || (name != "coordinates" && name != "rates")) return {};
    const bool isRate = name == "rates";
    Quantity quantity;
    quantity.get = [&session, &body, isRate] {
        const State& state = session.getState();
        return toNumbers(isRate ? body.mobod.getUAsVector(state) : body.mobod.getQAsVector(state));
    };
    quantity.calcStateWith = [&session, &body, isRate](const Values& values) {
        State state = session.copyState();
        const Vector vector = toVector(values);
        if (isRate)
            body.mobod.setUFromVector(state, vector);
        else
            body.mobod.setQFromVector(state, vector);
        return state;
    };
    return quantity;
}

std::optional<Quantity> makeFrameQuantity(const Session& session, const BodyEntry& body,
                                          const std::string& name) {
    Quantity quantity;
    if (name == "position") {
        quantity.unit = "m";
        quantity.get = [&] { return toNumbers(calcPose(session, body).p()); };
        quantity.calcStateWith = [&](const Values& values) {
            return place(session, body, Transform(calcPose(session, body).R(), toVec3(values)));
        };
    } else if (name == "orientation") {
        quantity.unit = "rad";
        quantity.get = [&] {
            return toNumbers(calcPose(session, body).R().convertRotationToBodyFixedXYZ());
        };
        quantity.calcStateWith = [&](const Values& values) {
            Rotation R;
            R.setRotationToBodyFixedXYZ(toVec3(values));
            return place(session, body, Transform(R, calcPose(session, body).p()));
        };
    } else if (name == "velocity" || name == "angular_velocity") {
        const int part = name == "velocity" ? 1 : 0;
        quantity.unit = part ? "m/s" : "rad/s";
        quantity.get = [&session, &body, part] {
            return toNumbers(calcVelocity(session, body)[part]);
        };
        quantity.calcStateWith = [&session, &body, part](const Values& values) {
            SpatialVec V = calcVelocity(session, body);
            V[part] = toVec3(values);
            return setVelocity(session, body, V);
        };
    } else {
        return {};
    }
    return quantity;
}

std::optional<Quantity> findBodyQuantity(const Session& session, const PathParts& parts) {
    const BodyEntry& body = findNamed(session.getModel().getBodies(), "body", parts[1]);
    if (parts.size() < 3 || parts.size() > 4) return {};
    const std::string& name = parts[2];
    std::optional<Quantity> quantity = makeFrameQuantity(session, body, name);
    if (!quantity) quantity = makeFlexibleQuantity(session, body, name);
    if (!quantity) quantity = makeMobilizerQuantity(session, body, name);
    if (!quantity) return {};
    quantity->path = "bodies." + body.name + '.' + name;
    if (parts.size() == 3) return quantity;
    if (name == "modes" || name == "modal_speeds")
        return pickElement(*quantity, readIndex(parts[3], 1, body.flexible->getNumModes(), "mode"),
                           parts[3]);
    if (name == "coordinates" || name == "rates")
        return pickElement(
            *quantity, readIndex(parts[3], 0, int(quantity->get().size()), "coordinate"), parts[3]);
    const std::string axes = "xyz";
    if (name == "rigid" || parts[3].size() != 1 || axes.find(parts[3]) == std::string::npos)
        return {};
    return pickElement(*quantity, int(axes.find(parts[3])), parts[3]);
}

}  // namespace

int readIndex(const std::string& text, int first, int count, const std::string& what) {
    char* end = nullptr;
    const long index = std::strtol(text.c_str(), &end, 10);
    if (text.empty() || *end || index < first || index >= first + count)
        throw std::runtime_error("there is no " + what + " '" + text + "'" +
                                 (count ? "; they are numbered from " + std::to_string(first) +
                                              " to " + std::to_string(first + count - 1)
                                        : "; there are none"));
    return int(index) - first;
}

std::string normalizePath(const std::string& path) {
    static const std::pair<const char*, const char*> plurals[] = {
        {"joint.", "joints."}, {"body.", "bodies."},          {"parameter.", "parameters."},
        {"probe.", "probes."}, {"motion.", "motions."},       {"frame.", "frames."},
        {"load.", "loads."},   {"connector.", "connectors."}, {"part.", "parts."}};
    for (const auto& [singular, plural] : plurals)
        if (path.rfind(singular, 0) == 0) return plural + path.substr(std::string(singular).size());
    return path;
}

std::optional<Quantity> findQuantity(const Session& session, const std::string& path) {
    const PathParts parts = splitAt(normalizePath(path), '.');
    if (path == "time") {
        Quantity quantity;
        quantity.path = "time";
        quantity.unit = "s";
        quantity.get = [&session] { return Values{session.getTime()}; };
        return quantity;
    }
    if (parts.size() < 2) return {};
    if (parts[0] == "joints") return findJointQuantity(session, parts);
    if (parts[0] == "bodies") return findBodyQuantity(session, parts);
    return {};
}

std::vector<std::string> listQuantities(const Session& session) {
    std::vector<std::string> paths{"time"};
    for (const Model::JointEntry& entry : session.getModel().getJoints())
        for (const std::string& name : getCoordinateNames(entry.joint)) {
            paths.push_back("joints." + entry.name + '.' + name);
            paths.push_back("joints." + entry.name + '.' + name + "_rate");
        }
    for (const BodyEntry& body : session.getModel().getBodies()) {
        std::vector<std::string> names = {"position", "orientation", "velocity",
                                          "angular_velocity"};
        if (body.flexible)
            names.insert(names.end(), {"modes", "modal_speeds", "rigid"});
        else
            names.insert(names.end(), {"coordinates", "rates"});
        for (const std::string& name : names) paths.push_back("bodies." + body.name + '.' + name);
    }
    return paths;
}

}  // namespace model
}  // namespace simflex
