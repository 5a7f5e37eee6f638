/** @file
Commands of the prompt that read and change the model and its State: get, set, drag. **/

#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/shell/Shell.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/schema/SchemaReference.h"
#include "simflex/model/session/JointDrag.h"
#include "simflex/model/session/Quantities.h"

namespace simflex {
namespace cli {
namespace {

/** Describes the default of an omitted value. **/
std::string describeDefault(const ModelValue& value) {
    try {
        return value.getText() + " (default)";
    } catch (const std::exception&) {
        return "not given";
    }
}

/** Returns the text of the model file at a path, nothing if the path is not set. **/
std::optional<std::string> formatModelValue(const ModelValue& file, const std::string& path) {
    ModelValue value = file;
    for (const std::string& part : splitAt(path, '.')) {
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
    if (!value.isGiven() && !value.getNode().key) return {};  // unknown name
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

/** Returns paths of the model file and its schema that begin with `begin`, at most one level
deeper; a path that can be continued ends with a dot. **/
std::vector<std::string> completeModelPath(const ModelValue& file, const std::string& begin) {
    const std::string level = begin.substr(0, begin.rfind('.') + 1);  // empty without a dot
    std::optional<ModelValue> value = file;
    for (const std::string& part : splitAt(level, '.'))
        if (!part.empty() && value)
            value = value->has(part) ? std::optional(value->get(part)) : std::nullopt;
    std::set<std::string> keys;
    for (const SchemaForm* form : findSchemaForms(level)) {
        for (const SchemaKey& key : form->keys) keys.insert(key.name);
        if (form->kind == SchemaForm::Kind::Entries && value)
            for (const std::string& key : value->getKeys()) keys.insert(key);
    }
    std::vector<std::string> found;
    for (const std::string& key : keys) {
        bool hasMore = false;
        for (const SchemaForm* form : findSchemaForms(level + key))
            hasMore = hasMore || form->kind == SchemaForm::Kind::Map ||
                      form->kind == SchemaForm::Kind::Entries;
        found.push_back(level + key + (hasMore ? "." : ""));
    }
    return found;
}

/** Returns all names accepted by `get`. **/
std::vector<std::string> listNames(const Session& session) {
    std::vector<std::string> names = session.listQuantities();
    for (const Probe& probe : session.getProbes()) names.push_back(probe.name);
    const ModelValue file = session.getModel().getFile();
    for (const std::string& section : file.getKeys()) {
        names.push_back(section);
        for (const std::string& key : file.get(section).getKeys())
            names.push_back(section + '.' + key);
    }
    return names;
}

/** Finds a path without its section: "shoulder", "crank.modes.3". **/
std::optional<Quantity> findByName(const Session& session, const std::string& path) {
    const std::string name = path.substr(0, path.find('.'));
    if (seekNamed(session.getModel().getJoints(), name))
        return session.findQuantity("joints." + path);
    if (seekNamed(session.getModel().getBodies(), name))
        return session.findQuantity("bodies." + path);
    return {};
}

void printVariable(const Quantity& variable) {
    writeOut("%s = %s\n", variable.path.c_str(),
             formatValues(variable.get(), variable.unit).c_str());
}

void get(Shell& shell, const Words& words) {
    const Session& session = shell.updSession();
    for (const std::string& path : words) {
        if (const auto variable = session.findQuantity(path)) {
            printVariable(*variable);
            continue;
        }
        std::string full = normalizePath(path);
        if (const Probe* probe = seekNamed(session.getProbes(), path)) {
            writeOut("%s = %s\n", path.c_str(),
                     formatValues(session.calcProbe(*probe), probe->unit).c_str());
            continue;
        }
        const ModelValue file = session.getModel().getFile();
        std::optional<std::string> text = formatModelValue(file, full);
        if (!text) text = formatModelValue(file, full = "parameters." + full);
        if (!text) {
            const auto variable = findByName(session, path);
            if (!variable)
                throw std::runtime_error(describeUnknown("value", path, listNames(session)));
            printVariable(*variable);
            continue;
        }
        writeOut("%s = %s\n", full.c_str(), text->c_str());
    }
}

void setVariable(Shell& shell, const Quantity& variable, const std::string& text) {
    Session& session = shell.updSession();
    if (!variable.calcStateWith)
        throw std::runtime_error("'" + variable.path + "' cannot be set" +
                                 (variable.path == "time" ? ": write 'run TIME' or 'reset'" : ""));
    const std::vector<double> values = text == "true"    ? std::vector<double>{1}
                                       : text == "false" ? std::vector<double>{0}
                                                         : shell.calcNumbers(text);
    session.set(variable.path, values);
    printVariable(variable);
}

/** Rebuilds the model with another value. **/
void setModelValue(Shell& shell, const std::string& path, const std::string& value) {
    const bool isAtStart = shell.updSession().change(path, value);
    writeOut("the model was built anew with %s = %s; %s, t = %s s\n", path.c_str(), value.c_str(),
             isAtStart ? "back at the start" : "it stays where it is",
             formatNumber(shell.updSession().getTime()).c_str());
}

void set(Shell& shell, const Words& words) {
    // `set PATH = VALUE` is accepted, too.
    const bool hasSign = words.size() == 3 && words[1] == "=";
    if (words.size() == 3 && !hasSign)
        throw std::runtime_error("'" + words[2] + "' is too much; write a list in brackets, " +
                                 "[1, 2, 3], and a text with blanks in quotes");
    const std::string& path = words[0];
    const std::string& value = words.back();
    const Session& session = shell.updSession();
    if (const auto variable = session.findQuantity(path))
        return setVariable(shell, *variable, value);
    std::string full = normalizePath(path);
    if (formatModelValue(session.getModel().getFile(), "parameters." + full))
        full = "parameters." + full;
    else if (const auto variable = findByName(session, path))
        return setVariable(shell, *variable, value);
    if (full.find('.') == std::string::npos &&
        !formatModelValue(session.getModel().getFile(), full))
        throw std::runtime_error(describeUnknown("value", path, listNames(session)));
    setModelValue(shell, full, value);
}

void drag(Shell& shell, const Words& words) {
    const std::string path = normalizePath("joint." + words[0]);
    const auto variable = shell.updSession().findQuantity(path);
    if (!variable || variable->get().size() != 1) {
        const Joint& joint = findNamed(shell.updSession().getModel().getJoints(), "joint",
                                       words[0].substr(0, words[0].find('.')))
                                 .joint;
        const std::vector<std::string> names = getCoordinateNames(joint);
        if (names.empty())
            throw std::runtime_error("'" + joint.getName() + "' has no coordinate to drag");
        std::string text;
        for (const std::string& name : names)
            text += (text.empty() ? "" : ", ") + joint.getName() + '.' + name;
        throw std::runtime_error("name one of the coordinates: " + text);
    }
    setVariable(shell, *variable, words[1]);
}

void keep(Shell& shell, const Words& words) {
    shell.updSession().keepState(words[0]);
    writeOut("%s: t = %s s\n", words[0].c_str(),
             formatNumber(shell.updSession().getTime()).c_str());
}

void restore(Shell& shell, const Words& words) {
    shell.updSession().restoreState(words[0]);
    writeOut("t = %s s\n", formatNumber(shell.updSession().getTime()).c_str());
}

std::vector<std::string> completeValues(const Shell& shell, const std::string& word, bool hasAll) {
    if (!shell.hasSession()) return {};
    const Session& session = shell.updSession();
    std::vector<std::string> found = session.listQuantities();
    const size_t point = word.find('.');
    const std::string section = normalizePath(word).substr(0, normalizePath(word).find('.') + 1);
    if (point != std::string::npos)
        for (std::string& path : found)  // use the singular section name if it was typed
            if (path.compare(0, section.size(), section) == 0)
                path = word.substr(0, point + 1) + path.substr(section.size());
    if (hasAll)
        for (const Probe& probe : session.getProbes()) found.push_back(probe.name);
    for (const std::string& path : completeModelPath(session.getModel().getFile(), word))
        found.push_back(path);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
}

}  // namespace

void addStateCommands(std::vector<Command>& commands) {
    const std::string group = "State and model";
    commands.push_back(
        {group, "get", "PATH ...",
         "Print a coordinate, speed, probe, parameter or value of the model file",
         "joints.NAME.angle, angle_rate, displacement; NAME alone if that is clear. "
         "bodies.NAME.position, orientation, "
         "velocity, "
         "angular_velocity,\nmodes, modal_speeds, rigid; of a rigid body's own mobilizer "
         "coordinates and rates. Parts of\nlists: bodies.crank.modes.3, bodies.slider.position.x.",
         1, 100, get, [](const Shell& shell, const Words&, const std::string& word) {
             return completeValues(shell, word, true);
         }});
    commands.push_back({group, "set", "PATH VALUE", "Set what 'get' prints",
                        "Coordinates and speeds change at once; then joints are assembled and "
                        "speeds made consistent, where\n"
                        "a joint's coordinate and its rate get exactly the value. For values of "
                        "the model file the model is\n"
                        "built anew and begins at its start, except for colors, pictures, probes, "
                        "analyses, output and solver,\n"
                        "which leave the motion where it is; the file itself is not changed.",
                        2, 3, set,
                        [](const Shell& shell, const Words& before, const std::string& word) {
                            return before.empty() ? completeValues(shell, word, false)
                                                  : std::vector<std::string>{};
                        }});
    commands.push_back(
        {group, "drag", "JOINT VALUE",
         "Move the mechanism until a joint's coordinate has this value",
         "JOINT.COORDINATE if it has several. An angle goes through whole turns to it. Flexible "
         "bodies keep their\nshapes; where the joints cannot be closed with these, they deform as "
         "little as "
         "needed.",
         2, 2, drag, [](const Shell& shell, const Words& before, const std::string&) {
             std::vector<std::string> names;
             if (!before.empty() || !shell.hasSession()) return names;
             for (const Model::JointEntry& entry : shell.updSession().getModel().getJoints()) {
                 const std::vector<std::string> coordinates = getCoordinateNames(entry.joint);
                 if (coordinates.size() == 1) names.push_back(entry.name);
                 if (coordinates.size() > 1)
                     for (const std::string& coordinate : coordinates)
                         names.push_back(entry.name + '.' + coordinate);
             }
             return names;
         }});
    commands.push_back({group, "keep", "FILE", "Save the present state to a file",
                        "Time, coordinates, speeds and counted revolutions, for the same model.", 1,
                        1, keep, completeFile()});
    commands.push_back(
        {group, "restore", "FILE", "Restore a saved state",
         "The record begins anew; integration starts with small steps, as after 'set'.", 1, 1,
         restore, completeFile()});
}

}  // namespace cli
}  // namespace simflex
