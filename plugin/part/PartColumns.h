#pragma once
/** @file
Axial loads between the interfaces of a part, relative to Euler's buckling load (private header).

The interface loads F that cause a deformation ξ are those whose own deformation differs from ξ by
the least strain energy. With B the displacements and rotations of the k interfaces per mode,
6k×n_f, and a basis Z of loads,

    F = Z (Zᵀ B Ω⁻² Bᵀ Z)⁻¹ Zᵀ B ξ.

Z contains first the self-equilibrated loads; the remainder is assigned to all loads, balanced by
the part's weight or acceleration, since uniform force fields do no work on modes.

The compression between interfaces A and B is ½(F_A − F_B)·d, d the unit vector from A to B. With
hinged ends the part would buckle at 1/λ, λ the largest eigenvalue of Ω⁻¹ ∫ y'ᵀy' dx Ω⁻¹, y the
lateral displacement of the axis from the chord per mode. A part with one interface is clamped
there, with d towards the centre of mass; the force F·d decreases linearly to the free far end, and
y is the displacement relative to the interface. The axis is the mean of the nodes in slices across
d. For slender parts both agree with beam theory; for others λ is an estimate. **/

#include <Eigen/Dense>
#include <vector>

#include "simflex/part/ReducedBody.h"

namespace simflex {

class PartColumns {
public:
    /** @param part  must outlive this object **/
    explicit PartColumns(const ReducedBody& part);

    struct Load {
        int from = -1, to = -1;  ///< interfaces; to = −1: the free end
        double force = 0;        ///< P [N], positive
        double share = 0;        ///< relative to the buckling load; 0: no load
    };
    struct Loads {
        Load compression, tension;
    };
    /** Finds the largest shares of compression and tension among all pairs of interfaces, or from
    the only one to the free end. O(interfaces²·n_f), and O(nodes·n_f) once per loaded pair.
    @param xi  n_f **/
    Loads findLargest(const double* xi);

private:
    struct Column {
        int from, to;                  ///< as in Load
        ::Eigen::Vector3d direction;   ///< d
        double length;                 ///< [m]
        ::Eigen::VectorXd shortening;  ///< [m per unit ξ]
        ::Eigen::VectorXd force;       ///< compressive [N per unit ξ]
        double critical = -1;          ///< Euler's load [N]; negative: not computed yet
    };
    /** The axis of a column: displacements per mode [m per unit ξ]. **/
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
