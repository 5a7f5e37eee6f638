#pragma once
/** @file
Loads of the attachment modes, which supplement constraint and normal modes in the basis, and
self-equilibrated loads on the free part. Internal to reduction.

Every attachment mode is the static deflection u = K⁻¹f under a load f, with all interfaces held:

- a load point: unit forces shared by its nodes.
- inertia relief: f = M a, a = e_k and a = s_b e_a about the centre of mass. Gravity, ω̇ × s and ω ×
  (ω × s) are sums of these twelve fields, so weight, angular acceleration and centrifugal load are
  exact. Rigid accelerations do not deform a part without interfaces; only the six symmetric fields
  do.
- a frequency ω: with d the remaining motion, (K − ω²M) d = ω²M ψ for each constraint mode ψ, and (K
  − ω²M) d = p for each load point, f = ω²M(ψ + d) and f = p + ω²M d. **/

#include <string>
#include <vector>

#include "CraigBampton.h"

namespace simflex {

/** Returns unit forces at the load points, one column per direction. @throws
std::invalid_argument. **/
Shapes makePointLoads(const FeModel& model, const InterfaceTies& ties,
                      const ReductionOptions& options);

/** Describes each column of makePointLoads(). **/
std::vector<std::string> listPointLoads(const ReductionOptions& options);

/** Returns the loads of the inertia-relief modes. **/
Shapes makeInertiaLoads(const FeModel& model, const FeProducts& products, const RigidMotion& rigid,
                        bool hasInterfaces);
int countInertiaLoads(bool hasInterfaces);

/** Returns the loads of the motion at a frequency [Hz]: one column per constraint mode and point
load.
@param constraint  numDofs×numBoundaryDofs, without columns for a part without interfaces
@throws std::invalid_argument naming the frequency if it is a resonance of the part with held
interfaces. **/
Shapes makeFrequencyLoads(const std::string& part, const FeProducts& products,
                          const FixedInterfaces& held, const Shapes& constraint,
                          const Shapes& pointLoads, double hertz, const ProgressCallback& progress);

/** Loads in equilibrium with the inertia of the free part, one per column: of the six products of
angular velocities, of unit forces and moments on the interfaces, then others. **/
struct EquilibriumLoads {
    std::vector<std::string> names;
    Shapes applied;          ///< f, in equilibrium except for the unit loads on rigid interfaces
    Eigen::MatrixXd onTies;  ///< 6·interfaces×loads: forces and moments on the rigid masters
};

/** @param others  nodal loads, with their names **/
EquilibriumLoads makeEquilibriumLoads(const FeModel& model, const FeProducts& products,
                                      const RigidMotion& rigid, const InterfaceTies& ties,
                                      const Shapes& others = {},
                                      const std::vector<std::string>& otherNames = {});

/** Displacements under such loads, determined up to a rigid motion. **/
struct EquilibriumShapes {
    Shapes u;                  ///< numDofs×loads
    Eigen::MatrixXd boundary;  ///< numBoundaryDofs×loads
};
EquilibriumShapes solveEquilibrium(const FeProducts& products, const InterfaceTies& ties,
                                   const ModeBasis& basis, const EquilibriumLoads& loads);

}  // namespace simflex
