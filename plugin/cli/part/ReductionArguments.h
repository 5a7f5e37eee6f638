#pragma once
/** @file
The input and reduction options of the command reduce. **/

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "simflex/fe/ModelSource.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace cli {

/** Source of the finite element model. **/
class SourceArguments {
public:
    /** Adds SOURCE and its options. `this` must outlive `command`. **/
    void addTo(CLI::App& command);

    const std::string& path() const { return m_options.path; }

    /** Returns the options given. @throws CLI::ValidationError for a malformed option. **/
    SourceOptions parse() const;

private:
    SourceOptions m_options;
    std::string m_lengthUnit;
    std::vector<std::string> m_settings, m_materials;
};

/** Interfaces, load points and modes. **/
class ReductionArguments {
public:
    /** Adds the options. `this` must outlive `command`. **/
    void addTo(CLI::App& command);

    /** Returns the options given, without the part's name. @throws CLI::ValidationError for a
    malformed option. **/
    ReductionOptions parse() const;

private:
    ReductionOptions m_options;
    std::vector<std::string> m_rigid, m_distributing, m_masters, m_loadPoints;
    std::string m_stress;  ///< all, skin or nodes; empty: none
    double m_memory = 0;   ///< [GiB]
};

}  // namespace cli
}  // namespace simflex
