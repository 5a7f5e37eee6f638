#pragma once
/** @file
The generalized coordinates q of a part's nodes, u = T q (see NodalConstraints). Internal to
reduction. Without constraints q = u, and T costs nothing. **/

#include "SymmetricProduct.h"

namespace simflex {

class Coordinates {
public:
    /** Keeps a reference to the model. **/
    explicit Coordinates(const FeModel& model) : m_model(model) {}

    int size() const;

    /** TᵀKT. **/
    SymmetricMatrix assemble(const SymmetricMatrix& K) const;

    /** u = T q for the columns of q; only the listed coordinates, q's rows in their order, are not
    zero. **/
    Shapes expand(const std::vector<int>& listed, const Eigen::MatrixXd& q) const;

    /** The listed rows of Tᵀ f. **/
    Eigen::MatrixXd contract(const std::vector<int>& listed, const Shapes& f) const;

    /** q_R with T q_R = R for the rigid motions R (numDofs×6).
    @throws std::invalid_argument if the constraints resist them. **/
    Shapes solveRigid(const Shapes& R) const;

    /** The coordinates that the translations of a node are made of. **/
    std::vector<int> coordinatesOf(int node) const;

    /** Deck number of a node that the coordinate moves. O(nodes). **/
    int nodeNumberOf(int coordinate) const;

private:
    const NodalConstraints& constraints() const { return m_model.constraints; }

    const FeModel& m_model;
};

}  // namespace simflex
