#pragma once
/** @file
Helpers shared by the builders of a model's system (private header). **/

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "simflex/model/Model.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace model {

using Parts = std::map<std::string, std::shared_ptr<const ReducedBody>>;

/** Finds an entry by name.
@throws ModelError by value.failUnknown() if there is none. **/
template <class Entry>
const Entry& findEntry(const std::vector<Entry>& entries, const char* what, const std::string& name,
                       const ModelValue& value) {
    std::vector<std::string> known;
    for (const Entry& entry : entries) {
        if (entry.name == name) return entry;
        known.push_back(entry.name);
    }
    value.failUnknown(what, name, known);
}

/** Calls `action`; invalid_argument and out_of_range become ModelErrors with the place of `value`.
 **/
template <class Action>
auto withPlace(const ModelValue& value, const Action& action) -> decltype(action()) {
    try {
        return action();
    } catch (const ModelError&) {
        throw;
    } catch (const std::invalid_argument& error) {
        value.fail(error.what());
    } catch (const std::out_of_range& error) {
        value.fail(error.what());
    }
}

}  // namespace model
}  // namespace simflex
