#include "DesignParameters.h"

#include <algorithm>
#include <stdexcept>

#include "ThinSections.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NameDistance.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/elements/FeElements.h"

namespace simflex {
namespace {

struct FieldPlace {
    size_t card, line, field;
};

struct NamedNumber {
    std::string name, unit;
    double value = 0;  ///< in units of the deck
    std::vector<FieldPlace> fields;
    std::string where;        ///< location of the first
    std::string differsFrom;  ///< location of a different value under the same name; else empty
};

class NumberFinder {
public:
    explicit NumberFinder(const std::vector<DeckCard>& cards) : m_cards(cards) {}

    std::vector<NamedNumber> find() {
        bool inStep = false;
        for (m_card = 0; m_card < m_cards.size(); ++m_card) {
            const DeckCard& card = m_cards[m_card];
            if (card.keyword == "STEP") inStep = true;
            if (card.keyword == "ENDSTEP") inStep = false;
            if (!inStep && !card.data.empty()) addCard(card);
            if (card.keyword == "MATERIAL" && card.has("NAME")) m_material = card.get("NAME");
        }
        return std::move(m_numbers);
    }

private:
    void addCard(const DeckCard& card) {
        const std::string& keyword = card.keyword;
        if (keyword == "DENSITY") {
            addColumn("density:" + m_material, "kg/m^3");
        } else if (keyword == "ELASTIC") {
            addElastic(card);
        } else if (keyword == "NODALTHICKNESS") {
            add("nodal_thickness", "1", listAll([](size_t, size_t field) { return field > 0; }));
        }
        if (!card.has("ELSET")) return;
        const std::string& set = card.get("ELSET");
        if (keyword == "SHELLSECTION") {
            addThickness(card, set);
        } else if (keyword == "MEMBRANESECTION") {
            add("thickness:" + set, "m", {{m_card, 0, 0}});
        } else if (keyword == "SOLIDSECTION") {
            add("area:" + set, "m^2", {{m_card, 0, 0}});
        } else if (keyword == "BEAMSECTION" || keyword == "BEAMGENERALSECTION") {
            addSection(card, set);
            if (keyword == "BEAMGENERALSECTION") addOwnMaterial(card, set);
        }
    }

    /** Adds E and G in the third line of the section. **/
    void addOwnMaterial(const DeckCard& card, const std::string& set) {
        if (card.has("MATERIAL") || card.data.size() < 3) return;
        add("stiffness:" + set, "1", {{m_card, 2, 0}, {m_card, 2, 1}});
        add("youngs_modulus:" + set, "Pa", {{m_card, 2, 0}});
        add("shear_modulus:" + set, "Pa", {{m_card, 2, 1}});
    }

    /** Adds the first number of each line: a single one by value, several by a factor. **/
    void addColumn(const std::string& name, const std::string& unit) {
        const auto first = listAll([](size_t, size_t field) { return field == 0; });
        add(name, first.size() == 1 ? unit : "1", first);
    }

    /** Adds all moduli; for an isotropic material also E by its own name. **/
    void addElastic(const DeckCard& card) {
        const std::string type = card.has("TYPE") ? card.get("TYPE").substr(0, 3) : "ISO";
        const auto isModulus = [&](size_t line, size_t field) {
            if (type == "ISO") return field == 0;
            if (type == "ENG" || type == "ORT") {
                if (line % 2 == 1) return field == 0;
                return type == "ORT" || field < 3 || field == 6 || field == 7;
            }
            if (type == "LAM") return field < 2 || (field > 2 && field < 6);
            return type == "ANI" && (line % 3 < 2 || field < 5);
        };
        add("stiffness:" + m_material, "1", listAll(isModulus));
        if (type == "ISO" && card.data.size() == 1)
            add("youngs_modulus:" + m_material, "Pa", {{m_card, 0, 0}});
    }

    void addThickness(const DeckCard& card, const std::string& set) {
        if (card.has("NODALTHICKNESS")) return;
        const std::string name = "thickness:" + set;
        if (!card.has("COMPOSITE")) return add(name, "m", {{m_card, 0, 0}});
        add(name, "m", listAll([](size_t, size_t field) { return field == 0; }));
        for (size_t line = 0; line < card.data.size(); ++line)
            add(name + ":" + std::to_string(line + 1), "m", {{m_card, line, 0}});
    }

    void addSection(const DeckCard& card, const std::string& set) {
        const BeamSection* shape =
            card.has("SECTION") ? findBeamSection(card.get("SECTION")) : nullptr;
        if (!shape || card.has("NODALTHICKNESS")) return;
        const auto& fields = card.data[0].fields;
        const auto count = size_t(std::count_if(
            fields.begin(), fields.end(), [](const std::string& field) { return !field.empty(); }));
        const std::vector<const char*> letters =
            *shape == BeamSection::Pipe  ? std::vector{"r", "t"}
            : *shape == BeamSection::Box ? std::vector{"a", "b", "t1", "t2", "t3", "t4"}
            : *shape == BeamSection::Circle && count == 1 ? std::vector{"r"}
                                                          : std::vector{"a", "b"};
        for (size_t k = 0; k < std::min(letters.size(), fields.size()); ++k)
            add("section:" + set + ":" + letters[k], "m", {{m_card, 0, k}});
    }

    template <class IsTaken>
    std::vector<FieldPlace> listAll(const IsTaken& isTaken) const {
        std::vector<FieldPlace> fields;
        const DeckCard& card = m_cards[m_card];
        for (size_t line = 0; line < card.data.size(); ++line)
            for (size_t field = 0; field < card.data[line].fields.size(); ++field)
                if (isTaken(line, field)) fields.push_back({m_card, line, field});
        return fields;
    }

    /** Adds the fields that contain a number. Together they are one parameter, their sum, unless
    the unit is that of a factor. **/
    void add(const std::string& name, const std::string& unit,
             const std::vector<FieldPlace>& fields) {
        NamedNumber number{name, unit, 0, {}, "", ""};
        for (const FieldPlace& at : fields) {
            const DeckCard& card = m_cards[at.card];
            const DeckLine& data = card.data[at.line];
            if (at.field >= data.fields.size() || !isDeckNumber(data.fields[at.field])) continue;
            number.value += parseDeckNumber(data.fields[at.field], card, data);
            if (number.fields.empty()) number.where = card.where(data.line);
            number.fields.push_back(at);
        }
        if (number.fields.empty()) return;
        if (unit == "1") number.value = 1;
        const auto known =
            std::find_if(m_numbers.begin(), m_numbers.end(),
                         [&](const NamedNumber& other) { return other.name == name; });
        if (known == m_numbers.end()) {
            m_numbers.push_back(std::move(number));
            return;
        }
        if (known->value != number.value || known->unit != unit) known->differsFrom = number.where;
        known->fields.insert(known->fields.end(), number.fields.begin(), number.fields.end());
    }

    const std::vector<DeckCard>& m_cards;
    size_t m_card = 0;
    std::string m_material;
    std::vector<NamedNumber> m_numbers;
};

/** Writes a number with at most the digits read by CalculiX, since DeckBuilder would shorten
it. **/
std::string writeDeckNumber(double value) {
    constexpr size_t Longest = 20;
    std::string text;
    for (int digits = 17; text.empty() || text.size() > Longest; --digits)
        text = writeGeneral(value, digits);
    return text;
}

std::vector<DeckCard> scaleNumber(std::vector<DeckCard> cards, const NamedNumber& number,
                                  double factor) {
    for (const FieldPlace& at : number.fields) {
        DeckCard& card = cards[at.card];
        DeckLine& data = card.data[at.line];
        std::string& field = data.fields[at.field];
        field = writeDeckNumber(factor * parseDeckNumber(field, card, data));
    }
    return cards;
}

const NamedNumber& findNumber(const std::vector<NamedNumber>& numbers, const std::string& name) {
    constexpr size_t MostListed = 30;
    std::vector<std::string> known;
    std::string list;
    for (const NamedNumber& number : numbers) {
        if (lowerCase(number.name) == lowerCase(name)) return number;
        known.push_back(number.name);
    }
    for (size_t k = 0; k < std::min(MostListed, known.size()); ++k)
        list += (k > 0 ? ", " : "") + known[k];
    if (known.size() > MostListed)
        list += " and " + std::to_string(known.size() - MostListed) + " more";
    const std::string nearest = findNearestName(name, known);
    throw std::invalid_argument(
        "it has no such number" + (nearest.empty() ? "" : "; did you mean '" + nearest + "'?") +
        (known.empty() ? "" : (nearest.empty() ? "; it has " : " It has ")) + list);
}

bool haveSameNodes(const FeModel& a, const FeModel& b) {
    const FeElements &p = *a.elements, &q = *b.elements;
    if (a.mesh.nodeNumbers != b.mesh.nodeNumbers || p.size() != q.size() ||
        a.constraints.empty() != b.constraints.empty() ||
        a.constraints.numCoordinates != b.constraints.numCoordinates)
        return false;
    for (int e = 0; e < p.size(); ++e)
        if (p.numNodesOf(e) != q.numNodesOf(e) ||
            !std::equal(p.nodesOf(e), p.nodesOf(e) + p.numNodesOf(e), q.nodesOf(e)))
            return false;
    return true;
}

bool differ(const FeModel& a, const FeModel& b) {
    if (a.mesh.positions != b.mesh.positions || a.K.values != b.K.values ||
        a.m.values != b.m.values)
        return true;
    ElementPoints ofA, ofB;
    for (int e = 0; e < a.elements->size(); ++e) {
        a.elements->calcPoints(e, a.mesh, ofA);
        b.elements->calcPoints(e, b.mesh, ofB);
        if (!ofA.haveSameStiffness(ofB) || !ofA.haveSameMass(ofB)) return true;
    }
    return false;
}

std::shared_ptr<const DesignParameter> makeParameter(
    const std::vector<DeckCard>& cards, const NamedNumber& number, const FeModel& model,
    const std::function<FeModel(std::vector<DeckCard>)>& build) {
    if (!number.differsFrom.empty())
        throw std::invalid_argument("it stands for numbers that differ (" + number.where + " " +
                                    number.differsFrom + "): give them names of their own");
    if (!(number.value > 0))
        throw std::invalid_argument(number.where + "it is " + writeGeneral(number.value, 6) +
                                    ", and must be positive: it is changed in proportion");
    auto parameter = std::make_shared<DesignParameter>();
    parameter->name = number.name;
    parameter->unit = number.unit;
    parameter->value = number.value;
    for (size_t k = 0; k < parameter->variants.size(); ++k) {
        FeModel& variant = parameter->variants[k];
        variant = build(
            scaleNumber(cards, number, 1 + DesignParameter::Steps[k] * DesignParameter::Step));
        if (!haveSameNodes(model, variant))
            throw std::invalid_argument(
                number.where +
                "at another value the part has other nodes: elements of other sets with the same "
                "thickness, section or offset share nodes with these, and would have nodes of "
                "their own; put them into one set with one section");
    }
    if (!differ(parameter->variants.front(), parameter->variants.back()))
        throw std::invalid_argument(number.where + "nothing in the part depends on it");
    return parameter;
}

}  // namespace

std::vector<std::shared_ptr<const DesignParameter>> makeDesignParameters(
    const std::vector<DeckCard>& cards, const std::vector<std::string>& names, const FeModel& model,
    const std::function<FeModel(std::vector<DeckCard>)>& build) {
    std::vector<std::shared_ptr<const DesignParameter>> parameters;
    if (names.empty()) return parameters;
    const std::vector<NamedNumber> numbers = NumberFinder(cards).find();
    for (const std::string& name : names) {
        const auto refuse = [&](const std::string& why) {
            throw std::invalid_argument(model.source + ": derivative by '" + name + "': " + why);
        };
        try {
            const NamedNumber& number = findNumber(numbers, name);
            for (const auto& other : parameters)
                if (other->name == number.name) refuse("it is asked for twice");
            parameters.push_back(makeParameter(cards, number, model, build));
        } catch (const std::invalid_argument& error) {
            const std::string text = error.what();
            if (text.find("derivative by '") != std::string::npos) throw;
            refuse(text);
        }
    }
    return parameters;
}

}  // namespace simflex
