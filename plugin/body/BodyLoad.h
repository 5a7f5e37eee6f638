#pragma once
/** @file
A load spread over a flexible body, projected onto its rigid motions and modes (private header). **/

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "Simbody.h"

namespace simflex {

struct BodyLoad {
    SimTK::Vec3 force, torque;                                   ///< in B, torque about its origin
    ::Eigen::VectorXd modal;                                     ///< n_f modal forces
    ::Eigen::Matrix<double, 3, ::Eigen::Dynamic> torquePerMode;  ///< torque added per unit ξ_i
    std::function<SimTK::Real(SimTK::Real time)> scale;
};

/** Adds the loads: torque in B, force in Ground, n_f modal forces.
@param scales  one per load **/
inline void addInLoads(const std::vector<BodyLoad>& loads, const SimTK::Real* scales,
                       const SimTK::Rotation& R_GB, const double* xi, SimTK::Vec3& torque_B,
                       SimTK::Vec3& force_G, double* modal) {
    for (const BodyLoad& load : loads) {
        const SimTK::Real scale = *scales++;
        force_G += scale * (R_GB * load.force);
        torque_B += scale * load.torque;
        for (int i = 0; i < int(load.modal.size()); ++i) {
            for (int a = 0; a < 3; ++a) torque_B[a] += scale * load.torquePerMode(a, i) * xi[i];
            modal[i] += scale * load.modal[i];
        }
    }
}

}  // namespace simflex
