#include "DeckGenerators.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

const std::map<std::string, std::set<std::string>> GeneratorParameters = {
    {"NGEN", {"NSET", "LINE"}},
    {"NFILL", {"NSET"}},
    {"NCOPY", {"OLDSET", "NEWSET", "CHANGENUMBER", "SHIFT"}},
    {"ELGEN", {"ELSET"}},
    {"ELCOPY", {"OLDSET", "NEWSET", "ELEMENTSHIFT", "SHIFTNODES"}}};

class Generator {
public:
    Generator(const DeckCard& card, const GeneratorModel& model) : m_card(card), m_model(model) {}

    std::vector<DeckCard> make() {
        for (const auto& [parameter, value] : m_card.parameters)
            if (!GeneratorParameters.at(m_card.keyword).count(parameter))
                refuseCard(m_card, m_card.title + " with " + parameter +
                                       " is not known to simflex; write the deck out with what it "
                                       "makes");
        if (m_card.keyword == "NGEN") fillLines();
        if (m_card.keyword == "NFILL") fillBetween();
        if (m_card.keyword == "NCOPY") copyNodes();
        if (m_card.keyword == "ELGEN") repeatElements();
        if (m_card.keyword == "ELCOPY") copyElements();
        return std::move(m_made);
    }

private:
    /** Returns an integer of a data line, or `other` if it is missing. **/
    int number(const DeckLine& data, size_t field, int other) const {
        if (field >= data.fields.size() || data.fields[field].empty()) return other;
        return parseDeckInteger(data.fields[field], m_card, data);
    }

    DeckCard& add(const char* title) {
        DeckCard card;
        card.setTitle(title);
        card.file = m_card.file;
        card.line = m_card.line;
        m_made.push_back(std::move(card));
        return m_made.back();
    }

    static void addLine(DeckCard& card, std::vector<std::string> fields, int line) {
        DeckLine data;
        data.line = line;
        data.fields = std::move(fields);
        card.data.push_back(std::move(data));
    }

    void addNode(DeckCard& card, int node, const Vec3d& x, int line) {
        addLine(card,
                {std::to_string(node), writeGeneral(x[0]), writeGeneral(x[1]), writeGeneral(x[2])},
                line);
        m_model.report();
    }

    /** Adds evenly spaced nodes between two existing ones. **/
    void addBetween(DeckCard& card, int first, int last, int count, int step, int line) {
        const Vec3d a = m_model.positionOf(first), b = m_model.positionOf(last);
        for (int k = 1; k < count; ++k)
            addNode(card, first + k * step,
                    sumOf(scaled(a, 1 - double(k) / count), double(k) / count, b), line);
    }

    /** Adds a set of existing nodes. **/
    void addSet(const char* parameter, const std::vector<int>& nodes, int line) {
        if (!m_card.has(parameter)) return;
        DeckCard& set = add("*NSET");
        set.parameters["NSET"] = m_card.get(parameter);
        for (const int node : nodes) addLine(set, {std::to_string(node)}, line);
    }

    void fillLines() {
        if (m_card.has("LINE"))
            refuseCard(m_card,
                       "*NGEN along a curve (LINE) is not known to simflex; write its "
                       "nodes out");
        for (const DeckLine& data : m_card.data) {
            const int first = number(data, 0, 0), last = number(data, 1, 0),
                      step = number(data, 2, 1);
            if (step < 1 || last <= first || (long(last) - first) % step != 0)
                refuseCard(m_card,
                           "*NGEN from " + std::to_string(first) + " to " + std::to_string(last) +
                               " by " + std::to_string(step) +
                               ": the last node must be a whole "
                               "number of steps behind the first",
                           data.line);
            const long count = (long(last) - first) / step;
            m_model.claim(count, data.line);
            DeckCard& nodes = add("*NODE");
            addBetween(nodes, first, last, int(count), step, data.line);
            std::vector<int> all;
            for (long k = 0; k <= count; ++k) all.push_back(int(first + k * step));
            addSet("NSET", all, data.line);
        }
    }

    void fillBetween() {
        for (const DeckLine& data : m_card.data) {
            if (data.fields.size() < 3)
                refuseCard(m_card,
                           "*NFILL needs two node sets, the intervals between them and the "
                           "step of numbers",
                           data.line);
            const std::vector<int> from = m_model.nodesOf(data.fields[0], data.line),
                                   to = m_model.nodesOf(data.fields[1], data.line);
            const int count = number(data, 2, 0), step = number(data, 3, 1);
            if (from.size() != to.size())
                refuseCard(m_card,
                           "*NFILL between sets of " + std::to_string(from.size()) + " and " +
                               std::to_string(to.size()) + " nodes; both sets must have as many",
                           data.line);
            if (count < 1 || step == 0)
                refuseCard(m_card, "*NFILL needs at least one interval and a step of numbers",
                           data.line);
            m_model.claim(long(count) * long(from.size()), data.line);
            DeckCard& nodes = add("*NODE");
            std::vector<int> all = from;
            for (size_t k = 0; k < from.size(); ++k) {
                addBetween(nodes, from[k], to[k], count, step, data.line);
                for (int j = 1; j < count; ++j) all.push_back(from[k] + j * step);
            }
            all.insert(all.end(), to.begin(), to.end());
            addSet("NSET", all, data.line);
        }
    }

    void copyNodes() {
        if (!m_card.has("SHIFT"))
            refuseCard(m_card, "*NCOPY is known with SHIFT alone; write reflected nodes out");
        const int shift = parseDeckInteger(m_card.get("CHANGENUMBER"), m_card.where());
        Vec3d move{}, point{}, axis{};
        double angle = 0;
        if (m_card.data.size() > 2)
            refuseCard(m_card, "*NCOPY has more than a translation and a rotation",
                       m_card.data[2].line);
        if (!m_card.data.empty())
            for (size_t a = 0; a < 3; ++a)
                if (a < m_card.data[0].fields.size() && !m_card.data[0].fields[a].empty())
                    move[a] = readDeckNumber(m_card, m_card.data[0], a, "a translation");
        if (m_card.data.size() == 2) {
            const DeckLine& data = m_card.data[1];
            Vec3d end{};
            for (size_t a = 0; a < 3; ++a) {
                const char* what = "two points and an angle of its rotation";
                point[a] = readDeckNumber(m_card, data, a, what);
                end[a] = readDeckNumber(m_card, data, a + 3, what);
            }
            angle = readDeckNumber(m_card, data, 6, "the angle of its rotation") * M_PI / 180;
            axis = minus(end, point);
            if (!(normOf(axis) > 0))
                refuseCard(m_card, "the two points of the rotation are the same", data.line);
            axis = scaled(axis, 1 / normOf(axis));
        }
        DeckCard& nodes = add("*NODE");
        if (m_card.has("NEWSET")) nodes.parameters["NSET"] = m_card.get("NEWSET");
        const std::vector<int> originals = m_model.nodesOf(m_card.get("OLDSET"), m_card.line);
        m_model.claim(long(originals.size()), m_card.line);
        for (const int node : originals) {
            Vec3d x = sumOf(m_model.positionOf(node), 1, move);
            const Vec3d r = minus(x, point), side = cross(axis, r);
            if (angle != 0)
                for (size_t a = 0; a < 3; ++a)
                    x[a] = point[a] + std::cos(angle) * r[a] + std::sin(angle) * side[a] +
                           (1 - std::cos(angle)) * dot(axis, r) * axis[a];
            addNode(nodes, node + shift, x, m_card.line);
        }
    }

    void addElement(int element, int elementShift, int nodeShift, const std::string& set,
                    int line) {
        const auto [type, nodes] = m_model.findElement(element);
        const bool isNext = !m_made.empty() && m_made.back().keyword == "ELEMENT" &&
                            m_made.back().get("TYPE") == type;
        DeckCard& card = isNext ? m_made.back() : add("*ELEMENT");
        card.parameters["TYPE"] = type;
        if (!set.empty()) card.parameters["ELSET"] = set;
        std::vector<std::string> fields = {std::to_string(element + elementShift)};
        for (const int node : nodes) fields.push_back(std::to_string(node + nodeShift));
        addLine(card, std::move(fields), line);
        m_model.report();
    }

    void repeatElements() {
        const std::string set = m_card.has("ELSET") ? m_card.get("ELSET") : "";
        for (const DeckLine& data : m_card.data) {
            const int master = number(data, 0, 0);
            int count[3], nodeStep[3], elementStep[3];
            long all = 1;
            for (size_t d = 0; d < 3; ++d) {
                count[d] = number(data, 3 * d + 1, 1);
                nodeStep[d] = number(data, 3 * d + 2, 1);
                elementStep[d] = number(data, 3 * d + 3, 1);
                if (count[d] < 1)
                    refuseCard(m_card, "*ELGEN needs at least one element in each direction",
                               data.line);
                // Within a limit, so that the product stays in range.
                all = std::min(all, long(std::numeric_limits<int>::max())) * count[d];
            }
            m_model.claim(all, data.line);
            for (int k = 0; k < count[2]; ++k)
                for (int j = 0; j < count[1]; ++j)
                    for (int i = 0; i < count[0]; ++i)
                        if (i + j + k > 0)
                            addElement(master,
                                       i * elementStep[0] + j * elementStep[1] + k * elementStep[2],
                                       i * nodeStep[0] + j * nodeStep[1] + k * nodeStep[2], set,
                                       data.line);
            if (set.empty()) continue;
            DeckCard& first = add("*ELSET");
            first.parameters["ELSET"] = set;
            addLine(first, {std::to_string(master)}, data.line);
        }
    }

    void copyElements() {
        const int elements = parseDeckInteger(m_card.get("ELEMENTSHIFT"), m_card.where()),
                  nodes = parseDeckInteger(m_card.get("SHIFTNODES"), m_card.where());
        const std::string set = m_card.has("NEWSET") ? m_card.get("NEWSET") : "";
        const std::vector<int> originals = m_model.elementsOf(m_card.get("OLDSET"));
        m_model.claim(long(originals.size()), m_card.line);
        for (const int element : originals) addElement(element, elements, nodes, set, m_card.line);
    }

    const DeckCard& m_card;
    const GeneratorModel& m_model;
    std::vector<DeckCard> m_made;
};

}  // namespace

bool isGenerator(const std::string& keyword) {
    return GeneratorParameters.count(keyword) > 0;
}

std::vector<DeckCard> generateCards(const DeckCard& card, const GeneratorModel& model) {
    return Generator(card, model).make();
}

}  // namespace simflex
