#pragma once
/** @file
Reads models from texts. **/

#include <gtest/gtest.h>
#include <stdlib.h>

#include <filesystem>
#include <string>
#include <vector>

#include "simflex/cli/model/ModelReader.h"

namespace simflex {
namespace testing {

/** A folder of a test's own, removed at the end. **/
class ModelFolder {
public:
    ModelFolder() {
        _path = ::testing::TempDir() + "simflex-model-XXXXXX";
        if (!mkdtemp(_path.data())) throw std::runtime_error("no folder " + _path);
    }
    ~ModelFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(_path, ignored);
    }
    ModelFolder(const ModelFolder&) = delete;
    ModelFolder& operator=(const ModelFolder&) = delete;

    const std::string& path() const { return _path; }
    std::string operator/(const std::string& name) const { return _path + "/" + name; }

private:
    std::string _path;
};

inline cli::ModelValue readModelText(const std::string& text,
                                     const std::vector<std::string>& settings = {}) {
    return cli::readModel({"m.yaml", text, settings});
}

/** The same for what follows `simflex: 1` in the first line. **/
inline cli::ModelValue readRest(const std::string& text,
                                const std::vector<std::string>& settings = {}) {
    return readModelText("simflex: 1\n" + text, settings);
}

/** What the reader says of a text that it refuses. **/
inline std::string refuse(const std::string& text, const std::vector<std::string>& settings = {}) {
    try {
        readModelText(text, settings);
    } catch (const cli::ModelError& error) {
        return error.what();
    }
    ADD_FAILURE() << "accepted:\n" << text;
    return "";
}
inline std::string refuseRest(const std::string& text,
                              const std::vector<std::string>& settings = {}) {
    return refuse("simflex: 1\n" + text, settings);
}

}  // namespace testing
}  // namespace simflex
