#pragma once
/** @file
Smallest and largest of numbers that may be NaN where a quantity has no value. **/

#include <cmath>
#include <utility>

namespace simflex {
namespace model {

/** Positions of the smallest and the largest number, each its first occurrence; `first` if there
are none. **/
template <class Iterator>
std::pair<Iterator, Iterator> findExtremes(Iterator first, Iterator last) {
    std::pair<Iterator, Iterator> extremes(first, first);
    for (Iterator at = first; at != last; ++at) {
        if (std::isnan(*at)) continue;
        if (!(*at >= *extremes.first)) extremes.first = at;
        if (!(*at <= *extremes.second)) extremes.second = at;
    }
    return extremes;
}

}  // namespace model
}  // namespace simflex
