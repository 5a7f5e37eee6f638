#include "DeckAssembly.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <stdexcept>

#include "DeckGenerators.h"
#include "DeckVocabulary.h"
#include "HingedElements.h"
#include "PointElements.h"
#include "ThinElements.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/Vec3d.h"

namespace simflex {
namespace {

/** x → R (x + t − a) + a **/
struct Placement {
    Vec3d shift{}, point{}, axis{};
    double angle = 0;  ///< [rad]

    bool isTurned() const { return angle != 0; }
    bool isMoved() const { return isTurned() || normOf(shift) > 0; }

    Vec3d turn(const Vec3d& v) const {
        if (!isTurned()) return v;
        const Vec3d side = cross(axis, v);
        Vec3d turned{};
        for (size_t i = 0; i < 3; ++i)
            turned[i] = std::cos(angle) * v[i] + std::sin(angle) * side[i] +
                        (1 - std::cos(angle)) * dot(axis, v) * axis[i];
        return turned;
    }
    Vec3d place(const Vec3d& x) const {
        const Vec3d moved = sumOf(x, 1, shift);
        return isTurned() ? sumOf(point, 1, turn(minus(moved, point))) : moved;
    }
};

Placement readPlacement(const DeckCard& card) {
    Placement placement;
    if (card.data.size() > 2)
        refuseCard(card, "*INSTANCE has more than a translation and a rotation", card.data[2].line);
    if (!card.data.empty())
        for (size_t a = 0; a < 3; ++a)
            placement.shift[a] =
                readDeckNumber(card, card.data[0], a, "three numbers of its translation");
    if (card.data.size() < 2) return placement;
    Vec3d end{};
    for (size_t a = 0; a < 3; ++a) {
        const char* what = "two points and an angle of its rotation";
        placement.point[a] = readDeckNumber(card, card.data[1], a, what);
        end[a] = readDeckNumber(card, card.data[1], a + 3, what);
    }
    placement.angle =
        readDeckNumber(card, card.data[1], 6, "the angle of its rotation") * M_PI / 180;
    const Vec3d line = minus(end, placement.point);
    if (placement.isTurned() && !(normOf(line) > 0))
        refuseCard(card, "the two points of the rotation are the same", card.data[1].line);
    if (placement.isTurned()) placement.axis = scaled(line, 1 / normOf(line));
    return placement;
}

/** Numbers and names of an instance, or of the assembly. **/
struct Scope {
    std::string name, part;
    int line = 0;
    Placement placement;
    std::vector<DeckCard> cards;
    long nodeOffset = 0, elementOffset = 0;
};

enum class NumberKind { Node, Element, Name };

class Flattener {
public:
    Flattener(std::vector<DeckCard> cards, std::vector<std::string>& notes,
              const std::function<void()>& report)
        : m_cards(std::move(cards)), m_notes(notes), m_report(report) {}

    std::vector<DeckCard> flatten() {
        divide();
        long nodes = 0, elements = 0;
        for (Scope& instance : m_instances) {
            instance.nodeOffset = nodes;
            instance.elementOffset = elements;
            countNumbers(instance, nodes, elements);
            if (instance.nodeOffset || instance.elementOffset)
                m_notes.push_back("nodes of instance " + instance.name + " have their number + " +
                                  std::to_string(instance.nodeOffset) + ", elements + " +
                                  std::to_string(instance.elementOffset));
        }
        m_assembly.nodeOffset = nodes;
        m_assembly.elementOffset = elements;
        for (const Scope& instance : m_instances)
            for (DeckCard card : instance.cards) {
                m_report();
                adapt(card, instance, &instance);
                m_result.push_back(std::move(card));
            }
        bool isInStep = false;  // steps are left out
        for (DeckCard& card : m_assembly.cards) {
            m_report();
            const Scope* scope = &m_assembly;
            isInStep |= card.keyword == "STEP";
            if (isInStep) {
                m_result.push_back(std::move(card));
                continue;
            }
            if (card.has("INSTANCE")) {
                scope = &findInstance(card, card.get("INSTANCE"));
                card.parameters.erase("INSTANCE");
            }
            adapt(card, *scope, nullptr);
            m_result.push_back(std::move(card));
        }
        return std::move(m_result);
    }

private:
    /** Assigns cards to parts, instances and the assembly. Cards of the model come last, since they
    refer to the assembly. **/
    void divide() {
        std::map<std::string, std::vector<DeckCard>> parts;
        std::vector<DeckCard>* part = nullptr;
        Scope* instance = nullptr;
        bool isInAssembly = false;
        std::vector<DeckCard> model;
        for (DeckCard& card : m_cards) {
            const std::string& keyword = card.keyword;
            if (keyword == "PART") {
                if (part || isInAssembly) refuseCard(card, "*PART stands within another block");
                part = &parts[card.get("NAME")];
            } else if (keyword == "ENDPART") {
                part = nullptr;
            } else if (keyword == "ASSEMBLY") {
                if (part)
                    refuseCard(card, "*ASSEMBLY stands within a *PART, whose *END PART is missing");
                isInAssembly = true;
                if (card.has("NAME")) m_assembly.name = card.get("NAME");
            } else if (keyword == "ENDASSEMBLY") {
                isInAssembly = false;
                instance = nullptr;
            } else if (keyword == "INSTANCE") {
                m_report();
                m_instances.push_back(makeInstance(card, parts));
                if (!m_indexOf.emplace(m_instances.back().name, m_instances.size() - 1).second)
                    refuseCard(card, "instance " + m_instances.back().name + " is given twice");
                instance = &m_instances.back();
            } else if (keyword == "ENDINSTANCE") {
                instance = nullptr;
            } else if (part) {
                part->push_back(std::move(card));
            } else if (instance) {
                instance->cards.push_back(std::move(card));
            } else if (isInAssembly) {
                m_assembly.cards.push_back(std::move(card));
            } else {
                model.push_back(std::move(card));
            }
        }
        if (m_instances.empty() && !parts.empty()) {
            const auto& [name, cards] = *parts.begin();
            throw std::invalid_argument((cards.empty() ? std::string() : cards[0].where()) +
                                        "the deck has part " + name +
                                        ", but no *INSTANCE of it in an *ASSEMBLY");
        }
        std::set<std::string> used;
        for (const Scope& scope : m_instances) used.insert(scope.part);
        for (const auto& [name, cards] : parts)
            if (!used.count(name))
                m_notes.push_back("left out part " + name + ", of which there is no instance");
        for (const DeckCard& card : m_assembly.cards)
            for (const char* parameter : {"NSET", "ELSET", "NAME"})
                if (card.has(parameter)) m_assemblyNames.insert(card.get(parameter));
        std::move(model.begin(), model.end(), std::back_inserter(m_assembly.cards));
    }

    Scope makeInstance(const DeckCard& card,
                       const std::map<std::string, std::vector<DeckCard>>& parts) const {
        for (const auto& [parameter, value] : card.parameters)
            if (parameter != "NAME" && parameter != "PART")
                refuseCard(card, card.title + " with " + parameter + " is not known to simflex");
        Scope instance;
        instance.name = card.get("NAME");
        instance.part = card.get("PART");
        instance.placement = readPlacement(card);
        const auto part = parts.find(instance.part);
        if (part == parts.end())
            refuseCard(card, "the deck has no *PART " + instance.part + " before its instance");
        instance.cards = part->second;
        return instance;
    }

    const Scope& findInstance(const DeckCard& card, const std::string& name) const {
        const auto found = m_indexOf.find(name);
        if (found != m_indexOf.end()) return m_instances[found->second];
        refuseCard(card, card.title + " names instance " + name + ", which the deck does not have");
    }

    static size_t numNodesOfType(const DeckCard& card) {
        std::string type = card.get("TYPE");
        if (const std::string* nearest = findNearestElement(type)) type = *nearest;
        if (const ThinType* thin = findThinType(type)) return size_t(thin->numNodes);
        if (const ElementType* solid = findSolid(type)) return size_t(numNodesOf(*solid));
        for (const int count : {numPointNodesOf(type), numHingedNodesOf(type)})
            if (count > 0) return size_t(count);
        return size_t(numSkinNodesOf(type));
    }

    /** Calls visit(field, isElement) for the numbers of an *ELEMENT card. **/
    template <class Visit>
    static void visitElements(DeckCard& card, const Visit& visit) {
        const size_t size = numNodesOfType(card) + 1;
        size_t at = 0;
        for (DeckLine& data : card.data) {
            if (size == 1) at = 0;  // a type that will be refused
            for (std::string& field : data.fields) {
                if (field.empty()) continue;
                visit(field, at == 0, data);
                at = (at + 1) % (size == 1 ? 1000 : size);
            }
        }
    }

    /** Raises the counts to the largest numbers of the instance. **/
    static void countNumbers(Scope& instance, long& nodes, long& elements) {
        const long firstNode = nodes, firstElement = elements;
        for (DeckCard& card : instance.cards) {
            if (card.keyword == "NODE")
                for (const DeckLine& data : card.data)
                    nodes = std::max(
                        nodes, firstNode + parseDeckInteger(data.fields[0], card.where(data.line)));
            if (card.keyword == "ELEMENT")
                visitElements(
                    card, [&](const std::string& field, bool isElement, const DeckLine& data) {
                        if (isElement)
                            elements = std::max(
                                elements,
                                firstElement + parseDeckInteger(field, card.where(data.line)));
                    });
        }
    }

    /** Returns the name in the plain deck of a name in an instance. **/
    std::string nameIn(const Scope& instance, const std::string& name) const {
        return m_instances.size() == 1 && !m_assemblyNames.count(name) ? name
                                                                       : instance.name + "." + name;
    }

    /** Converts a number or name of a scope to the plain deck's. **/
    void refer(const DeckCard& card, int line, const Scope& scope, NumberKind kind,
               std::string& field) const {
        if (field.empty()) return;
        const Scope* at = &scope;
        const size_t dot = field.find('.');
        if (dot != std::string::npos && &scope == &m_assembly && isLetter(field[0])) {
            const std::string before = field.substr(0, dot);
            const auto instance = m_indexOf.find(before);
            if (instance != m_indexOf.end()) at = &m_instances[instance->second];
            if (at != &scope || before == m_assembly.name) field = field.substr(dot + 1);
        }
        if (kind == NumberKind::Name || !isDeckNumber(field)) {
            if (at != &m_assembly) field = nameIn(*at, field);
            return;
        }
        const long number = parseDeckInteger(field, card.where(line)) +
                            (kind == NumberKind::Node ? at->nodeOffset : at->elementOffset);
        if (number > std::numeric_limits<int>::max())
            refuseCard(card,
                       "numbers of all instances together go beyond 2147483647; renumber the parts",
                       line);
        field = std::to_string(number);
    }

    /** Moves the three coordinates (or rotates a direction) that start at a field. **/
    static void move(const DeckCard& card, DeckLine& data, size_t first, const Placement& placement,
                     bool isDirection) {
        Vec3d x{};
        for (size_t a = 0; a < 3; ++a)
            if (first + a < data.fields.size() && !data.fields[first + a].empty())
                x[a] = parseDeckNumber(data.fields[first + a], card.where(data.line));
        x = isDirection ? placement.turn(x) : placement.place(x);
        data.fields.resize(std::max(data.fields.size(), first + 3));
        for (size_t a = 0; a < 3; ++a) data.fields[first + a] = writeGeneral(x[a]);
    }

    /** @param owner  the card's instance, null for cards of the assembly **/
    void adapt(DeckCard& card, const Scope& scope, const Scope* owner) const {
        const std::string& keyword = card.keyword;
        const auto rename = [&](const char* parameter, NumberKind kind = NumberKind::Name) {
            const auto found = card.parameters.find(parameter);
            if (found != card.parameters.end() && !found->second.empty())
                refer(card, card.line, owner ? *owner : m_assembly, kind, found->second);
        };
        const auto referAll = [&](size_t first, size_t step, size_t count, NumberKind kind) {
            for (DeckLine& data : card.data)
                for (size_t k = first; k < data.fields.size() && k < count; k += step)
                    refer(card, data.line, scope, kind, data.fields[k]);
        };
        constexpr size_t All = std::numeric_limits<size_t>::max();
        for (const char* parameter : {"NSET", "ELSET", "SURFACE", "ORIENTATION", "TIENSET"})
            rename(parameter);
        rename("REFNODE", NumberKind::Node);
        rename("ROTNODE", NumberKind::Node);
        if (keyword == "SURFACE" || keyword == "ORIENTATION" || keyword == "DISTRIBUTION")
            rename("NAME");

        const Placement& placement = scope.placement;
        if (isGenerator(keyword))
            refuseCard(card, card.title +
                                 " in a part is not known to simflex; write the part out "
                                 "with the nodes and elements that it makes");
        if (keyword == "NODE") {
            referAll(0, 1, 1, NumberKind::Node);
            for (DeckLine& data : card.data)
                if (placement.isMoved()) move(card, data, 1, placement, false);
        } else if (keyword == "ELEMENT") {
            visitElements(card, [&](std::string& field, bool isElement, const DeckLine& data) {
                refer(card, data.line, scope, isElement ? NumberKind::Element : NumberKind::Node,
                      field);
            });
        } else if (keyword == "NSET" || keyword == "ELSET") {
            referAll(0, 1, card.has("GENERATE") ? 2 : All,
                     keyword == "NSET" ? NumberKind::Node : NumberKind::Element);
        } else if (keyword == "SURFACE") {
            const bool isOfNodes = card.has("TYPE") && card.get("TYPE") == "NODE";
            referAll(0, 1, 1, isOfNodes ? NumberKind::Node : NumberKind::Element);
        } else if (keyword == "TIE") {
            referAll(0, 1, 2, NumberKind::Name);
        } else if (keyword == "NODALTHICKNESS" || keyword == "INITIALCONDITIONS") {
            referAll(0, 1, 1, NumberKind::Node);
        } else if (keyword == "MPC") {
            for (DeckLine& data : card.data)
                for (size_t k = isLetter(data.fields[0][0]) ? 1 : 0; k < data.fields.size(); ++k)
                    refer(card, data.line, scope, NumberKind::Node, data.fields[k]);
        } else if (keyword == "EQUATION") {
            if (owner && placement.isTurned())
                refuseCard(
                    card,
                    "*EQUATION stands in a part whose instance is rotated, and simflex does not "
                    "know whether its directions rotate as well; write it in the assembly");
            for (DeckLine& data : card.data)
                for (size_t k = 0; data.fields.size() > 2 && k < data.fields.size(); k += 3)
                    refer(card, data.line, scope, NumberKind::Node, data.fields[k]);
        } else if ((keyword == "ORIENTATION" || keyword == "TRANSFORM") && !card.data.empty()) {
            const char* kind = keyword == "ORIENTATION" ? "SYSTEM" : "TYPE";
            const bool isRectangular = !card.has(kind) || card.get(kind)[0] == 'R';
            std::string& given = card.data[0].fields[0];
            if (keyword == "ORIENTATION" && !given.empty() && isLetter(given[0])) {
                if (!isRectangular && placement.isMoved())
                    refuseCard(card,
                               "a *DISTRIBUTION gives axes that are not rectangular, and its "
                               "instance is moved, which simflex does not support");
                refer(card, card.data[0].line, owner ? *owner : m_assembly, NumberKind::Name,
                      given);
                return;
            }
            for (const size_t first : {size_t(0), size_t(3)})
                if (placement.isMoved()) move(card, card.data[0], first, placement, isRectangular);
        } else if (keyword == "DISTRIBUTION") {
            for (DeckLine& data : card.data) {
                refer(card, data.line, scope, NumberKind::Element, data.fields[0]);
                for (const size_t first : {size_t(1), size_t(4)})
                    if (placement.isTurned()) move(card, data, first, placement, true);
            }
        } else if (keyword == "NORMAL") {
            for (DeckLine& data : card.data) {
                refer(card, data.line, scope, NumberKind::Element, data.fields[0]);
                if (data.fields.size() > 1)
                    refer(card, data.line, scope, NumberKind::Node, data.fields[1]);
                if (placement.isTurned()) move(card, data, 2, placement, true);
            }
        } else if (keyword == "SHELLSECTION" && card.has("COMPOSITE")) {
            for (DeckLine& data : card.data)
                if (data.fields.size() > 3 && !isDeckNumber(data.fields[3]))
                    refer(card, data.line, scope, NumberKind::Name, data.fields[3]);
        } else if ((keyword == "BEAMSECTION" || keyword == "BEAMGENERALSECTION") &&
                   placement.isTurned()) {
            if (card.data.size() < 2)
                refuseCard(card, "the instance is rotated; give the axis n1 of the section");
            move(card, card.data[1], 0, placement, true);
        }
    }

    std::vector<DeckCard> m_cards, m_result;
    std::vector<std::string>& m_notes;
    const std::function<void()>& m_report;
    std::vector<Scope> m_instances;
    std::map<std::string, size_t> m_indexOf;  ///< of an instance, by name
    Scope m_assembly;
    std::set<std::string> m_assemblyNames;
};

/** Axes and origin given by a *SYSTEM. **/
struct NodeSystem {
    Vec3d origin{}, x{1, 0, 0}, y{0, 1, 0}, z{0, 0, 1};

    Vec3d place(const Vec3d& local) const {
        return sumOf(sumOf(sumOf(origin, local[0], x), local[1], y), local[2], z);
    }
};

NodeSystem readNodeSystem(const DeckCard& card) {
    constexpr double Level = 1e-6;  // sine of an angle
    const auto hasPoint = [&](size_t line, size_t first) {
        return line < card.data.size() && card.data[line].fields.size() > first;
    };
    const auto readPoint = [&](size_t line, size_t first) {
        Vec3d point{};
        for (size_t a = 0; a < 3; ++a)
            point[a] = readDeckNumber(card, card.data[line], first + a,
                                      "points a and b, and below them c, of three numbers each");
        return point;
    };
    NodeSystem system;
    if (!hasPoint(0, 0)) return system;
    system.origin = readPoint(0, 0);
    if (!hasPoint(0, 3)) return system;
    const Vec3d along = minus(readPoint(0, 3), system.origin);
    const double length = normOf(along);
    if (!(length > 0)) refuseCard(card, "points a and b of *SYSTEM are the same");
    system.x = scaled(along, 1 / length);
    if (hasPoint(1, 0)) {
        const Vec3d up = cross(system.x, minus(readPoint(1, 0), system.origin));
        if (!(normOf(up) > Level * length))
            refuseCard(card, "the three points of *SYSTEM are on a line", card.data[1].line);
        system.z = scaled(up, 1 / normOf(up));
    } else if (std::abs(system.x[2]) > Level) {
        refuseCard(card,
                   "without its point c the z axis of *SYSTEM is the deck's, and a and b lie "
                   "beside each other at the same z");
    }
    system.y = cross(system.z, system.x);
    return system;
}

void placeNodes(DeckCard& card, const NodeSystem& system) {
    const std::string kind = card.has("SYSTEM") ? card.get("SYSTEM") : "R";
    card.parameters.erase("SYSTEM");
    if (kind != "R" && kind != "C")
        refuseCard(card, "*NODE with SYSTEM=" + kind + " is not known: give plain coordinates");
    for (DeckLine& data : card.data) {
        if (data.fields.size() < 4) data.fields.resize(4);
        Vec3d x{};
        for (size_t a = 0; a < 3; ++a)
            if (!data.fields[a + 1].empty())
                x[a] = readDeckNumber(card, data, a + 1, "the three coordinates of a node");
        if (kind == "C") {
            const double angle = x[1] * M_PI / 180;
            x = {x[0] * std::cos(angle), x[0] * std::sin(angle), x[2]};
        }
        x = system.place(x);
        for (size_t a = 0; a < 3; ++a) data.fields[a + 1] = writeGeneral(x[a]);
    }
}

/** Transforms nodes to the axes of the deck, or of its parts. **/
std::vector<DeckCard> placeSystems(std::vector<DeckCard> cards) {
    std::vector<DeckCard> placed;
    std::optional<NodeSystem> system;
    for (DeckCard& card : cards) {
        const std::string& keyword = card.keyword;
        if (keyword == "SYSTEM") {
            system.reset();
            if (!card.data.empty()) system = readNodeSystem(card);
            continue;
        }
        if (keyword == "PART" || keyword == "ENDPART" || keyword == "INSTANCE" ||
            keyword == "ENDINSTANCE")
            system.reset();
        if (system && isGenerator(keyword))
            refuseCard(card, card.title +
                                 " between *SYSTEM cards is not known to simflex; end the "
                                 "system before it by a *SYSTEM without data");
        if (keyword == "NODE" && (system || card.has("SYSTEM")))
            placeNodes(card, system.value_or(NodeSystem()));
        placed.push_back(std::move(card));
    }
    return placed;
}

}  // namespace

std::vector<DeckCard> flattenAssembly(std::vector<DeckCard> given, std::vector<std::string>& notes,
                                      const std::function<void()>& report) {
    std::vector<DeckCard> cards = placeSystems(std::move(given));
    const bool isFlat = std::none_of(cards.begin(), cards.end(), [](const DeckCard& card) {
        return card.keyword == "PART" || card.keyword == "INSTANCE" || card.keyword == "ASSEMBLY";
    });
    return isFlat ? std::move(cards) : Flattener(std::move(cards), notes, report).flatten();
}

}  // namespace simflex
