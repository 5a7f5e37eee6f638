#pragma once
/** @file
Writes a run as one self-contained page for a browser, without network access: its motion, which can
be played, rotated and exaggerated; linked curves of all probes; tables, warnings and the model.

    writeReport("crank.results.h5", "crank.html", {});

The motion consists of at most 300 of the stored States, at several exaggeration factors. Curves of
more than 4000 rows are reduced to the minimum and maximum of each bucket of rows. **/

#include <string>

#include "simflex/model/Results.h"

namespace simflex {
namespace model {

/** @param options  only, code.scripts, listener
@return a summary of the contents for the user
@throws std::runtime_error if the results cannot be read, have no such analysis, or the page cannot
be written. If the model of the run cannot be built any more, the page says why and has no motion.
**/
std::string writeReport(const std::string& results, const std::string& page,
                        const RunOptions& options);

}  // namespace model
}  // namespace simflex
