#include "simflex/model/file/ModelTexts.h"

#include <filesystem>

#include "simflex/model/file/ModelNode.h"

namespace simflex {
namespace model {

std::string getModelTitle(const ModelValue& model) {
    const ModelValue title = model.get("title");
    if (title.isGiven() && !title.getText().empty()) return title.getText();
    return std::filesystem::path(model.getNode().file->path).stem().string();
}

void failMissingFile(const ModelValue& value) {
    const std::filesystem::path path(value.getFilePath());
    const std::string folder =
        std::filesystem::absolute(path).lexically_normal().parent_path().string();
    value.fail("there is no file '" + path.filename().string() + "' in '" + folder + "'" +
               (std::filesystem::path(value.getText()).is_absolute()
                    ? ""
                    : "; paths begin in the model file's folder"));
}

}  // namespace model
}  // namespace simflex
