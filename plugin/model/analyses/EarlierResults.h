#pragma once
/** @file
Keeps outdated results until new ones have replaced them.

    keepAside("run.h5");        // run.h5.before-1/run.h5, with its journal and checkpoint
    // … write run.h5 again …
    removeReplaced("run.h5");   // the folder, once run.h5 has all of its analyses complete

Moved back, the files are as before: an interrupted run continues from its checkpoint.
Internal. **/

#include <string>

namespace simflex {
namespace model {

/** Moves a result file and its companion files into a new folder. The result file is moved last, so
that the next call completes an interrupted move.
@returns the folder
@throws std::runtime_error, also if another run is writing the file **/
std::string keepAside(const std::string& path);

/** Removes a result file and its companion files. **/
void removeResults(const std::string& path);

/** Removes folders all of whose analyses are complete in the result file or in a later folder.
Other files in them are kept. **/
void removeReplaced(const std::string& path);

}  // namespace model
}  // namespace simflex
