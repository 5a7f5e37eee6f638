#pragma once
/** @file Checks of options that are numbers, with words for people. **/

#include <CLI/CLI.hpp>
#include <string>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace cli {

/** @param isAllowed  of a number; @param what  they are, "positive" **/
template <class IsAllowed>
CLI::Validator makeNumberCheck(IsAllowed isAllowed, const std::string& what) {
    return {[isAllowed, what](const std::string& text) -> std::string {
                double value = 0;
                if (!readNumber(text, value))
                    return "'" + text + "' is not a number" +
                           (text.find(',') == std::string::npos
                                ? ""
                                : "; decimals are written with a point");
                return isAllowed(value) ? "" : "'" + text + "' is not " + what;
            },
            ""};
}

inline CLI::Validator makePositiveCheck() {
    return makeNumberCheck([](double value) { return value > 0; }, "positive");
}

inline CLI::Validator makeNonNegativeCheck() {
    return makeNumberCheck([](double value) { return value >= 0; }, "positive or zero");
}

}  // namespace cli
}  // namespace simflex
