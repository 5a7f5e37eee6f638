#pragma once
/** @file
Suggestions for misspelled names. **/

#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/base/NameDistance.h"

namespace simflex {
namespace model {

/** "did you mean 'x'?", or "there is: a, b, c" if there are few, or "". **/
std::string proposeName(const std::string& name, const std::vector<std::string>& known);

/** "there is no joint 'bearng'; did you mean 'bearing'?", or with a list of all if there are few.
 **/
std::string describeUnknown(const std::string& what, const std::string& name,
                            const std::vector<std::string>& known);

template <class Items>
std::vector<std::string> getNames(const Items& items) {
    std::vector<std::string> names;
    for (const auto& item : items) names.push_back(item.name);
    return names;
}

/** The item of that name; null if none. **/
template <class Items>
auto seekNamed(Items& items, const std::string& name) -> decltype(&*std::begin(items)) {
    for (auto& item : items)
        if (item.name == name) return &item;
    return nullptr;
}

/** The same.
@throws Error with describeUnknown(). **/
template <class Error = std::runtime_error, class Items>
const auto& findNamed(const Items& items, const std::string& what, const std::string& name) {
    if (const auto* item = seekNamed(items, name)) return *item;
    throw Error(describeUnknown(what, name, getNames(items)));
}

/** "a, b, c". **/
std::string joinNames(const std::vector<std::string>& names, const std::string& separator = ", ");

}  // namespace model
}  // namespace simflex
