#include "DeckBuilder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <unordered_map>

#include "AnsysDeck.h"
#include "DeckAssembly.h"
#include "DeckConstraints.h"
#include "DeckElasticity.h"
#include "DeckGenerators.h"
#include "DeckMaterials.h"
#include "DeckOrientations.h"
#include "DeckParameters.h"
#include "DeckRigidBodies.h"
#include "DeckVocabulary.h"
#include "ElementShapes.h"
#include "IncompatibleModes.h"
#include "LockingElements.h"
#include "NastranDeck.h"
#include "PointElements.h"
#include "ThinSections.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/Memory.h"
#include "simflex/base/NameDistance.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

constexpr size_t LongestField = 20;       // characters of a number read by ccx
constexpr long MostGenerated = 20000000;  // numbers, nodes and elements made by all cards
constexpr double BytesPerGenerated = 500;

std::string plural(size_t count, const std::string& noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

void sortUnique(std::vector<int>& values) {
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
}

/** A set of numbers, mostly contiguous from 1. **/
class NumberSet {
public:
    void insert(int number) {
        if (number < 0 || number >= MostFlags) {
            m_others.insert(number);
            return;
        }
        if (size_t(number) >= m_flags.size())
            m_flags.resize(std::max(size_t(number) + 1, 2 * m_flags.size()));
        m_flags[size_t(number)] = true;
    }
    bool has(int number) const {
        return number >= 0 && number < MostFlags
                   ? size_t(number) < m_flags.size() && m_flags[size_t(number)]
                   : m_others.count(number) > 0;
    }

private:
    static constexpr int MostFlags = 100000000;
    std::vector<bool> m_flags;
    std::set<int> m_others;
};

class Builder {
public:
    Builder(const std::string& path, std::vector<DeckCard> cards, ContactUse contact,
            ShellUse shells, const ProgressCallback& progress)
        : m_progress(progress), m_contact(contact), m_shells(shells) {
        m_model.path = path;
        m_cards = flattenAssembly(std::move(cards), m_model.notes, [this] { report(); });
    }

    DeckModel build() {
        bool inStep = false;
        DeckCard* material = nullptr;
        DeckRigidCard* coupling = nullptr;  // the previous card, if its type is still to come
        // Nodes may be defined after their elements.
        for (const DeckCard& card : m_cards) {
            if (card.keyword == "STEP") inStep = true;
            if (card.keyword == "ENDSTEP") inStep = false;
            if (inStep || card.keyword != "NODE") continue;
            checkParameters(card);
            addNodes(card);
        }
        inStep = false;
        for (DeckCard& card : m_cards) {
            report();
            const std::string& keyword = card.keyword;
            if (keyword == NoteCard) {
                m_model.notes.push_back(card.title);
                continue;
            }
            if (keyword == "STEP") inStep = true;
            if (inStep) {
                if (const std::string* reason = findStepRefusal(keyword))
                    refuseCard(card, card.title + " of a step cannot be left out: " + *reason);
                if (keyword == "TEMPERATURE" && !m_temperatures.inStep)
                    m_temperatures.inStep = &card;
                noteLeftOut(keyword == "STEP" ? "*STEP" : card.title + " of a step", card);
                if (keyword == "ENDSTEP") inStep = false;
                continue;
            }
            const CardUse use = findCardUse(keyword);
            const bool isProperty =
                use == CardUse::MaterialProperty || use == CardUse::LeftOutProperty;
            if (isProperty && !material) refuseCard(card, card.title + " stands outside *MATERIAL");
            if (!isProperty) material = nullptr;
            checkParameters(card);
            const bool isCouplingKind = keyword == "KINEMATIC" || keyword == "DISTRIBUTING";
            if (isCouplingKind != (coupling != nullptr))
                refuseCard(coupling ? coupling->card : card,
                           isCouplingKind ? card.title + " must stand below *COUPLING"
                                          : "*COUPLING needs *KINEMATIC or *DISTRIBUTING below it");
            if (isCouplingKind) readCouplingKind(card, *coupling);
            coupling = nullptr;
            if (keyword == "NODE") {
                // Already read.
            } else if (keyword == "ELEMENT") {
                addElements(card);
            } else if (isGenerator(keyword)) {
                addGenerated(card);
            } else if (keyword == "NSET") {
                addSet(card, "NSET", m_nodeSets);
            } else if (keyword == "ELSET") {
                addSet(card, "ELSET", m_elementSets);
            } else if (keyword == "MATERIAL") {
                m_model.materials.push_back(card);
                material = &card;
            } else if (use == CardUse::MaterialProperty) {
                keepNumbers(card);
                m_model.materials.push_back(card);
            } else if (keyword == "ORIENTATION") {
                if (card.has("DEFINITION") && card.get("DEFINITION") != "COORDINATES")
                    refuseCard(card, card.title + " with DEFINITION=" + card.get("DEFINITION") +
                                         " is not known to simflex; give its axes as COORDINATES");
                card.parameters.erase("DEFINITION");
                keepNumbers(card);
                m_model.sections.push_back(card);
            } else if (keyword == "DISTRIBUTION") {
                if (card.has("LOCATION") && card.get("LOCATION") != "ELEMENT")
                    refuseCard(card, card.title + " with LOCATION=" + card.get("LOCATION") +
                                         " is not known to simflex; known is ELEMENT");
                m_model.sections.push_back(card);
            } else if (keyword == "NORMAL") {
                m_normalCards.push_back(card);
            } else if (keyword == "SOLIDSECTION" || keyword == "SHELLSECTION" ||
                       keyword == "BEAMSECTION" || keyword == "BEAMGENERALSECTION" ||
                       keyword == "MEMBRANESECTION") {
                if (keyword == "BEAMGENERALSECTION") takeMaterial(card);
                if (card.has("COMPOSITE") && card.has("SYMMETRIC")) mirrorLayers(card);
                m_model.sections.push_back(card);
            } else if (keyword == "NONSTRUCTURALMASS") {
                m_addedMassCards.push_back(card);
            } else if (keyword == "NODALTHICKNESS") {
                m_thicknessCards.push_back(card);
            } else if (keyword == "EQUATION" || keyword == "MPC") {
                m_equationCards.push_back(card);
            } else if (keyword == "RIGIDBODY" || keyword == "COUPLING") {
                for (const char* parameter : {"REFNODE", "ROTNODE"}) settleNode(card, parameter);
                m_rigidCards.push_back(readRigidCard(card));
                if (keyword == "COUPLING") coupling = &m_rigidCards.back();
            } else if (keyword == "INITIALCONDITIONS") {
                readInitialConditions(card);
            } else if (keyword == "TIE") {
                m_tieCards.push_back(card);
            } else if (keyword == "SURFACE") {
                m_surfaceCards.push_back(card);
            } else if (keyword == "MASS" || keyword == "ROTARYINERTIA" || keyword == "SPRING" ||
                       keyword == "DASHPOT" || keyword == "DISTRIBUTINGCOUPLING" ||
                       keyword == "GAP") {
                m_pointCards.push_back(card);
            } else if (keyword == "TRANSFORM") {
                readTransform(card);
            } else if (use == CardUse::LeftOut || use == CardUse::LeftOutProperty) {
                if (keyword != "HEADING") noteLeftOut(card.title, card, findConsequence(keyword));
            } else if (use == CardUse::Contact) {
                leaveContactOut(card);
            } else if (use == CardUse::Refused) {
                refuseCard(card, card.title +
                                     " cannot be part of a flexible body: " + getRefusal(keyword));
            } else if (use == CardUse::Unknown) {
                const std::string proposal = proposeCard(keyword);
                refuseCard(card, card.title +
                                     " is not known to simflex, so it cannot tell whether K and "
                                     "M stay those of a free solid" +
                                     (proposal.empty() ? "; take it out of the deck" : proposal));
            }
        }
        if (m_numSolids == 0 && m_thin.empty() && m_hinged.empty()) refuseEmpty();
        if (coupling)
            refuseCard(coupling->card, "*COUPLING needs *KINEMATIC or *DISTRIBUTING below it");
        finishSections();
        readNormals();
        settleAxes();
        expandThin();
        addMasses();
        readTemperatures();
        readPointCards();
        checkRigidNodes();
        readEquationCards();
        finishSprings();
        dropLooseNodes();
        finishMesh();
        addInternalNodes(m_model);
        finishElementSets();
        settleMaterials(m_temperatures, m_model);
        finishSurfaces();
        readTies();
        makeRigidBodies();
        std::vector<char> hasElement(m_model.mesh.nodeNumbers.size(), 0);
        for (const ElementBlock& block : m_model.mesh.elements)
            for (const int node : block.nodes) hasElement[size_t(node)] = 1;
        listRigidBodies();
        m_model.constraints = applyConstraints(m_constraints, hasElement, m_model.mesh,
                                               m_model.notes, m_model.warnings);
        placeInternalNodes(m_model);
        checkElementShapes(m_model);
        warnOfLockingElements(m_thin, m_nodes, m_shells, m_model);
        for (const auto& [what, leftOut] : m_leftOut) {
            const std::string text =
                "left out " + what + leftOut.where +
                (leftOut.count > 1 ? ", " + std::to_string(leftOut.count) + " times" : "");
            if (leftOut.consequence)
                m_model.warnings.push_back(text + ": " + *leftOut.consequence);
            else
                m_model.notes.push_back(text);
        }
        return std::move(m_model);
    }

private:
    /** Refuses a deck without solid elements. **/
    [[noreturn]] void refuseEmpty() const {
        std::string why = "the deck has no solid elements";
        const bool isRestarted = std::any_of(
            m_cards.begin(), m_cards.end(),
            [](const DeckCard& card) { return card.keyword == "RESTART" && card.has("READ"); });
        if (isRestarted) {
            why +=
                ": its model is in the files of the run that *RESTART, READ names; give the deck "
                "of that run";
        } else if (!m_skinTypes.empty()) {
            why += ", but " + *m_skinTypes.begin() +
                   ": mesh the part in space, by solids, shells or beams";
        } else if (!m_pointElements.empty()) {
            why += ", shells or beams, but " + m_pointElements.begin()->second.type +
                   ": springs and masses alone make no flexible part; put them into the multibody "
                   "model";
        }
        throw std::invalid_argument(m_model.path + ": " + why);
    }

    using Sets = std::map<std::string, std::vector<int>>;

    /** Cards of one kind that are left out. **/
    struct LeftOut {
        std::string where;  ///< location of the first one
        int count = 0;
        const std::string* consequence = nullptr;
    };

    /** @param consequence  null: none **/
    void noteLeftOut(const std::string& what, const DeckCard& card,
                     const std::string* consequence = nullptr) {
        LeftOut& entry = m_leftOut[what];
        if (entry.count++ > 0) return;
        entry.where = " (" + card.file + ":" + std::to_string(card.line) + ")";
        entry.consequence = consequence;
    }

    /** Converts *BEAM GENERAL SECTION to *BEAM SECTION. Abaqus's contains its material: E and G in
    the third line, DENSITY. **/
    void takeMaterial(DeckCard& card) {
        card.keyword = "BEAMSECTION";
        if (card.has("MATERIAL") || !findBeamSection(card.get("SECTION"))) return;
        constexpr const char* Needs = "E and G in its third line, or MATERIAL=…";
        if (card.data.size() < 3) refuseCard(card, card.title + " needs " + Needs);
        const double E = readDeckNumber(card, card.data[2], 0, Needs),
                     G = readDeckNumber(card, card.data[2], 1, Needs);
        if (!(E > 0) || !(3 * G > E))
            refuseCard(card,
                       card.title + " has E = " + writeGeneral(E, 6) + " and G = " +
                           writeGeneral(G, 6) + "; E must be positive and G more than E/3",
                       card.data[2].line);
        if (!card.has("DENSITY")) refuseCard(card, card.title + " needs DENSITY=…, or MATERIAL=…");
        const double density = parseDeckNumber(card.get("DENSITY"), card.where());
        if (!(density > 0))
            refuseCard(card, card.title + " has DENSITY " + writeGeneral(density, 6) +
                                 "; it must be positive");
        const std::string name = "SIMFLEX_BEAM_" + std::to_string(card.line);
        const auto add = [&](const char* title, const std::vector<std::string>& fields) {
            DeckCard made;
            made.setTitle(title);
            made.file = card.file;
            made.line = card.line;
            if (fields.empty())
                made.parameters["NAME"] = name;
            else
                made.data = {{card.line, fields, false}};
            m_model.materials.push_back(made);
        };
        add("*MATERIAL", {});
        add("*ELASTIC", {writeFortran(E, 13), writeFortran(E / (2 * G) - 1, 13)});
        add("*DENSITY", {card.get("DENSITY")});
        for (const char* parameter : {"DENSITY", "POISSON"}) card.parameters.erase(parameter);
        card.parameters["MATERIAL"] = name;
        card.data.resize(2);
    }

    /** Layers from the bottom to the middle; the others are theirs in reverse. **/
    static void mirrorLayers(DeckCard& card) {
        card.parameters.erase("SYMMETRIC");
        for (size_t k = card.data.size(); k-- > 0;) card.data.push_back(card.data[k]);
    }

    void leaveContactOut(const DeckCard& card) {
        static const std::string PassThrough = "surfaces in contact there can penetrate each other";
        if (m_contact == ContactUse::Refused)
            refuseCard(card, card.title +
                                 " cannot be part of a flexible body, for contact is not linear: "
                                 "tie surfaces that stay together by *TIE, or leave all contact "
                                 "out by --without-contact (of a model's part, without_contact: "
                                 "true)");
        noteLeftOut(card.title, card, &PassThrough);
    }

    /** Shortens numbers to the length read by ccx, with a note, since ccx would truncate the
    exponent. **/
    void keepNumbers(DeckCard& card) {
        for (DeckLine& data : card.data)
            for (std::string& field : data.fields) {
                if (field.size() <= LongestField || !isDeckNumber(field)) continue;
                const std::string text =
                    writeFortran(parseDeckNumber(field, card.where(data.line)), 13);
                m_model.notes.push_back(card.where(data.line) + "'" + field +
                                        "' has more than the 20 "
                                        "characters that ccx reads; used as " +
                                        text);
                field = text;
            }
    }

    void checkParameters(const DeckCard& card) const {
        const std::set<std::string>* known = findParameters(card.keyword);
        if (!known) return;
        for (const auto& [parameter, value] : card.parameters) {
            if (known->count(parameter)) continue;
            std::string list;
            for (const std::string& name : *known) list += (list.empty() ? " but " : ", ") + name;
            const std::string nearest = findNearestName(parameter, {known->begin(), known->end()});
            refuseCard(
                card, card.title + " with " + parameter +
                          " is not known to simflex, so it cannot tell what that does to K "
                          "and M; it knows none" +
                          list +
                          (nearest.empty() || nearest[0] != parameter[0]  // PIN NSET isn't TIE NSET
                               ? ". Take it out of the deck."
                               : "; did you mean " + nearest + "?"));
        }
    }

    void addNodes(const DeckCard& card) {
        std::vector<int>* set = card.has("NSET") ? &m_nodeSets[card.get("NSET")] : nullptr;
        for (const DeckLine& data : card.data) {
            report();
            const int number = parseDeckInteger(data.fields[0], card, data);
            if (number < 1) refuseCard(card, "node numbers begin at 1", data.line);
            std::array<double, 3> position{};
            for (size_t a = 1; a < data.fields.size(); ++a) {
                if (data.fields[a].empty()) continue;
                if (a == 4 && data.fields.size() == 5 &&
                    parseDeckNumber(data.fields[a], card, data) == 0) {
                    noteLeftOut("zeros behind the three coordinates of nodes", card);
                    continue;
                }
                if (a > 3)
                    refuseCard(card,
                               "node " + std::to_string(number) + " has '" + data.fields[a] +
                                   "' behind its three coordinates; is a comma in place of a "
                                   "decimal point?",
                               data.line);
                position[a - 1] = parseDeckNumber(data.fields[a], card, data);
            }
            const size_t before = m_nodes.size();  // node numbers are often ascending
            const auto found = m_nodes.emplace_hint(m_nodes.end(), number, position);
            const bool isNew = m_nodes.size() > before;
            if (!isNew && found->second != position) {
                std::ostringstream text;
                text << std::setprecision(10) << "node " << number << " is given twice, at";
                for (const auto* x : {&found->second, &position})
                    text << (x == &position ? " and at" : "") << " (" << (*x)[0] << ", " << (*x)[1]
                         << ", " << (*x)[2] << ")";
                refuseCard(card, text.str() + "; give it another number", data.line);
            }
            m_nodeNumbers.insert(number);
            if (set) set->push_back(number);
        }
    }

    /** Called for each card and data line, so that reading can be cancelled. **/
    void report() {
        if (++m_numReports % DeckLinesPerReport == 0)
            reportProgress(m_progress, ReadingDeck, ReadingCards);
    }

    /** Counts what all cards of the deck make before one makes it.
    @throws std::invalid_argument if that is too much, or more than the memory holds. **/
    void claim(const DeckCard& card, const std::string& makes, long count, int line) {
        m_numGenerated += count;
        const std::string all = m_numGenerated > count ? ", together with those made before it " +
                                                             std::to_string(m_numGenerated)
                                                       : "";
        if (m_numGenerated > MostGenerated)
            refuseCard(card,
                       makes + " more than " + std::to_string(MostGenerated) + " " +
                           (card.has("GENERATE") ? "numbers" : "of them") + all +
                           "; is a digit too many?",
                       line);
        const double needed = BytesPerGenerated * double(m_numGenerated),
                     available = double(calcAvailableMemory());
        if (needed > available)
            refuseCard(card,
                       makes + " " + std::to_string(count) + " of them" + all +
                           ", for which there is not enough memory: about " + formatMemory(needed) +
                           ", of which " + formatMemory(available) +
                           " are available; is a digit too many?",
                       line);
    }

    /** Adds the nodes and elements generated by cards such as *NGEN and *ELGEN. **/
    void addGenerated(const DeckCard& card) {
        GeneratorModel model;
        model.positionOf = [&](int node) {
            const auto found = m_nodes.find(node);
            if (found == m_nodes.end())
                refuseCard(card, card.title + " names node " + std::to_string(node) +
                                     ", which the deck does not define before it");
            return found->second;
        };
        model.nodesOf = [&](const std::string& field, int line) {
            DeckLine data;
            data.line = line;
            return findNodes(card, data, field);
        };
        model.elementsOf = [&](const std::string& name) {
            const auto set = m_elementSets.find(name);
            if (set == m_elementSets.end())
                refuseCard(card, card.title + " names element set " + name +
                                     ", which the deck does not define before it");
            return set->second;
        };
        std::unordered_map<int, std::pair<std::string, const std::vector<int>*>> elements;
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids) elements[solid.number] = {type, &solid.nodes};
        for (const ThinElement& element : m_thin)
            elements[element.number] = {element.type, &element.nodes};
        model.findElement = [&](int number) {
            const auto found = elements.find(number);
            if (found == elements.end())
                refuseCard(card, card.title + " copies element " + std::to_string(number) +
                                     ", which is no solid, shell or beam that the deck defines "
                                     "before it");
            return std::make_pair(found->second.first, *found->second.second);
        };
        model.claim = [&](long count, int line) {
            claim(card, card.title + " makes", count, line);
        };
        model.report = [&] { report(); };
        for (const DeckCard& made : generateCards(card, model)) {
            if (made.keyword == "NODE") addNodes(made);
            if (made.keyword == "ELEMENT") addElements(made);
            if (made.keyword == "NSET") addSet(made, "NSET", m_nodeSets);
            if (made.keyword == "ELSET") addSet(made, "ELSET", m_elementSets);
        }
    }

    void addElements(const DeckCard& card) {
        std::string type = card.get("TYPE");
        if (const std::string* nearest = findNearestElement(type)) {
            const std::string text = "elements " + type + " are taken as " + *nearest;
            if (m_replaced.insert(type).second)
                m_model.warnings.push_back(card.where() + text + ", which CalculiX has");
            type = *nearest;
        }
        const ThinType* thin = findThinType(type);
        const ElementType* solid = thin ? nullptr : findSolid(type);
        const int skinNodes = numSkinNodesOf(type);
        const int pointNodes = numPointNodesOf(type), hingedNodes = numHingedNodesOf(type);
        if (!solid && !skinNodes && !thin && !pointNodes && !hingedNodes)
            refuseCard(card, findElementRefusal(type));
        const int size = solid         ? numNodesOf(*solid)
                         : thin        ? thin->numNodes
                         : pointNodes  ? pointNodes
                         : hingedNodes ? hingedNodes
                                       : skinNodes;
        const bool hasMore = hasMoreNodes(card, size, type);
        std::vector<int> numbers;
        int firstLine = 0;
        std::vector<DeckModel::Solid>* solids = nullptr;
        if (solid) m_solidNumbers.reserve(m_solidNumbers.size() + card.data.size());
        std::vector<int>* set = card.has("ELSET") ? &m_elementSets[card.get("ELSET")] : nullptr;
        for (const DeckLine& data : card.data) {
            report();
            if (numbers.empty()) firstLine = data.line;
            for (const std::string& field : data.fields)
                if (!field.empty()) numbers.push_back(parseDeckInteger(field, card, data));
            if (int(numbers.size()) < size + 1) continue;
            if (hasMore) numbers.resize(size_t(size) + 1);
            if (int(numbers.size()) > size + 1)
                refuseCard(card,
                           "element " + std::to_string(numbers[0]) + " has more than the " +
                               std::to_string(size) + " nodes of a " + type +
                               "; is its type another?",
                           firstLine);
            if (pointNodes) {
                m_pointElements[numbers[0]] = {
                    type, {numbers.begin() + 1, numbers.end()}, card.where(firstLine)};
            } else if (hingedNodes) {
                HingedElement& element = m_hinged[numbers[0]];
                element.number = numbers[0];
                element.type = type;
                element.nodes.assign(numbers.begin() + 1, numbers.end());
                element.where = card.where(firstLine);
                m_skinTypes.insert(type);
            } else if (solid || thin) {
                if (!m_solidNumbers.insert({numbers[0], type}).second)
                    refuseCard(card, "element " + std::to_string(numbers[0]) + " is given twice",
                               firstLine);
                for (int k = 1; k <= size; ++k)
                    if (!m_nodeNumbers.has(numbers[k]))
                        refuseCard(card,
                                   "element " + std::to_string(numbers[0]) + " uses node " +
                                       std::to_string(numbers[k]) +
                                       ", which the deck does not define",
                                   firstLine);
                if (thin) {
                    ThinElement element;
                    element.number = numbers[0];
                    element.type = type;
                    element.nodes.assign(numbers.begin() + 1, numbers.end());
                    element.where = card.where(firstLine);
                    m_thinIndex[numbers[0]] = m_thin.size();
                    m_thin.push_back(std::move(element));
                } else {
                    if (!solids) solids = &m_model.solids[type];
                    solids->push_back({numbers[0], {numbers.begin() + 1, numbers.end()}});
                    ++m_numSolids;
                }
            } else {
                m_skin[numbers[0]].assign(numbers.begin() + 1, numbers.end());
                m_skinTypes.insert(type);
                noteLeftOut("surface or line elements " + type, card);
            }
            if (set) set->push_back(numbers[0]);
            numbers.clear();
        }
        if (!numbers.empty())
            refuseCard(card,
                       "element " + std::to_string(numbers[0]) + " has " +
                           std::to_string(numbers.size() - 1) + " nodes, a " + type + " has " +
                           std::to_string(size),
                       firstLine);
    }

    /** Returns whether the lines of all hexahedra have this many nodes more than their type, of
    which CalculiX uses the first, the corners. If only some lines do, elements continue on the next
    line. **/
    bool hasMoreNodes(const DeckCard& card, int size, const std::string& type) {
        const auto countOf = [](const DeckLine& data) {
            return std::count_if(data.fields.begin(), data.fields.end(),
                                 [](const std::string& field) { return !field.empty(); });
        };
        if (type.compare(0, 4, "C3D8") != 0 || card.data.empty()) return false;
        const auto count = countOf(card.data[0]);
        if (count <= size + 1) return false;
        for (const DeckLine& data : card.data)
            if (countOf(data) != count) return false;
        m_model.warnings.push_back(card.where() + "elements " + type + " have " +
                                   std::to_string(count - 1) +
                                   " nodes on their lines; as in CalculiX the first " +
                                   std::to_string(size) + " are taken; is their type another?");
        return true;
    }

    void addSet(const DeckCard& card, const std::string& kind, Sets& sets) {
        const std::string name = card.get(kind);
        std::vector<int> members;
        if (&sets == &m_nodeSets && card.has("ELSET")) members = listNodesOf(card);
        std::set<std::string> included;  // ignore duplicates
        for (const DeckLine& data : card.data) {
            report();
            if (card.has("GENERATE")) {
                const std::string where = card.where(data.line);
                if (data.fields.size() < 2)
                    refuseCard(card, "GENERATE needs first, last[, step]", data.line);
                const int first = parseDeckInteger(data.fields[0], where);
                const int last = parseDeckInteger(data.fields[1], where);
                const int step = data.fields.size() > 2 && !data.fields[2].empty()
                                     ? parseDeckInteger(data.fields[2], where)
                                     : 1;
                if (step < 1) refuseCard(card, "the step of GENERATE must be positive", data.line);
                if (last < first)
                    refuseCard(card,
                               "GENERATE goes from " + std::to_string(first) + " to " +
                                   std::to_string(last) + ", must go up",
                               data.line);
                claim(card, "GENERATE makes", (long(last) - first) / step + 1, data.line);
                for (long k = first; k <= last; k += step) members.push_back(int(k));
                continue;
            }
            for (const std::string& field : data.fields) {
                if (field.empty()) continue;
                if (isDeckNumber(field)) {
                    members.push_back(parseDeckInteger(field, card.where(data.line)));
                    continue;
                }
                const auto other = sets.find(field);
                if (other == sets.end())
                    refuseCard(card,
                               card.title + " " + name + " names set " + field +
                                   ", which the deck does not define before it",
                               data.line);
                if (included.insert(field).second)
                    members.insert(members.end(), other->second.begin(), other->second.end());
            }
        }
        std::vector<int>& set = sets[name];
        set.insert(set.end(), members.begin(), members.end());
        sortUnique(set);
    }

    /** Returns the nodes of the elements in the set named by a card. **/
    std::vector<int> listNodesOf(const DeckCard& card) const {
        const auto set = m_elementSets.find(card.get("ELSET"));
        if (set == m_elementSets.end())
            refuseCard(card, card.title + " names element set " + card.get("ELSET") +
                                 ", which the deck does not define before it");
        const std::set<int> numbers(set->second.begin(), set->second.end());
        std::vector<int> nodes;
        const auto add = [&](int number, const std::vector<int>& of) {
            if (numbers.count(number)) nodes.insert(nodes.end(), of.begin(), of.end());
        };
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids) add(solid.number, solid.nodes);
        for (const ThinElement& element : m_thin) add(element.number, element.nodes);
        for (const auto& [number, element] : m_hinged) add(number, element.nodes);
        for (const auto& [number, of] : m_skin) add(number, of);
        return nodes;
    }

    /** Element sets that contain only skin elements, as Gmsh writes for physical groups of surfaces
    or lines, become sets of their nodes. **/
    void addSetsOfSkin() {
        for (const auto& [name, numbers] : m_elementSets) {
            std::vector<int> nodes;
            const bool isSkin = std::all_of(numbers.begin(), numbers.end(), [&](int number) {
                const auto found = m_skin.find(number);
                if (found == m_skin.end() || m_solidNumbers.count(number)) return false;
                nodes.insert(nodes.end(), found->second.begin(), found->second.end());
                return true;
            });
            if (isSkin) m_nodeSets.insert({name, std::move(nodes)});
        }
    }

    /** Reads the axes of a node set, which supports, loads and equations refer to. **/
    void readTransform(const DeckCard& card) {
        DeckCard axes = card;
        axes.parameters["SYSTEM"] = card.has("TYPE") ? card.get("TYPE") : "R";
        const auto set = m_nodeSets.find(card.get("NSET"));
        if (set == m_nodeSets.end())
            refuseCard(card, card.title + " names node set " + card.get("NSET") +
                                 ", which the deck does not define before it");
        for (const int node : set->second) m_axesOf[node] = m_transforms.size();
        m_transforms.push_back(parseOrientation(axes));
        noteLeftOut(card.title + " but for equations", card);
    }

    /** Transforms an equation from the axes of its nodes to the deck's. **/
    void turnTerms(const DeckCard& card, DeckEquation& equation) const {
        std::vector<DeckEquation::Term> terms;
        for (const auto& term : equation.terms) {
            const auto found = m_axesOf.find(term.node);
            if (found == m_axesOf.end()) {
                terms.push_back(term);
                continue;
            }
            if (m_rotationNodes.count(term.node))
                refuseCard(card, card.title + " names rotations of node " +
                                     std::to_string(term.node) +
                                     " in axes of *TRANSFORM, which simflex does not support");
            const Axes axes = m_transforms[found->second].calcAxes(m_nodes.at(term.node));
            for (int a = 0; a < 3; ++a)
                if (const double part = axes[size_t(a)][size_t(term.axis)]; part != 0)
                    terms.push_back({term.node, a, term.coefficient * part});
        }
        equation.terms = std::move(terms);
    }

    /** Sets areas and thicknesses of trusses and membranes and removes their sections. Lines
    without section, as written by meshers along edges, are left out. **/
    void finishHinged() {
        std::vector<DeckCard> sections;
        for (const DeckCard& card : m_model.sections) {
            const bool isMembrane = card.keyword == "MEMBRANESECTION";
            const auto members = m_elementSets.find(card.has("ELSET") ? card.get("ELSET") : "");
            if (members == m_elementSets.end() || !(isMembrane || card.keyword == "SOLIDSECTION")) {
                if (isMembrane)
                    refuseCard(card, "the deck has no element set " + card.get("ELSET"));
                sections.push_back(card);
                continue;
            }
            size_t numHinged = 0;
            for (const int number : members->second) {
                const auto found = m_hinged.find(number);
                if (found == m_hinged.end()) {
                    if (isMembrane)
                        refuseCard(card, card.title + " does not fit element " +
                                             std::to_string(number) + ", which is no membrane");
                    continue;
                }
                HingedElement& element = found->second;
                if (isTruss(element.type) == isMembrane)
                    refuseCard(card, card.title + " does not fit element " +
                                         std::to_string(number) + ", a " + element.type);
                if (card.data.empty())
                    refuseCard(card, card.title + " of " + element.type + " needs their " +
                                         (isMembrane ? "thickness" : "area"));
                element.size =
                    readDeckNumber(card, card.data[0], 0, isMembrane ? "a thickness" : "an area");
                if (!(element.size > 0))
                    refuseCard(
                        card,
                        card.title + " is " + card.data[0].fields[0] + "; it must be positive",
                        card.data[0].line);
                element.material = card.get("MATERIAL");
                ++numHinged;
            }
            if (numHinged == 0) {
                sections.push_back(card);
            } else if (numHinged < members->second.size()) {
                refuseCard(card, card.title +
                                     " is of trusses and of others; give the trusses a "
                                     "section of their own, with their area");
            }
        }
        m_model.sections = std::move(sections);
        for (const auto& [number, element] : m_hinged) {
            if (element.size > 0) {
                for (const int node : element.nodes)
                    if (!m_nodes.count(node))
                        throw std::invalid_argument(
                            element.where + "element " + std::to_string(number) + " uses node " +
                            std::to_string(node) + ", which the deck does not define");
                m_extraNodes.insert(m_extraNodes.end(), element.nodes.begin(), element.nodes.end());
                m_model.hinged.push_back(element);
            } else if (isTruss(element.type)) {
                m_skin[number] = element.nodes;
                LeftOut& entry = m_leftOut["surface or line elements " + element.type];
                if (entry.count++ == 0)
                    entry.where = " (" + element.where.substr(0, element.where.size() - 2) + ")";
            } else {
                throw std::invalid_argument(element.where + "element " + std::to_string(number) +
                                            ", a " + element.type + ", has no *MEMBRANE SECTION");
            }
        }
    }

    static bool isSection(const DeckCard& card) {
        return card.keyword == "SOLIDSECTION" || card.keyword == "SHELLSECTION" ||
               card.keyword == "BEAMSECTION";
    }

    /** Warns of elements in two sections: the last one applies, as in CalculiX; other programs
    differ. **/
    void warnOfSecondSections() {
        std::unordered_map<int, int> lines;  // line of each element's section
        for (const DeckCard& card : m_model.sections) {
            if (!isSection(card)) continue;
            const auto members = m_elementSets.find(card.get("ELSET"));
            if (members == m_elementSets.end()) continue;
            size_t count = 0;
            int number = 0, line = 0;
            for (const int member : members->second) {
                const auto [first, isNew] = lines.try_emplace(member, card.line);
                if (isNew || first->second == card.line) continue;
                if (count++ == 0) number = member, line = first->second;
                first->second = card.line;
            }
            if (count)
                m_model.warnings.push_back(
                    card.where() + card.title + " gives element " + std::to_string(number) +
                    (count > 1 ? " and " + plural(count - 1, "other") : "") +
                    " a second section, which holds; the first one is in line " +
                    std::to_string(line));
        }
    }

    /** Converts quadrilateral linear shells with a repeated corner to triangles. **/
    void makeTriangles() {
        size_t count = 0;
        for (ThinElement& element : m_thin) {
            if (m_shells != ShellUse::Shells || (element.type != "S4" && element.type != "S4R"))
                continue;
            std::vector<int> nodes;
            for (size_t k = 0; k < 4; ++k)
                if (element.nodes[k] != element.nodes[(k + 1) % 4])
                    nodes.push_back(element.nodes[k]);
            if (nodes.size() != 3) continue;
            element.nodes = std::move(nodes);
            element.type = "S3";
            ++count;
        }
        if (count)
            m_model.notes.push_back(plural(count, "quadrilateral shell") +
                                    " with two corners at one node taken as triangles, S3");
    }

    /** Linear beams get a node in their middle. **/
    void addMiddles() {
        if (m_shells != ShellUse::Shells) return;
        int next = m_nodes.empty() ? 1 : m_nodes.rbegin()->first + 1;
        for (ThinElement& element : m_thin) {
            if (element.nodes.size() != 2) continue;
            const int from = element.nodes[0], to = element.nodes[1];
            m_nodes[next] = sumOf(scaled(m_nodes.at(from), 0.5), 0.5, m_nodes.at(to));
            m_middles[next] = {from, to};
            element.nodes = {from, next++, to};
            element.type = "B32";
        }
    }

    /** Thicknesses and axes of shells and beams; their cards become those of solids. **/
    void finishSections() {
        finishHinged();
        makeTriangles();
        addMiddles();
        warnOfSecondSections();
        for (DeckCard& card : m_model.sections) {
            if (!isSection(card)) continue;
            const std::string& set = card.get("ELSET");
            const auto members = m_elementSets.find(set);
            if (members == m_elementSets.end())
                refuseCard(card, "the deck has no element set " + set);
            const bool isSolid = card.keyword == "SOLIDSECTION";
            ThinElement section;
            if (!isSolid) section = readThinSection(card);
            if (!isSolid && hasRadius(card, section))
                m_model.warnings.push_back(
                    card.where() + card.title +
                    ", SECTION=CIRC has one number, which is taken as the radius, as in Abaqus; "
                    "CalculiX's section has two, both diameters");
            for (const int number : members->second) {
                const auto found = m_thinIndex.find(number);
                const bool fits =
                    found == m_thinIndex.end()
                        ? isSolid || !m_solidNumbers.count(number)
                        : !isSolid && (card.keyword == "BEAMSECTION") ==
                                          findThinType(m_thin[found->second].type)->isBeam;
                if (!fits)
                    refuseCard(card, card.title + " does not fit element " +
                                         std::to_string(number) + ", a " +
                                         m_solidNumbers.at(number));
                if (found == m_thinIndex.end()) continue;
                ThinElement& element = m_thin[found->second];
                if (section.section != BeamSection::Rectangle && element.nodes.size() == 2)
                    refuseCard(card, "beam " + std::to_string(number) +
                                         " is linear, which CalculiX gives no section but RECT; "
                                         "leave --calculix-shells out, or use B32R");
                const bool canHaveLayers =
                    element.type == "S8R" || element.type == "S6" ||
                    (element.nodes.size() < 6 && m_shells == ShellUse::Shells);
                if (section.isLayered && !canHaveLayers)
                    refuseCard(card,
                               "shell " + std::to_string(number) + " is a " + element.type +
                                   ", which has no layers in CalculiX; use S8R or S6, or mesh "
                                   "each layer by solids");
                if (section.walls[0] > 0 && m_shells != ShellUse::Shells && element.type != "B32R")
                    refuseCard(card, "beam " + std::to_string(number) + " is a " + element.type +
                                         ", of which PIPE and BOX have no integration points; use "
                                         "B32R");
                section.number = element.number;
                section.type = element.type;
                section.nodes = element.nodes;
                section.where = element.where;
                section.hasSection = true;
                element = section;
            }
            if (isSolid) continue;
            std::map<std::string, std::string> kept = {{"ELSET", set}};
            if (card.has("ORIENTATION")) kept["ORIENTATION"] = card.get("ORIENTATION");
            const bool isComposite = card.has("COMPOSITE");
            if (isComposite && section.isLayered) {
                card.keyword = LayersCard;
                card.parameters = kept;
                continue;
            }
            kept["MATERIAL"] =
                isComposite ? layerMaterial(card, card.data[0]) : card.get("MATERIAL");
            if (isComposite && card.data[0].fields.size() > 3 && !card.data[0].fields[3].empty())
                kept["ORIENTATION"] = card.data[0].fields[3];
            card.keyword = "SOLIDSECTION";
            if (isOfDeck(card)) card.title = "*SOLID SECTION";
            card.parameters = kept;
            card.data.clear();
        }
        for (const ThinElement& element : m_thin)
            if (!element.hasSection)
                throw std::invalid_argument(element.where + "element " +
                                            std::to_string(element.number) + ", a " + element.type +
                                            ", has no section");
    }

    static const std::string& layerMaterial(const DeckCard& card, const DeckLine& layer) {
        if (layer.fields.size() < 3 || layer.fields[2].empty())
            refuseCard(card,
                       "a layer needs its thickness, a number of points (or nothing) and its "
                       "material",
                       layer.line);
        return layer.fields[2];
    }

    /** Assigns *NORMAL cards to their elements. **/
    void readNormals() {
        for (const DeckCard& card : m_normalCards)
            for (const DeckLine& data : card.data) {
                const char* what = "an element, a node and three numbers";
                Vec3d normal{};
                for (size_t a = 0; a < 3; ++a)
                    if (a == 0 || (a + 2 < data.fields.size() && !data.fields[a + 2].empty()))
                        normal[a] = readDeckNumber(card, data, a + 2, what);
                if (!(normOf(normal) > 0)) refuseCard(card, "a *NORMAL is zero", data.line);
                const int node = parseDeckInteger(data.fields[1], card, data);
                for (const int number : findElements(card, data)) {
                    const auto found = m_thinIndex.find(number);
                    if (found == m_thinIndex.end())
                        refuseCard(card,
                                   "*NORMAL of element " + std::to_string(number) +
                                       ", which is no shell or beam of the deck",
                                   data.line);
                    ThinElement& element = m_thin[found->second];
                    if (!std::count(element.nodes.begin(), element.nodes.end(), node))
                        refuseCard(card,
                                   "*NORMAL of element " + std::to_string(number) + " at node " +
                                       std::to_string(node) + ", which is none of its nodes",
                                   data.line);
                    element.normals[node] = scaled(normal, 1 / normOf(normal));
                }
            }
    }

    bool isIsotropic(const std::string& material) const {
        bool isInside = false;
        for (const DeckCard& card : m_model.materials) {
            if (card.keyword == "MATERIAL") isInside = card.get("NAME") == material;
            if (isInside && card.keyword == "ELASTIC" && card.has("TYPE"))
                return card.get("TYPE").compare(0, 3, "ISO") == 0;
        }
        return true;
    }

    /** Returns false for cards converted from another program, whose titles name its own
    entries. **/
    static bool isOfDeck(const DeckCard& card) { return card.title[0] == '*'; }

    void noteDistribution(const DeckCard& section) {
        if (!isOfDeck(section) || !m_distributed.insert(section.line).second) return;
        m_model.notes.push_back(
            section.where() +
            "each shell or beam has the axes that *DISTRIBUTION gives it, as in "
            "Abaqus; CalculiX takes those of its first line for all");
    }

    /** Returns the *ORIENTATION of an element, in the plane of a shell; null: the deck's axes.
    @param turn  additional rotation about a shell's normal [rad] **/
    std::optional<DeckCard> findElementAxes(const DeckOrientations& orientations,
                                            const DeckCard& section, const std::string& name,
                                            int number, double turn = 0) {
        std::optional<DeckCard> card;
        if (!name.empty()) card = orientations.find(section, name, number);
        const auto thin = m_thinIndex.find(number);
        if (thin == m_thinIndex.end()) return card;
        if (orientations.isDistributed(name)) noteDistribution(section);
        if (findThinType(m_thin[thin->second].type)->isBeam) return card;
        std::vector<Vec3d> positions;
        for (const int node : m_thin[thin->second].nodes) positions.push_back(m_nodes.at(node));
        Axes axes = turnIntoShell(positions, [&](const Vec3d& place) {
            return card ? parseOrientation(*card).calcAxes(place)
                        : Axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
        });
        for (auto& row : axes)
            row = {std::cos(turn) * row[0] + std::sin(turn) * row[1],
                   std::cos(turn) * row[1] - std::sin(turn) * row[0], row[2]};
        return makeOrientationCard("", axes);
    }

    /** Returns the name of an orientation with these numbers, adding it to the deck if
    necessary. **/
    std::string nameAxes(const std::optional<DeckCard>& axes, std::vector<DeckCard>& sections) {
        if (!axes) return "";
        std::string key = axes->has("SYSTEM") ? axes->get("SYSTEM") : "";
        for (const DeckLine& data : axes->data)
            for (const std::string& field : data.fields) key += "," + field;
        const auto [found, isNew] =
            m_axesNames.emplace(key, "SIMFLEX_AXES_" + std::to_string(m_axesNames.size() + 1));
        if (isNew) {
            sections.push_back(*axes);
            sections.back().parameters["NAME"] = found->second;
        }
        return found->second;
    }

    /** Divides sections whose elements have their own axes; isotropic materials need none. **/
    void settleAxes() {
        const DeckOrientations orientations(m_model.sections, m_elementSets);
        std::vector<DeckCard> sections;
        for (const DeckCard& card : m_model.sections) {
            if (card.keyword == "DISTRIBUTION" ||
                (card.keyword == "ORIENTATION" && orientations.isDistributed(card.get("NAME"))))
                continue;
            if (card.keyword == LayersCard) settleLayers(orientations, card, sections);
            if (card.keyword != "SOLIDSECTION") {
                sections.push_back(card);
                continue;
            }
            const std::vector<int>& members = m_elementSets.at(card.get("ELSET"));
            const bool isThin = !members.empty() && m_thinIndex.count(members[0]);
            const std::string name = card.has("ORIENTATION") ? card.get("ORIENTATION") : "";
            const bool isDistributed = orientations.isDistributed(name);
            DeckCard bare = card;
            if (isThin || isDistributed) bare.parameters.erase("ORIENTATION");
            if (!(isThin || isDistributed) || isIsotropic(card.get("MATERIAL"))) {
                if (!name.empty() && !members.empty()) orientations.find(card, name, members[0]);
                sections.push_back(bare);
                continue;
            }
            std::map<std::string, std::vector<int>> groups;
            for (const int number : members)
                groups[nameAxes(findElementAxes(orientations, card, name, number), sections)]
                    .push_back(number);
            for (auto& [axes, numbers] : groups) {
                DeckCard part = bare;
                if (!axes.empty()) {
                    part.parameters["ORIENTATION"] = axes;
                    part.parameters["ELSET"] = axes + "_" + std::to_string(m_elementSets.size());
                    m_elementSets[part.parameters["ELSET"]] = std::move(numbers);
                }
                sections.push_back(part);
            }
        }
        m_model.sections = std::move(sections);
    }

    /** Reads the layers of each element: thickness, points, material, and an *ORIENTATION or the
    angle [°] to that of the section. **/
    void settleLayers(const DeckOrientations& orientations, const DeckCard& card,
                      std::vector<DeckCard>& sections) {
        const std::string common = card.has("ORIENTATION") ? card.get("ORIENTATION") : "";
        bool hasNamed = false;
        for (const int number : m_elementSets.at(card.get("ELSET"))) {
            std::vector<DeckLayer>& layers = m_model.layersOf[number];
            layers.clear();
            for (const DeckLine& data : card.data) {
                DeckLayer layer;
                layer.thickness = readDeckNumber(card, data, 0, "the thickness of each layer");
                layer.material = layerMaterial(card, data);
                const std::string own = data.fields.size() > 3 ? data.fields[3] : "";
                if (own.empty() && hasNamed && common.empty() && !isIsotropic(layer.material))
                    refuseCard(card,
                               "a layer without ORIENTATION is below one that has it: CalculiX "
                               "takes that of the layer before, Abaqus that of the section; give "
                               "each layer its own",
                               data.line);
                const bool isAngle = isDeckNumber(own);
                hasNamed |= !own.empty() && !isAngle;
                if (!isIsotropic(layer.material))
                    layer.orientation = nameAxes(
                        findElementAxes(
                            orientations, card, own.empty() || isAngle ? common : own, number,
                            isAngle ? parseDeckNumber(own, card, data) * M_PI / 180 : 0),
                        sections);
                layers.push_back(std::move(layer));
            }
            hasNamed = false;
        }
    }

    std::map<int, std::array<double, 2>> readNodalThickness() const {
        std::map<int, std::array<double, 2>> result;
        for (const DeckCard& card : m_thicknessCards)
            for (const DeckLine& data : card.data) {
                std::array<double, 2> thickness{};
                thickness[0] = readDeckNumber(card, data, 1, "a node and its thickness");
                thickness[1] =
                    data.fields.size() > 2 ? readDeckNumber(card, data, 2, "") : thickness[0];
                for (const int node : findNodes(card, data)) result[node] = thickness;
            }
        for (const auto& [middle, ends] : m_middles) {
            const auto from = result.find(ends[0]), to = result.find(ends[1]);
            if (from == result.end() || to == result.end()) continue;
            std::array<double, 2> mean{};
            for (size_t k = 0; k < 2; ++k) mean[k] = 0.5 * (from->second[k] + to->second[k]);
            result[middle] = mean;
        }
        return result;
    }

    /** Of each beam, by its mean thickness. **/
    void makeBeamRules(const std::map<int, std::array<double, 2>>& nodalThickness) {
        using Key = std::tuple<BeamSection, std::array<double, 2>, std::array<double, 4>>;
        std::map<Key, size_t> rules;
        for (const ThinElement& element : m_thin) {
            if (!findThinType(element.type)->isBeam) continue;
            std::array<double, 2> size = element.thickness;
            if (element.hasNodalThickness) {
                size = {};
                for (const int node : element.nodes)
                    for (size_t k = 0; k < 2; ++k)
                        size[k] += nodalThickness.at(node)[k] / double(element.nodes.size());
            }
            const auto [rule, isNew] =
                rules.emplace(Key{element.section, size, element.walls}, m_model.beamRules.size());
            if (isNew) m_model.beamRules.push_back(makeBeamRule(element, size, m_shells));
            if (!m_model.beamRules[rule->second].points.empty())
                m_model.beamRuleOf[element.number] = rule->second;
        }
    }

    /** *NONSTRUCTURAL MASS, as density. **/
    void addMasses() {
        for (const DeckCard& card : m_addedMassCards) {
            const auto set = m_elementSets.find(card.get("ELSET"));
            if (set == m_elementSets.end())
                refuseCard(card, "the deck has no element set " + card.get("ELSET"));
            if (card.data.empty()) refuseCard(card, card.title + " needs its mass");
            const double mass = readDeckNumber(card, card.data[0], 0, "its mass");
            const std::string units = card.get("UNITS");
            const bool isOfArea = units == "MASSPERAREA", isOfLength = units == "MASSPERLENGTH";
            if (!isOfArea && !isOfLength && units != "MASSPERVOLUME")
                refuseCard(card, card.title +
                                     " with other UNITS than MASS PER AREA (of shells), MASS PER "
                                     "LENGTH (of beams) and MASS PER VOLUME is not known to "
                                     "simflex; divide the mass by the area, length or volume");
            for (const int number : set->second) {
                if (!m_solidNumbers.count(number)) continue;
                double share = 1;
                if (isOfArea || isOfLength) {
                    const auto thin = m_thinIndex.find(number);
                    if (thin == m_thinIndex.end() ||
                        findThinType(m_thin[thin->second].type)->isBeam != isOfLength)
                        refuseCard(card, card.title + " per " + (isOfArea ? "area" : "length") +
                                             " of element " + std::to_string(number) +
                                             ", which is no " + (isOfArea ? "shell" : "beam"));
                    const ThinElement& element = m_thin[thin->second];
                    if (element.hasNodalThickness)
                        refuseCard(card, card.title + " of element " + std::to_string(number) +
                                             ", whose thickness varies; give MASS PER VOLUME");
                    share = element.thickness[0] * (isOfLength ? calcArea(element) : 1);
                }
                m_model.addedDensity[number] += mass / share;
            }
        }
    }

    /** Of a beam's section, over its first thickness [m]. **/
    double calcArea(const ThinElement& beam) const {
        const auto rule = m_model.beamRuleOf.find(beam.number);
        if (rule == m_model.beamRuleOf.end()) return beam.thickness[1];
        double area = 0;  // of 4, the square's
        for (const SectionPoint& point : m_model.beamRules[rule->second].points)
            area += point.weight;
        return beam.thickness[1] * area / 4;
    }

    /** The number of a node that a parameter names by a set. **/
    void settleNode(DeckCard& card, const char* parameter) const {
        if (!card.has(parameter) || isDeckNumber(card.get(parameter))) return;
        const std::string& name = card.get(parameter);
        const auto set = m_nodeSets.find(name);
        if (set == m_nodeSets.end() || set->second.size() != 1)
            refuseCard(card,
                       card.title + " names node set " + name + ", which " +
                           (set == m_nodeSets.end() ? "the deck does not define before it"
                                                    : "has " + plural(set->second.size(), "node") +
                                                          "; it must have one"));
        card.parameters[parameter] = std::to_string(set->second[0]);
    }

    /** Returns the node, or the nodes of the set, named in a field. **/
    std::vector<int> findNodes(const DeckCard& card, const DeckLine& data) const {
        return findNodes(card, data, data.fields[0]);
    }
    std::vector<int> findNodes(const DeckCard& card, const DeckLine& data,
                               const std::string& field) const {
        if (isDeckNumber(field)) return {parseDeckInteger(field, card.where(data.line))};
        const auto set = m_nodeSets.find(field);
        if (set == m_nodeSets.end())
            refuseCard(card,
                       card.title + " names node set " + field + ", which the deck does not have",
                       data.line);
        return set->second;
    }

    /** Expands shells and beams to solids and adds the expanded nodes to node sets. **/
    void expandThin() {
        if (m_thin.empty()) return;
        const auto nodalThickness = readNodalThickness();
        m_constraints.thin = expandThinElements(m_nodes, m_thin, nodalThickness, m_shells);
        makeBeamRules(nodalThickness);
        const ThinExpansion& thin = m_constraints.thin;
        noteHinges();
        m_model.warnings.insert(m_model.warnings.end(), thin.warnings.begin(), thin.warnings.end());
        for (const auto& solid : thin.solids) {
            m_model.solids[solid.type].push_back({solid.number, solid.nodes});
            m_solidNumbers[solid.number] = solid.type;
        }
        for (const auto& [number, position] : thin.nodes) m_nodes[number] = position;
        for (const auto& [node, expanded] : thin.expandedOf) m_extraNodes.push_back(node);
        for (auto& [name, numbers] : m_nodeSets)
            for (size_t k = 0, given = numbers.size(); k < given; ++k) {
                const auto found = thin.expandedOf.find(numbers[k]);
                if (found == thin.expandedOf.end()) continue;
                numbers.insert(numbers.end(), found->second.begin(), found->second.end());
            }
        m_model.notes.push_back(plural(thin.solids.size(), "shell or beam element") +
                                " expanded between nodes on both sides, as CalculiX does; these "
                                "have the numbers from " +
                                std::to_string(thin.nodes.begin()->first));
    }

    /** Notes shells and beams that are hinged at a single row of a solid's nodes. **/
    void noteHinges() {
        std::set<int> betweens;
        for (const auto& between : m_constraints.thin.betweens) betweens.insert(between.node);
        std::set<int> shared;
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids)
                for (const int node : solid.nodes)
                    if (betweens.count(node)) shared.insert(node);
        if (shared.empty()) return;
        m_model.warnings.push_back(
            plural(shared.size(), "node") + " shared by solids and shells or beams, the first " +
            std::to_string(*shared.begin()) +
            ": as in CalculiX the translation alone is shared, so that one row of "
            "such nodes is a hinge");
    }

    void readEquationCards() {
        for (const DeckCard& card : m_equationCards) {
            const auto positionOf = [&](int node) -> Vec3d {
                const auto found = m_nodes.find(node);
                if (found == m_nodes.end())
                    refuseCard(card, card.title + " names node " + std::to_string(node) +
                                         ", which the deck does not define");
                return found->second;
            };
            const auto& expanded = m_constraints.thin.nodes;
            const auto nodesOf = [&](const std::string& field, const DeckLine& data) {
                std::vector<int> nodes = findNodes(card, data, field);
                nodes.erase(std::remove_if(nodes.begin(), nodes.end(),
                                           [&](int node) { return expanded.count(node) > 0; }),
                            nodes.end());
                return nodes;
            };
            std::vector<int> averaged;
            auto equations = card.keyword == "MPC"
                                 ? readMultiPointConstraints(card, nodesOf, positionOf, averaged)
                                 : readEquations(card, nodesOf);
            for (const int node : averaged) m_averagedNodes.emplace_back(card, node);
            for (DeckEquation& equation : equations) {
                for (const auto& term : equation.terms) {
                    positionOf(term.node);
                    if (!m_rotationNodes.count(term.node)) m_extraNodes.push_back(term.node);
                }
                if (card.keyword == "EQUATION") turnTerms(card, equation);
                m_constraints.equations.push_back(std::move(equation));
            }
        }
    }

    /** A *SURFACE in mesh indices, or the reason why it was not found. **/
    struct Surface {
        std::vector<std::vector<int>> faces;
        std::vector<int> nodes;
        std::string problem;
    };

    /** Resolves surfaces and the node sets of their names. **/
    void finishSurfaces() {
        if (m_surfaceCards.empty()) return;
        std::unordered_map<int, std::pair<ElementType, const DeckModel::Solid*>> solidOf;
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids) solidOf[solid.number] = {getSolid(type), &solid};
        for (const DeckCard& card : m_surfaceCards) {
            const std::string& name = card.get("NAME");
            Surface& surface = m_surfaces[name];
            try {
                for (const DeckLine& data : card.data) {
                    if (card.has("TYPE") && card.get("TYPE") == "NODE") {
                        for (const int number : findNodes(card, data)) {
                            const auto found = m_indexOf.find(number);
                            if (found != m_indexOf.end()) surface.nodes.push_back(found->second);
                        }
                        continue;
                    }
                    for (const int number : findElements(card, data)) {
                        const auto found = solidOf.find(number);
                        if (found == solidOf.end())
                            refuseCard(card,
                                       "element " + std::to_string(number) + " is not a solid",
                                       data.line);
                        surface.faces.push_back(findFace(card, data, number, found->second.first,
                                                         found->second.second));
                    }
                }
            } catch (const std::invalid_argument& error) {
                surface.problem = error.what();
                m_model.notes.push_back("left out *SURFACE " + name + ": " + surface.problem);
                continue;
            }
            for (const auto& face : surface.faces)
                surface.nodes.insert(surface.nodes.end(), face.begin(), face.end());
            sortUnique(surface.nodes);
            if (surface.nodes.empty()) continue;
            const auto [set, isNew] = m_model.mesh.nodeSets.insert({name, surface.nodes});
            if (!isNew && set->second != surface.nodes)
                m_model.warnings.push_back(card.where() + "the deck has a *NSET " + name +
                                           " too; it, not the *SURFACE, is what an interface of "
                                           "that name takes");
        }
    }

    std::vector<int> findElements(const DeckCard& card, const DeckLine& data) const {
        const std::string& field = data.fields[0];
        if (isDeckNumber(field)) return {parseDeckInteger(field, card.where(data.line))};
        const auto set = m_elementSets.find(field);
        if (set == m_elementSets.end())
            refuseCard(
                card, card.title + " names element set " + field + ", which the deck does not have",
                data.line);
        return set->second;
    }

    std::vector<int> findFace(const DeckCard& card, const DeckLine& data, int number,
                              ElementType type, const DeckModel::Solid* solid) const {
        std::string label = data.fields.size() > 1 ? data.fields[1] : "";
        const auto thin = m_thinIndex.find(number);
        if (thin != m_thinIndex.end()) {
            if (findThinType(m_thin[thin->second].type)->isBeam)
                refuseCard(card,
                           "element " + std::to_string(number) + " is a beam, which has no faces",
                           data.line);
            if (label == "SNEG") label = "S1";
            if (label == "SPOS") label = "S2";
        }
        std::vector<int> face;
        if (label.size() == 2 && label[0] == 'S') face = getFaceNodes(type, label[1] - '0');
        if (face.empty())
            refuseCard(card,
                       "'" + label + "' is not a face of element " + std::to_string(number) +
                           ", a " + m_solidNumbers.at(number) + "; faces are S1, S2, …",
                       data.line);
        for (int& node : face) node = m_indexOf.at(solid->nodes[size_t(node)]);
        return face;
    }

    void readTies() {
        for (const DeckCard& card : m_tieCards) {
            DeckTie tie;
            for (const auto& [parameter, value] : card.parameters) {
                if (parameter == "NAME") continue;
                if (parameter == "POSITIONTOLERANCE") {
                    tie.tolerance = parseDeckNumber(card.get(parameter), card.where());
                } else if (parameter == "ADJUST") {
                    tie.adjust = value != "NO";
                } else if (parameter == "TYPE") {
                    if (value == "SURFACETOSURFACE")
                        m_model.warnings.push_back(
                            card.where() +
                            "*TIE, TYPE=SURFACE TO SURFACE ties node by node, as "
                            "CalculiX does");
                } else {
                    refuseCard(card, "*TIE with " + parameter + " is not known to simflex");
                }
            }
            tie.where = card.where() + "*TIE" + (card.has("NAME") ? " " + card.get("NAME") : "");
            if (card.data.empty() || card.data[0].fields.size() != 2)
                refuseCard(card, "*TIE needs a line 'slave surface, master surface'");
            const int line = card.data[0].line;
            const auto find = [&](size_t field) -> const Surface& {
                const std::string& name = card.data[0].fields[field];
                const auto found = m_surfaces.find(name);
                if (found == m_surfaces.end())
                    refuseCard(card,
                               "*TIE names surface " + name + ", which the deck does not have",
                               line);
                if (!found->second.problem.empty())
                    throw std::invalid_argument(found->second.problem);
                return found->second;
            };
            tie.slaves = find(0).nodes;
            tie.faces = find(1).faces;
            if (tie.slaves.empty())
                refuseCard(card, "the slave surface of *TIE has no nodes", line);
            if (tie.faces.empty())
                refuseCard(card, "the master surface of *TIE has no faces; TYPE=ELEMENT is needed",
                           line);
            m_constraints.ties.push_back(std::move(tie));
        }
    }

    void readInitialConditions(const DeckCard& card) {
        static const std::set<std::string> Harmless = {"DISPLACEMENT",  "VELOCITY", "PLASTICSTRAIN",
                                                       "FLUIDVELOCITY", "MASSFLOW", "TOTALPRESSURE",
                                                       "PRESSURE",      "SOLUTION"};
        const std::string& type = card.get("TYPE");
        if (card.has("USER") && type == "TEMPERATURE")
            refuseCard(card, card.title +
                                 " with USER: simflex cannot know what its routine gives; "
                                 "write the numbers out");
        if (type == "TEMPERATURE") {
            m_temperatureCards.push_back(card);
        } else if (Harmless.count(type)) {
            noteLeftOut(card.title + ", TYPE=" + type, card);
        } else {
            refuseCard(card,
                       card.title + ", TYPE=" + type +
                           (type == "STRESS" ? " cannot be part of a flexible body: stress "
                                               "makes the part stiffer or softer; if it is to "
                                               "be as without it, take the card out"
                                             : " is not known to simflex"));
        }
    }

    void readTemperatures() {
        for (const DeckCard& card : m_temperatureCards)
            for (const DeckLine& data : card.data) {
                const double value =
                    readDeckNumber(card, data, 1, "a node or node set and its temperature");
                for (size_t k = 2; k < data.fields.size(); ++k)
                    if (!data.fields[k].empty())
                        refuseCard(card,
                                   card.title +
                                       " gives more than one temperature at a node, which simflex "
                                       "does not support",
                                   data.line);
                for (const int node : findNodes(card, data)) m_temperatures.ofNode[node] = value;
            }
        for (const ThinElement& element : m_thin)
            for (const int node : element.nodes)
                if (!m_middles.count(node))
                    m_temperatures.thinNodes[element.number].push_back(node);
    }

    /** Calls visit(card, element) for each element referred to by cards of the keyword. **/
    template <class Visit>
    void visitPoints(const char* keyword, const Visit& visit) const {
        std::set<int> given;
        for (const DeckCard& card : m_pointCards) {
            if (card.keyword != keyword) continue;
            const auto set = m_elementSets.find(card.get("ELSET"));
            if (set == m_elementSets.end())
                refuseCard(card, card.title + " names element set " + card.get("ELSET") +
                                     ", which the deck does not have");
            for (const int number : set->second) {
                const auto element = m_pointElements.find(number);
                if (element == m_pointElements.end() ||
                    getPointCard(element->second.type) != keyword)
                    refuseCard(card, card.title + " names element " + std::to_string(number) +
                                         ", which is of another type");
                if (!given.insert(number).second)
                    refuseCard(card,
                               "element " + std::to_string(number) + " has two " + card.title);
                for (const int node : element->second.nodes)
                    if (!m_nodes.count(node))
                        throw std::invalid_argument(element->second.where + "element " +
                                                    std::to_string(number) + " uses node " +
                                                    std::to_string(node) +
                                                    ", which the deck does not define");
                visit(card, element->second);
            }
        }
        for (const auto& [number, element] : m_pointElements)
            if (getPointCard(element.type) == keyword && !given.count(number))
                throw std::invalid_argument(element.where + "element " + std::to_string(number) +
                                            ", a " + element.type + ", has no *" + keyword);
    }

    /** Reads masses, inertias and springs and adds their nodes to the mesh. **/
    void readPointCards() {
        visitPoints("MASS", [&](const DeckCard& card, const PointElement& element) {
            if (card.data.empty()) refuseCard(card, card.title + " needs a mass");
            const double mass = readDeckNumber(card, card.data[0], 0, "a mass");
            if (!(mass > 0))
                refuseCard(card,
                           card.title + " is " + card.data[0].fields[0] + "; it must be positive",
                           card.data[0].line);
            m_model.masses[element.nodes[0]] += mass;
            m_extraNodes.push_back(element.nodes[0]);
        });
        visitPoints("ROTARYINERTIA", [&](const DeckCard& card, const PointElement& element) {
            addInertia(card, element.nodes[0]);
        });
        visitPoints("SPRING", [&](const DeckCard& card, const PointElement& element) {
            if (card.has("NONLINEAR"))
                refuseCard(card, card.title +
                                     ", NONLINEAR: simflex has linear springs in a part; give its "
                                     "stiffness about the state you need, or put it into the "
                                     "multibody model");
            if (element.type == "SPRING1") {
                static const std::string Grounds =
                    "they hold the part to the ground; put them into the multibody model";
                return noteLeftOut(card.title + " of SPRING1", card, &Grounds);
            }
            std::array<Vec3d, 2> places{};
            for (size_t k = 0; k < 2; ++k) places[k] = m_nodes.at(element.nodes[k]);
            const auto axes = findAxes(card, places[0]);
            m_model.springs.push_back(readSpring(card, element, places, axes ? &*axes : nullptr));
        });
        visitPoints("DASHPOT", [&](const DeckCard& card, const PointElement&) {
            noteLeftOut(card.title, card, findConsequence("DAMPING"));
        });
        visitPoints("GAP",
                    [&](const DeckCard& card, const PointElement&) { leaveContactOut(card); });
        visitPoints("DISTRIBUTINGCOUPLING", [&](const DeckCard& card, const PointElement& element) {
            m_averagedNodes.emplace_back(card, element.nodes[0]);
        });
    }

    /** Returns the nodes of elements and rigid bodies. **/
    std::set<int> listHeldNodes() const {
        std::set<int> held;
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids) held.insert(solid.nodes.begin(), solid.nodes.end());
        for (const auto& [node, expanded] : m_constraints.thin.expandedOf) held.insert(node);
        for (const HingedElement& element : m_model.hinged)
            held.insert(element.nodes.begin(), element.nodes.end());
        for (const DeckRigidCard& body : m_rigidCards) {
            held.insert({body.reference, body.rotation});
            const auto set = m_nodeSets.find(body.nodeSet);
            if (set != m_nodeSets.end()) held.insert(set->second.begin(), set->second.end());
        }
        return held;
    }

    /** Removes a node used only by equations, in some directions: it moves freely in the others.
    Eliminating it leaves the relations among the other nodes unchanged. **/
    void dropLooseNodes() {
        std::vector<DeckEquation>& equations = m_constraints.equations;
        if (equations.empty()) return;
        std::set<int> held = listHeldNodes();
        for (const auto& [node, mass] : m_model.masses) held.insert(node);
        for (const DeckSpring& spring : m_model.springs)
            held.insert(spring.nodes.begin(), spring.nodes.end());
        std::map<int, std::set<int>> axesOf;
        for (const DeckEquation& equation : equations)
            for (const auto& term : equation.terms)
                if (!held.count(term.node)) axesOf[term.node].insert(term.axis);
        std::set<int> dropped;
        for (const auto& [node, axes] : axesOf) {
            if (axes.size() == 3) continue;
            dropped.insert(node);
            for (const int axis : axes) eliminate(equations, node, axis);
        }
        if (dropped.empty()) return;
        m_extraNodes.erase(std::remove_if(m_extraNodes.begin(), m_extraNodes.end(),
                                          [&](int node) { return dropped.count(node) > 0; }),
                           m_extraNodes.end());
        m_model.notes.push_back(
            plural(dropped.size(), "node") + " of equations alone left out, the first is " +
            std::to_string(*dropped.begin()) + ": what holds them is no part of it");
    }

    /** Eliminates a translation from all equations by the one with its largest coefficient, which
    is removed. **/
    static void eliminate(std::vector<DeckEquation>& equations, int node, int axis) {
        const auto coefficientOf = [&](const DeckEquation& equation) {
            double sum = 0;
            for (const auto& term : equation.terms)
                if (term.node == node && term.axis == axis) sum += term.coefficient;
            return sum;
        };
        const auto isLess = [&](const DeckEquation& a, const DeckEquation& b) {
            return std::abs(coefficientOf(a)) < std::abs(coefficientOf(b));
        };
        const auto most = std::max_element(equations.begin(), equations.end(), isLess);
        if (most == equations.end() || coefficientOf(*most) == 0) return;
        const DeckEquation rule = *most;
        equations.erase(most);
        for (DeckEquation& equation : equations) {
            const double factor = -coefficientOf(equation) / coefficientOf(rule);
            if (factor == 0) continue;
            std::map<std::pair<int, int>, double> sums;
            for (const auto& term : equation.terms)
                sums[{term.node, term.axis}] += term.coefficient;
            for (const auto& term : rule.terms)
                sums[{term.node, term.axis}] += factor * term.coefficient;
            sums.erase({node, axis});
            equation.terms.clear();
            for (const auto& [at, coefficient] : sums)
                if (coefficient != 0) equation.terms.push_back({at.first, at.second, coefficient});
        }
    }

    /** Removes springs to otherwise unused nodes, for instance those held by a *BOUNDARY: they
    exert no force. **/
    void finishSprings() {
        std::vector<DeckSpring>& springs = m_model.springs;
        if (springs.empty()) return;
        std::set<int> held = listHeldNodes();
        held.insert(m_extraNodes.begin(), m_extraNodes.end());
        for (size_t before = 0; before != springs.size();) {
            before = springs.size();
            std::map<int, int> uses;
            for (const DeckSpring& spring : springs)
                for (const int node : spring.nodes) ++uses[node];
            const auto isLoose = [&](const DeckSpring& spring) {
                for (const int node : spring.nodes)
                    if (!held.count(node) && uses[node] == 1) {
                        m_model.warnings.push_back(
                            "left out the spring from node " + std::to_string(spring.nodes[0]) +
                            " to " + std::to_string(spring.nodes[1]) + ": node " +
                            std::to_string(node) +
                            " belongs to nothing else; a spring to the ground belongs into the "
                            "multibody model");
                        return true;
                    }
                return false;
            };
            springs.erase(std::remove_if(springs.begin(), springs.end(), isLoose), springs.end());
        }
        for (const DeckSpring& spring : springs)
            m_extraNodes.insert(m_extraNodes.end(), spring.nodes.begin(), spring.nodes.end());
    }

    /** Returns the axes of a card's ORIENTATION at a point, if it has one. **/
    std::optional<Axes> findAxes(const DeckCard& card, const Vec3d& place) const {
        if (!card.has("ORIENTATION")) return {};
        for (const DeckCard& section : m_model.sections)
            if (section.keyword == "ORIENTATION" && section.get("NAME") == card.get("ORIENTATION"))
                return parseOrientation(section).calcAxes(place);
        refuseCard(card, "the deck has no *ORIENTATION " + card.get("ORIENTATION"));
    }

    /** Adds point masses that follow the node's rigid body and have its inertia. **/
    void addInertia(const DeckCard& card, int node) {
        const auto body =
            std::find_if(m_rigidCards.begin(), m_rigidCards.end(), [&](const DeckRigidCard& rigid) {
                if (rigid.isDistributing) return false;
                if (rigid.reference == node || rigid.rotation == node) return true;
                const auto set = m_nodeSets.find(rigid.nodeSet);
                return set != m_nodeSets.end() &&
                       std::find(set->second.begin(), set->second.end(), node) != set->second.end();
            });
        if (body == m_rigidCards.end())
            refuseCard(card, card.title + " stands in node " + std::to_string(node) +
                                 ", which has no rotation: tie it to the part by *RIGID BODY or "
                                 "*COUPLING with *KINEMATIC, or weld a rigid body to an "
                                 "interface");
        const Vec3d place = m_nodes.at(node);
        double size = 0;
        for (const auto& [number, position] : m_nodes)
            size = std::max(size, normOf(minus(position, place)));
        constexpr double Near = 0.01;  // relative to the part's size
        const auto given = m_model.masses.find(node);
        const double mass = given == m_model.masses.end() ? 0 : given->second;
        const auto axes = findAxes(card, place);
        double left = mass;
        for (const PointMass& point :
             spreadInertia(card, mass, Near * size, axes ? &*axes : nullptr)) {
            if (!(point.mass > 0)) continue;
            const int number = m_nodes.rbegin()->first + 1;
            m_nodes[number] = sumOf(place, 1, point.arm);
            m_model.masses[number] = point.mass;
            m_extraNodes.push_back(number);
            m_inertiaNodes[body->reference].push_back(number);
            left -= point.mass;
        }
        m_model.masses[node] = mass > 0 ? 0 : left;
        m_extraNodes.push_back(node);
    }

    void checkRigidNodes() {
        for (const DeckRigidCard& body : m_rigidCards)
            for (const int node : {body.reference, body.rotation}) {
                if (node == 0) continue;  // not given
                if (!m_nodes.count(node))
                    refuseCard(body.card, body.card.title + " names node " + std::to_string(node) +
                                              ", which the deck does not define");
                if (node == body.rotation) m_rotationNodes.insert(node);
            }
    }

    /** Returns the mesh indices of the nodes that follow. **/
    std::vector<int> findFollowers(const DeckRigidCard& body) const {
        std::vector<int> nodes;
        const auto add = [&](int number) {
            const auto found = m_indexOf.find(number);
            if (found != m_indexOf.end() && number != body.reference)
                nodes.push_back(found->second);
        };
        if (const auto found = m_inertiaNodes.find(body.reference); found != m_inertiaNodes.end())
            for (const int number : found->second) add(number);
        const auto refuseSet = [&](const char* kind, const std::string& name) {
            refuseCard(body.card, body.card.title + " names " + kind + " " + name +
                                      ", which the deck does not have");
        };
        if (!body.surface.empty()) {
            const auto surface = m_surfaces.find(body.surface);
            if (surface == m_surfaces.end()) refuseSet("surface", body.surface);
            if (!surface->second.problem.empty())
                throw std::invalid_argument(surface->second.problem);
            for (const int node : surface->second.nodes)
                add(m_model.mesh.nodeNumbers[size_t(node)]);
        } else if (!body.nodeSet.empty()) {
            const auto set = m_nodeSets.find(body.nodeSet);
            if (set == m_nodeSets.end()) refuseSet("node set", body.nodeSet);
            for (const int number : set->second) add(number);
        } else {
            const auto set = m_elementSets.find(body.elementSet);
            if (set == m_elementSets.end()) refuseSet("element set", body.elementSet);
            const std::set<int> numbers(set->second.begin(), set->second.end());
            for (const auto& [type, solids] : m_model.solids)
                for (const auto& solid : solids)
                    if (numbers.count(solid.number))
                        for (const int number : solid.nodes) add(number);
        }
        sortUnique(nodes);
        if (nodes.empty())
            refuseCard(body.card, body.card.title + " ties no node of the part's elements");
        return nodes;
    }

    /** Notes nodes that are the mean of others, which add no stiffness, and refuses them if
    anything else uses them. **/
    void noteAveragedNodes() {
        for (const auto& [card, node] : m_averagedNodes) {
            if (m_indexOf.count(node))
                refuseCard(card, card.title + " hangs node " + std::to_string(node) +
                                     " on the mean of others, and something else uses that node: "
                                     "simflex does not support that in a deck; make the nodes a "
                                     "distributing interface instead");
            m_model.notes.push_back(card.where() + card.title +
                                    " stiffens nothing; loads on its node are left out");
        }
    }

    void makeRigidBodies() {
        noteAveragedNodes();
        std::map<int, int> numUses;  // by reference node
        for (const DeckRigidCard& body : m_rigidCards) ++numUses[body.reference];
        int next = std::numeric_limits<int>::min();
        for (const DeckRigidCard& card : m_rigidCards) {
            DeckRigidBody body;
            body.where = card.where();
            body.nodes = findFollowers(card);
            const auto inMesh = m_indexOf.find(card.reference);
            if (card.isDistributing) {
                if (inMesh != m_indexOf.end() || numUses[card.reference] > 1)
                    refuseCard(card.card, "*DISTRIBUTING hangs reference node " +
                                              std::to_string(card.reference) +
                                              " on the mean of others, and something else uses "
                                              "that node: simflex does not support that in a deck; "
                                              "make the surface a distributing interface instead");
                m_model.notes.push_back(body.where +
                                        " with *DISTRIBUTING stiffens nothing; loads on its "
                                        "reference node are left out");
                continue;
            }
            const bool holdsTurns =
                std::any_of(body.nodes.begin(), body.nodes.end(), [&](int node) {
                    return m_constraints.thin.nodes.count(m_model.mesh.nodeNumbers[size_t(node)]);
                });
            if (holdsTurns && m_model.masses.count(card.reference) &&
                card.card.title == "*RIGID BODY")
                m_model.warnings.push_back(
                    body.where +
                    " holds the rotations of shells or beams as well, where in CalculiX a row of "
                    "nodes is a hinge: what its mass does differs");
            if (m_indexOf.count(card.rotation))
                refuseCard(card.card, "ROT NODE " + std::to_string(card.rotation) +
                                          " is a node of elements; give one of its own");
            // Without a reference node, the body gets its own reference.
            body.reference = card.reference ? card.reference : next++;
            if (card.reference)
                body.place = m_nodes.at(card.reference);
            else if (!body.nodes.empty())
                std::copy_n(m_model.mesh.positions.begin() + 3 * body.nodes[0], 3,
                            body.place.begin());
            body.isReferenceInMesh = inMesh != m_indexOf.end();
            body.rotation = card.rotation        ? card.rotation
                            : card.surface != "" ? -card.reference
                                                 : next++;
            if (!card.surface.empty()) findDirections(card, body);
            m_constraints.bodies.push_back(std::move(body));
        }
    }

    /** Of the model, for geometric stiffness. **/
    void listRigidBodies() {
        std::vector<char> isTaken(size_t(m_model.mesh.numNodes()), 0);
        for (const DeckRigidBody& body : m_constraints.bodies) {
            std::vector<int> nodes = body.nodes;
            if (body.isReferenceInMesh) nodes.push_back(m_model.mesh.indexOf(body.reference));
            std::sort(nodes.begin(), nodes.end());
            nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
            m_model.hasOtherBodies |= !body.directions.empty();
            for (const int node : nodes) {
                m_model.hasOtherBodies |= isTaken[size_t(node)] != 0;
                isTaken[size_t(node)] = 1;
            }
            m_model.rigidBodies.push_back(std::move(nodes));
        }
        std::set<int> references, rotations;
        for (const DeckRigidBody& body : m_constraints.bodies)
            m_model.hasOtherBodies |= !references.insert(body.reference).second ||
                                      !rotations.insert(body.rotation).second;
    }

    /** The directions in which the nodes of a *COUPLING follow; masses that are an inertia do in
     * all.
     * **/
    void findDirections(const DeckRigidCard& card, DeckRigidBody& body) const {
        if (card.axes == std::array<bool, 3>{true, true, true}) return;
        std::optional<Orientation> orientation;
        for (const DeckCard& section : m_model.sections)
            if (section.keyword == "ORIENTATION" && section.get("NAME") == card.orientation)
                orientation = parseOrientation(section);
        if (!card.orientation.empty() && !orientation)
            refuseCard(card.card, "the deck has no *ORIENTATION " + card.orientation);
        for (const int node : body.nodes) {
            const int number = m_model.mesh.nodeNumbers[size_t(node)];
            if (const auto own = m_inertiaNodes.find(card.reference);
                own != m_inertiaNodes.end() &&
                std::count(own->second.begin(), own->second.end(), number) > 0) {
                body.directions.push_back({{1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
                continue;
            }
            if (!orientation && m_axesOf.count(number))
                refuseCard(card.card,
                           "some directions of nodes with a *TRANSFORM follow, which simflex does "
                           "not support; give the axes as its ORIENTATION");
            Axes axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
            if (orientation) axes = orientation->calcAxes(m_model.mesh.position(node));
            std::vector<Vec3d> directions;
            for (size_t a = 0; a < 3; ++a)
                if (card.axes[a]) directions.push_back({axes[0][a], axes[1][a], axes[2][a]});
            body.directions.push_back(std::move(directions));
        }
    }

    /** Builds the mesh from nodes of solids and constrained nodes, in the order of their numbers,
    and their node sets. **/
    void finishMesh() {
        Mesh& mesh = m_model.mesh;
        NumberSet used;
        for (const int number : m_extraNodes) used.insert(number);
        for (const auto& [type, solids] : m_model.solids)
            for (const auto& solid : solids)
                for (const int number : solid.nodes) used.insert(number);
        std::unordered_map<int, int>& indexOf = m_indexOf;
        indexOf.reserve(m_nodes.size());
        for (const auto& [number, position] : m_nodes) {
            if (!used.has(number)) continue;
            indexOf[number] = int(indexOf.size());
            mesh.nodeNumbers.push_back(number);
            mesh.positions.insert(mesh.positions.end(), position.begin(), position.end());
        }
        for (const auto& [type, solids] : m_model.solids) {
            const ElementType kind = getSolid(type);
            for (const auto& solid : solids) {
                const auto thin = m_thinIndex.find(solid.number);
                const bool isShell =
                    thin != m_thinIndex.end() && !findThinType(m_thin[thin->second].type)->isBeam;
                auto block = std::find_if(
                    mesh.elements.begin(), mesh.elements.end(),
                    [&](const ElementBlock& b) { return b.type == kind && b.isShell == isShell; });
                if (block == mesh.elements.end()) {
                    mesh.elements.emplace_back();
                    block = mesh.elements.end() - 1;
                    block->type = kind;
                    block->isShell = isShell;
                }
                for (const int number : solid.nodes) block->nodes.push_back(indexOf[number]);
            }
        }
        for (const auto& [node, expanded] : m_constraints.thin.expandedOf) {
            std::vector<int>& nodes = mesh.expandedNodes[node];
            for (const int number : expanded) nodes.push_back(indexOf.at(number));
            nodes.push_back(indexOf.at(node));
            sortUnique(nodes);
        }
        if (m_nodes.size() > mesh.nodeNumbers.size())
            m_model.notes.push_back("left out " +
                                    plural(m_nodes.size() - mesh.nodeNumbers.size(), "node") +
                                    " of no solid element");
        addSetsOfSkin();
        for (auto& [name, numbers] : m_nodeSets) {
            std::vector<int> nodes;
            size_t unknown = 0;
            sortUnique(numbers);
            for (const int number : numbers) {
                const auto found = indexOf.find(number);
                if (found == indexOf.end()) {
                    ++unknown;
                } else {
                    nodes.push_back(found->second);
                }
            }
            if (unknown)
                m_model.notes.push_back("left " + plural(unknown, "node") +
                                        " of no solid element out "
                                        "of node set " +
                                        name);
            if (!nodes.empty()) mesh.nodeSets[name] = std::move(nodes);
        }
    }

    /** Reduces element sets to their solids; sections may not name anything else. **/
    void finishElementSets() {
        for (auto& [name, numbers] : m_elementSets) {
            sortUnique(numbers);
            std::vector<int> solids;
            for (const int number : numbers)
                if (m_solidNumbers.count(number)) solids.push_back(number);
            if (!solids.empty()) m_model.elementSets[name] = std::move(solids);
        }
        bool hasSection = m_model.solids.empty();
        for (const DeckCard& card : m_model.sections) {
            hasSection |= card.keyword == LayersCard;
            if (card.keyword != "SOLIDSECTION") continue;
            hasSection = true;
            const std::string& set = card.get("ELSET");
            const auto given = m_elementSets.find(set);
            if (given == m_elementSets.end())
                refuseCard(card, "the deck has no element set " + set);
            for (const int number : given->second)
                if (m_skin.count(number) && !m_solidNumbers.count(number))
                    refuseCard(card, card.title + " gives a material to element " +
                                         std::to_string(number) +
                                         ", which is no solid: mesh the whole part with solids");
        }
        if (!hasSection)
            throw std::invalid_argument(m_model.path +
                                        ": the deck has no *SOLID SECTION, so its elements "
                                        "have no material");
    }

    const ProgressCallback& m_progress;
    long m_numReports = 0, m_numGenerated = 0;
    const ContactUse m_contact;
    const ShellUse m_shells;
    std::vector<DeckCard> m_cards;
    DeckModel m_model;
    std::map<int, std::array<double, 3>> m_nodes;
    NumberSet m_nodeNumbers;  ///< defined by *NODE
    Sets m_nodeSets, m_elementSets;
    std::unordered_map<int, std::string> m_solidNumbers;
    std::vector<DeckCard> m_addedMassCards;
    std::map<int, std::array<int, 2>> m_middles;  ///< nodes added to linear beams, between these
    std::unordered_map<int, size_t> m_thinIndex;
    std::vector<ThinElement> m_thin;
    std::map<std::string, std::string> m_axesNames;  ///< by their numbers
    std::set<int> m_distributed;                     ///< lines of sections with a note
    std::vector<DeckCard> m_normalCards, m_thicknessCards, m_equationCards, m_tieCards,
        m_surfaceCards, m_temperatureCards;
    std::vector<DeckRigidCard> m_rigidCards;
    std::set<int> m_rotationNodes;
    DeckTemperatures m_temperatures;
    std::map<std::string, Surface> m_surfaces;
    DeckConstraints m_constraints;
    std::vector<int> m_extraNodes;  ///< belong to the mesh even without element
    std::unordered_map<int, int> m_indexOf;
    std::map<int, size_t> m_axesOf;  ///< index in m_transforms, by node
    std::vector<Orientation> m_transforms;
    std::set<std::string> m_replaced;  ///< element types
    std::vector<DeckCard> m_pointCards;
    std::map<int, PointElement> m_pointElements;
    std::map<int, std::vector<int>> m_inertiaNodes;  ///< by the reference node that they follow
    std::vector<std::pair<DeckCard, int>> m_averagedNodes;
    std::map<int, HingedElement> m_hinged;   ///< by number
    std::map<int, std::vector<int>> m_skin;  ///< left-out elements with their nodes
    std::set<std::string> m_skinTypes;
    size_t m_numSolids = 0;
    std::map<std::string, LeftOut> m_leftOut;
};

}  // namespace

std::vector<DeckCard> readModelCards(const std::string& path, const ProgressCallback& progress,
                                     DeckIncludes includes) {
    const std::string suffix = lowerCase(std::filesystem::path(path).extension().string());
    for (const char* bulk : {".bdf", ".nas", ".dat"})
        if (suffix == bulk) return readNastranCards(path, progress);
    if (suffix == ".cdb") return readAnsysCards(path, progress);
    std::vector<DeckCard> cards = readDeckCards(path, progress, includes);
    applyParameters(cards);
    return cards;
}

DeckModel buildDeckModel(const std::string& path, std::vector<DeckCard> cards, ContactUse contact,
                         ShellUse shells, const ProgressCallback& progress) {
    try {
        return Builder(path, std::move(cards), contact, shells, progress).build();
    } catch (const BadElementShape&) {
        throw;
    } catch (const std::invalid_argument& error) {
        // Prefix errors without location by the deck.
        const std::string text = error.what();
        throw std::invalid_argument(text.find(path) == std::string::npos ? path + ": " + text
                                                                         : text);
    }
}

}  // namespace simflex
