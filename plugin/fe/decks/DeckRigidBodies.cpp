#include "DeckRigidBodies.h"

namespace simflex {

DeckRigidCard readRigidCard(const DeckCard& card) {
    DeckRigidCard body;
    body.card = card;
    if (card.keyword == "COUPLING" || card.has("REFNODE"))
        body.reference = parseDeckInteger(card.get("REFNODE"), card.where());
    if (card.keyword == "COUPLING") {
        body.surface = card.get("SURFACE");
        if (card.has("ORIENTATION")) body.orientation = card.get("ORIENTATION");
        return body;
    }
    if (card.has("ROTNODE")) body.rotation = parseDeckInteger(card.get("ROTNODE"), card.where());
    if (card.has("NSET") + card.has("ELSET") + card.has("TIENSET") != 1)
        refuseCard(card, card.title + " needs either NSET=… or ELSET=…");
    if (card.has("ELSET"))
        body.elementSet = card.get("ELSET");
    else
        body.nodeSet = card.get(card.has("NSET") ? "NSET" : "TIENSET");
    if (!card.data.empty())
        refuseCard(card, card.title + " has a line of data, of which simflex knows nothing",
                   card.data[0].line);
    return body;
}

void readCouplingKind(const DeckCard& card, DeckRigidCard& coupling) {
    coupling.isDistributing = card.keyword == "DISTRIBUTING";
    if (card.data.empty()) return;  // all directions, as in Abaqus
    coupling.axes.fill(false);
    for (const DeckLine& data : card.data) {
        const int first = int(readDeckNumber(card, data, 0, "its first degree of freedom"));
        const int last = data.fields.size() > 1 && !data.fields[1].empty()
                             ? int(readDeckNumber(card, data, 1, ""))
                             : first;
        if (first < 1 || last < first || last > 6)
            refuseCard(card,
                       card.title + " has degrees of freedom " + std::to_string(first) + " to " +
                           std::to_string(last) + ", allowed are 1 to 6",
                       data.line);
        // Nodes of solids have no rotations 4 to 6.
        for (int axis = first; axis <= last && axis <= 3; ++axis)
            coupling.axes[size_t(axis - 1)] = true;
    }
}

}  // namespace simflex
