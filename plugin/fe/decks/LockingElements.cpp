#include "LockingElements.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <unordered_map>
#include <unordered_set>

#include "simflex/base/NumberText.h"
#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

constexpr double ManySolids = 0.1;  // relative to all solids
constexpr double Overstiff =
    0.02;  // excess of bending stiffness that causes a warning: 1 % of frequency
constexpr double Smooth = 0.939693;  // cosine of 20°: beams at a larger angle meet in a knot

/** k of LockingElements.h. **/
double getArcFactor(const ThinElement& element, ShellUse use) {
    if (use == ShellUse::Shells && findThinType(element.type)->isBeam) return 0;
    if (element.type == "B32" || element.type == "S8") return 0.07;
    if (element.type == "S6") return 0.017;
    return element.type == "B32R" && element.section == BeamSection::Circle ? 0.01 : 0;
}
constexpr double KinkFactor = 0.25, BrickArcFactor = 0.07, ShearFactor = 0.385,
                 ThicknessFactor = 0.23;
constexpr double Slender = 3;  // how much longer than thick a part is that bends

std::string plural(size_t count, const std::string& noun) {
    return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

/** Hexahedra of solids, and how thick the part is at each of them along its three directions. **/
class BrickChains {
public:
    struct Brick {
        const std::string* type;
        const std::vector<int>* nodes;
        std::array<Vec3d, 3> axes;        ///< between the middles of opposite faces [m]
        std::array<double, 3> size{};     ///< their lengths
        std::array<double, 3> through{};  ///< from skin to skin; ∞ where it is not all bricks
        std::array<int, 3> layers{};      ///< as many bricks
        std::array<std::array<int, 2>, 3> next{};  ///< of each direction, −1: none
    };
    std::vector<Brick> bricks;

    BrickChains(const DeckModel& deck, const std::unordered_set<int>& thinNumbers,
                const std::map<int, Vec3d>& nodes)
        : m_nodes(nodes) {
        bool canLock = false;
        for (const auto& [type, solids] : deck.solids) {
            if (solids.empty() || thinNumbers.count(solids[0].number)) continue;
            if (type.compare(0, 4, "C3D8") != 0 && type.compare(0, 5, "C3D20") != 0) continue;
            canLock |= type != "C3D20R";
            for (const auto& solid : solids)
                if (!thinNumbers.count(solid.number)) bricks.push_back({&type, &solid.nodes, {}});
        }
        if (!canLock) bricks.clear();
        if (bricks.empty()) return;
        for (Brick& brick : bricks) measure(brick);
        join();
        const auto isSkin = findSkin(deck);
        for (size_t b = 0; b < bricks.size(); ++b)
            for (size_t d = 0; d < 3; ++d)
                for (const size_t side : {0, 1})
                    if (bricks[b].next[d][side] < 0 && bricks[b].layers[d] == 0)
                        follow(int(b), d, side, isSkin);
        for (Brick& brick : bricks)
            for (size_t d = 0; d < 3; ++d)
                if (brick.layers[d] == 0) setEndless(brick, d);
    }

    /** How far the middles of the edges along a direction lie off the straight, along another. **/
    double calcSagitta(const Brick& brick, size_t along, size_t across) const {
        // Of nodes 8 … 19: between which corners; edges of direction 0, 1, 2.
        static constexpr int Edges[3][4][3] = {{{8, 0, 1}, {10, 3, 2}, {12, 4, 5}, {14, 7, 6}},
                                               {{9, 1, 2}, {11, 0, 3}, {13, 5, 6}, {15, 4, 7}},
                                               {{16, 0, 4}, {17, 1, 5}, {18, 2, 6}, {19, 3, 7}}};
        double most = 0;
        for (const auto& [middle, from, to] : Edges[along]) {
            const Vec3d chord = minus(at(brick, to), at(brick, from));
            const Vec3d off = minus(at(brick, middle), sumOf(at(brick, from), 0.5, chord));
            most = std::max(most, std::abs(dot(off, brick.axes[across])) / brick.size[across]);
        }
        return most;
    }

    /** Sine of the larger smooth angle to its neighbours, in the plane of two directions. **/
    double calcKink(const Brick& brick, size_t along, size_t across) const {
        double most = 0;
        for (const int other : brick.next[along]) {
            if (other < 0) continue;
            const Brick& next = bricks[size_t(other)];
            for (size_t d = 0; d < 3; ++d) {  // its directions may have other names
                const double length = next.size[d] * brick.size[along];
                if (!(std::abs(dot(next.axes[d], brick.axes[along])) > Smooth * length)) continue;
                most = std::max(most, std::abs(dot(next.axes[d], brick.axes[across])) /
                                          (next.size[d] * brick.size[across]));
            }
        }
        return most;
    }

private:
    using Face = std::array<int, 4>;

    const Vec3d& at(const Brick& brick, int local) const {
        return m_nodes.at((*brick.nodes)[size_t(local)]);
    }

    static Face faceOf(const Brick& brick, size_t direction, size_t side) {
        static constexpr int Corners[3][2][4] = {{{0, 3, 7, 4}, {1, 2, 6, 5}},
                                                 {{0, 1, 5, 4}, {3, 2, 6, 7}},
                                                 {{0, 1, 2, 3}, {4, 5, 6, 7}}};
        Face face;
        for (size_t k = 0; k < 4; ++k)
            face[k] = (*brick.nodes)[size_t(Corners[direction][side][k])];
        std::sort(face.begin(), face.end());
        return face;
    }

    void measure(Brick& brick) const {
        for (size_t d = 0; d < 3; ++d) {
            brick.next[d] = {-1, -1};
            for (const size_t side : {0, 1})
                for (const int node : faceOf(brick, d, side))
                    brick.axes[d] = sumOf(brick.axes[d], side ? 0.25 : -0.25, m_nodes.at(node));
            brick.size[d] = normOf(brick.axes[d]);
        }
    }

    void join() {
        struct Side {
            Face face;
            int brick;
            std::uint8_t direction, side;
        };
        std::vector<Side> sides;
        sides.reserve(6 * bricks.size());
        for (size_t b = 0; b < bricks.size(); ++b)
            for (std::uint8_t d = 0; d < 3; ++d)
                for (const std::uint8_t side : {0, 1})
                    sides.push_back({faceOf(bricks[b], d, side), int(b), d, side});
        std::sort(sides.begin(), sides.end(),
                  [](const Side& a, const Side& b) { return a.face < b.face; });
        for (size_t k = 0; k + 1 < sides.size(); ++k) {
            const Side &a = sides[k], &b = sides[k + 1];
            if (a.face != b.face) continue;
            bricks[size_t(a.brick)].next[a.direction][a.side] = b.brick;
            bricks[size_t(b.brick)].next[b.direction][b.side] = a.brick;
        }
    }

    static std::set<Face> findSkin(const DeckModel& deck) {
        std::set<Face> skin;
        for (const MeshFace& face : extractBoundaryFaces(deck.mesh)) {
            if (face.numCorners() != 4) continue;
            Face corners = face.corners;
            for (int& corner : corners) corner = deck.mesh.nodeNumbers[size_t(corner)];
            std::sort(corners.begin(), corners.end());
            skin.insert(corners);
        }
        return skin;
    }

    static void setEndless(Brick& brick, size_t direction) {
        brick.through[direction] = std::numeric_limits<double>::infinity();
        brick.layers[direction] = std::numeric_limits<int>::max();
    }

    /** All bricks one behind another from the end of a chain. **/
    void follow(int first, size_t direction, size_t side, const std::set<Face>& skin) {
        std::vector<std::pair<int, size_t>> chain;
        double length = 0;
        bool isWhole = skin.count(faceOf(bricks[size_t(first)], direction, side)) > 0;
        for (int b = first, before = -1;;) {
            Brick& brick = bricks[size_t(b)];
            if (before >= 0) {  // where it came in
                bool isFound = false;
                for (size_t d = 0; d < 3 && !isFound; ++d)
                    for (const size_t s : {0, 1})
                        if (!isFound && brick.next[d][s] == before)
                            direction = d, side = s, isFound = true;
            }
            if (brick.layers[direction] != 0) break;  // its start was found from the other end
            chain.emplace_back(b, direction);
            brick.layers[direction] = 1;  // for now
            length += brick.size[direction];
            const int next = brick.next[direction][1 - side];
            if (next < 0) {
                isWhole = isWhole && skin.count(faceOf(brick, direction, 1 - side));
                break;
            }
            before = b;
            b = next;
        }
        for (const auto& [b, d] : chain) {
            Brick& brick = bricks[size_t(b)];
            setEndless(brick, d);
            if (!isWhole) continue;
            brick.through[d] = length;
            brick.layers[d] = int(chain.size());
        }
    }

    const std::map<int, Vec3d>& m_nodes;
};

class LockingSearch {
public:
    LockingSearch(const std::vector<ThinElement>& thin, const std::map<int, Vec3d>& nodes,
                  ShellUse use, DeckModel& deck)
        : m_thin(thin), m_nodes(nodes), m_use(use), m_deck(deck) {
        for (const ThinElement& element : thin) m_thinNumbers.insert(element.number);
    }

    /** Warns of CalculiX's solids for linear shells: C3D6 always locks, C3D8I and C3D8R lock if
    they are not rectangular or coarse. **/
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
        warnOfThinBricks(numAll);
    }

    void warnOfCurvedElements() {
        std::map<int, std::vector<const ThinElement*>> beamsAt;
        for (const ThinElement& element : m_thin)
            if (element.type == "B31")
                for (const int node : element.nodes) beamsAt[node].push_back(&element);
        struct Kind {
            size_t numAll = 0, numLocked = 0;
            double excess = 0;  ///< sum of what is added to stiffnesses of 1
        };
        std::map<std::string, Kind> kinds;
        for (const ThinElement& element : m_thin) {
            Kind& kind = kinds[element.type];
            const double excess =
                element.type == "B31" ? calcExcessOfKinks(element, beamsAt) : calcExcess(element);
            ++kind.numAll;
            kind.excess += excess;
            kind.numLocked += excess > Overstiff;
        }
        for (const auto& [type, kind] : kinds) {
            const double mean = kind.excess / double(kind.numAll);
            if (!(mean > Overstiff)) continue;
            const bool isBeam = findThinType(type)->isBeam;
            warn(plural(kind.numLocked, "element") + " " + type + " of " +
                 std::to_string(kind.numAll) + " follow a curve in steps too long for their " +
                 "thickness and lock: the part is too stiff in bending by about " +
                 writeExcess(mean) + "; use " +
                 (isBeam ? "simflex's own beams, without --calculix-shells" : "S8R") +
                 ", or shorter elements: half the length leaves " +
                 (type == "B31" ? "a sixty-fourth" : "a sixteenth") + " of it");
        }
    }

private:
    void warn(const std::string& text) { m_deck.warnings.push_back(text); }

    /** Of bricks whose bending is too stiff, or of C3D8R anything. **/
    void warnOfThinBricks(size_t numAll) {
        const BrickChains chains(m_deck, m_thinNumbers, m_nodes);
        for (const std::string type : {"C3D8", "C3D8I", "C3D20"}) {
            size_t numLocked = 0, count = 0;
            double sum = 0;
            for (const BrickChains::Brick& brick : chains.bricks) {
                if (*brick.type != type) continue;
                const double excess = calcExcess(chains, brick);
                ++count;
                sum += excess;
                numLocked += excess > Overstiff;
            }
            const double mean = count ? sum / double(count) : 0;
            if (!(mean > Overstiff) || !(double(numLocked) > ManySolids * double(numAll))) continue;
            warn(plural(numLocked, "element") + " " + type + " of " + std::to_string(count) +
                 (type == "C3D8"
                      ? " are too long for the thickness of the part and lock"
                      : " follow a curve in steps too long for the thickness of the part and "
                        "lock") +
                 ": it is too stiff in bending by about " + writeExcess(mean) + "; use " +
                 (type == "C3D8" ? "C3D8I or C3D20R" : "C3D20R") + ", or shorter elements");
        }
        size_t numReduced = 0;
        for (const BrickChains::Brick& brick : chains.bricks)
            numReduced += *brick.type == "C3D8R" &&
                          *std::min_element(brick.layers.begin(), brick.layers.end()) <= 2;
        if (double(numReduced) > ManySolids * double(numAll))
            warn(plural(numReduced, "element") +
                 " C3D8R lie where the part is one or two of them thick: their bending stiffness "
                 "is mostly that of hourglass control, and frequencies come out anywhere; use "
                 "C3D8I or C3D20R, or four of them or more");
    }

    static std::string writeExcess(double excess) {
        return excess < 1 ? writeGeneral(100 * excess, 2) + " %"
                          : "a factor of " + writeGeneral(1 + excess, 2);
    }

    /** Where the part is thin in one direction, by how much its bending along another is too
    stiff. **/
    static double calcExcess(const BrickChains& chains, const BrickChains::Brick& brick) {
        double most = 0;
        const double longest = *std::max_element(brick.through.begin(), brick.through.end());
        for (size_t thin = 0; thin < 3; ++thin)
            for (size_t along = 0; along < 3; ++along) {
                const double t = brick.through[thin];
                if (along == thin || !(brick.through[along] > Slender * t) ||
                    brick.through[along] < 0.5 * longest)
                    continue;
                const double h = brick.size[along];
                double excess = 0;
                if (*brick.type == "C3D8") {
                    excess = ShearFactor * std::pow(h / t, 2) +
                             ThicknessFactor / std::pow(brick.layers[thin], 2);
                } else if (*brick.type == "C3D20") {
                    const double s = chains.calcSagitta(brick, along, thin);
                    excess = BrickArcFactor * std::pow(8 * s / t, 2);
                } else {
                    const double sine = chains.calcKink(brick, along, thin);
                    excess = KinkFactor * std::pow(sine * sine * h / t, 2);
                }
                most = std::max(most, excess);
            }
        return most;
    }

    const Vec3d& at(int node) const { return m_nodes.at(node); }

    /** Returns the thickness across the axis of a beam, or along the normal of a shell [m]. @param
    direction  unit vector **/
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

    /** Returns the excess of the most curved edge: a mid-edge node at a distance s from its chord
    gives h²/R = 8 s. **/
    double calcExcess(const ThinElement& element) const {
        const double factor = getArcFactor(element, m_use);
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

    /** Returns the excess of the sharpest smooth kink. **/
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
    const ShellUse m_use;
    DeckModel& m_deck;
    std::unordered_set<int> m_thinNumbers;
};

}  // namespace

void warnOfLockingElements(const std::vector<ThinElement>& thin, const std::map<int, Vec3d>& nodes,
                           ShellUse use, DeckModel& deck) {
    LockingSearch search(thin, nodes, use, deck);
    if (use != ShellUse::Shells) search.warnOfLinearShells();
    search.warnOfLinearSolids();
    search.warnOfCurvedElements();
}

}  // namespace simflex
