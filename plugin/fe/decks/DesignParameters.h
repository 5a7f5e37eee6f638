#pragma once
/** @file
Finds the numbers of a deck that DesignParameter.h names, and makes its models of other values.
Internal to fe. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "InpCards.h"
#include "simflex/fe/DesignParameter.h"

namespace simflex {

/** @param build  the model of cards, see DesignParameter::variants
@param model  that of the cards given
@throws std::invalid_argument naming the deck and the parameter: one that the deck does not have,
    with those that it has; a number that is not positive, or stands for several that differ; one
that nothing in the part depends on, or at another value of which the part has other nodes. **/
std::vector<std::shared_ptr<const DesignParameter>> makeDesignParameters(
    const std::vector<DeckCard>& cards, const std::vector<std::string>& names, const FeModel& model,
    const std::function<FeModel(std::vector<DeckCard>)>& build);

}  // namespace simflex
