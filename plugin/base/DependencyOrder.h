#pragma once
/** @file
Resolves entries of a file that name each other, in whatever order: without recursion, because
chains may be as long as the file. **/

#include <algorithm>
#include <optional>
#include <set>
#include <vector>

namespace simflex {

/** Finishes `first`, and before it the entries that it depends on, in linear time.
@param findOpen    (key) → optional key: an entry that it needs and that is not finished yet
@param finish      (key), when findOpen finds none
@param failCircle  (keys): called with entries each of which needs the next, and the last the first;
                   must throw **/
template <class Key, class FindOpen, class Finish, class FailCircle>
void finishInOrder(const Key& first, const FindOpen& findOpen, const Finish& finish,
                   const FailCircle& failCircle) {
    std::vector<Key> path;
    std::set<Key> begun;
    const auto begin = [&](const Key& key) {
        if (!begun.insert(key).second)
            failCircle(std::vector<Key>(std::find(path.begin(), path.end(), key), path.end()));
        path.push_back(key);
    };
    begin(first);
    while (!path.empty()) {
        if (const std::optional<Key> next = findOpen(path.back())) {
            begin(*next);
            continue;
        }
        finish(path.back());
        begun.erase(path.back());
        path.pop_back();
    }
}

}  // namespace simflex
