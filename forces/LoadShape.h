#pragma once
/** @file
A load spread over a flexible part, projected once onto its rigid motions and modes: what stays of
it however many nodes it acts on. Constant in the body's axes; DistributedLoad scales it in time.

    const LoadShape push = LoadShape::pressure(part, "SEAT");            // 1 Pa
    DistributedLoad(flexible, body, push, [](Real t) { return 3e5 * t; });

With nodal forces f at positions s and mode shapes φ: force Σf, torque Σ s×f and, as the nodes move,
Σ φ_i×f ξ_i more, modal forces Σ φ_i·f. Forces turn with the body. **/

#include <functional>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

struct LoadShape {
    SimTK::Vec3 force{0};         ///< in B
    SimTK::Vec3 torque{0};        ///< about B's origin, undeformed, in B
    SimTK::Vector modal;          ///< n_f modal forces
    SimTK::Matrix torquePerMode;  ///< 3×n_f: torque that ξ_i = 1 adds

    /** Modal forces alone (as an MFORCE): no resultant.
    @param forces  n_f of them **/
    static LoadShape fromModalForces(const SimTK::Vector& forces);

    /** Forces on nodes by mesh index, in B [N].
    @throws std::invalid_argument on a wrong number of forces or an index outside the mesh. **/
    static LoadShape fromNodalForces(const ReducedBody& part, const std::vector<int>& nodes,
                                     const std::vector<SimTK::Vec3>& forces);

    /** A force shared equally by the nodes of a set [N].
    @throws std::out_of_range that names the set asked for and those that exist. **/
    static LoadShape nodeSetForce(const ReducedBody& part, const std::string& nodeSet,
                                  const SimTK::Vec3& force);

    /** @name The same as for sets, for nodes by mesh index **/
    /**@{**/
    static LoadShape nodeForce(const ReducedBody& part, const std::vector<int>& nodes,
                               const SimTK::Vec3& force);
    static LoadShape pressure(const ReducedBody& part, const std::vector<int>& nodes);
    static LoadShape traction(const ReducedBody& part, const std::vector<int>& nodes,
                              const SimTK::Vec3& forcePerArea);
    /**@}**/

    /** Pressure of 1 Pa onto the skin's element faces whose nodes are all in a set: it pushes
    inwards, and shells that lie in the set wholly against their upper side, along −n. Integrated with the elements' shape functions.
    @throws std::out_of_range that names the set, std::invalid_argument if no face lies in it. **/
    static LoadShape pressure(const ReducedBody& part, const std::string& nodeSet);

    /** The same for a force per area in B [Pa]. **/
    static LoadShape traction(const ReducedBody& part, const std::string& nodeSet,
                              const SimTK::Vec3& forcePerArea);
};

}  // namespace simflex
