#pragma once
/** @file
Names of what can be read and changed at the prompt while a model runs: `joints.bearing.angle`,
`bodies.crank.modes.3`, `time`. The singular works as well: `joint.bearing.angle`. **/

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "simflex/cli/shell/ShellModel.h"

namespace simflex {
namespace cli {

struct ShellVariable {
    std::string path, unit;
    std::function<std::vector<double>()> get;
    /** The State with new values, as many as get() gives; empty: cannot be set. **/
    std::function<SimTK::State(const std::vector<double>& values)> calcStateWith;
};

/** With "joints", "bodies", "parameters" instead of their singulars. **/
std::string normalizePath(const std::string& path);

/** Refers to the model; empty if no variable is called so (something else may be).
@throws std::runtime_error if the path names a joint or body that there is not. **/
std::optional<ShellVariable> findVariable(const ShellModel& model, const std::string& path);

/** All of them, without their elements. **/
std::vector<std::string> listVariables(const ShellModel& model);

/** The text of what the model file says at a path; empty if it says nothing there. **/
std::optional<std::string> formatModelValue(const ModelValue& file, const std::string& path);

/** Paths that the model file and its schema have, of those that begin like `begin`; one level
 * deeper at most, the end of a level with a point. **/
std::vector<std::string> completeModelPath(const ModelValue& file, const std::string& begin);

}  // namespace cli
}  // namespace simflex
