#include "simflex/forces/ModalDamping.h"

#include <cmath>

#include "simflex/body/FlexibleBodySubsystemGuts.h"

namespace simflex {

using namespace SimTK;

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, Real ratio)
    : ModalDamping(subsystem, body, Vector(body.getNumModes(), ratio)) {}

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                           const Vector& ratios) {
    const ReducedBody& part = body.getPart();
    if (ratios.size() != part.numModes)
        throw std::invalid_argument("ModalDamping of '" + body.getName() +
                                    "': " + std::to_string(ratios.size()) + " ratios for " +
                                    std::to_string(part.numModes) + " modes");
    Array_<Real> coefficients;
    for (int i = 0; i < ratios.size(); ++i) {
        if (!(ratios[i] >= 0) || !std::isfinite(ratios[i]))
            throw std::invalid_argument("ModalDamping of '" + body.getName() +
                                        "': the ratio of mode " + std::to_string(i + 1) + " is " +
                                        std::to_string(ratios[i]) + ", must be 0 or more");
        coefficients.push_back(2 * ratios[i] * std::sqrt(part.omegaSquared[i]));
    }
    subsystem.updGuts().addModalDamping(body.getIndex(), coefficients);
}

}  // namespace simflex
