#pragma once
/** @file
Damping of the modes of a flexible body: force `−d_i ξ̇_i` with `d_i = 2 ζ_i Ω_i` for the ratio ζ_i
of critical. **/

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
};

}  // namespace simflex
