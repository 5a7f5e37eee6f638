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

    const std::string& path() const { return m_options.path; }

    /** What was asked for. @throws CLI::ValidationError for an option of the wrong form. **/
    SourceOptions parse() const;

private:
    SourceOptions m_options;
    std::string m_lengthUnit;
    std::vector<std::string> m_settings, m_materials;
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
    ReductionOptions m_options;
    std::vector<std::string> m_rigid, m_distributing, m_masters, m_loadPoints;
    std::string m_stress;  ///< all, skin or nodes; empty: none
    double m_memory = 0;   ///< [GiB]
};

}  // namespace cli
}  // namespace simflex
