#pragma once
/** @file
Reads the cards of a CalculiX deck into a DeckModel. Internal to fe. **/

#include <string>
#include <vector>

#include "DeckModel.h"
#include "ThinElements.h"

namespace simflex {

/** What becomes of contact pairs and gaps. **/
enum class ContactUse { LeftOut, Refused };

/** @throws std::invalid_argument naming file and line for what cannot be a free solid part. **/
DeckModel buildDeckModel(const std::string& path, std::vector<DeckCard> cards,
                         ContactUse contact = ContactUse::LeftOut,
                         ShellUse shells = ShellUse::Shells);

/** The cards of a deck (.inp), or what stands for them in Nastran bulk data (.bdf, .nas, .dat) or a
model of Ansys (.cdb).
@throws as their readers. **/
std::vector<DeckCard> readModelCards(const std::string& path,
                                     const ProgressCallback& progress = {});

}  // namespace simflex
