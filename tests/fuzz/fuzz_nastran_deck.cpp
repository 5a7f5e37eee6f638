/** @file
Nastran bulk data as a deck, with a file that it includes. **/

#include "../../plugin/fe/decks/DeckBuilder.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    const std::string path = fuzz::getFolder().write("part.bdf", files[0]);
    fuzz::getFolder().write("more.bdf", files[1]);
    fuzz::accepts([&] { buildDeckModel(path, readModelCards(path)); });
    return 0;
}
