#pragma once
/** @file
States of a model in files: text, with all digits. **/

#include <string>
#include <vector>

#include "simflex/model/Model.h"

namespace simflex {

class Archive;
struct SavedState;

namespace model {

/** Replaces the file as a whole. @throws std::runtime_error. **/
void writeKeptState(const std::string& path, const Model& model, const SimTK::State& state);

/** Realized to Stage::Velocity.
@throws std::invalid_argument naming file and line, and what is wrong there; std::runtime_error if
it cannot be read. **/
SimTK::State readKeptState(const std::string& path, const Model& model);

/** What Session::save() gives, and the sum of its model, which must be the one it has.
@throws std::runtime_error **/
void visitSaved(Archive& archive, const Model& model, SavedState& saved);

}  // namespace model
}  // namespace simflex
