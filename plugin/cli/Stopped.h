#pragma once
/** @file
Ctrl-C in work of which some is done. **/

#include <stdexcept>
#include <string>

namespace simflex {
namespace cli {

/** Thrown by a command that Ctrl-C stopped; its text says what was kept. **/
class Stopped : public std::runtime_error {
public:
    explicit Stopped(const std::string& kept) : std::runtime_error(kept) {}
};

}  // namespace cli
}  // namespace simflex
