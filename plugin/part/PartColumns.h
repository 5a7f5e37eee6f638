#pragma once
/** @file
A part as a column between two of its interfaces: what compresses it, against Euler's load (private
header).

The loads F on its interfaces, in equilibrium with each other, that would deform a part at rest as
it is deformed are those of least strain energy of the difference: with B the interfaces'
displacements and rotations for each mode, 6k×n_f, and a basis Z of loads in equilibrium,

    F = Z (Zᵀ B Ω⁻² Bᵀ Z)⁻¹ Zᵀ B ξ.

Interfaces A and B with d the unit vector from A to B are pressed together by ½(F_A − F_B)·d. On
hinges there the part would buckle at 1/λ, λ the largest eigenvalue of Ω⁻¹ ∫ y'ᵀy' dx Ω⁻¹, y the
lateral displacement of the axis from the chord for each mode. The axis is the mean of the nodes in
slices across d. Of slender parts both are those of beam theory; of others λ is an estimate. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

class PartColumns {
public:
    /** @param part  outlives this **/
    explicit PartColumns(const ReducedBody& part);

    struct Load {
        int from = -1, to = -1;  ///< interfaces; −1: there is none
        double force = 0;        ///< P [N], positive
        double share = 0;        ///< of the load at which it would buckle on hinges
    };
    struct Loads {
        Load compression, tension;
    };
    /** Of all pairs of interfaces those of the largest shares. O(interfaces²·n_f), and O(nodes·n_f)
    once for each pair that is ever loaded. @param xi  n_f **/
    Loads findLargest(const double* xi);

private:
    struct Column {
        int from, to;
        double length;                 ///< [m]
        ::Eigen::VectorXd shortening;  ///< [m per unit ξ]
        ::Eigen::VectorXd force;       ///< pressing [N per unit ξ]
        double critical = -1;          ///< Euler's load [N]; negative: not known yet
    };
    double calcCriticalLoad(const Column& column) const;

    const ReducedBody& m_part;
    std::vector<Column> m_columns;
};

}  // namespace simflex
