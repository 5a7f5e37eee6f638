#pragma once
/** @file
The options of a command that say where its finite element model comes from. **/

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "simflex/fe/ModelSource.h"

namespace simflex {
namespace cli {

class SourceArguments {
public:
    /** Adds SOURCE and the options that go with it. `this` must live as long as `command`. **/
    void addTo(CLI::App& command);

    const std::string& path() const { return _options.path; }

    /** What was asked for. @throws CLI::ValidationError for an option of the wrong form. **/
    SourceOptions parse() const;

private:
    SourceOptions _options;
    std::string _lengthUnit;
    std::vector<std::string> _settings;
};

}  // namespace cli
}  // namespace simflex
