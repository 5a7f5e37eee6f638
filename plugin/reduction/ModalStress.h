#pragma once
/** @file
Stress and strain of every mode of a reduced part at chosen nodes. Internal to reduction. **/

#include "simflex/reduction/Reduction.h"

namespace simflex {

/** The nodes that the options name; mesh indices, ascending.
@throws std::invalid_argument as selectNodes(), with the part's name. **/
std::vector<int> findStressNodes(const std::string& part, const Mesh& mesh,
                                 const StressOptions& options);

/** Stress and strain of the modes of `body`, of which mesh and Phi must be set; see ElementStress.
@throws as reduce(). **/
ReducedBody::ModalStress calcModalStress(const FeModel& model, const ReducedBody& body,
                                         const StressOptions& options,
                                         const ProgressCallback& progress);

}  // namespace simflex
