#pragma once
/** @file
Symbols of force elements and arrows of loads, as in drawings of mechanisms. Internal.

    strut           a coil, a damper's cylinder and rod, or both in one, with an eye at each end
    torsion spring  a spiral between the two directions that it turns against each other
    bushing         rubber about a sleeve and a bolt
    stop            a plate with hatching behind it, and the knob that it stops
**/

#include "JointSymbols.h"

namespace simflex {

/** Dimensions of a strut's symbol [m], which do not change with its length. **/
struct StrutSize {
    double radius = 0.01;           ///< of the coil
    double length = 0.1;            ///< unloaded
    double coil = SimTK::Infinity;  ///< longest part of the line drawn as a coil, in its middle
    int numTurns = 8;
};

/** Chooses a well-proportioned size for an unloaded length.
@param scale  radius of the largest part of the scene **/
StrutSize chooseStrutSize(double length, double scale);

struct StrutParts {
    bool hasSpring = true, hasDamper = false;
    bool isFirstOnGround = false, isSecondOnGround = false;  ///< draws a block at the end
};

/** Draws a strut from the origin of X_GF to the point M_G. **/
void appendStrut(const SimTK::Transform& X_GF, const SimTK::Vec3& M_G, const StrutSize& size,
                 const StrutParts& parts, SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

/** Draws a spiral about the z axis of F, at `offset` along it. **/
void appendTorsionSpring(const SimTK::Transform& X_GF, const SimTK::Transform& X_GM,
                         const SymbolSize& size, double offset,
                         SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

void appendBushing(const SimTK::Transform& X_GF, const SimTK::Transform& X_GM,
                   const SymbolSize& size, SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

/** Draws the plate z = 0 of F. @param side  half of the plate's side **/
void appendStop(const SimTK::Transform& X_GF, const SimTK::Vec3& M_G, double side,
                SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

/** Draws a force as a straight arrow. **/
void appendForceArrow(const SimTK::Vec3& start_G, const SimTK::Vec3& span, double tipLength,
                      const SimTK::Vec3& color, SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

/** Draws a torque as most of a circle about `axis`, right-handed. **/
void appendTorqueArrow(const SimTK::Vec3& center_G, const SimTK::UnitVec3& axis, double radius,
                       double tipLength, const SimTK::Vec3& color,
                       SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

}  // namespace simflex
