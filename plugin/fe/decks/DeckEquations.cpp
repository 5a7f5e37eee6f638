#include "DeckEquations.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "simflex/base/AsciiText.h"

namespace simflex {
namespace {

constexpr size_t MostTermsPerLine = 4;
/** Largest distance of nodes from their line or plane, relative to its size. **/
constexpr double Straight = 1e-6;

[[noreturn]] void refuse(const DeckCard& card, int line, const std::string& why) {
    throw std::invalid_argument(card.where(line) + card.title + " " + why);
}

int parseAxis(const DeckCard& card, const DeckLine& data, const std::string& field) {
    const int direction = parseDeckInteger(field, card.where(data.line));
    if (direction >= 4 && direction <= 6)
        refuse(card, data.line,
               "names rotation " + field +
                   ", but simflex has nodal translations alone; tie nodes around the node instead");
    if (direction < 1 || direction > 3)
        refuse(card, data.line, "names direction " + field + ", allowed are 1, 2, 3");
    return direction - 1;
}

/** An *MPC: its kind and nodes, possibly on several lines. **/
struct NodeList {
    std::string kind;
    int line = 0;
    std::vector<int> nodes;
};

std::vector<NodeList> readNodeLists(const DeckCard& card, const FindDeckNodes& nodesOf) {
    std::vector<NodeList> lists;
    for (const DeckLine& data : card.data)
        for (size_t k = 0; k < data.fields.size(); ++k) {
            const std::string& field = data.fields[k];
            if (field.empty()) continue;
            if (k == 0 && isLetter(field[0])) {
                lists.push_back({field, data.line, {}});
                continue;
            }
            if (lists.empty()) refuse(card, data.line, "needs its kind before the nodes");
            for (const int node : nodesOf(field, data))
                if (node != 0) lists.back().nodes.push_back(node);
        }
    return lists;
}

void addTerms(DeckEquation& equation, int node, const Vec3d& direction) {
    for (int a = 0; a < 3; ++a)
        if (direction[size_t(a)] != 0) equation.terms.push_back({node, a, direction[size_t(a)]});
}

/** Returns unit vectors normal to a line. **/
std::array<Vec3d, 2> acrossOf(const Vec3d& along) {
    size_t least = 0;
    for (size_t a = 1; a < 3; ++a)
        if (std::abs(along[a]) < std::abs(along[least])) least = a;
    Vec3d axis{};
    axis[least] = 1;
    Vec3d first = cross(along, axis);
    first = scaled(first, 1 / normOf(first));
    Vec3d second = cross(along, first);
    return {first, scaled(second, 1 / normOf(second))};
}

}  // namespace

std::vector<DeckEquation> readEquations(const DeckCard& card, const FindDeckNodes& nodesOf) {
    for (const auto& [parameter, value] : card.parameters)
        refuse(card, card.line, "with " + parameter + " is not known to simflex");
    std::vector<DeckEquation> equations;
    std::vector<std::vector<int>> nodes;  // by term of the last equation
    const auto multiply = [&](int line) {
        size_t count = 1;
        for (const auto& of : nodes) count = std::max(count, of.size());
        for (const auto& of : nodes)
            if (of.size() != 1 && of.size() != count)
                refuse(card, line,
                       "names sets of " + std::to_string(count) + " and " +
                           std::to_string(of.size()) +
                           " nodes; each set must have as many, or one");
        const DeckEquation form = std::move(equations.back());
        equations.pop_back();
        for (size_t k = 0; k < count; ++k) {
            equations.push_back(form);
            for (size_t t = 0; t < nodes.size(); ++t)
                equations.back().terms[t].node = nodes[t][nodes[t].size() == 1 ? 0 : k];
        }
        nodes.clear();
    };
    size_t missing = 0;
    for (const DeckLine& data : card.data) {
        const std::string where = card.where(data.line);
        if (missing == 0) {
            const int count = parseDeckInteger(data.fields[0], where);
            if (count < 1) refuse(card, data.line, "needs at least one term");
            missing = size_t(count);
            equations.push_back({{}, where + card.title});
            continue;
        }
        const size_t here = std::min(missing, MostTermsPerLine);
        if (data.fields.size() < 3 * here && data.fields.size() % 3 != 0)
            refuse(card, data.line, "needs node, direction, coefficient of each term");
        for (size_t k = 0; 3 * k + 2 < data.fields.size() && missing > 0; ++k, --missing) {
            nodes.push_back(nodesOf(data.fields[3 * k], data));
            const int axis = parseAxis(card, data, data.fields[3 * k + 1]);
            equations.back().terms.push_back(
                {0, axis, parseDeckNumber(data.fields[3 * k + 2], where)});
        }
        if (missing == 0) multiply(data.line);
    }
    if (missing > 0)
        refuse(card, card.data.empty() ? card.line : card.data.back().line,
               "ends with " + std::to_string(missing) + " terms missing");
    return equations;
}

std::vector<DeckEquation> readMultiPointConstraints(
    const DeckCard& card, const FindDeckNodes& nodesOf,
    const std::function<Vec3d(int node)>& positionOf, std::vector<int>& averaged) {
    std::vector<DeckEquation> equations;
    for (const NodeList& list : readNodeLists(card, nodesOf)) {
        const std::string where = card.where(list.line) + card.title + " " + list.kind;
        const auto add = [&](const std::vector<std::pair<int, Vec3d>>& parts) {
            equations.push_back({{}, where});
            for (const auto& [node, direction] : parts) addTerms(equations.back(), node, direction);
        };
        const auto needNodes = [&](size_t count) {
            if (list.nodes.size() >= count) return;
            refuse(card, list.line,
                   list.kind + " has " + std::to_string(list.nodes.size()) + " nodes, needs " +
                       std::to_string(count));
        };
        const auto checkOn = [&](int node, double miss, double size, const char* what) {
            if (miss <= Straight * size) return;
            std::ostringstream text;
            text << list.kind << ": node " << node << " lies " << miss << " m off the " << what
                 << " before any load, so that the constraint would strain the part; allowed "
                 << Straight * size << ". Move the node.";
            refuse(card, list.line, text.str());
        };
        std::vector<Vec3d> x;
        for (const int node : list.nodes) x.push_back(positionOf(node));
        if (list.kind == "BEAM") {
            needNodes(2);
            const Vec3d along = sumOf(x[1], -1, x[0]);
            if (normOf(along) == 0) refuse(card, list.line, "BEAM: its nodes coincide");
            add({{list.nodes[0], along}, {list.nodes[1], scaled(along, -1)}});
        } else if (list.kind == "STRAIGHT") {
            needNodes(3);
            const Vec3d line = sumOf(x[1], -1, x[0]);
            const double length = normOf(line);
            if (length == 0) refuse(card, list.line, "STRAIGHT: its first two nodes coincide");
            const Vec3d along = scaled(line, 1 / length);
            for (size_t k = 2; k < list.nodes.size(); ++k) {
                const Vec3d r = sumOf(x[k], -1, x[0]);
                const double at = dot(r, along) / length;
                checkOn(list.nodes[k], normOf(sumOf(r, -at, line)), length, "line");
                for (const Vec3d& across : acrossOf(along))
                    add({{list.nodes[k], across},
                         {list.nodes[0], scaled(across, at - 1)},
                         {list.nodes[1], scaled(across, -at)}});
            }
        } else if (list.kind == "PLANE") {
            needNodes(4);
            // The plane of the first two nodes and the one farthest from their line.
            const Vec3d a = sumOf(x[1], -1, x[0]);
            const auto normalOf = [&](size_t k) { return cross(a, sumOf(x[k], -1, x[0])); };
            size_t third = 2;
            for (size_t k = 3; k < x.size(); ++k)
                if (normOf(normalOf(k)) > normOf(normalOf(third))) third = k;
            const Vec3d b = sumOf(x[third], -1, x[0]), normal = normalOf(third);
            const double area = normOf(normal);
            if (area <= Straight * normOf(a) * normOf(b))
                refuse(card, list.line, "PLANE: its nodes lie on a line");
            const Vec3d n = scaled(normal, 1 / area);
            for (size_t k = 2; k < list.nodes.size(); ++k) {
                if (k == third) continue;
                const Vec3d r = sumOf(x[k], -1, x[0]);
                checkOn(list.nodes[k], std::abs(dot(r, n)), std::sqrt(area), "plane");
                // r = α a + β b
                const double alpha = dot(cross(r, b), n) / area, beta = dot(cross(a, r), n) / area;
                add({{list.nodes[k], n},
                     {list.nodes[0], scaled(n, alpha + beta - 1)},
                     {list.nodes[1], scaled(n, -alpha)},
                     {list.nodes[third], scaled(n, -beta)}});
            }
        } else if (list.kind == "MEANROT") {
            needNodes(2);
            averaged.push_back(list.nodes.back());
        } else if (list.kind == "DIST") {
            refuse(card, list.line,
                   "DIST keeps nodes no farther apart than a distance, which is not linear: where "
                   "they stay at it, write BEAM; else take it out");
        } else {
            refuse(card, list.line,
                   list.kind +
                       " is not known to simflex to be linear; it knows STRAIGHT, PLANE, BEAM (a "
                       "distance that stays) and MEANROT");
        }
    }
    return equations;
}

}  // namespace simflex
