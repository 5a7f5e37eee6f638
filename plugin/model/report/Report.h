#pragma once
/** @file
A run as one page for a browser, without network and without simflex: its motion, which can be
played, turned and exaggerated; curves of all probes linked to it; tables, warnings and the model.

    writeReport("crank.results.h5", "crank.html", {});

The motion is made of the States that the run has kept, 300 times at most, at several factors of
exaggeration; curves of more than 4000 rows are told by the least and the largest value of each
bucket of rows. **/

#include <string>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** @param options  only, code.scripts, listener
@return what is in it, for people
@throws std::runtime_error if the results cannot be read, have no such analysis, or the page cannot
be written. Where the model of the run cannot be built any more, the page says why and has no
motion. **/
std::string writeReport(const std::string& results, const std::string& page,
                        const RunOptions& options);

}  // namespace model
}  // namespace simflex
