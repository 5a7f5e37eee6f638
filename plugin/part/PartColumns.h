#pragma once
/** @file
A part as a column between two of its interfaces: what compresses it, against Euler's load (private
header).

The loads F on its interfaces that would deform a part as it is deformed are those of least strain
energy of the difference: with B the interfaces' displacements and rotations for each mode, 6k×n_f,
and a basis Z of loads,

    F = Z (Zᵀ B Ω⁻² Bᵀ Z)⁻¹ Zᵀ B ξ.

Z are first the loads in equilibrium with each other; what these leave is ascribed to all loads,
balanced by the part's weight or acceleration: uniform fields of force do no work on modes.

Interfaces A and B with d the unit vector from A to B are pressed together by ½(F_A − F_B)·d. On
hinges there the part would buckle at 1/λ, λ the largest eigenvalue of Ω⁻¹ ∫ y'ᵀy' dx Ω⁻¹, y the
lateral displacement of the axis from the chord for each mode. A part with one interface stands on
it, d towards the centre of mass; the force F·d there decreases evenly to its far end, which is
free, and y are displacements as seen from the interface. The axis is the mean of the nodes in
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
        int from = -1, to = -1;  ///< interfaces; to −1: the free end
        double force = 0;        ///< P [N], positive
        double share = 0;        ///< of the load at which it would buckle; 0: there is no load
    };
    struct Loads {
        Load compression, tension;
    };
    /** Of all pairs of interfaces, or from the only one to the free end, those of the largest
    shares. O(interfaces²·n_f), and O(nodes·n_f) once for each pair that is ever loaded.
    @param xi  n_f **/
    Loads findLargest(const double* xi);

private:
    struct Column {
        int from, to;                  ///< as in Load
        ::Eigen::Vector3d direction;   ///< d
        double length;                 ///< [m]
        ::Eigen::VectorXd shortening;  ///< [m per unit ξ]
        ::Eigen::VectorXd force;       ///< pressing [N per unit ξ]
        double critical = -1;          ///< Euler's load [N]; negative: not known yet
    };
    /** The axis of a column: displacements for each mode [m per unit ξ]. **/
    struct Axis {
        std::vector<double> places;  ///< along d from the first interface [m], ascending from 0
        std::vector<::Eigen::MatrixXd> displacements;  ///< 3×n_f each
    };
    Axis makeAxis(int from, int to, const ::Eigen::Vector3d& d, double length) const;
    void addFreeColumn(const ::Eigen::MatrixXd& forces);
    double calcCriticalLoad(const Column& column) const;

    const ReducedBody& m_part;
    std::vector<Column> m_columns;
};

}  // namespace simflex
