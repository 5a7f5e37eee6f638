#pragma once
/** @file
Interface of an integration method (private header): its orders; for one-stage methods also the
formula of a step and its local error. **/

#include <string>
#include <utility>
#include <vector>

#include "simflex/solver/equations/StepFormula.h"
#include "simflex/solver/integration/SolutionHistory.h"

namespace simflex {

class IntegrationScheme {
public:
    virtual ~IntegrationScheme() = default;

    virtual const char* getName() const = 0;

    /** Requirement of a system on orders that are not set. **/
    enum class Suitability {
        AStable,   ///< lightly damped fast modes, or fixed steps
        HighOrder  ///< neither
    };
    /** @returns true if the scheme then uses orders higher than 2. **/
    virtual bool suit(Suitability) { return false; }

    /** Orders allowed with this history, once it is long enough. **/
    virtual int getLowestOrder() const = 0;
    virtual int getHighestOrder(const SolutionHistory& history) const = 0;
    /** The highest order with a long enough history. **/
    virtual int getMaximumOrder() const = 0;

    /** Number of newest nodes that the solution inside the last step interpolates, and of points
    for u̇ and λ. **/
    struct DenseNodes {
        int values, uDot, lambda;
    };
    virtual DenseNodes getDenseNodes(int order) const {
        // Steps of high order are long.
        return {order + 1, order > 2 ? order : 2, order + 1};
    }

    /** Names of its settings, as in the integrator, and values. **/
    virtual std::vector<std::pair<std::string, double>> listSettings() const = 0;
};

/** A method that solves for the end of a step only. **/
class OneStageScheme : public IntegrationScheme {
public:
    /** Writes the formula of a step from the newest point to tNew. **/
    virtual void calcFormula(const SolutionHistory& history, int order, double tNew,
                             StepFormula& formula) = 0;

    /** Completes an accepted point that is not in the history yet, its u and uDot given. **/
    virtual void completePoint(const SolutionHistory& history, const StepFormula& formula,
                               SolutionPoint& point) = 0;

    /** Local error of a step = factor·(y − y_pred), y_pred through order + 1 nodes. **/
    struct ErrorFactors {
        double q, u;
    };
    virtual ErrorFactors calcErrorFactors(const SolutionHistory& history, int order,
                                          double tNew) const = 0;

    /** C of the first step's local error C h²(u̇₁ − u̇₀) in q, when nodes are too few. **/
    virtual double getFirstErrorConstant() const = 0;
};

}  // namespace simflex
