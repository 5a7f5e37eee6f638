#pragma once
/** @file
The options of the command reduce that say what is to be reduced and how. **/

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "simflex/fe/ModelSource.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace cli {

/** Where the finite element model comes from. **/
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

/** Interfaces, load points, modes. **/
class ReductionArguments {
public:
    /** Adds the options. `this` must live as long as `command`. **/
    void addTo(CLI::App& command);

    /** What was asked for; the part has no name yet. @throws CLI::ValidationError for an option of
    the wrong form. **/
    ReductionOptions parse() const;

private:
    std::vector<std::string> _rigid, _distributing, _masters, _loadPoints;
    std::string _stress;  ///< all, skin or nodes; empty: none
    int _numModes = 50, _numCheckedModes = 0;
    double _highestFrequency = 0, _memory = 0;
};

}  // namespace cli
}  // namespace simflex
