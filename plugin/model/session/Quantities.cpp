#include "simflex/model/session/Quantities.h"

#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
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

std::optional<Quantity> findByPath(const std::vector<Quantity>& quantities,
                                   const std::string& path) {
    for (const Quantity& quantity : quantities)
        if (quantity.path == path) return quantity;
    return {};
}

/** An element of a quantity that is a list. **/
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

/** Makes a function that changes a copy of the Session's State. **/
template <class Change>
auto calcChanged(const Session& session, const Change& change) {
    return [&session, change](const Values& values) {
        State state = session.copyState();
        change(state, values);
        return state;
    };
}

// ---- joints

/** Quantities for a joint's coordinates and their rates. **/
std::vector<Quantity> makeJointQuantities(const Session& session, const Model::JointEntry& entry) {
    const Joint& joint = entry.joint;
    const std::vector<std::string> names = getCoordinateNames(joint);
    std::vector<Quantity> all;
    for (int c = 0; c < int(names.size()); ++c) {
        const std::string path = "joints." + entry.name + '.' + names[size_t(c)];
        const std::string unit = joint.getEquations().getCoordinate(c).isAngle() ? "rad" : "m";
        all.push_back(
            {path, unit, [&, c] { return Values{joint.calcCoordinates(session.getState())[c]}; },
             [&, c](const Values& values) {
                 return dragJoint(session.getModel(), session.copyState(), joint, c, values[0]);
             }});
        all.push_back({path + "_rate", unit + "/s",
                       [&, c] { return Values{joint.calcCoordinateDots(session.getState())[c]}; },
                       [&, c](const Values& values) {
                           return setJointRate(session.getModel(), session.copyState(), joint, c,
                                               values[0]);
                       }});
    }
    return all;
}

std::optional<Quantity> findJointQuantity(const Session& session, const PathParts& parts) {
    const Model::JointEntry& entry = findNamed(session.getModel().getJoints(), "joint", parts[1]);
    const std::vector<std::string> names = getCoordinateNames(entry.joint);
    const bool isOnly = names.size() == 1;
    if (parts.size() > 3 || names.empty()) return {};
    if (parts.size() == 2 && !isOnly)
        return Quantity{"joints." + entry.name,
                        "",
                        [&] {
                            Values all;
                            const SimTK::Vector now =
                                entry.joint.calcCoordinates(session.getState());
                            for (int c = 0; c < now.size(); ++c) all.push_back(now[c]);
                            return all;
                        },
                        {}};
    std::string name = parts.size() == 2 ? names[0] : parts[2];
    if (isOnly && name == "rate") name = names[0] + "_rate";
    for (size_t i = 0; i < names.size(); ++i)
        if (name == std::to_string(i)) name = names[i];
    return findByPath(makeJointQuantities(session, entry), "joints." + entry.name + '.' + name);
}

// ---- bodies

using BodyEntry = Model::BodyEntry;

Transform calcPose(const Session& session, const BodyEntry& body) {
    return body.mobod.getBodyTransform(session.getState()) * body.X_BP;
}

/** The State with the body's own frame (the part's, for a flexible body) at X_GP. **/
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

/** The State with the given velocity of the body's own frame in Ground. **/
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

std::vector<Quantity> makeBodyQuantities(const Session& session, const BodyEntry& body) {
    std::vector<Quantity> all{
        {"position", "m", [&] { return toNumbers(calcPose(session, body).p()); },
         [&](const Values& values) {
             return place(session, body, Transform(calcPose(session, body).R(), toVec3(values)));
         }},
        {"orientation", "rad",
         [&] { return toNumbers(calcPose(session, body).R().convertRotationToBodyFixedXYZ()); },
         [&](const Values& values) {
             Rotation R;
             R.setRotationToBodyFixedXYZ(toVec3(values));
             return place(session, body, Transform(R, calcPose(session, body).p()));
         }},
        {"velocity", "m/s", [&] { return toNumbers(calcVelocity(session, body)[1]); },
         [&](const Values& values) {
             const Vec3 omega = calcVelocity(session, body)[0];
             return setVelocity(session, body, SpatialVec(omega, toVec3(values)));
         }},
        {"angular_velocity", "rad/s", [&] { return toNumbers(calcVelocity(session, body)[0]); },
         [&](const Values& values) {
             const Vec3 v = calcVelocity(session, body)[1];
             return setVelocity(session, body, SpatialVec(toVec3(values), v));
         }}};
    const auto add = [&](const char* name, const char* unit, const auto& get, const auto& change) {
        all.push_back({name, unit, [&session, get] { return toNumbers(get(session.getState())); },
                       calcChanged(session, change)});
    };
    if (body.flexible) {
        const FlexibleBody& flexible = *body.flexible;
        add(
            "modes", "m kg^0.5", [&](const State& s) { return flexible.getModalCoordinates(s); },
            [&](State& s, const Values& xi) { flexible.setModalCoordinates(s, toVector(xi)); });
        add(
            "modal_speeds", "m kg^0.5/s",
            [&](const State& s) { return flexible.getModalSpeeds(s); },
            [&](State& s, const Values& u) { flexible.setModalSpeeds(s, toVector(u)); });
        add(
            "rigid", "", [&](const State& s) { return Vec<1>(flexible.isRigid(s) ? 1 : 0); },
            [&](State& s, const Values& values) {
                if (values[0] != 0)
                    flexible.setRigid(s);
                else
                    flexible.setFlexible(s);
            });
    } else {
        add(
            "coordinates", "", [&](const State& s) { return body.mobod.getQAsVector(s); },
            [&](State& s, const Values& q) { body.mobod.setQFromVector(s, toVector(q)); });
        add(
            "rates", "", [&](const State& s) { return body.mobod.getUAsVector(s); },
            [&](State& s, const Values& u) { body.mobod.setUFromVector(s, toVector(u)); });
    }
    for (Quantity& quantity : all) quantity.path = "bodies." + body.name + '.' + quantity.path;
    return all;
}

std::optional<Quantity> findBodyQuantity(const Session& session, const PathParts& parts) {
    const BodyEntry& body = findNamed(session.getModel().getBodies(), "body", parts[1]);
    if (parts.size() < 3 || parts.size() > 4) return {};
    const std::string& name = parts[2];
    const std::optional<Quantity> quantity =
        findByPath(makeBodyQuantities(session, body), "bodies." + body.name + '.' + name);
    if (!quantity || parts.size() == 3) return quantity;
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

// ---- states

Quantity makeStateQuantity(const Session& session, const std::string& name, const Signal& value) {
    const FlexibleBodySubsystem& flexible = session.getModel().getFlexibleBodies();
    Quantity quantity{"states." + name,
                      "",
                      [&] { return Values{value.calcValue(flexible, session.getState())}; },
                      {}};
    const auto& settable = session.getModel().getSettableStates();
    const auto found = settable.find(name);
    if (found != settable.end())
        quantity.calcStateWith = calcChanged(
            session, [&flexible, number = found->second](State& state, const Values& z) {
                flexible.setStateValue(state, number, z[0]);
            });
    return quantity;
}

std::vector<Quantity> makeStateQuantities(const Session& session) {
    std::vector<Quantity> all;
    for (const auto& [name, value] : session.getModel().getStates())
        if (!session.getModel().findInput(name))
            all.push_back(makeStateQuantity(session, name, value));
    return all;
}

// ---- inputs

Quantity makeOfState(const Session& session, const std::string& path, const std::string& unit,
                     int number) {
    const FlexibleBodySubsystem& flexible = session.getModel().getFlexibleBodies();
    return {path, unit,
            [&, number] { return Values{flexible.getStateValue(session.getState(), number)}; },
            calcChanged(session, [&flexible, number](State& state, const Values& value) {
                flexible.setStateValue(state, number, value[0]);
            })};
}

std::vector<Quantity> makeInputQuantities(const Session& session) {
    std::vector<Quantity> all;
    for (const Model::InputEntry& input : session.getModel().getInputs()) {
        const std::string path = "inputs." + input.name;
        all.push_back(makeOfState(session, path, input.unit, input.state));
        all.push_back(makeOfState(session, path + ".rate",
                                  input.unit.empty() ? "" : input.unit + "/s", input.state + 1));
    }
    return all;
}

}  // namespace

int readIndex(const std::string& text, int first, int count, const std::string& what) {
    int index = 0;
    if (!readInteger(text, index) || index < first || index >= first + count)
        throw std::runtime_error("there is no " + what + " '" + text + "'" +
                                 (count ? "; they are numbered from " + std::to_string(first) +
                                              " to " + std::to_string(first + count - 1)
                                        : "; there are none"));
    return index - first;
}

std::string normalizePath(const std::string& path) {
    static const std::pair<const char*, const char*> plurals[] = {
        {"joint.", "joints."}, {"body.", "bodies."},          {"parameter.", "parameters."},
        {"probe.", "probes."}, {"motion.", "motions."},       {"frame.", "frames."},
        {"load.", "loads."},   {"connector.", "connectors."}, {"part.", "parts."},
        {"state.", "states."}, {"input.", "inputs."}};
    for (const auto& [singular, plural] : plurals)
        if (path.rfind(singular, 0) == 0) return plural + path.substr(std::string(singular).size());
    return path;
}

}  // namespace model

using namespace model;

std::optional<Quantity> Session::findQuantity(const std::string& path) const {
    const std::vector<std::string> parts = splitAt(normalizePath(path), '.');
    if (path == "time")
        return Quantity{"time", "s", [this] { return std::vector<double>{getTime()}; }, {}};
    if (getModel().findInput(parts[0])) return findQuantity("inputs." + path);
    if (parts.size() < 2) return {};
    if (parts[0] == "joints") return findJointQuantity(*this, parts);
    if (parts[0] == "bodies") return findBodyQuantity(*this, parts);
    if (parts[0] == "states") return findByPath(makeStateQuantities(*this), normalizePath(path));
    if (parts[0] == "inputs") return findByPath(makeInputQuantities(*this), normalizePath(path));
    return {};
}

std::vector<std::string> Session::listQuantities() const {
    std::vector<std::string> paths{"time"};
    const auto add = [&](const std::vector<Quantity>& quantities) {
        for (const Quantity& quantity : quantities) paths.push_back(quantity.path);
    };
    for (const Model::JointEntry& entry : getModel().getJoints())
        add(makeJointQuantities(*this, entry));
    for (const Model::BodyEntry& body : getModel().getBodies())
        add(makeBodyQuantities(*this, body));
    add(makeInputQuantities(*this));
    add(makeStateQuantities(*this));
    return paths;
}

}  // namespace simflex
