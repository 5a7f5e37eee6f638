#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/fmu/FmuExport.h"

namespace simflex {
namespace fmu {

namespace {

const std::string Title = std::string("simflex unit ") + SIMFLEX_VERSION;

}  // namespace

std::string Manifest::write() const {
    std::string text = Title + "\ntoken " + token + "\nmodel " + model + "\n";
    const auto add = [&](const char* kind, const std::vector<std::string>& items) {
        for (const std::string& item : items) text += std::string(kind) + ' ' + item + '\n';
    };
    add("setting", settings);
    add("parameter", parameters);
    add("input", inputs);
    add("output", outputs);
    return text;
}

Manifest Manifest::read(const std::string& text) {
    const std::vector<std::string> lines = splitAt(text, '\n');
    if (lines[0] != Title)
        throw std::runtime_error("the FMU is of '" + lines[0] + "', its library of '" + Title +
                                 "': with another simflex loaded or installed it must be exported "
                                 "anew");
    Manifest manifest;
    for (size_t i = 1; i < lines.size(); ++i) {
        const size_t space = lines[i].find(' ');
        if (space == std::string::npos) continue;
        const std::string kind = lines[i].substr(0, space), item = lines[i].substr(space + 1);
        if (kind == "token") manifest.token = item;
        if (kind == "model") manifest.model = item;
        if (kind == "setting") manifest.settings.push_back(item);
        if (kind == "parameter") manifest.parameters.push_back(item);
        if (kind == "input") manifest.inputs.push_back(item);
        if (kind == "output") manifest.outputs.push_back(item);
    }
    return manifest;
}

std::vector<std::string> listOutputs(const std::vector<model::Probe>& probes) {
    std::vector<std::string> names;
    for (const model::Probe& probe : probes)
        for (const std::string& column : probe.columns)
            names.push_back(column.empty() ? probe.name : probe.name + '.' + column);
    return names;
}

}  // namespace fmu
}  // namespace simflex
