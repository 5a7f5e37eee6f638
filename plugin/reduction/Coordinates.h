#pragma once
/** @file
Generalized coordinates q of a part's nodes, u = T q: those of its constraints, with nodes of shells
and beams measured relative to the bases of their sections (NodalConstraints, SectionUnknowns).
Internal to reduction. Without constraints and sections q = u, and T costs nothing. **/

#include "SymmetricProduct.h"

namespace simflex {

class Coordinates {
public:
    /** Coordinates of the constraints only. Keeps a reference. **/
    explicit Coordinates(const FeModel& model);

    /** Keeps references.
    @param tieOf  by node: index of the rigid interface that it follows; negative: none **/
    Coordinates(const FeModel& model, const Stiffness& stiffness, const std::vector<int>& tieOf);

    int size() const;

    /** Returns whether q = u. **/
    bool isIdentity() const { return m_T.empty(); }

    /** Returns TᵀAT of a matrix A in displacements. **/
    SymmetricMatrix assemble(const SymmetricMatrix& A) const;

    /** Returns TᵀKT, computed from the stiffness in section unknowns if there are any. @pre not the
    constructor of the constraints only. **/
    SymmetricMatrix assembleStiffness() const;

    /** Returns u = T q for the columns of q. The rows of q are the listed coordinates; all others
    are zero. **/
    Shapes expand(const std::vector<int>& listed, const Vectors& q) const;

    /** Returns the listed rows of Tᵀ f. **/
    Vectors contract(const std::vector<int>& listed, const Shapes& f) const;

    /** Returns the q for which T q is closest to u (numDofs×k), by least squares.
    @throws std::invalid_argument if a coordinate moves no node. **/
    Vectors solve(const Shapes& u) const;

    /** Returns q_R with T q_R = R for the rigid motions R (numDofs×6).
    @throws std::invalid_argument if the constraints oppose them. **/
    Shapes solveRigid(const Shapes& R) const;

    /** Returns the coordinates on which the translations of a node depend. **/
    std::vector<int> coordinatesOf(int node) const;

    std::vector<int> listAll() const;

    /** Returns the deck number of a node moved by the coordinate. O(nodes). **/
    int nodeNumberOf(int coordinate) const;

private:
    void countFromBases(const std::vector<int>& tieOf);

    const FeModel& m_model;
    const Stiffness* m_stiffness = nullptr;  ///< null: constraints only
    NodalConstraints m_T;
};

}  // namespace simflex
