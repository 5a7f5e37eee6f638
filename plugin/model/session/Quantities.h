#pragma once
/** @file
Names of what a Session can tell and change while its model moves: `joints.bearing.angle`,
`bodies.crank.modes.3`, `time`. The singular works as well: `joint.bearing.angle`. **/

#include "simflex/model/Session.h"

namespace simflex {
namespace model {

/** The number of an element, counted from `first`. @throws std::runtime_error that names the
range. **/
int readIndex(const std::string& text, int first, int count, const std::string& what);

/** With "joints", "bodies", "parameters" instead of their singulars. **/
std::string normalizePath(const std::string& path);

}  // namespace model
}  // namespace simflex
