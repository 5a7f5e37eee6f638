#pragma once
/** @file
Treatment of all cards of a CalculiX deck, and its element types. Internal to fe. **/

#include <set>
#include <string>

#include "simflex/part/Mesh.h"

namespace simflex {

/** Treatment of a card, by its keyword without star and blanks: "SOLIDSECTION". Every keyword of
CalculiX 2.20 has an entry. **/
enum class CardUse {
    Read,              ///< nodes, elements, sets, sections, constraints
    MaterialProperty,  ///< child of *MATERIAL required for K or M
    LeftOutProperty,   ///< child of *MATERIAL not required
    Contact,           ///< contact pairs and the like, left out on request
    LeftOut,           ///< allowed in the deck of a free solid part, but irrelevant for K, M
    Refused,           ///< affects K or M in an unsupported way
    Unknown
};

CardUse findCardUse(const std::string& keyword);

/** Returns why a card of CardUse::Refused is refused. **/
const std::string& getRefusal(const std::string& keyword);

/** Returns why a card is refused within a *STEP, or null: it is left out with its step. **/
const std::string* findStepRefusal(const std::string& keyword);

/** Returns how leaving a card out changes the part, or null: not at all. **/
const std::string* findConsequence(const std::string& keyword);

/** Returns the parameters supported for a card that is read, or null if its reader checks them. **/
const std::set<std::string>* findParameters(const std::string& keyword);

/** Returns the number of nodes of an element type that meshers write along the skin of a solid; 0
for others. **/
int numSkinNodesOf(const std::string& calculixType);

/** Returns CalculiX's replacement for an Abaqus element type, or null. **/
const std::string* findNearestElement(const std::string& type);

/** Returns why elements of any other type are refused. **/
std::string findElementRefusal(const std::string& type);

/** Returns "; did you mean *NODE?", or "" if no card is similar. **/
std::string proposeCard(const std::string& keyword);

}  // namespace simflex
