#pragma once
/** @file
Finds the parameters of DesignParameter.h in a deck, and makes models with other values. Internal to
fe. **/

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "InpCards.h"
#include "simflex/fe/DesignParameter.h"

namespace simflex {

/** @param build  makes the model of cards, see DesignParameter::variants
@param model  the model of the given cards
@throws std::invalid_argument naming the deck and the parameter: one that the deck does not have
(listing the existing ones); a number that is not positive, or several different ones; one without
effect on the part, or one that changes the set of nodes. **/
std::vector<std::shared_ptr<const DesignParameter>> makeDesignParameters(
    const std::vector<DeckCard>& cards, const std::vector<std::string>& names, const FeModel& model,
    const std::function<FeModel(std::vector<DeckCard>)>& build);

}  // namespace simflex
