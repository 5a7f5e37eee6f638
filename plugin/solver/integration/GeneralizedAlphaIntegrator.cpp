#include "simflex/solver/GeneralizedAlphaIntegrator.h"

#include <stdexcept>

#include "simflex/solver/integration/GeneralizedAlphaScheme.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

GeneralizedAlphaIntegrator::GeneralizedAlphaIntegrator(const SimTK::System& system)
    : ImplicitIntegrator(std::make_unique<Implementation>(
          "GeneralizedAlphaIntegrator", system, std::make_unique<GeneralizedAlphaScheme>(0.8))) {}

void GeneralizedAlphaIntegrator::setSpectralRadius(SimTK::Real rho) {
    updImpl().requireNotInitialized("setSpectralRadius");
    if (!(rho >= 0 && rho <= 1))
        throw std::invalid_argument("GeneralizedAlphaIntegrator::setSpectralRadius(): " +
                                    std::to_string(rho) + " given; it must be 0 to 1");
    updImpl().updScheme<GeneralizedAlphaScheme>().setSpectralRadius(rho);
}

}  // namespace simflex
