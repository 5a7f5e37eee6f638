#pragma once
/** @file
What is wrong with a model file, and where. **/

#include <stdexcept>
#include <string>

namespace simflex {

/** Its text begins with file, line and column: "crank.yaml:12:9: joints.bearing: …". **/
class ModelError : public std::runtime_error {
public:
    explicit ModelError(const std::string& message) : std::runtime_error(message) {}
};

}  // namespace simflex
