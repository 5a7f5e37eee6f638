#pragma once
/** @file
Stress and strain of all modes of a reduced part at selected nodes. Internal to reduction. **/

#include "simflex/reduction/Reduction.h"

namespace simflex {

/** Returns the nodes selected by the options; mesh indices, ascending.
@throws std::invalid_argument as selectNodes(), with the part's name. **/
std::vector<int> findStressNodes(const std::string& part, const Mesh& mesh,
                                 const StressOptions& options);

/** Computes stress and strain of the modes of `body`, whose mesh and Phi must be set; see
ElementStress.
@throws as reduce(). **/
ReducedBody::ModalStress calcModalStress(const FeModel& model, const ReducedBody& body,
                                         const StressOptions& options,
                                         const ProgressCallback& progress);

}  // namespace simflex
