#pragma once
/** @file
A small symbol for each kind of joint, made of Simbody's decorative geometry. Internal.

    Ball      a ball in a ring            Slider     a rail and a carriage
    Pin       a shaft with two collars    Weld       a block
    Cylinder  a shaft and a sleeve        Universal  a cross
    Screw     a threaded shaft and nut    Planar     a plate and a disc
**/

#include <string>
#include <vector>

#include "SimTKcommon.h"

namespace simflex {

/** Dimensions of the seat that a joint's symbol is to fit [m]. **/
struct SymbolSize {
    double radius = 0.01;      ///< of a hole
    double halfLength = 0.01;  ///< along the joint's axis
};

/** Appends the symbol, in Ground.
@param kind  as JointEquations::getKind(); an unknown kind gets a small ball **/
void appendJointSymbol(const std::string& kind, const SimTK::Transform& X_GF,
                       const SimTK::Transform& X_GM, const SymbolSize& size,
                       SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

/** Appends the symbol of a coupler: a line between the frames of its coordinates. **/
void appendCouplerSymbol(const std::vector<SimTK::Transform>& frames, const SymbolSize& size,
                         SimTK::Array_<SimTK::DecorativeGeometry>& geometry);

}  // namespace simflex
