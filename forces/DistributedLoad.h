#pragma once
/** @file
A LoadShape on a flexible body, scaled by a constant or a function of time. **/

#include <functional>

#include "simflex/body/FlexibleBody.h"
#include "simflex/forces/LoadShape.h"

namespace simflex {

class DistributedLoad {
public:
    using Scale = std::function<SimTK::Real(SimTK::Real time)>;

    /** @throws std::invalid_argument if the shape has another number of modes than the body. **/
    DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                    const LoadShape& shape, Scale scale);
    DistributedLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                    const LoadShape& shape, SimTK::Real scale = 1);
};

}  // namespace simflex
