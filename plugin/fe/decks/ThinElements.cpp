#include "ThinElements.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <stdexcept>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/elements/SolidElements.h"

namespace simflex {
namespace {

constexpr double SameNormal = 0.939693;    // cosine of 20°, with CalculiX's digits
constexpr double SameAsGiven = 0.999962;   // cosine of half a degree, from a *NORMAL
constexpr double SameThickness = 1e-10;    // thicknesses [m] and offsets, as in CalculiX
constexpr double NearlyParallel = 0.0087;  // sine of half a degree between normals of a knot
constexpr double SameSurface = 0.05;       // smallest relative pivot of a surface's fit
constexpr double Flat = 1e-8;              // share of the largest moment that counts as zero

const std::map<std::string, ThinType> Thin = {
    {"S3", {false, 3, ShellWedge, "C3D6"}},   {"S4", {false, 4, ShellHex, "C3D8I"}},
    {"S4R", {false, 4, ShellHex, "C3D8R"}},   {"S6", {false, 6, "C3D15", "C3D15"}},
    {"S8", {false, 8, "C3D20", "C3D20"}},     {"S8R", {false, 8, "C3D20R", "C3D20R"}},
    {"B31", {true, 2, BeamSolid, "C3D8I"}},   {"B32", {true, 3, BeamSolid, "C3D20"}},
    {"B32R", {true, 3, BeamSolid, BeamSolid}}};

/** Positions of a beam's expanded nodes in its section, ξ along n₁ and η along n₂ in −1…1: corners,
then the middles of the sides. **/
constexpr double Section[8][2] = {{-1, 1}, {-1, -1}, {1, -1}, {1, 1},
                                  {-1, 0}, {0, -1},  {1, 0},  {0, 1}};

/** Hexahedron of a quadratic beam: index in Section and node along the beam. **/
constexpr int BeamHex[20][2] = {{0, 0}, {0, 2}, {1, 2}, {1, 0}, {3, 0}, {3, 2}, {2, 2},
                                {2, 0}, {0, 1}, {4, 2}, {1, 1}, {4, 0}, {3, 1}, {6, 2},
                                {2, 1}, {6, 0}, {7, 0}, {7, 2}, {5, 2}, {5, 0}};

Vec3d unit(const Vec3d& a) {
    return sumOf({0, 0, 0}, 1 / normOf(a), a);
}

/** An element at a node: its directions there and its expansion. **/
struct Corner {
    const ThinElement* element;
    int local;
    Vec3d normal{};   ///< shell: normal; beam: n₂
    Vec3d tangent{};  ///< beams
    std::array<double, 2> thickness{};
    bool isGiven = false;  ///< from a *NORMAL
    int expansion = -1;
};

/** Expansion of a node for a group of elements. **/
struct Expansion {
    Vec3d normal{};  ///< shell: normal; beam: n₂
    Vec3d first{};   ///< beam: n₁
    std::array<double, 2> thickness{};
    std::array<double, 2> offset{};
    BeamSection section = BeamSection::Rectangle;
    bool isBeam = false;
    std::array<int, 8> numbers{};  ///< of expanded nodes: shell bottom, middle, top; 0: not created
};

class Expander {
public:
    Expander(const std::map<int, std::array<double, 3>>& nodes,
             const std::vector<ThinElement>& elements,
             const std::map<int, std::array<double, 2>>& nodeThickness, ShellUse use)
        : m_nodes(nodes), m_elements(elements), m_nodeThickness(nodeThickness), m_use(use) {
        m_nextNumber = nodes.empty() ? 1 : nodes.rbegin()->first + 1;
    }

    ThinExpansion expand() {
        for (const ThinElement& element : m_elements)
            for (int k = 0; k < int(element.nodes.size()); ++k)
                m_corners[element.nodes[size_t(k)]].push_back(makeCorner(element, k));
        for (auto& [node, corners] : m_corners) {
            std::stable_sort(corners.begin(), corners.end(), [](const Corner& a, const Corner& b) {
                return a.element->number < b.element->number;
            });
            groupShells(node, corners);
            groupBeams(node, corners);
        }
        warnOfOtherSides();
        if (m_use == ShellUse::Shells) fitNormals();
        for (const ThinElement& element : m_elements) addSolid(element);
        for (auto& [node, expansions] : m_expansions) {
            if (expansions.size() > 1) {
                addKnot(node, expansions);
            } else {
                addBetween(node, expansions[0]);
            }
        }
        return std::move(m_result);
    }

private:
    static bool isBeam(const ThinElement& element) { return findThinType(element.type)->isBeam; }

    std::vector<Vec3d> positionsOf(const ThinElement& element) const {
        std::vector<Vec3d> x;
        for (const int node : element.nodes) x.push_back(m_nodes.at(node));
        return x;
    }

    Corner makeCorner(const ThinElement& element, int local) const {
        Corner corner{&element, local};
        corner.thickness = element.thickness;
        const int node = element.nodes[size_t(local)];
        if (element.hasNodalThickness) {
            const auto given = m_nodeThickness.find(node);
            if (given == m_nodeThickness.end())
                throw std::invalid_argument(element.where + "element " +
                                            std::to_string(element.number) +
                                            " takes the thickness of its nodes, but node " +
                                            std::to_string(node) + " has no *NODAL THICKNESS");
            corner.thickness = given->second;
        }
        for (int k = 0; k < (isBeam(element) ? 2 : 1); ++k)
            if (!(corner.thickness[size_t(k)] > 0))
                throw std::invalid_argument(
                    element.where + "element " + std::to_string(element.number) +
                    " has thickness " + writeGeneral(corner.thickness[size_t(k)], 6) + " at node " +
                    std::to_string(node) + "; it must be positive");
        const auto x = positionsOf(element);
        const auto given = element.normals.find(node);
        corner.isGiven = given != element.normals.end();
        if (isBeam(element)) {
            const double xi = local - 1;
            corner.tangent =
                x.size() == 2
                    ? sumOf(x[1], -1, x[0])
                    : sumOf(sumOf(sumOf({0, 0, 0}, xi - 0.5, x[0]), -2 * xi, x[1]), xi + 0.5, x[2]);
            check(corner.tangent, element, node, "tangent");
            corner.tangent = unit(corner.tangent);
            corner.normal =
                corner.isGiven ? given->second : cross(corner.tangent, unit(element.n1));
            if (normOf(cross(corner.tangent, corner.normal)) < 1e-6)
                throw std::invalid_argument(
                    element.where + "beam " + std::to_string(element.number) +
                    (corner.isGiven
                         ? " points along its *NORMAL at node " + std::to_string(node)
                         : " points along the first axis n1 of its section; give another n1 on the "
                           "second line of *BEAM SECTION (0, 0, -1 where there is none)"));
        } else {
            const auto at = getFaceNodeCoordinates(int(x.size()), local);
            const FacePoint point = calcFacePoint(x, at[0], at[1]);
            corner.normal = cross(point.tangentXi, point.tangentEta);
            check(corner.normal, element, node, "normal");
            if (corner.isGiven) {
                if (!(dot(corner.normal, given->second) > 0))
                    throw std::invalid_argument(
                        element.where + "the *NORMAL of element " + std::to_string(element.number) +
                        " at node " + std::to_string(node) +
                        " points to the other side than the order of its nodes; turn it around");
                corner.normal = given->second;
            }
        }
        corner.normal = unit(corner.normal);
        return corner;
    }

    static void check(const Vec3d& v, const ThinElement& element, int node, const char* what) {
        if (normOf(v) > 0) return;
        throw std::invalid_argument(element.where + "element " + std::to_string(element.number) +
                                    " has no " + what + " at node " + std::to_string(node) +
                                    "; do its nodes coincide?");
    }

    /** Returns the indices of the corners, those with a *NORMAL first. **/
    static std::vector<size_t> listLeads(const std::vector<Corner>& corners) {
        std::vector<size_t> leads;
        for (const bool isGiven : {true, false})
            for (size_t k = 0; k < corners.size(); ++k)
                if (corners[k].isGiven == isGiven) leads.push_back(k);
        return leads;
    }

    static bool isSame(double a, double b) { return std::abs(a - b) < SameThickness; }

    /** Groups shells with nearly equal normals; corners are ordered by element number. **/
    void groupShells(int node, std::vector<Corner>& corners) {
        for (const size_t first : listLeads(corners)) {
            const Corner& lead = corners[first];
            if (isBeam(*lead.element) || lead.expansion >= 0) continue;
            Expansion expansion;
            const double near = lead.isGiven ? SameAsGiven : SameNormal;
            const int index = int(m_expansions[node].size());
            for (size_t k = 0; k < corners.size(); ++k) {
                Corner& other = corners[k];
                if (isBeam(*other.element) || other.expansion >= 0) continue;
                if (k != first && !(dot(other.normal, lead.normal) > near &&
                                    isSame(other.thickness[0], lead.thickness[0]) &&
                                    isSame(other.element->offset[0], lead.element->offset[0])))
                    continue;
                expansion.normal = sumOf(expansion.normal, 1, other.normal);
                other.expansion = index;
            }
            expansion.normal = lead.isGiven ? lead.normal : unit(expansion.normal);
            expansion.thickness = lead.thickness;
            expansion.offset = lead.element->offset;
            // If a knot's nodes are nearly collinear, they become exactly collinear: a thickness
            // step in an otherwise smooth shell, as in CalculiX.
            if (index > 0) {
                const Vec3d& other = m_expansions[node][0].normal;
                if (normOf(cross(expansion.normal, other)) < NearlyParallel)
                    expansion.normal = scaled(other, dot(expansion.normal, other) > 0 ? 1.0 : -1.0);
            }
            m_expansions[node].push_back(expansion);
        }
    }

    /** As above for beams: axes and sections must agree. **/
    void groupBeams(int node, std::vector<Corner>& corners) {
        for (const size_t first : listLeads(corners)) {
            const Corner& lead = corners[first];
            if (!isBeam(*lead.element) || lead.expansion >= 0) continue;
            Expansion expansion;
            Vec3d tangent{};
            const double near = lead.isGiven ? SameAsGiven : SameNormal;
            const int index = int(m_expansions[node].size());
            for (size_t k = 0; k < corners.size(); ++k) {
                Corner& other = corners[k];
                if (!isBeam(*other.element)) continue;
                if (k != first && !(dot(other.normal, lead.normal) > near &&
                                    dot(other.tangent, lead.tangent) > near &&
                                    isSame(other.thickness[0], lead.thickness[0]) &&
                                    isSame(other.thickness[1], lead.thickness[1]) &&
                                    isSame(other.element->offset[0], lead.element->offset[0]) &&
                                    isSame(other.element->offset[1], lead.element->offset[1]) &&
                                    other.element->section == lead.element->section &&
                                    other.element->walls == lead.element->walls))
                    continue;
                expansion.normal = sumOf(expansion.normal, 1, other.normal);
                tangent = sumOf(tangent, 1, other.tangent);
                other.expansion = index;
            }
            tangent = unit(tangent);
            if (lead.isGiven) expansion.normal = lead.normal;
            expansion.normal =
                unit(sumOf(expansion.normal, -dot(expansion.normal, tangent), tangent));
            expansion.first = cross(expansion.normal, tangent);
            expansion.thickness = lead.thickness;
            expansion.offset = lead.element->offset;
            expansion.section = lead.element->section;
            if (m_use == ShellUse::Shells && expansion.section == BeamSection::Circle)
                expansion.section = BeamSection::Pipe;
            expansion.isBeam = true;
            m_expansions[node].push_back(expansion);
        }
    }

    /** Warns of neighbours with opposite node order where this matters. **/
    void warnOfOtherSides() {
        const auto hasSides = [](const Corner& corner) {
            return !isBeam(*corner.element) &&
                   (corner.element->isLayered || !isSame(corner.element->offset[0], 0));
        };
        const ThinElement *first = nullptr, *second = nullptr;
        int at = 0, count = 0;
        for (const auto& [node, corners] : m_corners)
            for (const Corner& a : corners)
                for (const Corner& b : corners) {
                    if (a.element->number >= b.element->number || isBeam(*b.element) ||
                        isBeam(*a.element) || !(hasSides(a) || hasSides(b)) ||
                        dot(a.normal, b.normal) > -SameNormal)
                        continue;
                    if (count++ == 0) first = a.element, second = b.element, at = node;
                }
        if (count)
            m_result.warnings.push_back(
                first->where + "shells " + std::to_string(first->number) + " and " +
                std::to_string(second->number) + " meet at node " + std::to_string(at) +
                " with opposite normals, so that their offset or layers lie on opposite sides" +
                (count > 1 ? ", as at other nodes" : "") +
                "; turn the order of the nodes of one around if they should not");
    }

    const Corner& cornerAt(const ThinElement& element, int node) const {
        const auto& corners = m_corners.at(node);
        return *std::find_if(corners.begin(), corners.end(),
                             [&](const Corner& corner) { return corner.element == &element; });
    }

    /** Computes the normals of linear shells from a surface fitted through the surrounding nodes.
    The mean of the facets' normals is wrong by an amount proportional to their size on skew meshes
    and at boundaries, which makes thin shells too stiff in bending. **/
    void fitNormals() {
        std::map<int, Vec3d> fitted;
        for (const auto& [node, corners] : m_corners) {
            const auto isOfShell = [](const Expansion& e) { return !e.isBeam; };
            const auto& expansions = m_expansions.at(node);
            if (std::count_if(expansions.begin(), expansions.end(), isOfShell) != 1) continue;
            const bool isLeft = std::any_of(corners.begin(), corners.end(), [](const Corner& c) {
                return !isBeam(*c.element) && (c.isGiven || c.element->nodes.size() > 4);
            });
            if (!isLeft)
                if (const auto normal = fitNormal(node, expansions[0].normal))
                    fitted[node] = *normal;
        }
        for (const auto& [node, normal] : fitted) m_expansions.at(node)[0].normal = normal;
    }

    /** Adds the nodes of the elements around a node that are smoothly connected there, including
    itself.
    @returns whether they surround it completely **/
    bool addRing(int node, int expansion, std::set<int>& ring) const {
        std::map<int, int> numEdges;  // by the node at the other end
        for (const Corner& corner : m_corners.at(node)) {
            if (corner.expansion != expansion || isBeam(*corner.element)) continue;
            const auto& nodes = corner.element->nodes;
            const size_t n = nodes.size(), k = size_t(corner.local);
            ++numEdges[nodes[(k + 1) % n]], ++numEdges[nodes[(k + n - 1) % n]];
            ring.insert(nodes.begin(), nodes.end());
        }
        return std::all_of(numEdges.begin(), numEdges.end(),
                           [](const auto& edge) { return edge.second == 2; });
    }

    /** Fits z = a x² + b xy + c y² + d x + e y over the tangent plane of a first guess; nothing if
    the nodes do not determine it. **/
    std::optional<Vec3d> fitNormal(int node, const Vec3d& guess) const {
        std::set<int> ring;
        const bool isInside = addRing(node, 0, ring);
        if (!isInside || ring.size() < 6) {
            for (const Corner& corner : m_corners.at(node)) {
                if (isBeam(*corner.element)) continue;
                for (const int next : corner.element->nodes)
                    addRing(next, cornerAt(*corner.element, next).expansion, ring);
            }
        }
        ring.erase(node);
        if (ring.size() < 5) return std::nullopt;
        const Eigen::Map<const Eigen::Vector3d> n(guess.data()), x0(m_nodes.at(node).data());
        const Eigen::Vector3d first = n.unitOrthogonal(), second = n.cross(first);
        Eigen::MatrixXd at(Eigen::Index(ring.size()), 3);
        Eigen::Index row = 0;
        for (const int other : ring) {
            const Eigen::Vector3d arm =
                Eigen::Map<const Eigen::Vector3d>(m_nodes.at(other).data()) - x0;
            at.row(row++) << arm.dot(first), arm.dot(second), arm.dot(n);
        }
        at /= at.cwiseAbs().maxCoeff();
        const auto x = at.col(0).array(), y = at.col(1).array();
        Eigen::MatrixXd A(at.rows(), 5);
        A << x.square(), x * y, y.square(), x, y;
        for (Eigen::Index k = 0; k < 5; ++k) A.col(k).normalize();
        const LeastSquares surface(A, SameSurface);
        if (surface.getRank() < 5) return std::nullopt;
        const Eigen::VectorXd c = surface.solve(at.col(2));
        const double d = c[3] / x.matrix().norm(), e = c[4] / y.matrix().norm();
        const Eigen::Vector3d normal = (n - d * first - e * second).normalized();
        if (!(normal.dot(n) > SameNormal)) return std::nullopt;
        return Vec3d{normal.x(), normal.y(), normal.z()};
    }

    /** Returns the position of an expanded node relative to its deck node. **/
    static Vec3d armOf(const Expansion& e, int place) {
        if (!e.isBeam)
            return sumOf({0, 0, 0}, e.thickness[0] * (0.5 * (place - 1) - e.offset[0]), e.normal);
        const auto& at = Section[place];
        // Corners of a circle's hexahedron lie on the circle.
        const double reach =
            place < 4 && e.section == BeamSection::Circle ? 0.5 / std::sqrt(2.0) : 0.5;
        const Vec3d first =
            sumOf({0, 0, 0}, e.thickness[0] * (reach * at[0] - e.offset[0]), e.first);
        return sumOf(first, e.thickness[1] * (reach * at[1] - e.offset[1]), e.normal);
    }

    /** Returns the number of an expanded node, creating it if necessary. **/
    int numberOf(int node, int expansion, int place) {
        Expansion& e = m_expansions[node][size_t(expansion)];
        int& number = e.numbers[size_t(place)];
        if (number == 0) {
            number = m_nextNumber++;
            m_result.nodes[number] = sumOf(m_nodes.at(node), 1, armOf(e, place));
            m_result.expandedOf[node].push_back(number);
        }
        return number;
    }

    void addSolid(const ThinElement& element) {
        const size_t count = element.nodes.size();
        std::vector<int> expansion;
        for (size_t k = 0; k < count; ++k) {
            const auto& corners = m_corners.at(element.nodes[k]);
            expansion.push_back(std::find_if(corners.begin(), corners.end(), [&](const Corner& c) {
                                    return c.element == &element && c.local == int(k);
                                })->expansion);
        }
        const ThinType& type = *findThinType(element.type);
        ThinExpansion::Solid solid{
            element.number, m_use == ShellUse::Shells ? type.solid : type.calculix, {}};
        if (element.isLayered && count > 4) solid.type = count == 6 ? LayeredWedge : LayeredHex;
        const auto add = [&](size_t node, int place) {
            solid.nodes.push_back(numberOf(element.nodes[node], expansion[node], place));
        };
        if (isBeam(element)) {
            for (int k = 0; k < (count == 3 ? 20 : 8); ++k)
                add(size_t(std::min(BeamHex[k][1], int(count) - 1)), BeamHex[k][0]);
        } else {
            const size_t edges = count == 3 || count == 6 ? 3 : 4;
            for (const int place : {0, 2})
                for (size_t k = 0; k < edges; ++k) add(k, place);
            for (const int place : {0, 2})
                for (size_t k = edges; k < count; ++k) add(k, place);
            for (size_t k = 0; count > edges && k < edges; ++k) add(k, 1);
        }
        m_result.solids.push_back(std::move(solid));
    }

    void addBetween(int node, const Expansion& e) {
        ThinExpansion::Between between{node, {}};
        if (!e.isBeam) {
            between.weights = {{e.numbers[0], 0.5 - e.offset[0]},
                               {e.numbers[2], 0.5 + e.offset[0]}};
        } else {
            const double reach = e.section == BeamSection::Circle ? 0.5 / std::sqrt(2.0) : 0.5;
            for (size_t place = 0; place < 4; ++place) {
                double weight = 1;
                for (size_t a = 0; a < 2; ++a)
                    weight *= 0.5 + Section[place][a] * e.offset[a] / (2 * reach);
                between.weights.emplace_back(e.numbers[place], weight);
            }
        }
        m_result.betweens.push_back(std::move(between));
    }

    void addKnot(int node, const std::vector<Expansion>& expansions) {
        ThinExpansion::Knot knot;
        knot.node = node;
        knot.members = m_result.expandedOf[node];
        // Scatter of all positions, including those that no solid needs.
        bool hasBeam = false;
        Eigen::Matrix3d about = Eigen::Matrix3d::Zero();  // Σ r rᵀ about the node
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        int count = 0;
        for (const Expansion& e : expansions) {
            hasBeam |= e.isBeam;
            for (int place = 0; place < (e.isBeam ? 8 : 3); ++place, ++count) {
                const Vec3d arm = armOf(e, place);
                const Eigen::Vector3d r(arm[0], arm[1], arm[2]);
                about += r * r.transpose();
                sum += r;
            }
        }
        knot.size = std::sqrt(about.trace() / count);

        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> scatter(about -
                                                                     sum * sum.transpose() / count);
        const bool isPlanar = scatter.eigenvalues()[0] < Flat * scatter.eigenvalues()[2];
        const bool isLine = scatter.eigenvalues()[1] < Flat * scatter.eigenvalues()[2];
        if (hasBeam && isPlanar && !isLine) {
            for (const Eigen::Index axis : {1, 2}) {
                const Eigen::Vector3d e = scatter.eigenvectors().col(axis);
                addStretch(knot, e * e.transpose());
            }
        } else {
            addStretch(knot, Eigen::Matrix3d::Identity());
        }

        // Moments about the node: exclude rotation about a line through all positions.
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> moments(
            about.trace() * Eigen::Matrix3d::Identity() - about);
        for (Eigen::Index k = 0; k < 3; ++k)
            if (moments.eigenvalues()[k] > Flat * moments.eigenvalues()[2]) {
                const Eigen::Vector3d axis = moments.eigenvectors().col(k);
                knot.turns.push_back({axis[0], axis[1], axis[2]});
            }
        m_result.knots.push_back(std::move(knot));
    }

    static void addStretch(ThinExpansion::Knot& knot, const Eigen::Matrix3d& A) {
        std::array<double, 9> rows;
        for (Eigen::Index i = 0; i < 3; ++i)
            for (Eigen::Index j = 0; j < 3; ++j) rows[size_t(3 * i + j)] = A(i, j);
        knot.stretches.push_back(rows);
    }

    const std::map<int, std::array<double, 3>>& m_nodes;
    const std::vector<ThinElement>& m_elements;
    const std::map<int, std::array<double, 2>>& m_nodeThickness;
    const ShellUse m_use;
    std::map<int, std::vector<Corner>> m_corners;
    std::map<int, std::vector<Expansion>> m_expansions;
    ThinExpansion m_result;
    int m_nextNumber = 1;
};

}  // namespace

const ThinType* findThinType(const std::string& type) {
    const auto found = Thin.find(type);
    return found == Thin.end() ? nullptr : &found->second;
}

std::vector<std::string> listThinTypes() {
    std::vector<std::string> types;
    for (const auto& entry : Thin) types.push_back(entry.first);
    return types;
}

ThinExpansion expandThinElements(const std::map<int, std::array<double, 3>>& nodes,
                                 const std::vector<ThinElement>& elements,
                                 const std::map<int, std::array<double, 2>>& nodeThickness,
                                 ShellUse use) {
    return Expander(nodes, elements, nodeThickness, use).expand();
}

}  // namespace simflex
