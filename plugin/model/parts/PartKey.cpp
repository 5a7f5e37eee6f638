#include "simflex/model/parts/PartKey.h"

#include <dlfcn.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/fe/GmshPart.h"
#include "simflex/fe/decks/IncludeLimit.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace model {

namespace fs = std::filesystem;

namespace {

std::string endingOf(const std::string& path) {
    return lowerCase(fs::path(path).extension().string());
}

bool isDeck(const std::string& ending) {
    for (const char* deck : {".inp", ".inc", ".bdf", ".nas", ".dat"})
        if (ending == deck) return true;
    return false;
}

/** File names after INPUT= on *INCLUDE cards, and after INCLUDE in bulk data. **/
std::vector<std::string> findDeckIncludes(std::string text) {
    std::vector<std::string> names;
    // Accept lines that end in CR, and two-byte characters.
    text.erase(std::remove(text.begin(), text.end(), '\0'), text.end());
    std::replace(text.begin(), text.end(), '\r', '\n');
    std::istringstream in(text);
    bool open = false;
    for (std::string line; std::getline(in, line);) {
        std::string blankless;
        for (const char c : line)
            if (!isBlank(c) && c != '"') blankless += c;
        const std::string upper = upperCase(blankless);
        if (upper.compare(0, 7, "INCLUDE") == 0) {
            std::string name;
            for (const char c : blankless.substr(7))
                if (c != '\'' && c != ',') name += c;
            names.push_back(name);
        }
        if (upper.compare(0, 2, "**") == 0) continue;
        if (upper.compare(0, 1, "*") == 0) open = upper.compare(0, 8, "*INCLUDE") == 0;
        if (!open) continue;
        const size_t input = upper.find("INPUT=");
        if (input == std::string::npos) continue;
        std::string name = line.substr(line.find('=', upper.find("INPUT=")) + 1);
        name.erase(0, name.find_first_not_of(" \t\""));
        const size_t end = name.find_last_not_of(" \t\r\"");
        names.push_back(end == std::string::npos ? "" : name.substr(0, end + 1));
        open = false;
    }
    return names;
}

/** The compiled reduction code, which may change within a version. **/
std::string readReductionCode() {
    Dl_info library;
    if (dladdr(reinterpret_cast<const void*>(&reduce), &library) == 0) return "";
    std::ifstream in = openInputFile(library.dli_fname);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

}  // namespace

PartKey::PartKey() {
    static const std::string code = [] {
        Hash hash;
        hash.add(readReductionCode());
        return hash.getText();
    }();
    m_second.add(std::string("second"));
    add(std::string(SIMFLEX_VERSION));
    add(code);
    add(double(ReducedBodyFileVersion));
}

void PartKey::add(const std::string& text) {
    m_first.add(text);
    m_second.add(text);
}

void PartKey::add(double number) {
    m_first.add(number);
    m_second.add(number);
}

void PartKey::addFile(const std::string& path) {
    IncludeLimit includes;
    if (!isGmshScript(path)) return addFile(path, 0, includes);
    for (const std::string& file : listScriptFiles(path)) addBytes(file);
}

std::string PartKey::addBytes(const std::string& path) {
    add(endingOf(path));
    if (!isInputFile(path)) {
        add(std::string("missing"));
        return "";
    }
    std::string bytes = readInputFile(path);
    add(bytes);
    return bytes;
}

void PartKey::addFile(const std::string& path, int depth, IncludeLimit& includes) {
    const std::string bytes = addBytes(path), ending = endingOf(path);
    // Reading refuses decks beyond the limit.
    if (!includes.enter(depth).empty() || (depth == 0 && !isDeck(ending))) return;
    for (const std::string& name : findDeckIncludes(bytes)) {
        const fs::path beside = fs::path(path).parent_path() / name;
        addFile((fs::exists(beside) || !fs::exists(name) ? beside : fs::path(name)).string(),
                depth + 1, includes);
    }
}

std::string PartKey::getText() const {
    return m_first.getText() + m_second.getText();
}

}  // namespace model
}  // namespace simflex
