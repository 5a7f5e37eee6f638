#pragma once
/** @file
Carriers of modal coordinates: up to six ξ each, as mobilities of a Simbody mobilized body on
Ground.

The transform is the identity for any q, H = 2⁴⁰·1₆ is constant, and the carrier has mass 2⁻⁸⁰,
centre of mass 0 and inertia 2⁻⁸⁰·1₃. Powers of two make `HᵀMH = 1` exact, so Simbody's mass matrix
has an exact identity block for mass-normalised modes, there is no bias force, and q̇ = u = ξ̇. **/

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"

namespace simflex {

class ModalMobilizer : public SimTK::MobilizedBody::Custom {
public:
    static constexpr int MaxModes = 6;

    /** @pre 1 ≤ numModes ≤ 6.
    @throws std::invalid_argument otherwise. **/
    ModalMobilizer(SimTK::SimbodyMatterSubsystem& matter, int numModes);
};

}  // namespace simflex
