#include "DeckElements.h"

#include <map>
#include <stdexcept>
#include <tuple>
#include <unordered_map>

#include "DeckElasticity.h"

namespace simflex {
namespace {

class ElementMaker {
public:
    explicit ElementMaker(const DeckModel& deck) : m_deck(deck) {
        addMaterials();
        for (const DeckCard& card : deck.sections) {
            if (card.keyword == "ORIENTATION")
                m_orientations[card.get("NAME")] =
                    m_elements.addOrientation(parseOrientation(card));
            if (card.keyword != "SOLIDSECTION") continue;
            const auto members = deck.elementSets.find(card.get("ELSET"));
            if (members == deck.elementSets.end()) continue;  // no solids
            for (const int number : members->second) m_sectionOf[number] = &card;
        }
    }

    FeElements make() {
        std::unordered_map<int, int> indexOf;
        indexOf.reserve(m_deck.mesh.nodeNumbers.size());
        for (const int number : m_deck.mesh.nodeNumbers)
            indexOf.emplace(number, int(indexOf.size()));
        int internal = m_deck.mesh.numNodes() - m_deck.mesh.numInternalNodes;
        std::vector<int> nodes;
        for (const auto& [type, solids] : m_deck.solids)
            for (const auto& solid : solids) {
                nodes.clear();
                for (const int number : solid.nodes) nodes.push_back(indexOf.at(number));
                if (type == IncompatibleSolid)
                    for (int k = 0; k < 3; ++k) nodes.push_back(internal++);
                m_elements.addElement(solid.number, findMakeup(type, solid.number), nodes);
            }
        m_elements.beside.hasSprings = !m_deck.springs.empty();
        m_elements.beside.hasHinged = !m_deck.hinged.empty();
        m_elements.beside.rigidBodies = m_deck.rigidBodies;
        m_elements.beside.hasOtherBodies = m_deck.hasOtherBodies;
        return std::move(m_elements);
    }

private:
    void addMaterials() {
        std::string name;
        std::map<std::string, FeElements::Material> materials;
        for (const DeckCard& card : m_deck.materials) {
            if (card.keyword == "MATERIAL") name = card.get("NAME");
            if (card.keyword == "DENSITY")
                materials[name].density = readDeckNumber(card, card.data.at(0), 0, "the density");
            if (card.keyword != "ELASTIC") continue;
            materials[name].law = parseElasticLaw(card);
            if (!card.has("TYPE") || card.get("TYPE").compare(0, 3, "ISO") == 0)
                materials[name].young = readDeckNumber(card, card.data.at(0), 0, "Young's modulus");
        }
        for (const auto& [known, material] : materials) {
            m_materials[known] = m_elements.addMaterial(material);
            m_known[m_materials[known]] = material;
        }
    }

    ElementLayer makeLayer(double thickness, const std::string& material,
                           const std::string& orientation, int number) {
        const auto found = m_materials.find(material);
        if (found == m_materials.end())
            throw std::invalid_argument("element " + std::to_string(number) +
                                        " is made of material " + material +
                                        ", which the deck does not have");
        const int own = addDensity(found->second, number);
        if (orientation.empty()) return {thickness, own, -1};
        const auto axes = m_orientations.find(orientation);
        if (axes == m_orientations.end())
            throw std::invalid_argument("element " + std::to_string(number) +
                                        " has the axes of *ORIENTATION " + orientation +
                                        ", which the deck does not have");
        return {thickness, own, axes->second};
    }

    /** The material, or one that weighs more by what an element has added. **/
    int addDensity(int material, int element) {
        const auto added = m_deck.addedDensity.find(element);
        if (added == m_deck.addedDensity.end()) return material;
        const auto [heavier, isNew] = m_heavier.insert({{material, added->second}, 0});
        if (isNew) {
            FeElements::Material copy = m_known.at(material);
            copy.density += added->second;
            heavier->second = m_elements.addMaterial(copy);
        }
        return heavier->second;
    }

    int findMakeup(const std::string& type, int number) {
        const auto layers = m_deck.layersOf.find(number);
        if (layers != m_deck.layersOf.end()) {
            std::vector<ElementLayer> made;
            for (const DeckLayer& layer : layers->second)
                made.push_back(
                    makeLayer(layer.thickness, layer.material, layer.orientation, number));
            return m_elements.addMakeup(type, made);
        }
        const auto section = m_sectionOf.find(number);
        if (section == m_sectionOf.end())
            throw std::invalid_argument("element " + std::to_string(number) +
                                        " is in no *SOLID SECTION, so it has no material");
        const auto rule = m_deck.beamRuleOf.find(number);
        const bool isFull = rule == m_deck.beamRuleOf.end();
        const auto added = m_deck.addedDensity.find(number);
        const auto [makeup, isNew] = m_makeups.insert(
            {{type, section->second, isFull ? m_deck.beamRules.size() : rule->second,
              added == m_deck.addedDensity.end() ? 0 : added->second},
             0});
        if (isNew) {
            const DeckCard& card = *section->second;
            makeup->second = m_elements.addMakeup(
                type,
                {makeLayer(1, card.get("MATERIAL"),
                           card.has("ORIENTATION") ? card.get("ORIENTATION") : "", number)},
                isFull ? BeamRule() : m_deck.beamRules[rule->second]);
        }
        return makeup->second;
    }

    const DeckModel& m_deck;
    FeElements m_elements;
    std::map<std::string, int> m_materials, m_orientations;
    std::unordered_map<int, const DeckCard*> m_sectionOf;  ///< the last one holds
    std::map<std::tuple<std::string, const DeckCard*, size_t, double>, int> m_makeups;
    std::map<int, FeElements::Material> m_known;      ///< the deck's
    std::map<std::pair<int, double>, int> m_heavier;  ///< materials by what they have more
};

}  // namespace

FeElements makeElements(const DeckModel& deck) {
    return ElementMaker(deck).make();
}

}  // namespace simflex
