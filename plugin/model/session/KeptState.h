#pragma once
/** @file
States of a model in files: text, with all digits. **/

#include <string>

#include "simflex/model/Model.h"

namespace simflex {
namespace model {

/** Replaces the file as a whole. @throws std::runtime_error. **/
void writeKeptState(const std::string& path, const Model& model, const SimTK::State& state);

/** Realized to Stage::Velocity. @throws std::runtime_error naming the file and what is wrong with
it. **/
SimTK::State readKeptState(const std::string& path, const Model& model);

}  // namespace model
}  // namespace simflex
