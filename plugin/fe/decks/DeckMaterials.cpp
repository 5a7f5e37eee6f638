#include "DeckMaterials.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <sstream>
#include <stdexcept>

#include "DeckElasticity.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

struct MaterialCards {
    DeckCard card;
    std::optional<DeckCard> elastic, density;
    bool isUsed = false;
    std::optional<double> temperature;
    int node = 0;  ///< a node with this temperature

    DeckLine given;  ///< first line of *ELASTIC

    bool isIsotropic() const {
        return !elastic->has("TYPE") || elastic->get("TYPE").substr(0, 3) == "ISO";
    }
    bool isLamina() const {
        return elastic && elastic->has("TYPE") && elastic->get("TYPE").substr(0, 3) == "LAM";
    }
    bool dependsOnTemperature() const;
};

/** Returns the number of constants on each line of *ELASTIC; the temperature may follow the
last. **/
std::vector<size_t> getLayout(const DeckCard& card) {
    if (card.keyword == "DENSITY") return {1};
    const std::string type = card.has("TYPE") ? card.get("TYPE").substr(0, 3) : "ISO";
    if (type == "ISO") return {2};
    if (type == "ENG" || type == "ORT") return {8, 1};
    if (type == "LAM") return {6};
    if (type == "ANI") return {8, 8, 5};
    refuseCard(card,
               card.title + ": TYPE=" + card.get("TYPE") +
                   " is not known; known are ISO, ENGINEERING CONSTANTS, LAMINA, ORTHO and ANISO");
}

/** Constants at one temperature. **/
struct Entry {
    double temperature = 0;
    std::vector<double> constants;
};

std::vector<Entry> readEntries(const DeckCard& card) {
    const std::vector<size_t> layout = getLayout(card);
    const std::string what = card.keyword == "DENSITY" ? "the density"
                             : layout.size() == 1 && layout[0] == 2
                                 ? "Young's modulus and Poisson's ratio, with a comma between"
                                 : "all its constants";
    if (card.data.empty() || card.data.size() % layout.size() != 0)
        refuseCard(card,
                   card.title + " has " +
                       (card.data.empty()       ? std::string("no numbers")
                        : card.data.size() == 1 ? std::string("one line")
                                                : std::to_string(card.data.size()) + " lines") +
                       ", needs " + what + (layout.size() > 1 ? ", in lines of eight" : "") +
                       ", for each temperature");
    std::vector<Entry> entries;
    for (size_t first = 0; first < card.data.size(); first += layout.size()) {
        Entry entry;
        for (size_t l = 0; l < layout.size(); ++l) {
            const DeckLine& data = card.data[first + l];
            const bool isLast = l + 1 == layout.size();
            for (size_t k = 0; k < layout[l]; ++k)
                entry.constants.push_back(readDeckNumber(card, data, k, what.c_str()));
            if (isLast && data.fields.size() > layout[l] && !data.fields[layout[l]].empty())
                entry.temperature =
                    readDeckNumber(card, data, layout[l], "the temperature behind its constants");
            for (size_t k = layout[l] + (isLast ? 1 : 0); k < data.fields.size(); ++k)
                if (!data.fields[k].empty())
                    refuseCard(card,
                               card.title + " has '" + data.fields[k] +
                                   "' behind its constants and temperature; is a comma too many?",
                               data.line);
        }
        if (!entries.empty() && !(entry.temperature > entries.back().temperature))
            refuseCard(card, card.title + ": temperatures must ascend", card.data[first].line);
        entries.push_back(std::move(entry));
    }
    return entries;
}

bool differs(const DeckCard& card) {
    const auto entries = readEntries(card);
    return std::any_of(entries.begin(), entries.end(),
                       [&](const Entry& e) { return e.constants != entries[0].constants; });
}

bool MaterialCards::dependsOnTemperature() const {
    return differs(*elastic) || differs(*density);
}

/** Reduces a card to the constants at one temperature; a temperature-independent material has
none. **/
void settle(DeckCard& card, std::optional<double> temperature) {
    const auto entries = readEntries(card);
    std::vector<double> constants = entries[0].constants;
    if (temperature && differs(card)) {
        const auto above = std::find_if(entries.begin(), entries.end(), [&](const Entry& e) {
            return e.temperature >= *temperature;
        });
        if (above == entries.end()) {
            constants = entries.back().constants;
        } else if (above != entries.begin()) {
            const auto below = above - 1;
            const double share =
                (*temperature - below->temperature) / (above->temperature - below->temperature);
            if (share < 1 && card.has("TYPE") && card.get("TYPE").compare(0, 3, "ENG") == 0)
                refuseCard(card,
                           "simflex does not interpolate ENGINEERING CONSTANTS over temperature, "
                           "which CalculiX does by the stiffness made of them; give them at the "
                           "part's temperature");
            for (size_t k = 0; k < constants.size(); ++k)
                constants[k] =
                    below->constants[k] + share * (above->constants[k] - below->constants[k]);
        }
    }
    const bool isGiven = constants == entries[0].constants;
    size_t next = 0;
    std::vector<DeckLine> lines;
    for (const size_t count : getLayout(card)) {
        DeckLine line = card.data[lines.size()];
        line.fields.resize(count);
        for (size_t k = 0; k < count; ++k, ++next) {
            if (isGiven) continue;
            char text[40];
            std::snprintf(text, sizeof text, "%.13E", constants[next]);
            line.fields[k] = text;
        }
        lines.push_back(std::move(line));
    }
    card.data = std::move(lines);
}

std::map<std::string, MaterialCards> readMaterials(const std::vector<DeckCard>& cards) {
    std::map<std::string, MaterialCards> materials;
    MaterialCards* material = nullptr;
    for (const DeckCard& card : cards) {
        if (card.keyword == "MATERIAL") {
            const auto [found, isNew] = materials.emplace(card.get("NAME"), MaterialCards{});
            if (!isNew) refuseCard(card, "material " + card.get("NAME") + " is given twice");
            material = &found->second;
            material->card = card;
            continue;
        }
        std::optional<DeckCard>& property =
            card.keyword == "ELASTIC" ? material->elastic : material->density;
        if (property)
            refuseCard(card, "material " + material->card.get("NAME") + " has two " + card.title);
        property = card;
    }
    return materials;
}

/** Sets the temperature of a material to that of its elements' nodes, which must be uniform. **/
void takeTemperature(const DeckTemperatures& temperatures, int element,
                     const std::vector<int>& nodes, MaterialCards& material) {
    const std::string name = "material " + material.card.get("NAME");
    for (const int node : nodes) {
        const auto found = temperatures.ofNode.find(node);
        if (found == temperatures.ofNode.end())
            refuseCard(material.card,
                       name + " depends on temperature, but node " + std::to_string(node) +
                           " of element " + std::to_string(element) +
                           " has none; give it by *INITIAL CONDITIONS, TYPE=TEMPERATURE");
        if (!material.temperature) {
            material.temperature = found->second;
            material.node = node;
        } else if (*material.temperature != found->second) {
            std::ostringstream text;
            text << name << " depends on temperature, and its elements have several: "
                 << *material.temperature << " at node " << material.node << ", " << found->second
                 << " at node " << node
                 << ". simflex takes one temperature for a material; divide the elements into "
                    "materials of their own temperatures";
            refuseCard(material.card, text.str());
        }
    }
}

/** As above for one element of the material. **/
void settleTemperature(const DeckTemperatures& temperatures, const DeckModel::Solid& solid,
                       MaterialCards& material) {
    if (temperatures.inStep)
        refuseCard(*temperatures.inStep,
                   "*TEMPERATURE of a step, but material " + material.card.get("NAME") +
                       " depends on temperature, and the part is taken as it is before all steps; "
                       "give its temperature by *INITIAL CONDITIONS, TYPE=TEMPERATURE and take "
                       "*TEMPERATURE out");
    const auto thin = temperatures.thinNodes.find(solid.number);
    takeTemperature(temperatures, solid.number,
                    thin == temperatures.thinNodes.end() ? solid.nodes : thin->second, material);
}

}  // namespace

void settleMaterials(const DeckTemperatures& temperatures, DeckModel& deck) {
    std::map<std::string, MaterialCards> materials = readMaterials(deck.materials);
    std::unordered_map<int, MaterialCards*> materialOf;
    std::unordered_map<int, std::vector<MaterialCards*>> materialsOf;  // layered shells
    const auto findMaterial = [&](const DeckCard& section, const std::string& name) {
        const auto material = materials.find(name);
        if (material == materials.end()) refuseCard(section, "the deck has no material " + name);
        return &material->second;
    };
    const auto checkOrientation = [&](const DeckCard& section) {
        for (const DeckCard& card : deck.sections)
            if (card.keyword == "ORIENTATION" && card.get("NAME") == section.get("ORIENTATION"))
                return void(parseOrientation(card));
        refuseCard(section, "the deck has no *ORIENTATION " + section.get("ORIENTATION"));
    };
    for (const DeckCard& card : deck.sections) {
        if (card.keyword != "SOLIDSECTION") continue;
        if (card.has("ORIENTATION")) checkOrientation(card);
        MaterialCards* material = findMaterial(card, card.get("MATERIAL"));
        const auto set = deck.elementSets.find(card.get("ELSET"));
        if (set == deck.elementSets.end()) continue;  // no solids
        bool isTold = false;
        for (const int number : set->second) {
            MaterialCards*& own = materialOf[number];
            if (own && own != material && !isTold)
                deck.warnings.push_back(card.where() + "element " + std::to_string(number) +
                                        " has a section of another material before: as in "
                                        "CalculiX the last one holds");
            isTold |= own && own != material;
            own = material;
        }
    }
    for (const DeckCard& card : deck.sections) {
        if (card.keyword != LayersCard) continue;
        for (const int number : deck.elementSets.at(card.get("ELSET"))) {
            const auto layers = deck.layersOf.find(number);
            if (layers == deck.layersOf.end()) continue;
            materialsOf[number].clear();
            for (const DeckLayer& layer : layers->second)
                materialsOf[number].push_back(findMaterial(card, layer.material));
        }
    }
    for (const HingedElement& element : deck.hinged) {
        const auto material = materials.find(element.material);
        if (material == materials.end())
            throw std::invalid_argument(element.where + "the deck has no material " +
                                        element.material);
        material->second.isUsed = true;
    }
    for (auto& [number, material] : materialOf) material->isUsed = true;
    for (auto& [number, all] : materialsOf)
        for (MaterialCards* material : all) material->isUsed = true;
    deck.sections.erase(std::remove_if(deck.sections.begin(), deck.sections.end(),
                                       [&](const DeckCard& card) {
                                           return card.keyword == "SOLIDSECTION" &&
                                                  !materials.at(card.get("MATERIAL")).isUsed;
                                       }),
                        deck.sections.end());
    for (auto& [name, material] : materials) {
        if (!material.isUsed) continue;
        for (const auto& [property, what] :
             {std::make_pair(&material.elastic, "*ELASTIC, so that its elements have no stiffness"),
              std::make_pair(&material.density, "*DENSITY, so that its elements have no mass")})
            if (!*property) refuseCard(material.card, "material " + name + " has no " + what);
        for (const Entry& entry : readEntries(*material.density))
            if (!(entry.constants[0] > 0))
                refuseCard(*material.density, "*DENSITY is " + writeGeneral(entry.constants[0], 6) +
                                                  "; it must be positive");
    }
    std::unordered_map<const MaterialCards*, bool> depends;
    for (auto& [name, material] : materials)
        depends[&material] = material.isUsed && material.dependsOnTemperature();
    size_t numBare = 0;
    int bare = 0;
    for (const auto& [type, solids] : deck.solids)
        for (const auto& solid : solids) {
            const auto layered = materialsOf.find(solid.number);
            const auto found = materialOf.find(solid.number);
            if (found != materialOf.end() && found->second->isLamina() &&
                !temperatures.thinNodes.count(solid.number))
                refuseCard(*found->second->elastic,
                           "TYPE=LAMINA is a law of shells, but element " +
                               std::to_string(solid.number) +
                               " is a solid; give it ENGINEERING CONSTANTS");
            if (layered != materialsOf.end()) {
                for (MaterialCards* material : layered->second)
                    if (depends[material]) settleTemperature(temperatures, solid, *material);
            } else if (found == materialOf.end()) {
                if (numBare++ == 0) bare = solid.number;
            } else if (depends[found->second]) {
                settleTemperature(temperatures, solid, *found->second);
            }
        }
    for (const HingedElement& element : deck.hinged) {
        MaterialCards& material = materials.at(element.material);
        if (depends[&material])
            settleTemperature(temperatures, {element.number, element.nodes}, material);
    }
    if (numBare)
        throw std::invalid_argument(
            deck.path + ": element " + std::to_string(bare) +
            (numBare > 1 ? " and " + std::to_string(numBare - 1) + " more have" : " has") +
            " no material; give every element one by a *SOLID SECTION of its element set");

    deck.materials.clear();
    for (auto& [name, material] : materials) {
        if (!material.isUsed) continue;
        material.given = material.elastic->data[0];
        settle(*material.elastic, material.temperature);
        settle(*material.density, material.temperature);
        parseElasticLaw(*material.elastic);  // checks the constants
        if (const DeckLine& line = material.given;
            line.fields.size() == 3 && line.fields[1] == "0" && material.isIsotropic())
            deck.warnings.push_back(material.elastic->where(line.line) +
                                    "*ELASTIC has Poisson's ratio 0 at temperature " +
                                    line.fields[2] + ": is a comma in place of a decimal point?");
        if (material.temperature) {
            std::ostringstream text;
            text << material.card.where() << "material " << name << " is taken at temperature "
                 << *material.temperature;
            deck.notes.push_back(text.str());
        }
        for (DeckCard* card : {&material.card, &*material.elastic, &*material.density})
            deck.materials.push_back(std::move(*card));
    }
}

}  // namespace simflex
