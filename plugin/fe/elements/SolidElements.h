#pragma once
/** @file
Shape functions of the solid elements and CalculiX's integration points. Internal to fe.

Natural coordinates as in CalculiX: hexahedra −1…1; tetrahedra 0…1; wedges 0…1 in the triangle, −1…1
along their height. **/

#include <array>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** Solid types besides CalculiX's: hexahedra of B32R beams; layered shells, which decks cannot
name; linear shells between their expanded nodes (ShellElement.h). **/
constexpr const char *BeamSolid = "B32R", *LayeredHex = "S8R, COMPOSITE",
                     *LayeredWedge = "S6, COMPOSITE", *IncompatibleSolid = "C3D8I",
                     *ShellHex = "S4", *ShellWedge = "S3";

/** Returns whether the type is a linear shell. **/
bool isShell(const std::string& type);

/** Returns the shape of a type that decks can name, or of those above; null for others. **/
const ElementType* findSolid(const std::string& type);
/** @pre findSolid(type) **/
ElementType getSolid(const std::string& type);
std::vector<std::string> listSolids();

/** An integration point: its weight, and the shape functions and their gradients in natural
coordinates. **/
struct IntegrationPoint {
    std::array<double, 3> xi{};
    double weight = 0;
    std::vector<double> values;                    ///< of the shape functions
    std::vector<std::array<double, 3>> gradients;  ///< by node
};

/** Returns the points at which CalculiX outputs stresses of its element type ("C3D8R"), in its
order.
@throws std::invalid_argument for another type. **/
std::vector<IntegrationPoint> makeIntegrationPoints(const std::string& calculixType,
                                                    ElementType type);

/** A point of a beam's section, in the natural coordinates across the beam. **/
struct SectionPoint {
    double eta = 0, zeta = 0, weight = 0;
};

/** How the section of a beam is integrated: shear between its axis and its plane, where it has
points of its own, there alone, and all other strains at the others. Round sections are stressed
at the corners of their square as at the circle. **/
struct BeamRule {
    std::vector<SectionPoint> points;
    std::vector<SectionPoint> shear;  ///< may be empty
    bool isRound = false;
};

/** The points of the hexahedra of 20 nodes that B32R beams become: 2 along the first natural
coordinate, and those of the section across. **/
std::vector<IntegrationPoint> makeBeamPoints(const std::vector<SectionPoint>& section);

/** Returns the points of a layer of a Hex20 or Wedge15, from…to along its last natural coordinate:
2×2 or 3 in its plane, 2 through it. **/
std::vector<IntegrationPoint> makeLayerPoints(ElementType type, double from, double to);

/** Returns 5×5 points of a section that fills its square. **/
std::vector<SectionPoint> makeFullSection();

/** Computes the gradients of the shape functions in space at a point of the element with nodes at
`positions`. @returns the point's share of the element's volume. **/
double calcGradients(const std::vector<std::array<double, 3>>& positions,
                     const IntegrationPoint& point, std::vector<std::array<double, 3>>& gradients);

/** Returns ∂x/∂ξ at a point of the element with nodes at `positions`: one column per natural
coordinate. If the point has fewer gradients, only the first nodes count. **/
std::array<std::array<double, 3>, 3> calcTangents(
    const std::vector<std::array<double, 3>>& positions, const IntegrationPoint& point);

/** Returns t₁·(t₂×t₃), which is negative for inverted elements. **/
double calcDeterminant(const std::array<std::array<double, 3>, 3>& tangents);

/** Returns the corners of the element as points of the linear element with the same corners, weight
1. **/
std::vector<IntegrationPoint> makeCornerPoints(ElementType type);

/** Returns for each node the corners it lies between; for a corner, itself twice. **/
std::vector<std::array<int, 2>> getEdgeEnds(ElementType type);

/** How CalculiX carries values from the integration points to the nodes of an element:
nodes×points, row by row. C3D8, C3D20R: trilinear to the corners. C3D10: linear to the corners.
C3D15: linear to the corners, along the height by least squares. C3D20: least squares by its own
shape functions. C3D8R, C3D4: constant. C3D6: constant in the triangle, linear along the height.
Middles of edges, but for C3D20, lie between their corners. C3D8I as C3D8, B32R as C3D20R. S4 and
S3: from the places below, bilinear or constant, of each face.
@throws std::invalid_argument for another type. **/
/** Natural coordinates in the plane of a shell at which its stress is put out. **/
std::vector<std::array<double, 2>> listShellStressPlaces(const std::string& type);

/** Of a beam's hexahedron whose section is the circle in its square. **/
std::vector<double> makeRoundExtrapolation();
bool hasExtrapolation(const std::string& calculixType);
/** Returns the matrix by which CalculiX extrapolates values from the integration points to the
nodes of an element: nodes×points, row-major. C3D8, C3D20R: trilinear to the corners. C3D10: linear
to the corners. C3D15: linear to the corners, along the height by least squares. C3D20: least
squares with its own shape functions. C3D8R, C3D4: constant. C3D6: constant in the triangle, linear
along the height. Mid-edge nodes, except for C3D20, get the mean of their corners. C3D8I as C3D8,
B32R as C3D20R. S4 and S3: from the points of listShellStressPlaces(), bilinear or constant on each
face.
@throws std::invalid_argument for another type. **/
std::vector<double> makeExtrapolation(const std::string& calculixType, ElementType type);

}  // namespace simflex
