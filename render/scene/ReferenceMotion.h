#pragma once
/** @file
The rigid motion excluded from a part's drawn deformation. Internal to the renderer. **/

#include "SimTKcommon.h"
#include "simflex/body/InterfaceKinematics.h"

namespace simflex {

/** Displaces a point s of the part by shift + turn × s, in B. Displacements u are shown as u −
(shift + turn × s), and exaggerated by `factor` as

    s + u + (factor − 1)(u − shift − turn × s),

so that the reference frame stays in place. Zero: displacements from the mean axes. **/
struct ReferenceMotion {
    SimTK::Vec3 shift{0}, turn{0};

    SimTK::Vec3 calcDisplacement(const SimTK::Vec3& s) const { return shift + turn % s; }
    /** Returns the motion of the undeformed part. **/
    SimTK::Transform calcPose() const { return {calcExponential(turn), shift}; }
    /** Returns the drawn motion of a seat displaced by `atXi`. **/
    FrameSums exaggerate(const FrameSums& atXi, const SimTK::Vec3& s, double factor) const {
        return {factor * atXi.translation - (factor - 1) * calcDisplacement(s),
                factor * atXi.rotation - (factor - 1) * turn};
    }
};

}  // namespace simflex
