#include "support/TestFolder.h"

#include <stdlib.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace testing {

namespace fs = std::filesystem;

TestFolder::TestFolder() {
    std::string pattern = (fs::temp_directory_path() / "simflex-test-XXXXXX").string();
    if (!mkdtemp(pattern.data())) throw std::runtime_error("no folder " + pattern);
    _path = pattern;
    const char* old = std::getenv("TMPDIR");
    _oldTemporary = old ? old : "";
    fs::create_directory(_path + "/tmp");
    setenv("TMPDIR", (_path + "/tmp").c_str(), 1);
}

TestFolder::~TestFolder() {
    if (_oldTemporary.empty()) {
        unsetenv("TMPDIR");
    } else {
        setenv("TMPDIR", _oldTemporary.c_str(), 1);
    }
    std::error_code ignored;
    fs::remove_all(_path, ignored);
}

std::string TestFolder::makeFolder(const std::string& name) const {
    fs::create_directory(*this / name);
    return *this / name;
}

std::vector<std::string> TestFolder::listTemporaryFiles() const {
    return listFiles(_path + "/tmp");
}

std::string readText(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

void writeText(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
}

std::vector<std::string> listFiles(const std::string& folder) {
    std::vector<std::string> names;
    std::error_code isMissing;
    for (const auto& entry : fs::directory_iterator(folder, isMissing))
        names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

}  // namespace testing
}  // namespace simflex
