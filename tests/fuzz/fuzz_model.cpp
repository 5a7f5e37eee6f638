/** @file
Model files: YAML, the schema, formulas and tables. Every value of an accepted model is readable,
and its functions of time have finite values and derivatives or report where they are undefined. **/

#include <cmath>

#include "../../plugin/model/file/ModelNode.h"
#include "../../plugin/model/file/ModelReader.h"
#include "Fuzz.h"

using namespace simflex;

namespace {

void checkFunction(const model::Expression& function) {
    for (const double t : {0.0, 0.5, 1.0, 1e6})
        fuzz::accepts([&] {
            if (!std::isfinite(function.calcValue(t))) fuzz::fail("a value is not finite");
        });
    for (const double t : {0.0, 0.5, 1.0, 1e6})
        fuzz::accepts([&] {
            for (const double value : function.calcMotion(t))
                if (!std::isfinite(value)) fuzz::fail("a derivative is not finite");
        });
    double last = 0;
    for (const double time : function.findSwitches(last, 10)) {
        if (!(time > last && time <= 10)) fuzz::fail("a switch is out of order");
        last = time;
    }
}

void visit(const model::ModelValue& value) {
    const model::ModelValue::Node& node = value.getNode();
    if (value.getPlace().empty()) fuzz::fail("a value without a place");
    if (value.isMap())
        for (const std::string& key : value.getKeys()) visit(value.get(key));
    if (value.isList())
        for (int i = 0; i < value.getSize(); ++i) visit(value.at(i));
    if (!value.isScalar()) return;
    value.getText();
    if (node.form->kind == model::SchemaForm::Kind::Bool) value.getBool();
    if (node.form->kind == model::SchemaForm::Kind::Integer) value.getInteger();
    if (node.form->kind == model::SchemaForm::Kind::Function) checkFunction(value.getExpression());
    if (node.form->kind == model::SchemaForm::Kind::Number && !std::isfinite(value.getNumber()))
        fuzz::fail("a number is not finite");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 3);
    fuzz::getFolder().write("table.csv", files[1]);
    std::vector<std::string> settings;
    for (size_t begin = 0; begin < files[2].size() && settings.size() < 4;) {
        const size_t end = std::min(files[2].find('\n', begin), files[2].size());
        settings.push_back(files[2].substr(begin, end - begin));
        begin = end + 1;
    }
    const std::string path = fuzz::getFolder() / "model.yaml";
    try {
        std::unique_ptr<model::ModelValue> model;
        const bool isAccepted = fuzz::accepts([&] {
            try {
                model = std::make_unique<model::ModelValue>(readModel({path, files[0], settings}));
            } catch (const ModelError& error) {
                const std::string message = error.what();
                if (message.compare(0, 9, "setting '") != 0) throw;  // these name no file
            }
        });
        if (isAccepted && model) visit(*model);
    } catch (const std::exception& error) {
        fuzz::fail(std::string("an accepted model has no values: ") + error.what());
    }
    return 0;
}
