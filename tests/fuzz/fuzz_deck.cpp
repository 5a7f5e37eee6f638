/** @file
CalculiX decks: cards and what they mean. An accepted deck without ties, masses, springs and trusses
(they do not belong to the clean deck), written clean, reads back the same. **/

#include <sstream>

#include "../../plugin/fe/decks/DeckBuilder.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    const std::string path = fuzz::getFolder().write("deck.inp", files[0]);
    fuzz::getFolder().write("more.inp", files[1]);
    std::string clean;
    bool isTied = false;
    Mesh mesh;
    if (!fuzz::accepts([&] {
            const DeckModel deck = buildDeckModel(path, readModelCards(path));
            std::ostringstream out;
            deck.writeModel(out);
            clean = out.str();
            mesh = deck.mesh;
            isTied = !deck.constraints.empty() || !deck.masses.empty() || !deck.springs.empty() ||
                     !deck.hinged.empty();
        }) ||
        isTied)
        return 0;
    const std::string cleanPath = fuzz::getFolder().write("clean.inp", clean);
    const Mesh same = buildDeckModel(cleanPath, readModelCards(cleanPath)).mesh;
    if (same.nodeNumbers != mesh.nodeNumbers) fuzz::fail("the clean deck has other nodes");
    if (same.elements.size() != mesh.elements.size()) fuzz::fail("the clean deck has other blocks");
    for (size_t k = 0; k < mesh.elements.size(); ++k)
        if (same.elements[k].nodes != mesh.elements[k].nodes)
            fuzz::fail("the clean deck has other elements");
    return 0;
}
