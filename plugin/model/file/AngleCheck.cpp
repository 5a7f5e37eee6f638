#include "simflex/model/file/AngleCheck.h"

#include <cmath>

#include "simflex/base/NumberText.h"
#include "simflex/model/file/ModelError.h"
#include "simflex/model/file/ModelNode.h"

namespace simflex {
namespace model {

namespace {

/** Checks a rotation: a list of three angles, or a map with one. **/
void addAngleDoubts(const ModelValue::Node& node, std::vector<std::string>& doubts) {
    const std::string title = node.form ? node.form->title : "";
    const auto check = [&](const ModelValue::Node& angle) {
        const double value = angle.expression.calcValue(0);
        if (!(std::abs(value) > 2 * M_PI * (1 + 1e-9))) return;
        const std::string text = writeGeneral(value, 6);
        doubts.push_back(angle.place.getText() + ": " + angle.path +
                         ": angles are in radians, and " + text +
                         " is more than a whole turn: degrees are written " + text + "*deg");
    };
    if (title == "angles [x, y, z]")
        for (const auto& angle : node.items) check(*angle);
    if (title == "a rotation")
        for (const auto& [key, value] : node.entries)
            if (key == "angle") check(*value);
    for (const auto& item : node.items) addAngleDoubts(*item, doubts);
    for (const auto& entry : node.entries) addAngleDoubts(*entry.second, doubts);
}

}  // namespace

std::vector<std::string> listAngleDoubts(const ModelValue& model) {
    std::vector<std::string> doubts;
    addAngleDoubts(model.getNode(), doubts);
    return doubts;
}

}  // namespace model
}  // namespace simflex
