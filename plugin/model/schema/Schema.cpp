#include "simflex/model/schema/Schema.h"

#include <utility>

#include "simflex/model/schema/SchemaForms.h"

namespace simflex {
namespace model {

SchemaKey::SchemaKey(std::string keyName, std::vector<SchemaForm> keyForms, std::string keyMeaning)
    : name(std::move(keyName)), forms(std::move(keyForms)), meaning(std::move(keyMeaning)) {}

SchemaKey SchemaKey::in(const std::string& value) const {
    SchemaKey key(*this);
    key.unit = value;
    return key;
}
SchemaKey SchemaKey::orElse(const std::string& value) const {
    SchemaKey key(*this);
    key.defaultText = value;
    return key;
}
SchemaKey SchemaKey::orElseNote(const std::string& note) const {
    SchemaKey key(*this);
    key.defaultNote = note;
    return key;
}
SchemaKey SchemaKey::such(const std::string& value) const {
    SchemaKey key(*this);
    key.example = value;
    return key;
}
SchemaKey SchemaKey::required() const {
    SchemaKey key(*this);
    key.isRequired = true;
    return key;
}
SchemaKey SchemaKey::only(const std::vector<std::string>& types) const {
    SchemaKey key(*this);
    key.onlyFor = types;
    return key;
}
SchemaKey SchemaKey::with(const std::vector<std::string>& keys) const {
    SchemaKey key(*this);
    key.onlyWith = keys;
    return key;
}
SchemaKey SchemaKey::without(const std::vector<std::string>& keys) const {
    SchemaKey key(*this);
    key.notWith = keys;
    return key;
}

const SchemaKey* findSchemaKey(const SchemaForm& map, const std::string& name) {
    for (const SchemaKey& key : map.keys)
        if (key.name == name) return &key;
    return nullptr;
}

const SchemaForm& getModelSchema() {
    static const SchemaForm schema = [] {
        using namespace forms;
        std::vector<SchemaKey> keys;
        for (const auto& chapter : {makePartKeys(), makeBodyKeys(), makeJointKeys(), makeRunKeys(),
                                    makeProbeKeys(), makePictureKeys()})
            keys.insert(keys.end(), chapter.begin(), chapter.end());
        return map("a model", keys);
    }();
    return schema;
}

namespace forms {

namespace {

SchemaForm make(SchemaForm::Kind kind, const std::string& title) {
    SchemaForm form;
    form.kind = kind;
    form.title = title;
    return form;
}

}  // namespace

SchemaForm number(double minimum, double maximum) {
    SchemaForm form = make(SchemaForm::Kind::Number, "a number");
    form.minimum = minimum;
    form.maximum = maximum;
    return form;
}
SchemaForm positive() {
    SchemaForm form = number(0);
    form.isOpen = true;
    return form;
}
SchemaForm integer(double minimum, double maximum) {
    SchemaForm form = number(minimum, maximum);
    form.kind = SchemaForm::Kind::Integer;
    form.title = "a whole number";
    return form;
}
SchemaForm function() {
    return make(SchemaForm::Kind::Function, "a function of time");
}
SchemaForm law(const std::vector<std::string>& locals) {
    SchemaForm form = make(SchemaForm::Kind::Function, "a function of time and of quantities");
    form.isLaw = true;
    form.locals = locals;
    return form;
}
SchemaForm boolean() {
    return make(SchemaForm::Kind::Bool, "true or false");
}
SchemaForm text() {
    return make(SchemaForm::Kind::Text, "a text");
}
SchemaForm name(const std::string& title) {
    return make(SchemaForm::Kind::Name, title);
}
SchemaForm formula() {
    return make(SchemaForm::Kind::Formula, "a formula");
}
SchemaForm choice(const std::vector<std::string>& choices) {
    SchemaForm form = make(SchemaForm::Kind::Choice, "a choice");
    form.choices = choices;
    return form;
}
SchemaForm file(const std::string& title) {
    return make(SchemaForm::Kind::File, title);
}
SchemaForm output(const std::string& title) {
    return make(SchemaForm::Kind::Output, title);
}
SchemaForm list(const Forms& items, const std::vector<int>& sizes) {
    SchemaForm form = make(SchemaForm::Kind::List, "a list");
    form.items = items;
    form.sizes = sizes;
    return form;
}
SchemaForm map(const std::string& title, const std::vector<SchemaKey>& keys,
               const std::vector<std::string>& oneOf) {
    SchemaForm form = make(SchemaForm::Kind::Map, title);
    form.keys = keys;
    form.oneOf = oneOf;
    return form;
}
SchemaForm entries(const std::string& title, const Forms& values) {
    SchemaForm form = make(SchemaForm::Kind::Entries, title);
    form.items = values;
    return form;
}
SchemaForm numbered(const std::string& title, const Forms& values) {
    SchemaForm form = entries(title, values);
    form.hasNumbers = true;
    return form;
}

SchemaForm vec3() {
    SchemaForm form = list({number()}, {3});
    form.title = "a vector [x, y, z]";
    return form;
}
SchemaForm laws3() {
    SchemaForm form = list({law()}, {3});
    form.title = "a vector [x, y, z] of functions of time and of quantities";
    return form;
}

Forms numbersOrRange() {
    SchemaForm range =
        map("a range", {
                           SchemaKey("from", {number()}, "First value.").required().such("0"),
                           SchemaKey("to", {number()}, "Last value.").required().such("200"),
                           SchemaKey("count", {integer(1, 1e6)}, "Number of values, evenly spaced.")
                               .required()
                               .such("5"),
                       });
    return {list({number()}), range};
}

Forms rotation() {
    SchemaForm angles = list({number()}, {3});
    angles.title = "angles [x, y, z]";
    SchemaForm other =
        map("a rotation",
            {
                SchemaKey("axis", axis(), "Axis of the rotation.").with({"angle"}).such("z"),
                SchemaKey("angle", {number()}, "Angle about the axis.")
                    .in("rad")
                    .with({"axis"})
                    .such("30*deg"),
                SchemaKey("quaternion", {list({number()}, {4})},
                          "Quaternion [w, x, y, z]; it is normalized.")
                    .such("[1, 0, 0, 0]"),
            },
            {"angle", "quaternion"});
    return {angles, other};
}

Forms axis() {
    return {choice({"x", "y", "z"}), vec3()};
}

std::vector<SchemaKey> frameKeys() {
    return {
        SchemaKey("on", {name("a frame")},
                  "Frame to which this one is fixed: ground, BODY, BODY.INTERFACE or a name under "
                  "frames.")
            .required()
            .such("ground"),
        SchemaKey("node", {integer(0)}, "Node of the flexible body's part that carries the frame.")
            .such("4711"),
        SchemaKey(
            "position", {vec3()},
            "Position of the origin in the frame it is fixed to; of a node, relative to the node.")
            .in("m")
            .orElse("[0, 0, 0]")
            .such("[0, 0, 0.1]"),
        SchemaKey("rotation", rotation(), "Orientation relative to the frame it is fixed to.")
            .in("rad")
            .orElse("[0, 0, 0]")
            .such("[0, 0, 30*deg]"),
    };
}

Forms frame() {
    return {name("a frame"), map("a frame", frameKeys())};
}

Forms place() {
    return {map("a place",
                {
                    SchemaKey("position", {vec3()},
                              "Position of the body's origin (of a flexible body, the origin of "
                              "its part's coordinates) in Ground; with at, in that frame.")
                        .in("m")
                        .orElse("[0, 0, 0]")
                        .such("[0.1, 0, 0]"),
                    SchemaKey("rotation", rotation(),
                              "Orientation of the body relative to Ground, or to the frame at.")
                        .in("rad")
                        .orElse("[0, 0, 0]")
                        .such("{axis: z, angle: 90*deg}"),
                    SchemaKey("frame", frame(),
                              "Frame of this body that is made to coincide with the frame at.")
                        .orElseNote("the body's own frame")
                        .with({"at"})
                        .such("rod.big_end"),
                    SchemaKey("at", frame(),
                              "Frame of another body, or of Ground, at which the body is placed.")
                        .such("crank.pin"),
                })};
}

SchemaForm color() {
    SchemaForm form = text();
    form.title = "a color: a name or '#rrggbb'";
    return form;
}

}  // namespace forms
}  // namespace model
}  // namespace simflex
