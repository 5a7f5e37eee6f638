#include "ThinSections.h"

#include <string>

namespace simflex {
namespace {

/** CalculiX turns the axes of a material into each shell; only without axes is that no matter.
 * **/
void checkIsotropic(const DeckCard& section, const std::vector<DeckCard>& materials) {
    const std::string& name = section.get("MATERIAL");
    bool isInside = false;
    for (const DeckCard& card : materials) {
        if (card.keyword == "MATERIAL") isInside = card.get("NAME") == name;
        if (!isInside || card.keyword != "ELASTIC" || !card.has("TYPE")) continue;
        if (card.get("TYPE") != "ISO" && card.get("TYPE") != "ISOTROPIC")
            refuseCard(section, "material " + name +
                                    " is not isotropic, which simflex does not do in shells and "
                                    "beams; mesh the part with solids");
    }
}

}  // namespace

ThinElement readThinSection(const DeckCard& card, const std::vector<DeckCard>& materials) {
    const bool isBeam = card.keyword == "BEAMSECTION";
    ThinElement section;
    for (const auto& [parameter, value] : card.parameters) {
        const std::string where = card.where();
        if (parameter == "ELSET" || parameter == "MATERIAL" || parameter == "SECTION") continue;
        if (parameter == "NODALTHICKNESS") {
            section.hasNodalThickness = true;
        } else if (parameter == (isBeam ? "OFFSET1" : "OFFSET")) {
            section.offset[0] = parseDeckNumber(value, where);
        } else if (isBeam && parameter == "OFFSET2") {
            section.offset[1] = parseDeckNumber(value, where);
        } else if (parameter == "COMPOSITE") {
            refuseCard(card,
                       "composite shells are not known to simflex; mesh the layers as solids");
        } else {
            refuseCard(card, card.title + " with " + parameter + " is not known to simflex");
        }
    }
    checkIsotropic(card, materials);
    if (isBeam) {
        const std::string shape = card.get("SECTION").substr(0, 4);  // as ccx: RECTANGULAR too
        if (shape != "RECT" && shape != "CIRC")
            refuseCard(card,
                       "section " + card.get("SECTION") +
                           " has no geometry of its own in CalculiX; use RECT or CIRC, or mesh "
                           "the beam with shells or solids");
        if (shape == "CIRC") section.section = BeamSection::Circle;
    }
    size_t line = 0;
    if (!section.hasNodalThickness) {
        if (card.data.empty()) refuseCard(card, card.title + " needs its thickness");
        section.thickness[0] = readDeckNumber(card, card.data[0], 0, "its thickness");
        section.thickness[1] = card.data[0].fields.size() > 1 && isBeam
                                   ? readDeckNumber(card, card.data[0], 1, "its second thickness")
                                   : section.thickness[0];
        line = 1;
    } else if (isBeam && !card.data.empty()) {
        line = 1;
    }
    if (isBeam && line < card.data.size())
        for (size_t a = 0; a < 3; ++a)
            section.n1[a] =
                readDeckNumber(card, card.data[line], a, "three numbers of its axis n1");
    if (normOf(section.n1) == 0) refuseCard(card, "the axis n1 of the beam is zero");
    return section;
}

}  // namespace simflex
