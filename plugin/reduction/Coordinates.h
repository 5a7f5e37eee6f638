#pragma once
/** @file
The generalized coordinates q of a part's nodes, u = T q: those of its constraints, with nodes of
shells and beams counted from the bases of their sections (NodalConstraints, SectionUnknowns).
Internal to reduction. Without either q = u, and T costs nothing. **/

#include "SymmetricProduct.h"

namespace simflex {

class Coordinates {
public:
    /** Those of the constraints alone. Keeps a reference. **/
    explicit Coordinates(const FeModel& model);

    /** Keeps references.
    @param tieOf  by node: the rigid interface that it follows, negative: none **/
    Coordinates(const FeModel& model, const Stiffness& stiffness, const std::vector<int>& tieOf);

    int size() const;

    /** True where q = u. **/
    bool isIdentity() const { return m_T.empty(); }

    /** TᵀAT of a matrix A of displacements. **/
    SymmetricMatrix assemble(const SymmetricMatrix& A) const;

    /** TᵀKT, of the matrix in unknowns of sections where there are such; not of constraints alone.
     * **/
    SymmetricMatrix assembleStiffness() const;

    /** u = T q for the columns of q; only the listed coordinates, q's rows in their order, are not
    zero. **/
    Shapes expand(const std::vector<int>& listed, const Eigen::MatrixXd& q) const;

    /** The listed rows of Tᵀ f. **/
    Eigen::MatrixXd contract(const std::vector<int>& listed, const Shapes& f) const;

    /** The q whose T q is nearest to u (numDofs×k), by least squares.
    @throws std::invalid_argument if a coordinate moves no node. **/
    Eigen::MatrixXd solve(const Shapes& u) const;

    /** q_R with T q_R = R for the rigid motions R (numDofs×6).
    @throws std::invalid_argument if the constraints resist them. **/
    Shapes solveRigid(const Shapes& R) const;

    /** The coordinates that the translations of a node are made of. **/
    std::vector<int> coordinatesOf(int node) const;

    std::vector<int> listAll() const;

    /** Deck number of a node that the coordinate moves. O(nodes). **/
    int nodeNumberOf(int coordinate) const;

private:
    void countFromBases(const std::vector<int>& tieOf);

    const FeModel& m_model;
    const Stiffness* m_stiffness = nullptr;  ///< null: of the constraints alone
    NodalConstraints m_T;
};

}  // namespace simflex
