#include "fe/ThinDeck.h"

#include <cmath>
#include <iomanip>

namespace simflex {
namespace testing {

void ThinDeck::addPatch(const std::string& type, const std::string& set, int n, int m,
                        const std::function<Point(double, double)>& at) {
    const bool quadratic = type[1] == '6' || type[1] == '8';
    const bool triangles = type[1] == '3' || type[1] == '6';
    _elements << "*ELEMENT, TYPE=" << type << ", ELSET=" << set << "\n";
    const auto node = [&](double i, double j) { return addNode(at(i / n, j / m)); };
    const double corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const int halves[2][3] = {{0, 1, 2}, {0, 2, 3}};
    const int count = triangles ? 3 : 4;
    for (int j = 0; j < m; ++j)
        for (int i = 0; i < n; ++i)
            for (int half = 0; half < (triangles ? 2 : 1); ++half) {
                std::vector<int> numbers;
                for (int middle = 0; middle < (quadratic ? 2 : 1); ++middle)
                    for (int k = 0; k < count; ++k) {
                        const int a = triangles ? halves[half][k] : k;
                        const int next = (k + 1) % count;
                        const int b = !middle ? a : triangles ? halves[half][next] : next;
                        numbers.push_back(node(i + 0.5 * (corners[a][0] + corners[b][0]),
                                               j + 0.5 * (corners[a][1] + corners[b][1])));
                    }
                addElement(numbers);
            }
}

void ThinDeck::addBeam(const std::string& type, const std::string& set, int n, const Point& a,
                       const Point& b) {
    addCurvedBeam(type, set, n, [&](double s) {
        Point x;
        for (size_t c = 0; c < 3; ++c) x[c] = a[c] + s * (b[c] - a[c]);
        return x;
    });
}

void ThinDeck::addCurvedBeam(const std::string& type, const std::string& set, int n,
                             const std::function<Point(double)>& at) {
    _elements << "*ELEMENT, TYPE=" << type << ", ELSET=" << set << "\n";
    for (int i = 0; i < n; ++i) {
        std::vector<int> numbers;
        for (int k = 0; k <= 2; k += type[2] == '1' ? 2 : 1)
            numbers.push_back(addNode(at((i + 0.5 * k) / n)));
        addElement(numbers);
    }
}

void ThinDeck::addBox(const std::string& set, const std::array<int, 3>& n, const Point& low,
                      const Point& high) {
    addBricks("C3D20R", set, n, [&](const Point& u) {
        Point x;
        for (size_t c = 0; c < 3; ++c) x[c] = low[c] + u[c] * (high[c] - low[c]);
        return x;
    });
}

void ThinDeck::addBricks(const std::string& type, const std::string& set,
                         const std::array<int, 3>& n,
                         const std::function<Point(const Point&)>& at) {
    static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                     {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    static const int edge[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                                    {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};
    _elements << "*ELEMENT, TYPE=" << type << ", ELSET=" << set << "\n";
    for (int k = 0; k < n[2]; ++k)
        for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) {
                const int base[3] = {i, j, k};
                const auto node = [&](const int* a, const int* b) {
                    Point u;
                    for (size_t c = 0; c < 3; ++c) u[c] = (base[c] + 0.5 * (a[c] + b[c])) / n[c];
                    return addNode(at(u));
                };
                std::vector<int> numbers;
                for (const auto& c : corner) numbers.push_back(node(c, c));
                if (type.compare(0, 5, "C3D20") == 0)
                    for (const auto& e : edge) numbers.push_back(node(corner[e[0]], corner[e[1]]));
                addElement(numbers);
            }
}

void ThinDeck::addShellSection(const std::string& set, double thickness, double offset) {
    std::ostringstream text;
    text << "*SHELL SECTION, ELSET=" << set << ", MATERIAL=METAL, OFFSET=" << offset << "\n"
         << thickness << "\n";
    add(text.str());
}

void ThinDeck::addBeamSection(const std::string& set, const std::string& shape, double a, double b,
                              const std::string& n1) {
    std::ostringstream text;
    text << "*BEAM SECTION, ELSET=" << set << ", MATERIAL=METAL, SECTION=" << shape << "\n"
         << a << "," << b << "\n"
         << n1 << "\n";
    add(text.str());
}

void ThinDeck::addNodeSet(const std::string& set, const std::function<bool(const Point&)>& isIn) {
    add("*NSET, NSET=" + set + "\n");
    for (const auto& [key, node] : _nodes)
        if (isIn(node.second)) add(std::to_string(node.first) + ",\n");
}

int ThinDeck::addNode(const Point& x) {
    std::array<long, 4> key{0, 0, 0, _piece};
    for (size_t c = 0; c < 3; ++c) key[c] = std::lround(x[c] * 1e8);
    return _nodes.insert({key, {int(_nodes.size()) + 1, x}}).first->second.first;
}

std::string ThinDeck::text() const {
    std::ostringstream out;
    out << std::setprecision(14) << "*NODE, NSET=ALL\n";
    std::map<int, Point> sorted;
    for (const auto& [key, node] : _nodes) sorted[node.first] = node.second;
    for (const auto& [number, x] : sorted)
        out << number << "," << x[0] << "," << x[1] << "," << x[2] << "\n";
    out << _elements.str() << "*MATERIAL, NAME=METAL\n*ELASTIC\n70e9," << nu
        << "\n*DENSITY\n2700\n"
           "*MATERIAL, NAME=HEAVY\n*ELASTIC\n200e9,0.3\n*DENSITY\n7800\n"
        << _cards;
    return out.str();
}

void ThinDeck::addElement(const std::vector<int>& numbers) {
    _elements << ++_numElements;
    for (size_t k = 0; k < numbers.size(); ++k) _elements << (k == 10 ? ",\n" : ",") << numbers[k];
    _elements << "\n";
}

}  // namespace testing
}  // namespace simflex
