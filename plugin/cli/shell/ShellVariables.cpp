#include "simflex/cli/shell/ShellVariables.h"

#include <algorithm>
#include <cstdlib>
#include <set>
#include <stdexcept>

#include "simflex/body/JointEquations.h"
#include "simflex/cli/shell/CommandTable.h"
#include "simflex/cli/shell/JointDrag.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace cli {

using namespace SimTK;

namespace {

using Values = std::vector<double>;
using PathParts = std::vector<std::string>;

PathParts splitPath(const std::string& path) {
    PathParts parts(1);
    for (const char c : path) {
        if (c == '.')
            parts.emplace_back();
        else
            parts.back() += c;
    }
    return parts;
}

template <class V>
Values toValues(const V& vector) {
    Values values;
    for (int i = 0; i < vector.size(); ++i) values.push_back(vector[i]);
    return values;
}

Vec3 toVec3(const Values& values) {
    return {values[0], values[1], values[2]};
}

/** The number of an element, counted from `first`, or an error that names the range. **/
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

template <class Entries>
const auto& findEntry(const Entries& entries, const std::string& name, const std::string& what) {
    std::vector<std::string> names;
    for (const auto& entry : entries) {
        if (entry.name == name) return entry;
        names.push_back(entry.name);
    }
    throw std::runtime_error(describeUnknown(what, name, names));
}

/** An element of what is a list as a whole. **/
ShellVariable pickElement(const ShellVariable& whole, int index, const std::string& name) {
    ShellVariable element;
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

std::optional<ShellVariable> findJointVariable(const ShellModel& model, const PathParts& parts) {
    const Joint& joint = findEntry(model.getModel().getJoints(), parts[1], "joint").joint;
    const std::vector<std::string> names = getCoordinateNames(joint);
    ShellVariable variable;
    variable.path = "joints." + parts[1];
    if (parts.size() == 2 && names.size() == 1)
        return findJointVariable(model, {parts[0], parts[1], names[0]});
    if (parts.size() == 2 && !names.empty()) {
        variable.get = [&model, &joint] {
            return toValues(joint.calcCoordinates(model.getState()));
        };
        return variable;
    }
    if (parts.size() != 3) return {};
    for (size_t i = 0; i < names.size(); ++i) {
        const int c = int(i);
        const bool isAngle = joint.getEquations().getCoordinate(c).isAngle();
        const bool isOnly = names.size() == 1;
        if (parts[2] == names[i] || parts[2] == std::to_string(i)) {
            variable.path += '.' + names[i];
            variable.unit = isAngle ? "rad" : "m";
            variable.get = [&model, &joint, c] {
                return Values{joint.calcCoordinates(model.getState())[c]};
            };
            variable.calcStateWith = [&model, &joint, c](const Values& values) {
                return dragJoint(model.getModel(), model.copyState(), joint, c, values[0]);
            };
            return variable;
        }
        if (parts[2] == names[i] + "_rate" || (isOnly && parts[2] == "rate")) {
            variable.path += '.' + names[i] + "_rate";
            variable.unit = isAngle ? "rad/s" : "m/s";
            variable.get = [&model, &joint, c] {
                return Values{joint.calcCoordinateDots(model.getState())[c]};
            };
            variable.calcStateWith = [&model, &joint, c](const Values& values) {
                return setJointRate(model.getModel(), model.copyState(), joint, c, values[0]);
            };
            return variable;
        }
    }
    return {};
}

// ---- bodies

using BodyEntry = Model::BodyEntry;

Transform calcPose(const ShellModel& model, const BodyEntry& body) {
    return body.mobod.getBodyTransform(model.getState()) * body.X_BP;
}

/** The State with the body's own frame (of a flexible one: of its part) at X_GP. **/
State place(const ShellModel& model, const BodyEntry& body, const Transform& X_GP) {
    State state = model.copyState();
    const SimbodyMatterSubsystem& matter = model.getModel().getMatter();
    matter.getSystem().realize(state, Stage::Position);
    const Transform X_GB = X_GP * ~body.X_BP;
    const MobilizedBody& parent = body.mobod.getParentMobilizedBody();
    const Transform X_PB = ~parent.getBodyTransform(state) * X_GB;
    body.mobod.setQToFitTransform(
        state, ~body.mobod.getInboardFrame(state) * X_PB * body.mobod.getOutboardFrame(state));
    return state;
}

/** The State with these velocities of the body's own frame's origin, in Ground. **/
State setVelocity(const ShellModel& model, const BodyEntry& body, const SpatialVec& V_GP) {
    State state = model.copyState();
    model.getModel().getSystem().realize(state, Stage::Velocity);
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

SpatialVec calcVelocity(const ShellModel& model, const BodyEntry& body) {
    const State& state = model.getState();
    const SpatialVec V_GB = body.mobod.getBodyVelocity(state);
    const Vec3 p = body.mobod.getBodyRotation(state) * body.X_BP.p();
    return {V_GB[0], V_GB[1] + V_GB[0] % p};
}

std::optional<ShellVariable> makeFlexibleVariable(const ShellModel& model, const BodyEntry& body,
                                                  const std::string& name) {
    if (!body.flexible) return {};
    const FlexibleBody& flexible = *body.flexible;
    ShellVariable variable;
    if (name == "modes") {
        variable.unit = "m kg^0.5";
        variable.get = [&] { return toValues(flexible.getModalCoordinates(model.getState())); };
        variable.calcStateWith = [&](const Values& values) {
            State state = model.copyState();
            flexible.setModalCoordinates(state, Vector(int(values.size()), values.data()));
            return state;
        };
    } else if (name == "modal_speeds") {
        variable.unit = "m kg^0.5/s";
        variable.get = [&] { return toValues(flexible.getModalSpeeds(model.getState())); };
        variable.calcStateWith = [&](const Values& values) {
            State state = model.copyState();
            flexible.setModalSpeeds(state, Vector(int(values.size()), values.data()));
            return state;
        };
    } else if (name == "rigid") {
        variable.get = [&] { return Values{flexible.isRigid(model.getState()) ? 1. : 0.}; };
        variable.calcStateWith = [&](const Values& values) {
            State state = model.copyState();
            if (values[0] != 0)
                flexible.setRigid(state);
            else
                flexible.setFlexible(state);
            return state;
        };
    } else {
        return {};
    }
    return variable;
}

std::optional<ShellVariable> makeMobilizerVariable(const ShellModel& model, const BodyEntry& body,
                                                   const std::string& name) {
    if (body.flexible || (name != "coordinates" && name != "rates")) return {};
    const bool isRate = name == "rates";
    ShellVariable variable;
    variable.get = [&model, &body, isRate] {
        const State& state = model.getState();
        return toValues(isRate ? body.mobod.getUAsVector(state) : body.mobod.getQAsVector(state));
    };
    variable.calcStateWith = [&model, &body, isRate](const Values& values) {
        State state = model.copyState();
        const Vector vector(int(values.size()), values.data());
        if (isRate)
            body.mobod.setUFromVector(state, vector);
        else
            body.mobod.setQFromVector(state, vector);
        return state;
    };
    return variable;
}

std::optional<ShellVariable> makeFrameVariable(const ShellModel& model, const BodyEntry& body,
                                               const std::string& name) {
    ShellVariable variable;
    if (name == "position") {
        variable.unit = "m";
        variable.get = [&] { return toValues(calcPose(model, body).p()); };
        variable.calcStateWith = [&](const Values& values) {
            return place(model, body, Transform(calcPose(model, body).R(), toVec3(values)));
        };
    } else if (name == "orientation") {
        variable.unit = "rad";
        variable.get = [&] {
            return toValues(calcPose(model, body).R().convertRotationToBodyFixedXYZ());
        };
        variable.calcStateWith = [&](const Values& values) {
            Rotation R;
            R.setRotationToBodyFixedXYZ(toVec3(values));
            return place(model, body, Transform(R, calcPose(model, body).p()));
        };
    } else if (name == "velocity" || name == "angular_velocity") {
        const int part = name == "velocity" ? 1 : 0;
        variable.unit = part ? "m/s" : "rad/s";
        variable.get = [&model, &body, part] { return toValues(calcVelocity(model, body)[part]); };
        variable.calcStateWith = [&model, &body, part](const Values& values) {
            SpatialVec V = calcVelocity(model, body);
            V[part] = toVec3(values);
            return setVelocity(model, body, V);
        };
    } else {
        return {};
    }
    return variable;
}

std::optional<ShellVariable> findBodyVariable(const ShellModel& model, const PathParts& parts) {
    const BodyEntry& body = findEntry(model.getModel().getBodies(), parts[1], "body");
    if (parts.size() < 3 || parts.size() > 4) return {};
    const std::string& name = parts[2];
    std::optional<ShellVariable> variable = makeFrameVariable(model, body, name);
    if (!variable) variable = makeFlexibleVariable(model, body, name);
    if (!variable) variable = makeMobilizerVariable(model, body, name);
    if (!variable) return {};
    variable->path = "bodies." + body.name + '.' + name;
    if (parts.size() == 3) return variable;
    if (name == "modes" || name == "modal_speeds")
        return pickElement(*variable, readIndex(parts[3], 1, body.flexible->getNumModes(), "mode"),
                           parts[3]);
    if (name == "coordinates" || name == "rates")
        return pickElement(
            *variable, readIndex(parts[3], 0, int(variable->get().size()), "coordinate"), parts[3]);
    const std::string axes = "xyz";
    if (name == "rigid" || parts[3].size() != 1 || axes.find(parts[3]) == std::string::npos)
        return {};
    return pickElement(*variable, int(axes.find(parts[3])), parts[3]);
}

/** Of a value that the file leaves out. **/
std::string describeDefault(const ModelValue& value) {
    try {
        return value.getText() + " (default)";
    } catch (const std::exception&) {
        return "not given";
    }
}

}  // namespace

std::string normalizePath(const std::string& path) {
    static const std::pair<const char*, const char*> plurals[] = {
        {"joint.", "joints."}, {"body.", "bodies."},          {"parameter.", "parameters."},
        {"probe.", "probes."}, {"motion.", "motions."},       {"frame.", "frames."},
        {"load.", "loads."},   {"connector.", "connectors."}, {"part.", "parts."}};
    for (const auto& [singular, plural] : plurals)
        if (path.rfind(singular, 0) == 0) return plural + path.substr(std::string(singular).size());
    return path;
}

std::optional<ShellVariable> findVariable(const ShellModel& model, const std::string& path) {
    const PathParts parts = splitPath(normalizePath(path));
    if (path == "time") {
        ShellVariable variable;
        variable.path = "time";
        variable.unit = "s";
        variable.get = [&model] { return Values{model.getTime()}; };
        return variable;
    }
    if (parts.size() < 2) return {};
    if (parts[0] == "joints") return findJointVariable(model, parts);
    if (parts[0] == "bodies") return findBodyVariable(model, parts);
    return {};
}

std::vector<std::string> listVariables(const ShellModel& model) {
    std::vector<std::string> paths{"time"};
    for (const Model::JointEntry& entry : model.getModel().getJoints())
        for (const std::string& name : getCoordinateNames(entry.joint)) {
            paths.push_back("joints." + entry.name + '.' + name);
            paths.push_back("joints." + entry.name + '.' + name + "_rate");
        }
    for (const BodyEntry& body : model.getModel().getBodies()) {
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

std::optional<std::string> formatModelValue(const ModelValue& file, const std::string& path) {
    ModelValue value = file;
    for (const std::string& part : splitPath(path)) {
        if (value.isList()) {
            value = value.at(readIndex(part, 0, value.getSize(), "item"));
            continue;
        }
        try {
            value = value.get(part);
        } catch (const std::logic_error&) {  // not in the schema
            return {};
        }
    }
    if (!value.isGiven() && !value.getNode().key) return {};  // a name that is not there
    const std::function<std::string(const ModelValue&)> format = [&](const ModelValue& item) {
        if (!item.isGiven()) return describeDefault(item);
        if (item.isScalar()) return item.getText();
        std::string text;
        if (item.isList()) {
            for (int i = 0; i < item.getSize(); ++i) text += (i ? ", " : "") + format(item.at(i));
            return "[" + text + "]";
        }
        for (const std::string& key : item.getKeys())
            text += (text.empty() ? "" : ", ") + key + ": " + format(item.get(key));
        return "{" + text + "}";
    };
    return format(value);
}

std::vector<std::string> completeModelPath(const ModelValue& file, const std::string& begin) {
    using Forms = std::vector<const SchemaForm*>;
    const auto enter = [](const Forms& forms, const std::string& key) {
        Forms inner;
        for (const SchemaForm* form : forms) {
            const SchemaKey* known = findSchemaKey(*form, key);
            if (!known && form->kind != SchemaForm::Kind::Entries) continue;
            for (const SchemaForm& child : known ? known->forms : form->items)
                inner.push_back(&child);
        }
        return inner;
    };
    PathParts parts = splitPath(begin);
    parts.pop_back();
    Forms forms{&getModelSchema()};
    std::optional<ModelValue> value = file;
    std::string level;
    for (const std::string& part : parts) {
        forms = enter(forms, part);
        if (value) value = value->has(part) ? std::optional(value->get(part)) : std::nullopt;
        level += part + '.';
    }
    std::set<std::string> keys;
    for (const SchemaForm* form : forms) {
        for (const SchemaKey& key : form->keys) keys.insert(key.name);
        if (form->kind == SchemaForm::Kind::Entries && value)
            for (const std::string& key : value->getKeys()) keys.insert(key);
    }
    std::vector<std::string> found;
    for (const std::string& key : keys) {
        bool hasMore = false;
        for (const SchemaForm* form : enter(forms, key))
            hasMore = hasMore || form->kind == SchemaForm::Kind::Map ||
                      form->kind == SchemaForm::Kind::Entries;
        found.push_back(level + key + (hasMore ? "." : ""));
    }
    return found;
}

}  // namespace cli
}  // namespace simflex
