#pragma once
/** @file
The options of a command that say how a model is to be reduced: interfaces, load points, modes. **/

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace cli {

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
