#pragma once
/** @file
The least and the largest of numbers some of which may be NaN: where a quantity has no value. **/

#include <cmath>
#include <utility>

namespace simflex {
namespace model {

/** Places of the least and the largest number, each the first of its kind; the first place if there
is none, as of an empty range. **/
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
