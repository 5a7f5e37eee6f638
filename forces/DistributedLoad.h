#pragma once
/** @file
A LoadShape on a flexible body, scaled by a constant or a function of time. **/

#include <functional>
#include <string>

#include "simflex/body/FlexibleBody.h"
#include "simflex/forces/LoadShape.h"

namespace simflex {

class DistributedLoad {
public:
    using Scale = std::function<SimTK::Real(SimTK::Real time)>;

    /** @param name  for messages
    @throws std::invalid_argument if the shape and the body differ in their number of modes. **/
    DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                    const LoadShape& shape, Scale scale, const std::string& name = "");
    DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                    const LoadShape& shape, SimTK::Real scale = 1, const std::string& name = "");
};

}  // namespace simflex
