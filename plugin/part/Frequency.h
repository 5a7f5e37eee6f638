#pragma once
/** @file
Frequencies of a part's modes as numbers and text. **/

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "simflex/base/NumberText.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

/** Returns the free-free frequencies of the part [Hz], ascending. **/
inline std::vector<double> calcFrequencies(const ReducedBody& part) {
    constexpr double pi = 3.14159265358979323846;
    std::vector<double> hertz;
    for (const double omegaSquared : part.omegaSquared)
        hertz.push_back(std::sqrt(omegaSquared) / (2 * pi));
    return hertz;
}

/** Returns "123.4 Hz": about four significant digits, without an exponent unless the value is very
small. **/
inline std::string formatFrequency(double hertz) {
    const std::string text = hertz >= 99.995 || hertz == 0 ? writeFixed(hertz, 1)
                             : hertz >= 9.9995             ? writeFixed(hertz, 2)
                             : hertz >= 0.1                ? writeFixed(hertz, 3)
                                                           : writeGeneral(hertz, 4);
    return text + " Hz";
}

/** Returns a mode number (from 1) padded to the width of the largest one, at least two digits:
"07". **/
inline std::string formatModeNumber(int number, int numModes) {
    char text[32];
    std::snprintf(text, sizeof text, "%0*d", numModes < 100 ? 2 : numModes < 1000 ? 3 : 6, number);
    return text;
}

}  // namespace simflex
