/** @file
CalculiX decks. The elements of an accepted deck have finite matrices or are refused. **/

#include <algorithm>
#include <cmath>

#include "../../plugin/fe/decks/DeckBuilder.h"
#include "../../plugin/fe/decks/DeckElements.h"
#include "../../plugin/fe/elements/ElementAssembly.h"
#include "Fuzz.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const auto files = fuzz::splitFiles(data, size, 2);
    const std::string path = fuzz::getFolder().write("deck.inp", files[0]);
    fuzz::getFolder().write("more.inp", files[1]);
    SymmetricMatrix K, m;
    fuzz::accepts([&] {
        const DeckModel deck = buildDeckModel(path, readModelCards(path));
        assembleElements(makeElements(deck), deck.mesh, K, m, {});
    });
    for (const SymmetricMatrix* A : {&K, &m})
        if (!std::all_of(A->values.begin(), A->values.end(),
                         [](double x) { return std::isfinite(x); }))
            fuzz::fail("an entry is no finite number");
    return 0;
}
