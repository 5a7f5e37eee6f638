#pragma once
/** @file
Damping of the modes of a flexible body: force `−d_i ξ̇_i` with `d_i = 2 ζ_i Ω_i`, where ζ_i is the
ratio of critical damping. A body is undamped unless one of these is added; several add up.

    ModalDamping(flexible, crank, 0.01);                       // 1 % of critical for all modes
    ModalDamping::rayleigh(flexible, rod, 5, 1e-6);            // αM + βK
    ModalDamping::byFrequency(flexible, casing);               // common default in industry  **/

#include "simflex/body/FlexibleBody.h"

namespace simflex {

class ModalDamping {
public:
    /** One ratio of critical damping for every mode (0.01 is 1 %).
    @throws std::invalid_argument if it is negative or not finite. **/
    ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, SimTK::Real ratio);

    /** One ratio per mode, n_f in all.
    @throws std::invalid_argument as above or on a wrong number. **/
    ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                 const SimTK::Vector& ratios);

    /** Proportional to mass and stiffness: d_i = α + βΩ_i².
    @param alpha  α ≥ 0 [1/s]
    @param beta   β ≥ 0 [s]
    @throws std::invalid_argument that names the value found. **/
    static void rayleigh(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                         SimTK::Real alpha, SimTK::Real beta);

    /** 1 % of critical below 100 Hz, 10 % from 100 Hz to below 1000 Hz, 100 % above. This is the
    default of Adams/Flex and RecurDyn: it leaves the modes of interest nearly undamped and removes
    the others from the integration. **/
    static void byFrequency(FlexibleBodySubsystem& subsystem, const FlexibleBody& body);

    /** A full matrix: force −Dξ̇. The dense Newton matrix has all of D, the arrow form its
    diagonal.
    @param D  n_f×n_f [1/s]
    @throws std::invalid_argument if D has the wrong size, is not symmetric or has a negative
    eigenvalue, which would feed in energy. **/
    static void matrix(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                       const SimTK::Matrix& D);
};

}  // namespace simflex
