#pragma once
/** @file
Damping of the modes of a flexible body: force `−d_i ξ̇_i` with `d_i = 2 ζ_i Ω_i` for the ratio ζ_i
of critical. A body has none unless one of these is added; several add up.

    ModalDamping(flexible, crank, 0.01);                       // 1 % of critical for all modes
    ModalDamping::rayleigh(flexible, rod, 5, 1e-6);            // αM + βK
    ModalDamping::byFrequency(flexible, casing);               // as is usual in industry **/

#include "simflex/body/FlexibleBody.h"

namespace simflex {

class ModalDamping {
public:
    /** One ratio of critical damping for every mode (0.01 is 1 %).
    @throws std::invalid_argument if it is negative or not finite. **/
    ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, SimTK::Real ratio);

    /** One ratio per mode, n_f of them. @throws std::invalid_argument as above or on a wrong
     * number. **/
    ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                 const SimTK::Vector& ratios);

    /** Proportional to mass and stiffness: d_i = α + βΩ_i².
    @param alpha  α ≥ 0 [1/s]
    @param beta   β ≥ 0 [s]
    @throws std::invalid_argument that names the value found. **/
    static void rayleigh(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                         SimTK::Real alpha, SimTK::Real beta);

    /** 1 % of critical for modes below 100 Hz, 10 % from there below 1000 Hz, 100 % above: the
    default of Adams/Flex and RecurDyn, which leaves the modes that matter alone and takes the rest
    out of the integration. **/
    static void byFrequency(FlexibleBodySubsystem& subsystem, const FlexibleBody& body);

    /** A full matrix: force −Dξ̇. The Newton matrix has all of D in its dense form, D's diagonal in
    the arrow.
    @param D  n_f×n_f [1/s]
    @throws std::invalid_argument if D has the wrong size, is not symmetric or has a negative
    eigenvalue: it would feed energy in. **/
    static void matrix(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                       const SimTK::Matrix& D);
};

}  // namespace simflex
