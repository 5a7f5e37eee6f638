#pragma once
/** @file
Names of the quantities of a Session: `joints.bearing.angle`, `bodies.crank.modes.3`, `time`. The
singular is accepted as well: `joint.bearing.angle`. **/

#include "simflex/model/Session.h"

namespace simflex {
namespace model {

/** The number of an element, counted from `first`.
@throws std::runtime_error that names the allowed range. **/
int readIndex(const std::string& text, int first, int count, const std::string& what);

/** Replaces singulars by "joints", "bodies", "parameters". **/
std::string normalizePath(const std::string& path);

}  // namespace model
}  // namespace simflex
