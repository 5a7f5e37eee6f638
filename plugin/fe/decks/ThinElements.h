#pragma once
/** @file
Expands shells and beams to the solids used by CalculiX; linear shells are elements of our own
between the same nodes. Internal to fe.

A shell of thickness t and offset o (share of t) becomes a solid between x − (½+o) t n and
x + (½−o) t n. Its normals n are averaged at each node over elements of the same thickness and
offset whose normals are within 20° of that of the lowest element number. A beam becomes a
hexahedron about its axis, its section spanned by n₁ (as given) and n₂ = tangent × n₁, averaged
likewise; CalculiX's circle is a quadratic hexahedron with its sides on the circle. Other
sections fill the square or rectangle about them, of which they alone are integrated
(ThinSections.h). Beams of two nodes get a third between them: all are one element, but for those of
CalculiX. A
*NORMAL stands as it is given for its element, and for those whose normals are within half a degree
(of beams CalculiX 2.20 then loses n₁, and with it mass; here it is what the others have).

Where the elements at a node need several normals, thicknesses or offsets, or beams and shells meet,
the node is a *knot*: its expanded nodes move together,

    u = u_node + θ × r + α r,    r from the node

with one stretch α, or, if there is a beam among them and all lie in a plane, one stretch along each
principal axis of their positions (as in CalculiX, so that Poisson's effect does not lock).
Elsewhere the node itself is a point between its expanded nodes: u_node = Σ w u. **/

#include <array>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "simflex/fe/FaceShapes.h"

namespace simflex {

enum class BeamSection { Rectangle, Circle, Pipe, Box };

/** A shell or beam of the deck. **/
struct ThinElement {
    int number = 0;
    std::string type;        ///< CalculiX type: S8R
    std::vector<int> nodes;  ///< deck numbers
    std::string where;       ///< "FILE:LINE: "
    bool hasSection = false;
    bool hasNodalThickness = false;     ///< otherwise `thickness` applies
    std::array<double, 2> thickness{};  ///< [m]; of beams along n₁ and n₂
    std::array<double, 2> offset{};     ///< shares of the thickness
    BeamSection section = BeamSection::Rectangle;
    std::array<double, 4> walls{};  ///< [m]; of a box at +n₁, +n₂, −n₁, −n₂, of a pipe a single one
    Vec3d n1{0, 0, -1};            ///< for beams, as given
    bool isLayered = false;        ///< S8R and S6 only
    std::map<int, Vec3d> normals;  ///< *NORMAL, by deck node; for beams n₂
};

/** Expansion of a shell or beam type of CalculiX. **/
struct ThinType {
    bool isBeam;
    int numNodes;
    const char* solid;     ///< "C3D20R"; "B32R" for the hexahedron of B32R, see FeElements.h
    const char* calculix;  ///< CalculiX's own solid
};

/** What linear shells and all beams become. **/
enum class ShellUse { Shells, CalculixSolids };

/** Returns null for unsupported types. **/
const ThinType* findThinType(const std::string& type);
std::vector<std::string> listThinTypes();

/** The solids and the relations of their nodes to those of the deck. **/
struct ThinExpansion {
    struct Solid {
        int number;
        std::string type;
        std::vector<int> nodes;  ///< numbers of expanded nodes
    };
    struct Knot {
        int node;                                      ///< deck number
        std::vector<int> members;                      ///< expanded nodes
        std::vector<std::array<double, 9>> stretches;  ///< u = A r of each stretch, row-major
        std::vector<Vec3d> turns;                      ///< axes about which members rotate
        double size;                                   ///< characteristic length [m], > 0
    };
    struct Between {
        int node;
        std::vector<std::pair<int, double>> weights;  ///< expanded nodes
    };
    std::map<int, Vec3d> nodes;  ///< expanded nodes
    std::vector<Solid> solids;
    std::vector<Knot> knots;
    std::vector<Between> betweens;
    std::map<int, std::vector<int>> expandedOf;  ///< expanded nodes of each deck node
    std::vector<std::string> warnings;
};

/** Expands all shells and beams of a deck.
@param nodes           of the deck
@param nodeThickness   *NODAL THICKNESS of nodes
@throws std::invalid_argument naming file and line. **/
ThinExpansion expandThinElements(const std::map<int, std::array<double, 3>>& nodes,
                                 const std::vector<ThinElement>& elements,
                                 const std::map<int, std::array<double, 2>>& nodeThickness,
                                 ShellUse use);

}  // namespace simflex
