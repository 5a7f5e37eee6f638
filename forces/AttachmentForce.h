#pragma once
/** @file
A force and torque on an attachment frame, given in Ground's or the frame's own axes, constant or a
function of time.

    AttachmentForce drive(flexible, crank.interface("shaft"),
                          [](Real t) { return SpatialVec(Vec3(0, 0, 2), Vec3(0)); });

On an interface the power is `torque·ω_A + force·v_A` with the *interface's* own velocities (ω +
EΨξ̇). **/

#include <functional>

#include "simflex/body/FlexibleBodySubsystem.h"

namespace simflex {

class AttachmentForce {
public:
    enum class Axes { Ground, Attachment };
    /** Spatial force (torque [N m], force [N]) at a time [s]; evaluated once per time. **/
    using Function = std::function<SimTK::SpatialVec(SimTK::Real time)>;

    /** Spatial force from the time and the frame's own motion in Ground, for user-defined laws. The
    dense Newton matrix contains its derivatives by finite differences: the law is also evaluated at
    nearby positions and speeds. **/
    using Law = std::function<SimTK::SpatialVec(SimTK::Real time, const FrameMotion& motion)>;

    /** @param name  for messages
    @throws std::invalid_argument if the function is empty. **/
    AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment, Function force,
                    Axes axes = Axes::Ground, const std::string& name = "");
    AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment, Law law,
                    Axes axes = Axes::Ground, const std::string& name = "");
    AttachmentForce(FlexibleBodySubsystem& subsystem, const Attachment& attachment,
                    const SimTK::SpatialVec& force, Axes axes = Axes::Ground,
                    const std::string& name = "");
};

}  // namespace simflex
