#include "simflex/fe/NodeSelection.h"
#include "simflex/part/TextLines.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

using Point = std::array<double, 3>;

/** Of the mesh's size: what round-off may move a node. **/
constexpr double kSlack = 1e-6;

double dot(const Point& a, const Point& b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Point minus(const Point& a, const Point& b) {
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

std::string upperCase(std::string text) {
    for (char& c : text) c = char(std::toupper((unsigned char)(c)));
    return text;
}

std::string listNodeSets(const Mesh& mesh) {
    std::string list;
    for (const auto& [name, nodes] : mesh.nodeSets)
        list += (list.empty() ? "" : ", ") + name + " (" + std::to_string(nodes.size()) + ")";
    return list.empty() ? "none" : list;
}

[[noreturn]] void refuse(const std::string& selection, const std::string& why) {
    throw std::invalid_argument("'" + selection + "' " + why);
}

/** The numbers behind the colon. **/
std::vector<double> parseNumbers(const std::string& selection, size_t colon,
                                 const std::vector<size_t>& counts, const char* form) {
    std::vector<double> numbers;
    for (size_t at = colon; at < selection.size();) {
        const size_t end = std::min(selection.find(',', at + 1), selection.size());
        numbers.push_back(0);
        if (!readNumber(trimBlanks(std::string_view(selection).substr(at + 1, end - at - 1)),
                        numbers.back()))
            refuse(selection, std::string("is not of the form ") + form);
        at = end;
    }
    if (std::find(counts.begin(), counts.end(), numbers.size()) == counts.end())
        refuse(selection, std::string("is not of the form ") + form);
    return numbers;
}

Point parseDirection(const std::string& selection, const double* numbers) {
    Point a{numbers[0], numbers[1], numbers[2]};
    const double length = std::sqrt(dot(a, a));
    if (!(length > 0)) refuse(selection, "has a direction of length zero");
    for (double& value : a) value /= length;
    return a;
}

double parseRadius(const std::string& selection, double radius) {
    if (!(radius > 0)) refuse(selection, "has a radius or length that is not positive");
    return radius;
}

/** How far outside the shape a point is; not positive: inside. **/
std::function<double(const Point&)> makeShape(const std::string& selection, const std::string& kind,
                                              size_t colon) {
    if (kind == "SPHERE") {
        const auto v = parseNumbers(selection, colon, {4}, "sphere:x,y,z,radius");
        const Point center{v[0], v[1], v[2]};
        const double radius = parseRadius(selection, v[3]);
        return [=](const Point& x) {
            const Point d = minus(x, center);
            return std::sqrt(dot(d, d)) - radius;
        };
    }
    if (kind == "CYLINDER") {
        const auto v = parseNumbers(selection, colon, {7, 8},
                                    "cylinder:x,y,z,ax,ay,az,radius or …,radius,length");
        const Point foot{v[0], v[1], v[2]}, axis = parseDirection(selection, &v[3]);
        const double radius = parseRadius(selection, v[6]);
        const bool isEndless = v.size() == 7;
        const double length = isEndless ? 0 : parseRadius(selection, v[7]);
        return [=](const Point& x) {
            const Point d = minus(x, foot);
            const double along = dot(d, axis);
            const double outside = std::sqrt(std::max(0.0, dot(d, d) - along * along)) - radius;
            return isEndless ? outside : std::max({outside, -along, along - length});
        };
    }
    const auto v = parseNumbers(selection, colon, {6}, "plane:x,y,z,nx,ny,nz");
    const Point foot{v[0], v[1], v[2]}, normal = parseDirection(selection, &v[3]);
    return [=](const Point& x) { return std::abs(dot(minus(x, foot), normal)); };
}

double calcSize(const Mesh& mesh) {
    Point low, high;
    low.fill(std::numeric_limits<double>::infinity());
    high.fill(-std::numeric_limits<double>::infinity());
    for (int node = 0; node < mesh.numNodes(); ++node)
        for (size_t a = 0; a < 3; ++a) {
            low[a] = std::min(low[a], mesh.position(node)[a]);
            high[a] = std::max(high[a], mesh.position(node)[a]);
        }
    const Point d = minus(high, low);
    return std::sqrt(dot(d, d));
}

}  // namespace

std::vector<int> selectNodes(const Mesh& mesh, const std::string& selection) {
    const auto set = mesh.nodeSets.find(upperCase(selection));
    if (set != mesh.nodeSets.end()) return set->second;

    const size_t colon = selection.find(':');
    const std::string kind = upperCase(selection.substr(0, colon));
    if (colon == std::string::npos ||
        (kind != "NODE" && kind != "SPHERE" && kind != "CYLINDER" && kind != "PLANE"))
        throw std::invalid_argument("the model has no node set '" + selection + "'; it has " +
                                    listNodeSets(mesh) +
                                    ". Nodes can also be chosen by node:, sphere:, cylinder: or "
                                    "plane:");
    if (kind == "NODE") {
        const double number = parseNumbers(selection, colon, {1}, "node:NUMBER")[0];
        const auto found = std::find(mesh.nodeNumbers.begin(), mesh.nodeNumbers.end(), int(number));
        if (found == mesh.nodeNumbers.end() || *found != number)
            refuse(selection, "names a node that the model does not have");
        return {int(found - mesh.nodeNumbers.begin())};
    }
    const auto outside = makeShape(selection, kind, colon);
    const double slack = kSlack * calcSize(mesh);
    std::vector<int> nodes;
    double nearest = std::numeric_limits<double>::infinity();
    for (int node = 0; node < mesh.numNodes(); ++node) {
        const double distance = outside(mesh.position(node));
        nearest = std::min(nearest, distance);
        if (distance <= slack) nodes.push_back(node);
    }
    if (nodes.empty()) {
        std::ostringstream text;
        text << "holds no node; the nearest is " << nearest << " m outside";
        refuse(selection, text.str());
    }
    return nodes;
}

std::array<double, 3> findMiddle(const Mesh& mesh, const std::string& selection) {
    const std::vector<int> nodes = selectNodes(mesh, selection);
    Point mean{};
    for (const int node : nodes)
        for (size_t a = 0; a < 3; ++a) mean[a] += mesh.position(node)[a] / double(nodes.size());
    const size_t colon = selection.find(':');
    if (mesh.nodeSets.count(upperCase(selection)) || colon == std::string::npos ||
        upperCase(selection.substr(0, colon)) != "CYLINDER")
        return mean;
    const auto v = parseNumbers(selection, colon, {7, 8}, "cylinder:…");
    const Point foot{v[0], v[1], v[2]}, axis = parseDirection(selection, &v[3]);
    const double along = dot(minus(mean, foot), axis);
    return {foot[0] + along * axis[0], foot[1] + along * axis[1], foot[2] + along * axis[2]};
}

}  // namespace simflex
