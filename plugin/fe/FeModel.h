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

/** A symmetric sparse matrix: its lower triangle with the diagonal, compressed columns, rows
ascending within a column. **/
struct SymmetricMatrix {
    int size = 0;
    std::vector<std::int64_t> columnStarts;  ///< size+1
    std::vector<std::int32_t> rows;          ///< row ≥ column of each stored entry
    std::vector<double> values;              ///< of each stored entry

    std::int64_t numEntries() const { return std::int64_t(values.size()); }

    /** Builds the matrix from entries in any order; either triangle may be given, an entry once.
    Entries given several times are added, exact zeros off the diagonal are left out.
    O(entries). @throws std::invalid_argument for an index outside 0…size−1. **/
    static SymmetricMatrix fromEntries(int size, const std::vector<std::int32_t>& rows,
                                       const std::vector<std::int32_t>& columns,
                                       const std::vector<double>& values);
};

/** Homogeneous linear constraints among the nodal translations, solved for the independent ones:

    u = T q

with one row of T for each degree of freedom, q any generalized coordinates: translations of
independent nodes, or translation and rotation of a rigid cluster of nodes. The rigid motions of
the part must satisfy them: R = T q_R for some q_R. Multi-point constraints, ties and the knots of
shells and beams take this form. **/
struct NodalConstraints {
    int numCoordinates = 0;               ///< size of q; every one is used by some row
    std::vector<std::int64_t> rowStarts;  ///< 3·numNodes+1
    std::vector<std::int32_t> columns;    ///< q index of each coefficient, ascending within a row
    std::vector<double> coefficients;

    /** True where the nodes' translations are the coordinates: nothing is constrained. **/
    bool empty() const { return rowStarts.empty(); }
};

class FeElements;        // internal
struct DesignParameter;  // internal

/** Stiffness and mass of one free part on its mesh. **/
struct FeModel {
    std::string source;            ///< the deck or matrix file it was read from
    std::string program;           ///< the FE program that assembled it, with its version
    Mesh mesh;                     ///< positions in deck coordinates [m]
    SymmetricMatrix K;             ///< 3·numNodes, dof = 3·node + axis [N/m]
    SymmetricMatrix m;             ///< numNodes, M = m ⊗ 1₃ [kg]
    NodalConstraints constraints;  ///< what ties nodes to each other; K and m are without them
    /** What K and m are made of; null where they were read, so that there is neither stress nor
    geometric stiffness. **/
    std::shared_ptr<const FeElements> elements;
    /** Numbers by which K and M of a part made of the model are differentiated: those that
    CalculixOptions::derivatives asks for. **/
    std::vector<std::shared_ptr<const DesignParameter>> parameters;
    std::vector<std::string> notes;  ///< what the reader left out or changed without consequence
    /** What may change K, M or the meaning of a result; a part made of the model keeps them. **/
    std::vector<std::string> warnings;

    /** Total mass [kg]: the sum of all entries of m. **/
    double calcMass() const;

    /** Centre of mass with the FE mass matrix, deck coordinates [m]. **/
    std::array<double, 3> calcCenterOfMass() const;

    /** Checks sizes, finite numbers, positive mass, that every node belongs to an element or is
    tied to one that does, that elements (without any: K) and constraints make one piece, that the
    six rigid motions cost no energy (K R = 0) and that they satisfy the constraints (R = T q_R).
    @throws std::invalid_argument that names what is wrong, where, and what to do. **/
    void validate() const;
};

}  // namespace simflex
