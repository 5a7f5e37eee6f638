#include <algorithm>

#include "simflex/model/file/NearestName.h"
#include "simflex/model/file/YamlTree.h"
#include "simflex/model/formula/Parser.h"
#include "simflex/model/schema/SchemaJson.h"
#include "simflex/model/schema/SchemaReference.h"
#include "simflex/python/Callables.h"

namespace simflex {
namespace python {

namespace {

using model::SchemaForm;
using model::YamlTree;

using KeyPath = std::vector<std::string>;

/** A path in a model with everything below: `model.bodies.rod`. **/
struct Keys {
    py::object owner;  ///< the Model
    KeyPath path;      ///< empty: the whole model

    ModelText& getModel() const { return py::cast<ModelText&>(owner); }
    Keys operator/(const std::string& name) const {
        Keys below = *this;
        below.path.push_back(name);
        return below;
    }
};

std::string joinPath(const KeyPath& path) {
    return model::joinNames(path, ".");
}
/** Replaces names that are paths themselves; any name gives the same schema. **/
std::string findSchemaPath(KeyPath path) {
    for (std::string& name : path)
        if (name.find('.') != std::string::npos) name = "any";
    return joinPath(path);
}

bool hasForm(const Keys& keys, SchemaForm::Kind kind) {
    const std::vector<const SchemaForm*> forms = model::findSchemaForms(findSchemaPath(keys.path));
    return std::any_of(forms.begin(), forms.end(),
                       [&](const SchemaForm* form) { return form->kind == kind; });
}
bool hasEntries(const Keys& keys) {
    return hasForm(keys, SchemaForm::Kind::Entries);
}
std::vector<std::string> listSchemaKeys(const Keys& keys) {
    return model::getSchemaChildren(findSchemaPath(keys.path));
}

YamlTree readTree(const ModelText& text) {
    YamlTree tree = model::parseYaml(text.text, text.path);
    for (const std::string& setting : text.settings) model::applySetting(tree, setting);
    return tree;
}

/** Returns null if there is nothing. **/
YamlTree* seekBelow(YamlTree& tree, const KeyPath& path) {
    YamlTree* found = &tree;
    for (const std::string& name : path)
        if (found) found = found->find(name);
    return found;
}
/** Returns an empty tree if there is nothing. **/
YamlTree findBelow(const Keys& keys) {
    YamlTree tree = readTree(keys.getModel());
    const YamlTree* const found = seekBelow(tree, keys.path);
    return found ? YamlTree(*found) : YamlTree();
}

py::object toPython(const YamlTree& tree) {
    if (tree.kind == YamlTree::Kind::Empty) return py::none();
    if (tree.kind == YamlTree::Kind::List) {
        py::list items;
        for (const YamlTree& item : tree.items) items.append(toPython(item));
        return items;
    }
    if (tree.kind == YamlTree::Kind::Map) {
        py::dict entries;
        for (const YamlTree::Entry& entry : tree.entries)
            entries[py::str(entry.key)] = toPython(entry.value);
        return entries;
    }
    if (!tree.isQuoted) {
        if (tree.scalar == "true" || tree.scalar == "false")
            return py::bool_(tree.scalar == "true");
        double number = 0;
        if (formula::readPlainNumber(tree.scalar, number)) {
            const bool isWhole = tree.scalar.find_first_of(".eE") == std::string::npos;
            if (isWhole) return py::int_(py::str(tree.scalar));
            return py::float_(number);
        }
    }
    return py::str(tree.scalar);
}

py::dict toDict(const YamlTree& tree) {
    return tree.kind == YamlTree::Kind::Map ? py::dict(toPython(tree)) : py::dict();
}

[[noreturn]] void failUnknown(const Keys& keys, const std::string& name,
                              const std::vector<std::string>& known) {
    const std::string proposal = model::proposeName(name, known);
    throw py::attribute_error((keys.path.empty() ? "a model" : "'" + joinPath(keys.path) + "'") +
                              " has no key '" + name + "'" +
                              (proposal.empty() ? "" : "; " + proposal));
}

std::vector<std::string> listEntries(const YamlTree& tree) {
    std::vector<std::string> names;
    for (const YamlTree::Entry& entry : tree.entries) names.push_back(entry.key);
    return names;
}

/** Checks that the schema has such a key. **/
void checkKey(const Keys& keys, const std::string& name) {
    if (hasEntries(keys)) return;
    const std::vector<std::string> known = listSchemaKeys(keys);
    if (std::find(known.begin(), known.end(), name) == known.end()) failUnknown(keys, name, known);
}

py::object getKey(const Keys& keys, const std::string& name) {
    const YamlTree tree = findBelow(keys);
    const YamlTree* const value = tree.find(name);
    if (!value) {
        if (hasEntries(keys)) failUnknown(keys, name, listEntries(tree));
        checkKey(keys, name);
    }
    const Keys below = keys / name;
    const bool isGroup = hasForm(below, SchemaForm::Kind::Map) || hasEntries(below);
    const bool isValue =
        value && value->kind != YamlTree::Kind::Map && value->kind != YamlTree::Kind::Empty;
    if (isGroup && !isValue) return py::cast(below);
    return value ? toPython(*value) : py::none();
}

void setKeyBelow(const Keys& keys, const std::string& name, const py::handle& value) {
    checkKey(keys, name);
    // Settings cannot add parameters or names with dots; set the level above instead.
    const KeyPath all = (keys / name).path;
    size_t above = 0;
    while (above < all.size() && all[above].find('.') == std::string::npos &&
           !(above == 1 && all[0] == "parameters"))
        ++above;
    ModelText& model = keys.getModel();
    if (above == all.size()) return model.set(joinPath(all), toYaml(value, &model, joinPath(all)));
    const Keys base{keys.owner, KeyPath(all.begin(), all.begin() + std::ptrdiff_t(above))};
    const py::dict whole = toDict(findBelow(base));
    py::dict last = whole;
    for (size_t i = above; i + 1 < all.size(); ++i) {
        if (!last.contains(all[i]) || !py::isinstance<py::dict>(last[py::str(all[i])]))
            last[py::str(all[i])] = py::dict();
        last = last[py::str(all[i])];
    }
    last[py::str(name)] = value;
    model.set(joinPath(base.path), toYaml(whole, &model, joinPath(all)));
}

void removeKey(const Keys& keys, const std::string& name) {
    ModelText& model = keys.getModel();
    YamlTree tree = readTree(model);
    YamlTree* const parent = seekBelow(tree, keys.path);
    const auto isIt = [&](const YamlTree::Entry& entry) { return entry.key == name; };
    if (!parent || std::none_of(parent->entries.begin(), parent->entries.end(), isIt))
        failUnknown(keys, name, parent ? listEntries(*parent) : std::vector<std::string>());
    auto& entries = parent->entries;
    entries.erase(std::remove_if(entries.begin(), entries.end(), isIt), entries.end());
    model.text = toYaml(toPython(tree));
    model.settings.clear();
}

Keys addKey(const Keys& keys, const std::string& name, const py::kwargs& values) {
    if (!hasEntries(keys))
        throw py::type_error("'" + joinPath(keys.path) + "' has keys of its own: set these");
    const Keys added = keys / name;
    if (findBelow(keys).find(name))
        throw py::key_error("'" + joinPath(added.path) + "' is there already: set its keys");
    for (const auto& entry : values) checkKey(added, py::cast<std::string>(entry.first));
    setKeyBelow(keys, name, values);
    return added;
}

std::vector<std::string> listChildren(const Keys& keys) {
    return hasEntries(keys) ? listEntries(findBelow(keys)) : listSchemaKeys(keys);
}

/** Special names that Python looks up are no keys. **/
py::object getAttribute(const Keys& keys, const std::string& name) {
    if (name[0] == '_' && !findBelow(keys).find(name))
        throw py::attribute_error("no attribute '" + name + "'");
    return getKey(keys, name);
}

template <class Function>
auto translateErrors(const Function& function) {
    return [function](const Keys& keys, const std::string& name) {
        try {
            return function(keys, name);
        } catch (const py::attribute_error& error) {
            throw py::key_error(error.what());
        }
    };
}

py::list listAttributes(const py::object& self, const Keys& keys) {
    py::list names = py::module_::import("builtins").attr("object").attr("__dir__")(self);
    for (const std::string& name : listChildren(keys)) names.append(name);
    return names;
}

}  // namespace

void addKeys(py::module_& module, py::class_<ModelText>& modelClass) {
    py::class_<Keys>(
        module, "Keys",
        "What stands below a key of a model: model.bodies.rod.mass, with the keys of a model "
        "file.\n\n"
        "What is set is checked when the model is built, its keys at once; None stands for what\n"
        "is left to its default. Names that are no words of Python stand in brackets:\n"
        "model.analyses.run['from'].\n\n"
        ">>> import simflex\n"
        ">>> model = simflex.Model()\n"
        ">>> bob = model.bodies.add('bob', mass=1, inertia=[0.01, 0.01, 0.01])\n"
        ">>> bob.mass = 2\n"
        ">>> bob.place.position = [0, -1, 0]\n"
        ">>> model.bodies.bob\n"
        "<simflex.Keys bodies.bob: {'mass': 2, 'inertia': [0.01, 0.01, 0.01], "
        "'place': {'position': [0, -1, 0]}}>\n")
        .def("__getattr__", &getAttribute)
        .def("__getitem__", translateErrors(&getKey), py::arg("name"))
        .def("__setattr__", &setKeyBelow)
        .def(
            "__setitem__",
            [](const Keys& keys, const std::string& name, const py::object& value) {
                setKeyBelow(keys, name, value);
            },
            py::arg("name"), py::arg("value"))
        .def("__delattr__", &removeKey)
        .def("__delitem__", translateErrors(&removeKey), py::arg("name"))
        .def("__contains__",
             [](const Keys& keys, const std::string& name) {
                 return findBelow(keys).find(name) != nullptr;
             })
        .def("__len__", [](const Keys& keys) { return findBelow(keys).entries.size(); })
        .def("__iter__",
             [](const Keys& keys) { return py::iter(py::cast(listEntries(findBelow(keys)))); })
        .def("__dir__",
             [](const py::object& self) { return listAttributes(self, py::cast<Keys&>(self)); })
        .def("add", &addKey, py::arg("name"),
             "Adds an entry to bodies, joints, loads …, with these keys, and returns it.")
        .def(
            "to_dict", [](const Keys& keys) { return toDict(findBelow(keys)); },
            "A copy of what the file and later settings say; nothing of defaults.")
        .def("__repr__", [](const Keys& keys) {
            return "<simflex.Keys " + joinPath(keys.path) + ": " +
                   std::string(py::repr(toDict(findBelow(keys)))) + ">";
        });

    modelClass
        .def("__getattr__",
             [](const py::object& self, const std::string& name) {
                 return getAttribute({self, {}}, name);
             })
        .def("__setattr__",
             [](const py::object& self, const std::string& name, const py::object& value) {
                 setKeyBelow({self, {}}, name, value);
             })
        .def("__delattr__",
             [](const py::object& self, const std::string& name) {
                 removeKey({self, {}}, name);
             })
        .def("__dir__",
             [](const py::object& self) {
                 return listAttributes(self, {self, {}});
             })
        .def(
            "to_dict", [](const ModelText& model) { return toDict(readTree(model)); },
            "All that the file and later settings say; from_dict() takes it.");

    module.def(
        "keys",
        [](const std::string& path) {
            return model::writeKeyReference(path, model::ReferenceFormat::Text);
        },
        py::arg("path") = "",
        "What may stand at and below a key of models: print(simflex.keys('joints')).");
    module.def(
        "schema",
        [] { return py::module_::import("json").attr("loads")(model::writeJsonSchema()); },
        "The JSON Schema of model files, as a dict.");
}

}  // namespace python
}  // namespace simflex
