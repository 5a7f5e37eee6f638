#pragma once
/** @file
Results that are out of date and stay until new ones have taken their place.

    keepAside("run.h5");        // run.h5.before-1/run.h5, with its journal and checkpoint
    // … run.h5 is made anew …
    removeReplaced("run.h5");   // the folder, once run.h5 has all of its analyses complete

Moved back, the files are as they were: a run that was stopped continues from its checkpoint.
Internal. **/

#include <string>

namespace simflex {
namespace model {

/** Moves a result file and what belongs to it into a folder of its own. The result file comes last:
what a kill interrupts is completed by the next call.
@returns the folder
@throws std::runtime_error, also if another run is writing the file **/
std::string keepAside(const std::string& path);

/** Removes a result file and what belongs to it. **/
void removeResults(const std::string& path);

/** Removes folders of which every analysis is complete in the result file, or in a folder that was
kept later. Files of others in them stay. **/
void removeReplaced(const std::string& path);

}  // namespace model
}  // namespace simflex
