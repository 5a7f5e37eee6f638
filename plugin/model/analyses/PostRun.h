#pragma once
/** @file
Goes back to the results of a run: probes, pictures and videos from the States that it has kept,
without integrating again.

    postProcess("crank.results.h5", loadModelText("crank.yaml"), options);

The model may have other probes and pictures than it had in the run, all else must be the same;
pictures are drawn where they are other. What comes out is what the run would have given with them,
to the bit, forces and accelerations too. **/

#include <string>

#include "simflex/model/Results.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {

struct PostOptions : RunOptions {
    /** A .pvd file, which ParaView opens: flexible bodies at each row, see VtkReporter.h; empty:
    none. Of several analyses, FILE_ANALYSIS.pvd. **/
    std::string vtk;
};

/** @param text  the model with its new probes and pictures; null: that of the run
@param changes  further settings, "PATH=VALUE"
@param options  output (default: RESULTS.post.h5), only, writesCsv, drawsPictures, code.scripts,
    listener, vtk, animation
@return the path of the result file that it has written
@throws std::runtime_error that names what is not there or has changed since; ModelError; Cancelled.
**/
std::string postProcess(const std::string& results, const ModelText* text,
                        const std::vector<std::string>& changes, const PostOptions& options);

}  // namespace model
}  // namespace simflex
