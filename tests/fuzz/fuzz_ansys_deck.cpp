/** @file
Models of Ansys as decks. **/

#include "../../plugin/fe/decks/DeckBuilder.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    const std::string path = fuzz::getFolder().write("part.cdb", text);
    fuzz::accepts([&] { buildDeckModel(path, readModelCards(path)); });
    return 0;
}
