#pragma once
/** @file
Evaluates new probes, pictures and videos from the stored States of a run, without integrating
again.

    postProcess("crank.results.h5", loadModelText("crank.yaml"), options);

Only probes and pictures of the model may differ from those of the run; pictures are drawn if they
differ. Results are those that the run would have given, bit by bit, including forces and
accelerations. **/

#include <string>

#include "simflex/model/Results.h"
#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace model {

struct PostOptions : RunOptions {
    /** A .pvd file for ParaView with the flexible bodies at each row, see VtkReporter.h; empty:
    none. With several analyses, FILE_ANALYSIS.pvd. **/
    std::string vtk;
};

/** @param text  the model with its new probes and pictures; null: that of the run
@param changes  further settings, "PATH=VALUE"
@param options  output (default: RESULTS.post.h5), only, writesCsv, drawsPictures, code.scripts,
    listener, vtk, animation
@return the path of the new result file
@throws std::runtime_error naming what is missing or has changed; ModelError; Cancelled. **/
std::string postProcess(const std::string& results, const ModelText* text,
                        const std::vector<std::string>& changes, const PostOptions& options);

}  // namespace model
}  // namespace simflex
