#pragma once
/** @file
Files of a model's States, as text with all digits. **/

#include <string>
#include <vector>

#include "simflex/model/Model.h"

namespace simflex {

class Archive;
struct SavedState;

namespace model {

/** Replaces the file atomically.
@throws std::runtime_error. **/
void writeKeptState(const std::string& path, const Model& model, const SimTK::State& state);

/** Reads a State and realizes it to Stage::Velocity.
@throws std::invalid_argument naming file, line and defect; std::runtime_error if the file cannot be
read. **/
SimTK::State readKeptState(const std::string& path, const Model& model);

/** Visits the result of Session::save() and a checksum of its model, which must match.
@throws std::runtime_error **/
void visitSaved(Archive& archive, const Model& model, SavedState& saved);

}  // namespace model
}  // namespace simflex
