#pragma once
/** @file
Forces whose magnitude is a Signal: springs, cylinders and motors with user-defined laws, and
controllers. All their energy counts as work of the loads.

    LineForce(flexible, base, boom.interface("ram"), tension);
    CoordinateForce(flexible, shoulder, 0, torque);
    StateForce(flexible, tip, {drag, none, none});
    StateLoad(flexible, hull, LoadShape::pressure(part, "SKIN"), pressure);

Names are for messages. **/

#include <array>

#include "simflex/body/FlexibleBody.h"
#include "simflex/forces/LoadShape.h"
#include "simflex/forces/Signal.h"

namespace simflex {

class LineForce {
public:
    /** @param tension  force in the line between the two origins [N]; positive pulls them together
     **/
    LineForce(FlexibleBodySubsystem& subsystem, const Attachment& first, const Attachment& second,
              const Signal& tension, const std::string& name = "");
};

class CoordinateForce {
public:
    /** @param force  along the joint's coordinate: force [N] or torque [N m]; its power is force
        times rate
    @throws std::out_of_range if the joint has no such coordinate. **/
    CoordinateForce(FlexibleBodySubsystem& subsystem, const Joint& joint, int number,
                    const Signal& force, const std::string& name = "");
    CoordinateForce(FlexibleBodySubsystem& subsystem, const JointCoordinate& coordinate,
                    const Attachment& F, const Attachment& M, const Signal& force,
                    const std::string& name = "");
};

class StateForce {
public:
    enum class Axes { Ground, Attachment };

    /** @param force, torque  components [N, N m] **/
    StateForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
               const std::array<Signal, 3>& force, const std::array<Signal, 3>& torque,
               Axes axes = Axes::Ground, const std::string& name = "");
    StateForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
               const std::array<Signal, 3>& force, Axes axes = Axes::Ground,
               const std::string& name = "");
};

class StateLoad {
public:
    /** A LoadShape on a flexible body, scaled by a Signal.
    @throws std::invalid_argument if the shape and the body differ in their number of modes. **/
    StateLoad(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, const LoadShape& shape,
              const Signal& scale, const std::string& name = "");
};

}  // namespace simflex
