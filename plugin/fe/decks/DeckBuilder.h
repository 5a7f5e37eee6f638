#pragma once
/** @file
Builds a DeckModel from the cards of a CalculiX deck. Internal to fe. **/

#include <string>
#include <vector>

#include "DeckModel.h"
#include "ThinElements.h"

namespace simflex {

/** Treatment of contact pairs and gaps. **/
enum class ContactUse { LeftOut, Refused };

/** @throws std::invalid_argument naming file and line for features that a free solid part cannot
have. **/
DeckModel buildDeckModel(const std::string& path, std::vector<DeckCard> cards,
                         ContactUse contact = ContactUse::LeftOut,
                         ShellUse shells = ShellUse::Shells, const ProgressCallback& progress = {});

/** Reads the cards of a deck (.inp), or the equivalent ones of Nastran bulk data (.bdf, .nas, .dat)
or an Ansys model (.cdb).
@throws as their readers. **/
std::vector<DeckCard> readModelCards(const std::string& path, const ProgressCallback& progress = {},
                                     DeckIncludes includes = DeckIncludes::Read);

}  // namespace simflex
