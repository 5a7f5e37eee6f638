#pragma once
/** @file
Common forms of the schema, and the sections of which it consists. **/

#include "simflex/model/schema/Schema.h"

namespace simflex {
namespace model {
namespace forms {

using Forms = std::vector<SchemaForm>;

const double Unbounded = std::numeric_limits<double>::infinity();

SchemaForm number(double minimum = -Unbounded, double maximum = Unbounded);
SchemaForm positive();
SchemaForm integer(double minimum = -Unbounded, double maximum = Unbounded);
SchemaForm function();
/** A function of time, of quantities of the motion (probes, states) and of `locals`. **/
SchemaForm law(const std::vector<std::string>& locals = {});
SchemaForm boolean();
SchemaForm text();
SchemaForm name(const std::string& title);
SchemaForm formula();
SchemaForm choice(const std::vector<std::string>& choices);
SchemaForm file(const std::string& title);
SchemaForm output(const std::string& title);
SchemaForm list(const Forms& items, const std::vector<int>& sizes = {});
SchemaForm map(const std::string& title, const std::vector<SchemaKey>& keys,
               const std::vector<std::string>& oneOf = {});
/** Names chosen by the user → values. **/
SchemaForm entries(const std::string& title, const Forms& values);
/** Numbers from 1 → values. **/
SchemaForm numbered(const std::string& title, const Forms& values);

SchemaForm vec3();
SchemaForm laws3();
/** A list of numbers, or {from:, to:, count:}. **/
Forms numbersOrRange();
Forms rotation();
/** x, y, z, or a vector. **/
Forms axis();
/** A name, or a map. **/
Forms frame();
/** Keys of a frame: {on, node, position, rotation}. **/
std::vector<SchemaKey> frameKeys();
Forms place();
SchemaForm color();

/** @name Top-level keys by section. **/
/**@{**/
std::vector<SchemaKey> makePartKeys();
std::vector<SchemaKey> makeBodyKeys();
std::vector<SchemaKey> makeJointKeys();
std::vector<SchemaKey> makeRunKeys();
std::vector<SchemaKey> makeProbeKeys();
std::vector<SchemaKey> makePictureKeys();
/**@}**/

}  // namespace forms
}  // namespace model
}  // namespace simflex
