#pragma once
/** @file
Cards of a CalculiX deck that are left out or refused, and its element types. Internal to fe. **/

#include <set>
#include <string>

#include "simflex/part/Mesh.h"

namespace simflex {

/** What becomes of a card, by its keyword without star and blanks: "SOLIDSECTION". Every keyword of
CalculiX 2.20 has its entry. **/
enum class CardUse {
    Read,              ///< nodes, elements, sets, sections, what ties nodes
    MaterialProperty,  ///< child of *MATERIAL that K or M needs
    LeftOutProperty,   ///< child of *MATERIAL that they do not need
    Contact,           ///< contact pairs and their like, left out where that is asked for
    LeftOut,           ///< may stand in the deck of a free solid part, but does not belong to K, M
    Refused,           ///< changes K or M in a way that simflex does not do
    Unknown
};

CardUse findCardUse(const std::string& keyword);

/** Why a card of CardUse::Refused is refused. **/
const std::string& getRefusal(const std::string& keyword);

/** Why a card is refused within a *STEP, or null: all others are left out with their step. **/
const std::string* findStepRefusal(const std::string& keyword);

/** What it changes in a part that a card is left out, or null: nothing. **/
const std::string* findConsequence(const std::string& keyword);

/** The parameters that simflex knows of a card that is read, or null where its reader checks them.
 **/
const std::set<std::string>* findParameters(const std::string& keyword);

/** Number of nodes of an element that meshers write along the skin of a solid; 0 for others. **/
int numSkinNodesOf(const std::string& calculixType);

/** What CalculiX has in place of an element type of Abaqus, or null. **/
const std::string* findNearestElement(const std::string& type);

/** Why elements of a type that is none of those above are refused. **/
std::string findElementRefusal(const std::string& type);

/** "; did you mean *NODE?", or nothing where no card is near. **/
std::string proposeCard(const std::string& keyword);

}  // namespace simflex
