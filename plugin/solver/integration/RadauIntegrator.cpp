#include "simflex/solver/RadauIntegrator.h"

#include "simflex/solver/integration/ImplicitIntegratorImpl.h"
#include "simflex/solver/integration/RadauScheme.h"

namespace simflex {

RadauIntegrator::RadauIntegrator(const SimTK::System& system)
    : ImplicitIntegrator(std::make_unique<Implementation>("RadauIntegrator", system,
                                                          std::make_unique<RadauScheme>())) {}

}  // namespace simflex
