#include "StepSolids.h"

#include <algorithm>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <set>
#include <stdexcept>
#include <string_view>
#include <unordered_map>

#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

using Texts = std::vector<std::string_view>;
constexpr int DeepestAssembly = 100;
constexpr int MostProducts = 1000000;
constexpr size_t MostSolids = 100000;
constexpr double SameCorner = 1e-6;  ///< relative to the solid's size

/** Rotation and translation of an occurrence. **/
struct StepPlace {
    std::array<Vec3d, 3> axes{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Vec3d origin{};

    Vec3d apply(const Vec3d& x) const {
        Vec3d y = origin;
        for (size_t a = 0; a < 3; ++a) y = sumOf(y, x[a], axes[a]);
        return y;
    }
    StepPlace operator*(const StepPlace& inner) const {
        StepPlace product;
        for (size_t a = 0; a < 3; ++a) product.axes[a] = minus(apply(inner.axes[a]), origin);
        product.origin = apply(inner.origin);
        return product;
    }
    StepPlace inverted() const {
        StepPlace inverse;
        for (size_t a = 0; a < 3; ++a)
            for (size_t b = 0; b < 3; ++b) inverse.axes[a][b] = axes[b][a];
        inverse.origin = {-dot(axes[0], origin), -dot(axes[1], origin), -dot(axes[2], origin)};
        return inverse;
    }
};

/** Splits the content of brackets at its commas. **/
Texts splitArguments(std::string_view text) {
    Texts parts;
    int depth = 0;
    bool isText = false;
    size_t begin = 0;
    for (size_t k = 0; k <= text.size(); ++k) {
        const char c = k < text.size() ? text[k] : ',';
        if (c == '\'') isText = !isText;
        if (isText && k < text.size()) continue;
        if (c == '(') ++depth;
        if (c == ')') --depth;
        if (k < text.size() && (c != ',' || depth > 0)) continue;
        parts.push_back(trimBlanks(text.substr(begin, k - begin)));
        begin = k + 1;
    }
    return parts;
}

/** Returns the number after '#', or 0. **/
int readReference(std::string_view text) {
    int number = 0;
    return text.size() > 1 && text[0] == '#' && readInteger(text.substr(1), number) ? number : 0;
}

/** Returns all references in a text. **/
std::vector<int> findReferences(std::string_view text) {
    std::vector<int> found;
    bool isText = false;
    for (size_t k = 0; k < text.size(); ++k) {
        if (text[k] == '\'') isText = !isText;
        if (isText || text[k] != '#') continue;
        size_t end = k + 1;
        while (end < text.size() && isDigit(text[end])) ++end;
        if (const int number = readReference(text.substr(k, end - k))) found.push_back(number);
    }
    return found;
}

class StepFile {
public:
    explicit StepFile(const std::string& path) : m_path(path) {
        std::ifstream in = openInputFile(path);
        if (!in.is_open()) throw std::runtime_error("cannot read part '" + path + "'");
        m_text.assign(std::istreambuf_iterator<char>(in), {});
        m_text.erase(std::remove_if(m_text.begin(), m_text.end(),
                                    [](char c) { return c == '\n' || c == '\r'; }),
                     m_text.end());
        findEntities();
    }

    std::vector<StepSolid> read() {
        linkProducts();
        std::set<int> parts;
        for (const auto& [assembly, children] : m_children)
            for (const Child& child : children) parts.insert(child.definition);
        for (const int definition : m_definitions)
            if (!parts.count(definition)) addProduct(definition, {}, {}, 0);
        return std::move(m_solids);
    }

private:
    struct Entity {
        std::string_view type, arguments;  ///< empty type: a complex entity, with all types in
                                           ///< `arguments`
    };
    struct Child {
        int definition = 0, occurrence = 0;
    };

    [[noreturn]] void refuse(const std::string& why) const {
        throw std::invalid_argument(m_path + ": " + why);
    }

    /** Finds all `#1=TYPE(…);`. **/
    void findEntities() {
        const std::string_view text = m_text;
        size_t at = text.find("DATA;");
        if (at == std::string_view::npos) return;
        for (at += 5; at < text.size();) {
            size_t end = at;
            for (bool isText = false; end < text.size() && (isText || text[end] != ';'); ++end) {
                if (text[end] == '\'') isText = !isText;
                if (!isText && text.compare(end, 2, "/*") == 0)
                    end = std::min(text.find("*/", end), text.size() - 1);
            }
            addEntity(text.substr(at, end - at));
            at = end + 1;
        }
    }

    void addEntity(std::string_view text) {
        if (const size_t comment = text.rfind("*/"); comment != std::string_view::npos)
            text = text.substr(comment + 2);
        const size_t equals = text.find('='), open = text.find('('), close = text.rfind(')');
        if (equals == std::string_view::npos || open == std::string_view::npos ||
            close == std::string_view::npos || equals > open || close < open)
            return;
        const int number = readReference(trimBlanks(text.substr(0, equals)));
        if (!number) return;
        Entity entity;
        entity.type = trimBlanks(text.substr(equals + 1, open - equals - 1));
        entity.arguments = text.substr(open + 1, close - open - 1);
        m_entities[number] = entity;
        m_order.push_back(number);
    }

    const Entity& get(int number) const {
        static const Entity None;
        const auto found = m_entities.find(number);
        return found == m_entities.end() ? None : found->second;
    }

    Texts argumentsOf(int number) const { return splitArguments(get(number).arguments); }

    /** Returns the reference in an argument. **/
    int follow(int number, size_t argument) const {
        const Texts arguments = argumentsOf(number);
        return argument < arguments.size() ? readReference(arguments[argument]) : 0;
    }

    std::string readName(int number, size_t argument) const {
        const Texts arguments = argumentsOf(number);
        if (argument >= arguments.size() || arguments[argument].size() < 2) return "";
        const std::string_view text = arguments[argument];
        return text[0] != '\'' ? "" : std::string(trimBlanks(text.substr(1, text.size() - 2)));
    }

    /** Returns the arguments of one type of a complex entity. **/
    Texts findType(int number, std::string_view type) const {
        const std::string_view text = get(number).arguments;
        for (size_t at = text.find(type); at != std::string_view::npos;
             at = text.find(type, at + 1)) {
            const size_t open = at + type.size();
            if ((at > 0 && (isLetter(text[at - 1]) || text[at - 1] == '_')) ||
                open >= text.size() || text[open] != '(')
                continue;
            int depth = 0;
            for (size_t k = open; k < text.size(); ++k) {
                if (text[k] == '(') ++depth;
                if (text[k] == ')' && --depth == 0)
                    return splitArguments(text.substr(open + 1, k - open - 1));
            }
        }
        return {};
    }

    void linkProducts() {
        for (const int number : m_order) {
            const std::string_view type = get(number).type;
            if (type == "SHAPE_DEFINITION_REPRESENTATION") {
                const int definition = follow(follow(number, 0), 2);
                if (get(definition).type.substr(0, 18) != "PRODUCT_DEFINITION") continue;
                m_shapesOf[definition].push_back(follow(number, 1));
                m_definitions.push_back(definition);
            } else if (type == "SHAPE_REPRESENTATION_RELATIONSHIP") {
                m_same[follow(number, 2)].push_back(follow(number, 3));
                m_same[follow(number, 3)].push_back(follow(number, 2));
            } else if (type == "NEXT_ASSEMBLY_USAGE_OCCURRENCE") {
                m_children[follow(number, 3)].push_back({follow(number, 4), number});
            } else if (type == "CONTEXT_DEPENDENT_SHAPE_REPRESENTATION") {
                m_placeOf[follow(follow(number, 1), 2)] = follow(number, 0);
            }
        }
        std::sort(m_definitions.begin(), m_definitions.end());
        m_definitions.erase(std::unique(m_definitions.begin(), m_definitions.end()),
                            m_definitions.end());
    }

    /** Returns the representations of a product and those related to them as equal. **/
    std::vector<int> listShapes(int definition) const {
        const auto own = m_shapesOf.find(definition);
        std::vector<int> shapes = own == m_shapesOf.end() ? std::vector<int>() : own->second;
        for (size_t k = 0; k < shapes.size(); ++k)
            if (const auto same = m_same.find(shapes[k]); same != m_same.end())
                for (const int other : same->second)
                    if (std::find(shapes.begin(), shapes.end(), other) == shapes.end())
                        shapes.push_back(other);
        return shapes;
    }

    Vec3d readTriple(int number) const {
        Vec3d x{};
        const Texts arguments = argumentsOf(number);
        if (arguments.size() < 2 || arguments[1].size() < 2) return x;
        const Texts parts = splitArguments(arguments[1].substr(1, arguments[1].size() - 2));
        for (size_t a = 0; a < 3 && a < parts.size(); ++a) readNumber(parts[a], x[a]);
        return x;
    }

    /** Reads an AXIS2_PLACEMENT_3D, in metres. **/
    StepPlace readPlace(int number, double unit) const {
        StepPlace place;
        place.origin = scaled(readTriple(follow(number, 1)), unit);
        Vec3d z{0, 0, 1}, x{1, 0, 0};
        if (const int axis = follow(number, 2)) z = readTriple(axis);
        if (const int axis = follow(number, 3)) x = readTriple(axis);
        if (!(normOf(z) > 0)) return place;
        z = scaled(z, 1 / normOf(z));
        Vec3d across = sumOf(x, -dot(x, z), z);
        if (!(normOf(across) > 1e-9)) {
            x = std::abs(z[0]) < 0.5 ? Vec3d{1, 0, 0} : Vec3d{0, 1, 0};
            across = sumOf(x, -dot(x, z), z);
        }
        across = scaled(across, 1 / normOf(across));
        place.axes = {across, cross(z, across), z};
        return place;
    }

    /** Returns the length [m] of a representation's unit. **/
    double findUnit(int representation) const {
        const Texts arguments = argumentsOf(representation);
        if (arguments.size() < 3) return 1e-3;
        const Texts units = findType(readReference(arguments[2]), "GLOBAL_UNIT_ASSIGNED_CONTEXT");
        for (const int unit : units.empty() ? std::vector<int>() : findReferences(units[0]))
            if (const double length = readLength(unit, 0); length > 0) return length;
        return 1e-3;
    }

    /** Returns the length [m] of a unit, 0 if it is no unit of length. **/
    double readLength(int unit, int depth) const {
        const std::string_view text = get(unit).arguments;
        if (text.find("LENGTH_UNIT") == std::string_view::npos || depth > 2) return 0;
        const Texts si = findType(unit, "SI_UNIT"),
                    converted = findType(unit, "CONVERSION_BASED_UNIT");
        if (converted.size() > 1) {
            const int measure = readReference(converted[1]);
            const Texts value = findType(measure, "LENGTH_MEASURE");
            double factor = 0;
            if (value.empty() || !readNumber(value[0], factor)) return 0;
            return factor * readLength(follow(measure, 1), depth + 1);
        }
        if (si.empty()) return 0;
        static const std::map<std::string_view, double> Prefixes = {
            {"$", 1},          {".KILO.", 1e3},   {".DECI.", 1e-1}, {".CENTI.", 1e-2},
            {".MILLI.", 1e-3}, {".MICRO.", 1e-6}, {".NANO.", 1e-9}};
        const auto prefix = Prefixes.find(si[0]);
        return prefix == Prefixes.end() ? 0 : prefix->second;
    }

    /** Returns the placement of an occurrence in its assembly. **/
    StepPlace findPlace(const Child& child) const {
        const auto relation = m_placeOf.find(child.occurrence);
        if (relation == m_placeOf.end()) return {};
        const Texts ends = findType(relation->second, "REPRESENTATION_RELATIONSHIP"),
                    turn = findType(relation->second,
                                    "REPRESENTATION_RELATIONSHIP_WITH_TRANSFORMATION");
        if (ends.size() < 4 || turn.empty()) return {};
        const int transformation = readReference(turn[0]), first = readReference(ends[2]),
                  second = readReference(ends[3]);
        const StepPlace from = readPlace(follow(transformation, 2), findUnit(first)),
                        to = readPlace(follow(transformation, 3), findUnit(second));
        const std::vector<int> own = listShapes(child.definition);
        const bool isFirst = std::find(own.begin(), own.end(), first) != own.end();
        return isFirst ? to * from.inverted() : from * to.inverted();
    }

    static void addName(const std::string& name, std::vector<std::string>& names) {
        if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end())
            names.push_back(name);
    }

    void addProduct(int definition, std::vector<std::string> names, const StepPlace& place,
                    int depth) {
        if (depth > DeepestAssembly || ++m_numProducts > MostProducts)
            refuse("an assembly holds itself");
        const int product = follow(follow(definition, 2), 2);
        const std::string name = readName(product, 1);
        addName(name.empty() ? readName(product, 0) : name, names);
        for (const int shape : listShapes(definition)) addItems(shape, names, place, 0);
        const auto children = m_children.find(definition);
        if (children == m_children.end()) return;
        for (const Child& child : children->second) {
            std::vector<std::string> below = names;
            addName(readName(child.occurrence, 1), below);
            addProduct(child.definition, std::move(below), place * findPlace(child), depth + 1);
        }
    }

    void addItems(int shape, const std::vector<std::string>& names, const StepPlace& place,
                  int depth) {
        if (depth > DeepestAssembly || ++m_numProducts > MostProducts)
            refuse("an assembly holds itself");
        const Texts arguments = argumentsOf(shape);
        if (arguments.size() < 3) return;
        const double unit = findUnit(shape);
        for (const int item : findReferences(arguments[1])) {
            const std::string_view type = get(item).type;
            if (type == "MAPPED_ITEM") {
                const int map = follow(item, 1);
                const StepPlace inner =
                    readPlace(follow(item, 2), unit) * readPlace(follow(map, 0), unit).inverted();
                addItems(follow(map, 1), names, place * inner, depth + 1);
            } else if (type == "MANIFOLD_SOLID_BREP" || type == "BREP_WITH_VOIDS" ||
                       type == "FACETED_BREP") {
                if (m_solids.size() == MostSolids) refuse("it has too many solids");
                StepSolid solid;
                solid.names = names;
                addName(readName(item, 0), solid.names);
                for (const Vec3d& corner : findCorners(item))
                    solid.corners.push_back(place.apply(scaled(corner, unit)));
                std::sort(solid.corners.begin(), solid.corners.end());
                m_solids.push_back(std::move(solid));
            }
        }
    }

    /** Returns the ends of a solid's edges, in its own unit. **/
    const std::vector<Vec3d>& findCorners(int solid) {
        static const std::set<std::string_view> Ways = {
            "MANIFOLD_SOLID_BREP", "BREP_WITH_VOIDS", "FACETED_BREP",     "CLOSED_SHELL",
            "OPEN_SHELL",          "FACE_SURFACE",    "FACE_OUTER_BOUND", "ORIENTED_CLOSED_SHELL",
            "ADVANCED_FACE",       "FACE_BOUND",      "EDGE_LOOP",        "ORIENTED_EDGE",
            "EDGE_CURVE",          "VERTEX_LOOP",     "VERTEX_POINT",     "POLY_LOOP"};
        const auto [entry, isNew] = m_cornersOf.insert({solid, {}});
        std::vector<int> ways = {solid};
        std::set<int> seen;
        while (isNew && !ways.empty()) {
            const int number = ways.back();
            ways.pop_back();
            if (!seen.insert(number).second) continue;
            const Entity& entity = get(number);
            if (entity.type == "CARTESIAN_POINT") entry->second.push_back(readTriple(number));
            if (!Ways.count(entity.type)) continue;
            for (const int next : findReferences(entity.arguments)) ways.push_back(next);
        }
        return entry->second;
    }

    const std::string m_path;
    std::string m_text;
    std::unordered_map<int, Entity> m_entities;
    std::vector<int> m_order, m_definitions;
    std::map<int, std::vector<int>> m_shapesOf, m_same;
    std::map<int, std::vector<Child>> m_children;
    std::map<int, int> m_placeOf;
    std::map<int, std::vector<Vec3d>> m_cornersOf;
    std::vector<StepSolid> m_solids;
    int m_numProducts = 0;
};

}  // namespace

std::vector<StepSolid> readStepSolids(const std::string& path) {
    return StepFile(path).read();
}

bool haveSameCorners(const std::vector<Vec3d>& a, const std::vector<Vec3d>& b) {
    double size = 0;
    for (const Vec3d& x : a) size = std::max(size, normOf(minus(x, a[0])));
    const auto holds = [&](const std::vector<Vec3d>& all, const Vec3d& x) {
        return std::any_of(all.begin(), all.end(), [&](const Vec3d& y) {
            return normOf(minus(x, y)) <= SameCorner * size;
        });
    };
    return !a.empty() &&
           std::all_of(b.begin(), b.end(), [&](const Vec3d& x) { return holds(a, x); }) &&
           std::all_of(a.begin(), a.end(), [&](const Vec3d& x) { return holds(b, x); });
}

std::vector<int> matchSolids(const std::vector<StepSolid>& solids,
                             const std::vector<std::vector<Vec3d>>& volumes) {
    std::vector<int> result;
    std::vector<char> isTaken(volumes.size(), 0);
    for (const StepSolid& solid : solids) {
        size_t k = 0;
        while (k < volumes.size() && (isTaken[k] || !haveSameCorners(volumes[k], solid.corners)))
            ++k;
        result.push_back(k < volumes.size() ? int(k) : -1);
        if (k < volumes.size()) isTaken[k] = 1;
    }
    return result;
}

}  // namespace simflex
