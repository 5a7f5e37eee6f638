#pragma once
/** @file
An integration point of an element. Internal to fe. **/

#include <Eigen/Core>

#include "ElasticLaw.h"

namespace simflex {

/** Contribution to an element of n nodes: K = Σ volume Bᵀ D B, m = Σ volume density N Nᵀ, M = m ⊗
1₃. **/
struct ElementPoint {
    double volume = 0;   ///< [m³]
    Eigen::VectorXd N;   ///< shape functions, one per node
    Eigen::Matrix3Xd G;  ///< their gradients in space, one per column [1/m]
    /** Strain–displacement matrix, 3·node + axis, in the deck's axes; empty: computed from G
    [1/m]. **/
    Eigen::Matrix<double, 6, Eigen::Dynamic> B;
    ElasticMatrix D{};   ///< in the deck's axes [Pa]
    double density = 0;  ///< [kg/m³]

    bool hasSameStiffness(const ElementPoint& other) const;
    bool hasSameMass(const ElementPoint& other) const;

    /** Returns B, computed from G if it is empty. **/
    void calcStrainMatrix(Eigen::Matrix<double, 6, Eigen::Dynamic>& strain) const;
};

}  // namespace simflex
