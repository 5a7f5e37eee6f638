#pragma once
/** @file
What builders of a model's system share (private header). **/

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "simflex/model/Model.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {
namespace model {

using Parts = std::map<std::string, std::shared_ptr<const ReducedBody>>;

/** @throws ModelError by value.failUnknown() if `entries` has none of that name. **/
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

/** Calls `action`; what it throws beside ModelError gets the place of `value`. **/
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
