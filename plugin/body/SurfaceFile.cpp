#include "simflex/body/SurfaceFile.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "simflex/base/AsciiText.h"
#include "simflex/base/InputFile.h"
#include "simflex/base/NumberText.h"
#include "simflex/part/TextLines.h"

namespace simflex {
namespace {

using SimTK::Vec3;

constexpr std::size_t MostShown = 40;  ///< characters of a word quoted in a message

std::string quoteStart(std::string_view word) {
    return "'" + std::string(word.substr(0, MostShown)) + (word.size() > MostShown ? "…'" : "'");
}

/** Iterates over words separated by blanks and line ends. **/
class Words {
public:
    explicit Words(std::string_view text) : m_text(text) {}

    /** @returns false at the end. **/
    bool next(std::string_view& word) {
        const std::size_t begin = m_text.find_first_not_of(" \t\r\n\f\v", m_at);
        if (begin == m_text.npos) return false;
        m_at = std::min(m_text.find_first_of(" \t\r\n\f\v", begin), m_text.size());
        word = m_text.substr(begin, m_at - begin);
        return true;
    }

    double nextNumber() { return nextAs<double>(readNumber, "a number", "a finite number"); }
    int nextInteger() { return nextAs<int>(readInteger, "a whole number", "a whole number"); }

    Vec3 nextPoint() {
        Vec3 point;
        for (int k = 0; k < 3; ++k) point[k] = nextNumber();
        return point;
    }

private:
    template <class Number>
    Number nextAs(bool (*read)(std::string_view, Number&), const char* what, const char* kind) {
        Number number = 0;
        std::string_view word;
        if (!next(word)) throw std::runtime_error(std::string(what) + " is missing");
        if (!read(word, number)) throw std::runtime_error(quoteStart(word) + " is not " + kind);
        return number;
    }

    std::string_view m_text;
    std::size_t m_at = 0;
};

/** Calls `take(first word, others)` for each non-blank line; errors name the line. **/
template <class Take>
void forEachLine(std::string_view text, const Take& take) {
    int number = 0;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find('\n', at), text.size());
        const std::string_view line = trimBlanks(text.substr(at, end - at));
        at = end + 1;
        ++number;
        if (line.empty()) continue;
        const std::size_t first = std::min(line.find_first_of(" \t"), line.size());
        try {
            if (!take(lowerCase(line.substr(0, first)), line.substr(first))) return;
        } catch (const std::runtime_error& error) {
            throw std::runtime_error("line " + std::to_string(number) + ": " + error.what());
        }
    }
}

/** Limits the time of programs that take a face as a whole: CAD programs write some thousands. **/
constexpr std::size_t MostCorners = 10000;

void addFace(SimTK::PolygonalMesh& mesh, const std::vector<int>& vertices) {
    if (vertices.size() < 3)
        throw std::runtime_error("face " + std::to_string(mesh.getNumFaces() + 1) + " has " +
                                 std::to_string(vertices.size()) +
                                 " vertices; a face has three or more");
    if (vertices.size() > MostCorners)
        throw std::runtime_error("face " + std::to_string(mesh.getNumFaces() + 1) + " has " +
                                 std::to_string(vertices.size()) + " vertices, more than " +
                                 std::to_string(MostCorners) +
                                 ": split it into smaller faces, such as triangles");
    for (const int vertex : vertices)
        if (vertex < 0 || vertex >= mesh.getNumVertices())
            throw std::runtime_error("face " + std::to_string(mesh.getNumFaces() + 1) +
                                     " names vertex " + std::to_string(std::int64_t(vertex) + 1) +
                                     "; there are " + std::to_string(mesh.getNumVertices()));
    mesh.addFace(SimTK::Array_<int>(vertices));
}

//-------------------------------------------------------------------------------------------------
// STL

/** Faces of a file that gives vertices by position. Positions shared by faces agree only to
round-off. **/
class PlacedFaces {
public:
    void addVertex(const Vec3& place) {
        m_places.push_back(place);
        for (int k = 0; k < 3; ++k) {
            m_low[k] = std::min(m_low[k], place[k]);
            m_high[k] = std::max(m_high[k], place[k]);
        }
    }
    /** Ends a face of the vertices added since the last one. **/
    void endFace() { m_ends.push_back(m_places.size()); }

    void addTo(SimTK::PolygonalMesh& mesh) const {
        constexpr double RoundOff = 1e-6;  // relative to the extent of the faces
        const double tolerance = RoundOff * (m_high - m_low).norm();
        const auto isBefore = [&](const Vec3& a, const Vec3& b) {
            for (int k = 0; k < 3; ++k)
                if (std::abs(a[k] - b[k]) > tolerance) return a[k] < b[k];
            return false;
        };
        std::map<Vec3, int, decltype(isBefore)> numbers(isBefore);
        std::size_t next = 0;
        for (const std::size_t end : m_ends) {
            std::vector<int> vertices;
            for (; next < end; ++next) {
                const auto [found, isNew] = numbers.emplace(m_places[next], mesh.getNumVertices());
                if (isNew) mesh.addVertex(m_places[next]);
                vertices.push_back(found->second);
            }
            addFace(mesh, vertices);
        }
    }

private:
    std::vector<Vec3> m_places;
    std::vector<std::size_t> m_ends;
    Vec3 m_low{SimTK::Infinity}, m_high{-SimTK::Infinity};
};

/** Text starts with "solid", as some binary files do, followed by a facet or the end. **/
bool isStlText(std::string_view bytes) {
    int number = 0;
    bool isText = false;
    forEachLine(bytes, [&](const std::string& word, std::string_view) {
        if (++number == 1) return word == "solid";
        if (word == "color") return true;
        isText = word == "facet" || word == "facetnormal" || word == "endsolid";
        return false;
    });
    return isText;
}

/** Reads all solids of the file. **/
void readStlText(std::string_view text, SimTK::PolygonalMesh& mesh) {
    PlacedFaces faces;
    bool isInFacet = false;
    forEachLine(text, [&](const std::string& word, std::string_view rest) {
        if (!isInFacet) {
            isInFacet = word == "facet" || word == "facetnormal";
            return true;
        }
        if (word == "vertex") {
            Words words(rest);
            faces.addVertex(words.nextPoint());
            std::string_view more;
            if (words.next(more))
                throw std::runtime_error(quoteStart(more) + " stands behind the vertex");
        } else if (word == "endfacet") {
            faces.endFace();
            isInFacet = false;
        } else if (word != "outer" && word != "outerloop" && word != "endloop" && word != "color" &&
                   !std::strchr("#!$", word[0])) {
            throw std::runtime_error(quoteStart(word) +
                                     " stands in a facet, where vertex and endfacet are expected");
        }
        return true;
    });
    if (isInFacet) throw std::runtime_error("its last facet has no end");
    faces.addTo(mesh);
}

void readStlBytes(std::string_view bytes, SimTK::PolygonalMesh& mesh) {
    constexpr std::size_t Header = 80, Triangle = 50, Normal = 12;
    std::uint32_t count = 0;
    if (bytes.size() < Header + sizeof count) throw std::runtime_error("it is cut off");
    std::memcpy(&count, bytes.data() + Header, sizeof count);
    const char* at = bytes.data() + Header + sizeof count;
    if ((bytes.size() - Header - sizeof count) / Triangle < count)
        throw std::runtime_error("it is cut off: it has fewer than the " + std::to_string(count) +
                                 " triangles that it names");
    PlacedFaces faces;
    for (std::uint32_t k = 0; k < count; ++k, at += Triangle) {
        float numbers[9];
        std::memcpy(numbers, at + Normal, sizeof numbers);
        for (const float* n = numbers; n < numbers + 9; n += 3) {
            const Vec3 place(n[0], n[1], n[2]);
            if (!place.isFinite())
                throw std::runtime_error("triangle " + std::to_string(k + 1) +
                                         " has a vertex that is not at a finite place");
            faces.addVertex(place);
        }
        faces.endFace();
    }
    faces.addTo(mesh);
}

//-------------------------------------------------------------------------------------------------
// OBJ

void readObj(std::string text, SimTK::PolygonalMesh& mesh) {
    // A backslash continues the line.
    for (std::size_t at = text.find('\\'); at != text.npos; at = text.find('\\', at + 1)) {
        const std::size_t end = at + 1 + (text.compare(at + 1, 1, "\r") == 0);
        if (text.compare(end, 1, "\n") == 0)
            std::fill_n(text.begin() + std::ptrdiff_t(at), end + 1 - at, ' ');
    }
    std::vector<std::vector<int>> faces;
    forEachLine(text, [&](const std::string& word, std::string_view rest) {
        Words words(rest);
        if (word == "v") {
            mesh.addVertex(words.nextPoint());
        } else if (word == "f") {
            std::vector<int>& vertices = faces.emplace_back();
            for (std::string_view corner; words.next(corner);) {
                int number = 0;
                const std::string_view vertex = corner.substr(0, corner.find('/'));
                if (!readInteger(vertex, number))
                    throw std::runtime_error(quoteStart(corner) + " names no vertex");
                // Negative indices count from the last vertex.
                vertices.push_back(number < 0 ? mesh.getNumVertices() + number : number - 1);
            }
        }
        return true;
    });
    for (const std::vector<int>& vertices : faces) addFace(mesh, vertices);
}

//-------------------------------------------------------------------------------------------------
// VTP

/** Iterates over the tags of an XML text, regardless of their level. **/
class Tags {
public:
    explicit Tags(std::string_view xml) : m_xml(xml) {}

    std::string_view name;  ///< "DataArray", "/DataArray"

    bool next() {
        for (;;) {
            const std::size_t begin = m_xml.find('<', m_at);
            if (begin == m_xml.npos) return false;
            const bool isComment = m_xml.compare(begin, 4, "<!--") == 0;
            const std::string_view closing = isComment ? "-->" : ">";
            const std::size_t end = m_xml.find(closing, begin);
            if (end == m_xml.npos) throw std::runtime_error("it is cut off in a tag");
            m_at = end + closing.size();
            if (isComment) continue;
            m_tag = m_xml.substr(begin + 1, end - begin - 1);
            name = m_tag.substr(0, m_tag.find_first_of(" \t\r\n"));
            return true;
        }
    }

    /** @throws std::runtime_error if there is none before tag `end`. **/
    void find(std::string_view wanted, std::string_view end = "") {
        while (next()) {
            if (name == wanted) return;
            if (!end.empty() && name == end) break;
        }
        throw std::runtime_error("it has no element " + std::string(wanted));
    }

    /** Returns an attribute of the tag, "" if it has none. **/
    std::string_view getAttribute(std::string_view key) const {
        for (std::size_t at = m_tag.find(key); at != m_tag.npos; at = m_tag.find(key, at + 1)) {
            const std::size_t begin = at + key.size() + 2;
            if (at == 0 || !std::strchr(" \t\r\n", m_tag[at - 1]) || begin > m_tag.size() ||
                m_tag[begin - 2] != '=')
                continue;
            return m_tag.substr(begin, m_tag.find(m_tag[begin - 1], begin) - begin);
        }
        return "";
    }

    int getCount(std::string_view key) const {
        int count = 0;
        const std::string_view text = getAttribute(key);
        if (!readInteger(text, count) || count < 0)
            throw std::runtime_error("its " + std::string(key) + " is " + quoteStart(text));
        return count;
    }

    /** Returns the text up to the next tag. @throws std::runtime_error unless the numbers are
    text. **/
    std::string_view getNumbers() const {
        if (getAttribute("format") != "ascii")
            throw std::runtime_error("the format of a DataArray is " +
                                     quoteStart(getAttribute("format")) +
                                     "; write the file as text: \"ascii\"");
        return m_xml.substr(m_at, m_xml.find('<', m_at) - m_at);
    }

private:
    std::string_view m_xml, m_tag;
    std::size_t m_at = 0;
};

/** Reads the piece whose tag has been read, to its end. **/
void readVtpPiece(Tags& tags, SimTK::PolygonalMesh& mesh) {
    const int first = mesh.getNumVertices(), numPoints = tags.getCount("NumberOfPoints"),
              numFaces = tags.getCount("NumberOfPolys");
    const std::string_view strips = tags.getAttribute("NumberOfStrips");
    if (!strips.empty() && tags.getCount("NumberOfStrips") > 0)
        throw std::runtime_error("it has strips of triangles; write it with polygons alone");
    std::string_view points, connectivity, offsets;
    while (tags.next() && tags.name != "/Piece") {
        if (tags.name == "Points") {
            tags.find("DataArray", "/Points");
            points = tags.getNumbers();
        } else if (tags.name == "Polys") {
            while (tags.next() && tags.name != "/Polys") {
                if (tags.name != "DataArray") continue;
                if (tags.getAttribute("Name") == "connectivity") connectivity = tags.getNumbers();
                if (tags.getAttribute("Name") == "offsets") offsets = tags.getNumbers();
            }
        }
    }
    Words places(points), corners(connectivity), ends(offsets);
    for (int k = 0; k < numPoints; ++k) mesh.addVertex(places.nextPoint());
    for (int face = 0, begin = 0; face < numFaces; ++face) {
        const int end = ends.nextInteger();
        std::vector<int> vertices;
        for (int k = begin; k < end; ++k) {
            const int corner = corners.nextInteger();
            if (corner < 0 || corner >= numPoints)
                throw std::runtime_error("a polygon names point " + std::to_string(corner) +
                                         "; its piece has " + std::to_string(numPoints) +
                                         ", from 0");
            vertices.push_back(first + corner);
        }
        begin = end;
        addFace(mesh, vertices);
    }
    std::string_view more;
    if (places.next(more) || corners.next(more) || ends.next(more))
        throw std::runtime_error("it has more numbers than the " + std::to_string(numPoints) +
                                 " points and " + std::to_string(numFaces) +
                                 " polygons that it names");
}

void readVtp(std::string_view xml, SimTK::PolygonalMesh& mesh) {
    Tags tags(xml);
    tags.find("VTKFile");
    if (tags.getAttribute("type") != "PolyData")
        throw std::runtime_error("it is of type " + quoteStart(tags.getAttribute("type")) +
                                 ", not PolyData");
    tags.find("Piece");
    do {
        if (tags.name == "Piece") readVtpPiece(tags, mesh);
    } while (tags.next());
}

}  // namespace

SimTK::PolygonalMesh readSurface(const std::string& path) {
    std::ifstream file = openInputFile(path);
    if (!file.is_open()) throw std::runtime_error("there is no such file");
    std::string bytes(std::istreambuf_iterator<char>(file), {});
    const std::string ending = lowerCase(std::filesystem::path(path).extension().string());
    SimTK::PolygonalMesh mesh;
    if (ending == ".obj")
        readObj(std::move(bytes), mesh);
    else if (ending == ".vtp")
        readVtp(bytes, mesh);
    else if (ending != ".stl")
        throw std::runtime_error("a surface is a file .stl, .obj or .vtp");
    else if (isStlText(bytes))
        readStlText(bytes, mesh);
    else
        readStlBytes(bytes, mesh);
    if (mesh.getNumFaces() == 0) throw std::runtime_error("it has no faces");
    return mesh;
}

}  // namespace simflex
