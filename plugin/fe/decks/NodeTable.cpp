#include "NodeTable.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <numeric>
#include <set>
#include <stdexcept>

#include "BulkCards.h"
#include "DeckAssembly.h"
#include "DeckModel.h"
#include "DeckVocabulary.h"
#include "InpCards.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

using Sets = std::map<std::string, std::vector<int>>;

struct ListedNode {
    int number = 0;
    std::array<double, 3> position{};
};

/** Sorts the nodes by number and keeps their original order.
@throws std::invalid_argument if a number is repeated. **/
NodeTable sortNodes(const std::string& path, const std::vector<ListedNode>& listed) {
    if (listed.empty()) throw std::invalid_argument(path + ": there are no nodes in it");
    std::vector<int> byNumber(listed.size());
    std::iota(byNumber.begin(), byNumber.end(), 0);
    std::sort(byNumber.begin(), byNumber.end(), [&](int a, int b) {
        return listed[size_t(a)].number != listed[size_t(b)].number
                   ? listed[size_t(a)].number < listed[size_t(b)].number
                   : a < b;
    });
    NodeTable table;
    table.order.resize(listed.size());
    for (const int k : byNumber) {
        const ListedNode& node = listed[size_t(k)];
        if (!table.mesh.nodeNumbers.empty() && table.mesh.nodeNumbers.back() == node.number)
            throw std::invalid_argument(path + ": node " + std::to_string(node.number) +
                                        " is listed twice");
        table.order[size_t(k)] = table.mesh.numNodes();
        table.mesh.nodeNumbers.push_back(node.number);
        table.mesh.positions.insert(table.mesh.positions.end(), node.position.begin(),
                                    node.position.end());
    }
    return table;
}

NodeTable readTable(const std::string& path) {
    TextLines lines(path, "node table");
    std::vector<ListedNode> listed;
    std::vector<std::string_view> fields;
    bool mayBeHeader = true;
    while (lines.next()) {
        const std::string_view text = trimBlanks(lines.line());
        if (text.empty() || std::string_view("#%!*$").find(text[0]) != std::string_view::npos)
            continue;
        splitFields(text, fields);
        double ignored = 0;
        if (mayBeHeader && (fields.empty() || !readNumber(fields[0], ignored))) {
            mayBeHeader = false;
            continue;
        }
        mayBeHeader = false;
        if (fields.size() != 4)
            lines.refuse("the line has " + std::to_string(fields.size()) +
                         " fields; it must have four: node number, x, y, z");
        ListedNode node;
        node.number = lines.parseInteger(fields[0], "the node number");
        if (node.number < 1) lines.refuse("node numbers begin at 1");
        for (size_t a = 0; a < 3; ++a)
            node.position[a] = lines.parseNumber(fields[a + 1], "a coordinate");
        listed.push_back(node);
    }
    return sortNodes(path, listed);
}

NodeTable readGrids(const std::string& path) {
    BulkCards cards(path, "bulk data file", {"GRID", "GRDSET"});
    std::vector<ListedNode> listed;
    const auto checkBasic = [&](const BulkCard& card, size_t place, const char* what) {
        if (cards.parseInteger(card, card.field(place), what) > 0)
            cards.refuse(card, std::string(what) + " is " + std::string(card.field(place)) +
                                   "; simflex reads grids in the basic system (0 or blank) alone: "
                                   "write them out so, positions and displacements");
    };
    for (BulkCard card; cards.next(card);) {
        checkBasic(card, 1, "CP");
        checkBasic(card, 5, "CD");
        if (card.name == "GRDSET") continue;
        ListedNode node;
        node.number = cards.parseInteger(card, card.field(0), "the grid number");
        if (node.number < 1) cards.refuse(card, "grid numbers begin at 1");
        for (size_t a = 0; a < 3; ++a)
            node.position[a] = cards.parseNumber(card, card.field(a + 2), "a coordinate");
        listed.push_back(node);
    }
    if (listed.empty())
        throw std::invalid_argument(path +
                                    ": there are no GRID entries in it; give the bulk data "
                                    "file with the grids as --nodes");
    return sortNodes(path, listed);
}

/** Reads nodes, solids and node sets of an Abaqus or CalculiX deck; everything else is ignored. **/
class DeckNodes {
public:
    explicit DeckNodes(const std::string& path) : m_path(path), m_cards(readDeckCards(path)) {}

    NodeTable read() {
        for (const DeckCard& card : m_cards) {
            if (card.keyword == "PART" && ++m_numParts > 1)
                refuse(card, card.line,
                       "the deck has several parts, whose node numbers are not those of the "
                       "matrices; write a deck without parts and instances");
            if (card.keyword == "INSTANCE") checkInstance(card);
        }
        std::vector<std::string> notes;  // only used with several instances
        for (const DeckCard& card : flattenAssembly(std::move(m_cards), notes)) {
            if (card.keyword == "STEP") break;
            if (card.keyword == "NODE") addNodes(card);
            if (card.keyword == "ELEMENT") addElements(card);
            if (card.keyword == "NSET") addSet(card);
        }
        NodeTable table = sortNodes(m_path, m_listed);
        for (auto& [type, nodes] : m_elements) addBlock(type, nodes, table.mesh);
        for (auto& [name, numbers] : m_sets) {
            std::vector<int> nodes;
            for (const int number : numbers) {
                const int index = find(table.mesh, number);
                if (index >= 0) nodes.push_back(index);
            }
            std::sort(nodes.begin(), nodes.end());
            nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
            if (!nodes.empty()) table.mesh.nodeSets[name] = std::move(nodes);
        }
        return table;
    }

private:
    [[noreturn]] static void refuse(const DeckCard& card, int line, const std::string& why) {
        throw std::invalid_argument(card.where(line) + why);
    }

    static int find(const Mesh& mesh, int number) {
        const auto found =
            std::lower_bound(mesh.nodeNumbers.begin(), mesh.nodeNumbers.end(), number);
        const bool isThere = found != mesh.nodeNumbers.end() && *found == number;
        return isThere ? int(found - mesh.nodeNumbers.begin()) : -1;
    }

    void checkInstance(const DeckCard& card) {
        if (++m_numInstances > 1)
            refuse(card, card.line,
                   "the deck has several instances, whose node numbers are not those of the "
                   "matrices; write a deck without parts and instances");
        if (!card.data.empty())
            refuse(card, card.data[0].line,
                   "the instance is moved, so that the part's coordinates are not those of the "
                   "matrices; write a deck without parts and instances");
    }

    void addNodes(const DeckCard& card) {
        if (card.has("SYSTEM") && card.get("SYSTEM") != "R")
            refuse(card, card.line, "*NODE with SYSTEM is not known here: give plain coordinates");
        std::vector<int>* set = card.has("NSET") ? &m_sets[card.get("NSET")] : nullptr;
        for (const DeckLine& data : card.data) {
            const std::string where = card.where(data.line);
            ListedNode node;
            if (data.fields.empty()) continue;
            node.number = parseDeckInteger(data.fields[0], where);
            if (node.number < 1) refuse(card, data.line, "node numbers begin at 1");
            for (size_t a = 0; a < 3 && a + 1 < data.fields.size(); ++a)
                if (!data.fields[a + 1].empty())
                    node.position[a] = parseDeckNumber(data.fields[a + 1], where);
            m_listed.push_back(node);
            if (set) set->push_back(node.number);
        }
    }

    void addElements(const DeckCard& card) {
        ElementType type;
        try {
            type = getSolid(card.get("TYPE"));
        } catch (const std::out_of_range&) {
            return;
        }
        const size_t size = size_t(numNodesOf(type)) + 1;
        std::vector<int> numbers;
        for (const DeckLine& data : card.data) {
            for (const std::string& field : data.fields)
                if (!field.empty())
                    numbers.push_back(parseDeckInteger(field, card.where(data.line)));
            if (numbers.size() > size)
                refuse(card, data.line,
                       "element " + std::to_string(numbers[0]) + " has more nodes than its type " +
                           card.get("TYPE"));
            if (numbers.size() < size) continue;
            auto& nodes = m_elements[type];
            nodes.insert(nodes.end(), numbers.begin() + 1, numbers.end());
            numbers.clear();
        }
        if (!numbers.empty())
            refuse(card, card.data.back().line,
                   "element " + std::to_string(numbers[0]) + " has fewer nodes than its type " +
                       card.get("TYPE"));
    }

    void addSet(const DeckCard& card) {
        std::vector<int> members;
        std::set<std::string> included;
        for (const DeckLine& data : card.data) {
            const std::string where = card.where(data.line);
            if (card.has("GENERATE")) {
                if (data.fields.size() < 2)
                    refuse(card, data.line, "GENERATE needs first, last[, step]");
                const int first = parseDeckInteger(data.fields[0], where);
                const int last = parseDeckInteger(data.fields[1], where);
                const int step = data.fields.size() > 2 && !data.fields[2].empty()
                                     ? parseDeckInteger(data.fields[2], where)
                                     : 1;
                if (step < 1) refuse(card, data.line, "the step of GENERATE must be positive");
                // Existing nodes only: a range may exceed the memory.
                for (const ListedNode& node : m_listed)
                    if (node.number >= first && node.number <= last &&
                        (long(node.number) - first) % step == 0)
                        members.push_back(node.number);
                continue;
            }
            for (const std::string& field : data.fields) {
                if (field.empty()) continue;
                const auto other = m_sets.find(field);
                if (other != m_sets.end()) {
                    if (!included.insert(field).second) continue;
                    members.insert(members.end(), other->second.begin(), other->second.end());
                } else if (isDigit(field[0])) {
                    members.push_back(parseDeckInteger(field, where));
                }
            }
        }
        std::vector<int>& set = m_sets[card.get("NSET")];
        set.insert(set.end(), members.begin(), members.end());
        std::sort(set.begin(), set.end());
        set.erase(std::unique(set.begin(), set.end()), set.end());
    }

    void addBlock(ElementType type, const std::vector<int>& numbers, Mesh& mesh) const {
        ElementBlock block;
        block.type = type;
        for (const int number : numbers) {
            const int index = find(mesh, number);
            if (index < 0)
                throw std::invalid_argument(m_path + ": an element uses node " +
                                            std::to_string(number) +
                                            ", which the deck does not define");
            block.nodes.push_back(index);
        }
        mesh.elements.push_back(std::move(block));
    }

    std::string m_path;
    std::vector<DeckCard> m_cards;
    std::vector<ListedNode> m_listed;
    std::map<ElementType, std::vector<int>> m_elements;
    Sets m_sets;
    int m_numParts = 0, m_numInstances = 0;
};

/** Keeps the marked nodes, the elements whose nodes are all marked and the remaining node sets.
@returns the new index of each node, −1 if left out. **/
std::vector<int> keepNodes(NodeTable& table, const std::vector<char>& used) {
    const Mesh old = std::move(table.mesh);
    Mesh& mesh = table.mesh = Mesh();
    std::vector<int> indexOf(used.size(), -1);
    std::vector<int> left;
    for (size_t node = 0; node < used.size(); ++node) {
        if (!used[node]) {
            left.push_back(old.nodeNumbers[node]);
            continue;
        }
        indexOf[node] = mesh.numNodes();
        const auto x = old.position(int(node));
        mesh.nodeNumbers.push_back(old.nodeNumbers[node]);
        mesh.positions.insert(mesh.positions.end(), x.begin(), x.end());
    }
    size_t numElementsLeft = 0;
    for (const ElementBlock& block : old.elements) {
        ElementBlock kept;
        kept.type = block.type;
        const size_t size = size_t(numNodesOf(block.type));
        for (size_t first = 0; first < block.nodes.size(); first += size) {
            bool isWhole = true;
            for (size_t k = first; k < first + size; ++k)
                isWhole = isWhole && used[size_t(block.nodes[k])];
            numElementsLeft += !isWhole;
            for (size_t k = first; isWhole && k < first + size; ++k)
                kept.nodes.push_back(indexOf[size_t(block.nodes[k])]);
        }
        if (!kept.nodes.empty()) mesh.elements.push_back(std::move(kept));
    }
    for (const auto& [name, nodes] : old.nodeSets) {
        std::vector<int> kept;
        for (const int node : nodes)
            if (used[size_t(node)]) kept.push_back(indexOf[size_t(node)]);
        if (!kept.empty()) mesh.nodeSets[name] = std::move(kept);
    }
    if (!left.empty())
        table.notes.push_back("left out " + std::to_string(left.size()) +
                              (left.size() == 1 ? " node" : " nodes") +
                              " that the matrices do not have (node " + std::to_string(left[0]) +
                              (left.size() > 1 ? ", …)" : ")"));
    if (numElementsLeft)
        table.notes.push_back("left out " + std::to_string(numElementsLeft) +
                              " elements on nodes that the matrices do not have");
    return indexOf;
}

}  // namespace

NodeTable readNodeTable(const std::string& path) {
    const std::string suffix = lowerCase(std::filesystem::path(path).extension().string());
    if (suffix == ".inp") return DeckNodes(path).read();
    for (const char* bulk : {".bdf", ".nas", ".dat", ".blk", ".pch"})
        if (suffix == bulk) return readGrids(path);
    return readTable(path);
}

NodalEntries::NodalEntries(const NodeTable& nodes) {
    m_indexOf.reserve(nodes.mesh.nodeNumbers.size());
    for (const int number : nodes.mesh.nodeNumbers)
        m_indexOf.emplace(number, int(m_indexOf.size()));
}

int NodalEntries::findDof(const TextLines& at, int node, int direction) const {
    const auto found = m_indexOf.find(node);
    if (found == m_indexOf.end())
        at.refuse("the matrix names node " + std::to_string(node) +
                  (node < 1 ? ", an internal one of the FE program (Lagrange multipliers, "
                              "distributing couplings): take what makes it out of the model"
                            : ", which the nodes' file does not list"));
    return 3 * found->second + direction - 1;
}

void NodalEntries::add(const TextLines& at, int node1, int direction1, int node2, int direction2,
                       double value) {
    for (const auto& [node, direction] : {std::pair(node1, direction1), {node2, direction2}}) {
        if (direction >= 1 && direction <= 3) continue;
        if (direction >= 4 && direction <= 6) {
            if (value == 0) return;
            at.refuse("direction " + std::to_string(direction) + " of node " +
                      std::to_string(node) +
                      " is a rotation; simflex needs plain nodal translations: model the part with "
                      "solids, or condense the rotations out of the matrices");
        }
        at.refuse("direction " + std::to_string(direction) + " of node " + std::to_string(node) +
                  " is not a translation (1, 2 or 3)");
    }
    entries.add(findDof(at, node1, direction1), findDof(at, node2, direction2), value);
}

FeModel assembleModel(const std::string& source, const std::string& program, NodeTable nodes,
                      MatrixFile K, MatrixFile M, const ProgressCallback& progress) {
    reportProgress(progress, "checking K and M", 0);
    std::vector<char> used(nodes.mesh.nodeNumbers.size(), 0);
    for (const MatrixEntries* entries : {&K.entries, &M.entries})
        for (size_t k = 0; k < entries->values.size(); ++k) {
            used[size_t(entries->rows[k] / 3)] = 1;
            used[size_t(entries->columns[k] / 3)] = 1;
        }
    if (std::find(used.begin(), used.end(), 1) == used.end())
        throw std::invalid_argument(K.what + " is empty");
    if (std::find(used.begin(), used.end(), 0) != used.end()) {
        const auto indexOf = keepNodes(nodes, used);
        for (MatrixEntries* entries : {&K.entries, &M.entries})
            for (auto* dofs : {&entries->rows, &entries->columns})
                for (auto& dof : *dofs) dof = 3 * indexOf[size_t(dof / 3)] + dof % 3;
    }
    FeModel model;
    model.source = source;
    model.program = program;
    model.mesh = std::move(nodes.mesh);
    model.notes = std::move(nodes.notes);
    model.K = makeSymmetric(K.entries, K.form, model.mesh, K.what);
    K.entries = {};
    const SymmetricMatrix mass = makeSymmetric(M.entries, M.form, model.mesh, M.what);
    M.entries = {};
    try {
        model.m = takeNodalMass(mass, model.mesh);
    } catch (const std::invalid_argument& error) {
        throw std::invalid_argument(M.what + ": " + error.what());
    }
    model.validate();
    return model;
}

}  // namespace simflex
