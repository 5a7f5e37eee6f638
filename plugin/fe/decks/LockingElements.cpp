#include "LockingElements.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "simflex/base/NumberText.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

constexpr double ManySolids = 0.1;  // of all solids
constexpr double Overstiff =
    0.02;  // share of bending stiffness that is warned of: 1 % of frequency
constexpr double Smooth = 0.939693;  // cosine of 20°: beams at a larger angle meet in a knot

/** k of LockingElements.h. **/
double getArcFactor(const ThinElement& element) {
    if (element.type == "B32" || element.type == "S8") return 0.07;
    if (element.type == "S6") return 0.017;
    return element.type == "B32R" && element.section == BeamSection::Circle ? 0.01 : 0;
}
constexpr double KinkFactor = 0.25;

std::string plural(size_t count, const std::string& noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

class LockingSearch {
public:
    LockingSearch(const std::vector<ThinElement>& thin, const std::map<int, Vec3d>& nodes,
                  DeckModel& deck)
        : m_thin(thin), m_nodes(nodes), m_deck(deck) {
        for (const ThinElement& element : thin) m_thinNumbers.insert(element.number);
    }

    /** The solids that CalculiX makes of shells of first order: C3D6 locks whatever the mesh, C3D8I
    and C3D8R where they are not rectangular or coarse. **/
    void warnOfLinearShells() {
        std::map<std::string, size_t> counts;
        const ThinElement* first = nullptr;
        for (const ThinElement& element : m_thin) {
            if (findThinType(element.type)->isBeam || element.nodes.size() >= 6) continue;
            ++counts[element.type];
            if (!first) first = &element;
        }
        if (!first) return;
        std::string types;
        for (const auto& [type, count] : counts)
            types += (types.empty() ? "" : ", ") + type + ": " + std::to_string(count);
        warn(first->where + "shells of first order (" + types +
             ") are too stiff, as in CalculiX: the solids they become lock in bending, and "
             "frequencies come out up to three times too high; leave --calculix-shells out");
    }

    void warnOfLinearSolids() {
        size_t numAll = 0, numPlain = 0;
        for (const auto& [type, solids] : m_deck.solids) {
            numAll += solids.size();
            const bool isOfShell = !solids.empty() && m_thinNumbers.count(solids[0].number);
            if ((type == "C3D4" || type == "C3D6") && !isOfShell) numPlain += solids.size();
        }
        if (double(numPlain) > ManySolids * double(numAll))
            warn(std::to_string(numPlain) +
                 " linear tetrahedra and wedges (C3D4, C3D6) are far too stiff in bending: use "
                 "order 2 (C3D10, C3D15)");
        const std::pair<const char*, const char*> bricks[] = {
            {"C3D8", "one linear brick through a thickness is far too stiff in bending"},
            {"C3D8R",
             "one brick of reduced integration through a thickness has no stiffness in bending "
             "but that of its hourglass control, and frequencies come out anywhere"}};
        for (const auto& [type, why] : bricks) {
            const size_t numThrough = countBricksThrough(type);
            if (double(numThrough) > ManySolids * double(numAll))
                warn(plural(numThrough, "element") + " " + type +
                     " reach through the part from one side to the other: " + why +
                     "; use C3D8I or C3D20R, or more of them");
        }
    }

    void warnOfCurvedElements() {
        std::map<int, std::vector<const ThinElement*>> beamsAt;
        for (const ThinElement& element : m_thin)
            if (element.type == "B31")
                for (const int node : element.nodes) beamsAt[node].push_back(&element);
        struct Kind {
            size_t numAll = 0, numLocked = 0;
            double excess = 0;  ///< sum of what is added to stiffnesses of 1
            bool isCircle = false;
        };
        std::map<std::string, Kind> kinds;
        for (const ThinElement& element : m_thin) {
            Kind& kind = kinds[element.type];
            const double excess =
                element.type == "B31" ? calcExcessOfKinks(element, beamsAt) : calcExcess(element);
            ++kind.numAll;
            kind.excess += excess;
            kind.numLocked += excess > Overstiff;
            kind.isCircle |= element.section == BeamSection::Circle;
        }
        for (const auto& [type, kind] : kinds) {
            const double mean = kind.excess / double(kind.numAll);
            if (!(mean > Overstiff)) continue;
            const bool isBeam = findThinType(type)->isBeam;
            const std::string amount = mean < 1 ? writeGeneral(100 * mean, 2) + " %"
                                                : "a factor of " + writeGeneral(1 + mean, 2);
            warn(plural(kind.numLocked, "element") + " " + type + " of " +
                 std::to_string(kind.numAll) + " follow a curve in steps too long for their " +
                 "thickness and lock: the part is too stiff in bending by about " + amount +
                 "; use " +
                 (!isBeam          ? "S8R"
                  : type == "B32R" ? "SECTION=PIPE with a wall of nearly the radius"
                  : kind.isCircle  ? "B32R with SECTION=PIPE, its wall nearly the radius"
                                   : "B32R") +
                 ", or shorter elements: half the length leaves " +
                 (type == "B31" ? "a sixty-fourth" : "a sixteenth") + " of it");
        }
    }

private:
    void warn(const std::string& text) { m_deck.warnings.push_back(text); }

    /** Bricks that have the part's skin on two opposite sides. **/
    size_t countBricksThrough(const std::string& type) const {
        const auto bricks = m_deck.solids.find(type);
        if (bricks == m_deck.solids.end() || m_thinNumbers.count(bricks->second[0].number))
            return 0;
        // Corners of opposite faces.
        static constexpr int Pairs[3][2][4] = {{{0, 1, 2, 3}, {4, 5, 6, 7}},
                                               {{0, 1, 5, 4}, {3, 2, 6, 7}},
                                               {{0, 3, 7, 4}, {1, 2, 6, 5}}};
        std::set<std::array<int, 4>> skin;  // deck numbers
        std::unordered_set<int> onSkin;
        for (const MeshFace& face : extractBoundaryFaces(m_deck.mesh)) {
            std::array<int, 4> corners = face.corners;
            for (int& corner : corners)
                if (corner >= 0) corner = m_deck.mesh.nodeNumbers[size_t(corner)];
            onSkin.insert(corners.begin(), corners.begin() + face.numCorners());
            std::sort(corners.begin(), corners.end());
            skin.insert(corners);
        }
        size_t count = 0;
        for (const auto& solid : bricks->second) {
            if (!std::all_of(solid.nodes.begin(), solid.nodes.end(),
                             [&](int number) { return onSkin.count(number) > 0; }))
                continue;
            const auto isFree = [&](const int(&corners)[4]) {
                std::array<int, 4> face;
                for (size_t k = 0; k < 4; ++k) face[k] = solid.nodes[size_t(corners[k])];
                std::sort(face.begin(), face.end());
                return skin.count(face) > 0;
            };
            count += std::any_of(std::begin(Pairs), std::end(Pairs), [&](const auto& pair) {
                return isFree(pair[0]) && isFree(pair[1]);
            });
        }
        return count;
    }

    const Vec3d& at(int node) const { return m_nodes.at(node); }

    /** Of a beam across its axis, of a shell along its normal [m]. @param direction  of length 1
     * **/
    static double calcThickness(const ThinElement& element, const Vec3d& along,
                                const Vec3d& direction) {
        if (!findThinType(element.type)->isBeam) return element.thickness[0];
        const Vec3d first = sumOf(element.n1, -dot(element.n1, along), along);
        const double size = normOf(first);
        if (!(size > 0)) return element.thickness[0];
        const double share = dot(first, direction) / size;
        return std::abs(share) * element.thickness[0] +
               std::sqrt(std::max(0.0, 1 - share * share)) * element.thickness[1];
    }

    /** By the edge that is curved most: a middle node at a distance s from its chord makes
    h²/R = 8 s. **/
    double calcExcess(const ThinElement& element) const {
        const double factor = getArcFactor(element);
        const size_t corners = element.nodes.size() / 2;  // of shells
        const bool isBeam = findThinType(element.type)->isBeam;
        if (factor == 0 || !(element.thickness[0] > 0)) return 0;
        double most = 0;
        for (size_t edge = 0; edge < (isBeam ? 1 : corners); ++edge) {
            const Vec3d &a = at(element.nodes[edge]),
                        &b = at(element.nodes[isBeam ? 2 : (edge + 1) % corners]),
                        &middle = at(element.nodes[isBeam ? 1 : corners + edge]);
            const Vec3d chord = minus(b, a);
            const double length = normOf(chord);
            if (!(length > 0)) continue;
            const Vec3d along = scaled(chord, 1 / length);
            Vec3d off = minus(middle, sumOf(a, 0.5, chord));
            off = sumOf(off, -dot(off, along), along);
            if (!isBeam) {
                const Vec3d across = cross(minus(at(element.nodes[1]), at(element.nodes[0])),
                                           minus(at(element.nodes[2]), at(element.nodes[0])));
                const double size = normOf(across);
                if (!(size > 0)) continue;
                off = scaled(across, dot(off, across) / (size * size));
            }
            const double sagitta = normOf(off);
            if (!(sagitta > 0)) continue;
            const double t = calcThickness(element, along, scaled(off, 1 / sagitta));
            most = std::max(most, 8 * sagitta / t);
        }
        return factor * most * most;
    }

    /** By the sharpest of its smooth kinks. **/
    double calcExcessOfKinks(const ThinElement& element,
                             const std::map<int, std::vector<const ThinElement*>>& beamsAt) const {
        const Vec3d chord = minus(at(element.nodes[1]), at(element.nodes[0]));
        const double length = normOf(chord);
        if (!(length > 0) || !(element.thickness[0] > 0)) return 0;
        const Vec3d along = scaled(chord, 1 / length);
        double excess = 0;
        for (const int node : element.nodes)
            for (const ThinElement* other : beamsAt.at(node)) {
                if (other == &element) continue;
                const Vec3d next = minus(at(other->nodes[1]), at(other->nodes[0]));
                const double cosine = dot(next, along) / normOf(next);
                const Vec3d turn = sumOf(scaled(next, 1 / normOf(next)), -cosine, along);
                const double sine = normOf(turn);
                if (!(std::abs(cosine) > Smooth) || !(sine > 0)) continue;
                const double t = calcThickness(element, along, scaled(turn, 1 / sine));
                excess = std::max(excess, std::pow(sine * sine * length / t, 2));
            }
        return KinkFactor * excess;
    }

    const std::vector<ThinElement>& m_thin;
    const std::map<int, Vec3d>& m_nodes;
    DeckModel& m_deck;
    std::unordered_set<int> m_thinNumbers;
};

}  // namespace

void warnOfLockingElements(const std::vector<ThinElement>& thin, const std::map<int, Vec3d>& nodes,
                           ShellUse use, DeckModel& deck) {
    LockingSearch search(thin, nodes, deck);
    if (use != ShellUse::Shells) search.warnOfLinearShells();
    search.warnOfLinearSolids();
    search.warnOfCurvedElements();
}

}  // namespace simflex
