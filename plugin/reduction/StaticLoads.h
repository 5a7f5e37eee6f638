#pragma once
/** @file
Loads whose deflections, with all interfaces held, the basis has besides constraint and normal
modes; and loads in equilibrium, under which the part alone bends. Internal to reduction.

Every attachment mode is the static deflection u = K⁻¹f of some load f:

- a load point: unit forces that its nodes share.
- inertia relief: f = M a, a = e_k and a = s_b e_a about the centre of mass. Gravity, ω̇ × s and
  ω × (ω × s) are sums of these twelve fields, so that weight, angular acceleration and centrifugal
  load are carried exactly. A part without interfaces is at rest under rigid accelerations: the six
  symmetric fields alone bend it.
- a frequency ω: with d the rest of the motion, (K − ω²M) d = ω²M ψ for each constraint mode ψ, and
  (K − ω²M) d = p for each load point, f = ω²M(ψ + d) and f = p + ω²M d. **/

#include <string>
#include <vector>

#include "CraigBampton.h"

namespace simflex {

/** Unit forces at the load points, a column for each direction. @throws std::invalid_argument. **/
Shapes makePointLoads(const FeModel& model, const InterfaceTies& ties,
                      const ReductionOptions& options);

/** What each column of makePointLoads() is, in words. **/
std::vector<std::string> listPointLoads(const ReductionOptions& options);

/** Loads of the inertia-relief modes. **/
Shapes makeInertiaLoads(const FeModel& model, const FeProducts& products, const RigidMotion& rigid,
                        bool hasInterfaces);
int countInertiaLoads(bool hasInterfaces);

/** Loads of the motion at a frequency [Hz]: a column for each constraint mode and point load.
@param constraint  numDofs×numBoundaryDofs, without columns for a part without interfaces
@throws std::invalid_argument naming the frequency if the part with its interfaces held is in
    resonance there. **/
Shapes makeFrequencyLoads(const std::string& part, const FeProducts& products,
                          const FixedInterfaces& held, const Shapes& constraint,
                          const Shapes& pointLoads, double hertz, const ProgressCallback& progress);

/** Loads in equilibrium with the inertia of the free part, a column each: of the six products of
angular velocities, of unit forces and moments on the interfaces, then others. **/
struct EquilibriumLoads {
    std::vector<std::string> names;
    Shapes applied;          ///< f, in equilibrium but for the rigid interfaces' unit loads
    Eigen::MatrixXd onTies;  ///< 6·interfaces×loads: forces and moments on the rigid masters
};

/** @param others  nodal loads, with their names **/
EquilibriumLoads makeEquilibriumLoads(const FeModel& model, const FeProducts& products,
                                      const RigidMotion& rigid, const InterfaceTies& ties,
                                      const Shapes& others = {},
                                      const std::vector<std::string>& otherNames = {});

/** Displacements under such loads, up to a rigid motion. **/
struct EquilibriumShapes {
    Shapes u;                  ///< numDofs×loads
    Eigen::MatrixXd boundary;  ///< numBoundaryDofs×loads
};
EquilibriumShapes solveEquilibrium(const FeProducts& products, const InterfaceTies& ties,
                                   const ModeBasis& basis, const EquilibriumLoads& loads);

}  // namespace simflex
