#pragma once
/** @file
Radau IIA of order 5 as a scheme (private header); RadauStep solves its steps. **/

#include "simflex/solver/integration/IntegrationScheme.h"
#include "simflex/solver/integration/RadauTableau.h"

namespace simflex {

class RadauScheme : public IntegrationScheme {
public:
    static constexpr int Order = 5;

    const char* getName() const override { return "Radau"; }
    bool suit(Suitability) override { return true; }
    int getLowestOrder() const override { return Order; }
    int getHighestOrder(const SolutionHistory&) const override { return Order; }
    int getMaximumOrder() const override { return Order; }
    /** The collocation polynomial. **/
    DenseNodes getDenseNodes(int order) const override {
        if (order < Order) return IntegrationScheme::getDenseNodes(order);
        return {radau::NumStages + 1, radau::NumStages, radau::NumStages};
    }
    std::vector<std::pair<std::string, double>> listSettings() const override { return {}; }
};

}  // namespace simflex
