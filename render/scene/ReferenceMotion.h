#pragma once
/** @file
The rigid motion that a part's drawn deformation leaves out. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/body/InterfaceKinematics.h"

namespace simflex {

/** Displaces a point s of the part by shift + turn × s, in B. Displacements u are shown as
u − (shift + turn × s), and drawn `factor` times as large as

    s + u + (factor − 1)(u − shift − turn × s),

so that the frame from which they are measured stays where it is. Zero: displacements from the mean
axes. **/
struct ReferenceMotion {
    SimTK::Vec3 shift{0}, turn{0};

    SimTK::Vec3 calcDisplacement(const SimTK::Vec3& s) const { return shift + turn % s; }
    /** What the undeformed part is moved by. **/
    SimTK::Transform calcPose() const { return {calcExponential(turn), shift}; }
    /** Of a seat that modes displace by `atXi`, as it is drawn. **/
    FrameSums exaggerate(const FrameSums& atXi, const SimTK::Vec3& s, double factor) const {
        return {factor * atXi.translation - (factor - 1) * calcDisplacement(s),
                factor * atXi.rotation - (factor - 1) * turn};
    }
};

}  // namespace simflex
