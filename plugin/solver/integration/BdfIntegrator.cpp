#include "simflex/solver/BdfIntegrator.h"

#include <stdexcept>

#include "simflex/solver/integration/BdfScheme.h"
#include "simflex/solver/integration/ImplicitIntegratorImpl.h"

namespace simflex {

BdfIntegrator::BdfIntegrator(const SimTK::System& system)
    : ImplicitIntegrator(std::make_unique<Implementation>("BdfIntegrator", system,
                                                          std::make_unique<BdfScheme>())) {}

void BdfIntegrator::setMaximumOrder(int order) {
    updImpl().requireNotInitialized("setMaximumOrder");
    if (order < 1 || order > BdfScheme::MaxOrder)
        throw std::invalid_argument("BdfIntegrator::setMaximumOrder(): " + std::to_string(order) +
                                    " given; it must be 1 to 5");
    updImpl().updScheme<BdfScheme>().maximumOrder = order;
}

void BdfIntegrator::setFixedOrder(int order) {
    updImpl().requireNotInitialized("setFixedOrder");
    setMaximumOrder(order);
    updImpl().updScheme<BdfScheme>().fixedOrder = order;
}

void BdfIntegrator::initialize(const SimTK::Array_<SimTK::State>& history) {
    const BdfScheme& scheme = updImpl().updScheme<BdfScheme>();
    const int order = scheme.fixedOrder > 0 ? scheme.fixedOrder : scheme.getMaximumOrder();
    updImpl().initialize(history, order);
}

}  // namespace simflex
