#pragma once
/** @file
The finite element model of one free part: mesh, stiffness and mass.

    M ü + K u = f,   M = m ⊗ 1₃

Degrees of freedom are plain nodal translations along the deck's axes in the order of the mesh:
dof = 3·node + axis. The three axes share one scalar nodal mass matrix m (solid elements); K is
free, so that its null space is exactly the six rigid motions. SI units. Standard types only.

    FeModel crank = readCalculixDeck("crank.inp");   // CalculixDeck.h
    crank.validate();                                // done by every reader already
    double kg = crank.calcMass();
**/

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "simflex/part/Mesh.h"

namespace simflex {

/** A symmetric sparse matrix: its lower triangle with the diagonal, in compressed columns, rows
ascending within a column. **/
struct SymmetricMatrix {
    int size = 0;
    std::vector<std::int64_t> columnStarts;  ///< size+1
    std::vector<std::int32_t> rows;          ///< row ≥ column of each stored entry
    std::vector<double> values;              ///< value of each stored entry

    std::int64_t numEntries() const { return std::int64_t(values.size()); }

    /** Builds the matrix from unordered entries of either triangle, each given once. Duplicates are
    added, exact zeros off the diagonal are dropped. O(entries). @throws std::invalid_argument for
    an index outside 0…size−1. **/
    static SymmetricMatrix fromEntries(int size, const std::vector<std::int32_t>& rows,
                                       const std::vector<std::int32_t>& columns,
                                       const std::vector<double>& values);
};

/** Homogeneous linear constraints among the nodal translations, solved for the independent ones:

    u = T q

with one row of T per degree of freedom and any generalized coordinates q: translations of
independent nodes, or translation and rotation of a rigid cluster of nodes. The rigid motions of the
part must satisfy them: R = T q_R for some q_R. Multi-point constraints, ties and the knots of
shells and beams have this form. **/
struct NodalConstraints {
    int numCoordinates = 0;               ///< size of q; every coordinate is used by some row
    std::vector<std::int64_t> rowStarts;  ///< 3·numNodes+1
    std::vector<std::int32_t> columns;    ///< q index of each coefficient, ascending within a row
    std::vector<double> coefficients;

    /** Returns whether nothing is constrained: the nodal translations are the coordinates. **/
    bool empty() const { return rowStarts.empty(); }
};

class FeElements;        // internal
struct DesignParameter;  // internal

/** Stiffness and mass of one free part on its mesh. **/
struct FeModel {
    std::string source;            ///< deck or matrix file
    std::string program;           ///< FE program that assembled the matrices, with version
    Mesh mesh;                     ///< positions in deck coordinates [m]
    SymmetricMatrix K;             ///< 3·numNodes, dof = 3·node + axis [N/m]
    SymmetricMatrix m;             ///< numNodes, M = m ⊗ 1₃ [kg]
    NodalConstraints constraints;  ///< constraints among nodes; not included in K and m
    /** Elements of K and m; null if the matrices were read from a file, which provides neither
    stress nor geometric stiffness. **/
    std::shared_ptr<const FeElements> elements;
    /** Parameters with respect to which K and M of a reduced part are differentiated: those
    requested in CalculixOptions::derivatives. **/
    std::vector<std::shared_ptr<const DesignParameter>> parameters;
    std::vector<std::string> notes;  ///< data left out or changed without consequence
    /** Changes that may affect K, M or the meaning of results; stored in parts made from the
    model. **/
    std::vector<std::string> warnings;

    /** Returns the total mass [kg]: the sum of all entries of m. **/
    double calcMass() const;

    /** Returns the centre of mass with the FE mass matrix, deck coordinates [m]. **/
    std::array<double, 3> calcCenterOfMass() const;

    /** Checks sizes, finite numbers and positive mass; that every node belongs to an element or is
    tied to one that does; that elements (or, without any, K) and constraints form one piece; that
    the six rigid motions cost no energy (K R = 0) and satisfy the constraints (R = T q_R).
    @throws std::invalid_argument naming error, location and remedy. **/
    void validate() const;
};

}  // namespace simflex
