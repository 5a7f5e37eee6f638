#pragma once
/** @file
A load spread over a flexible part, projected once onto its rigid-body motions and modes; its size
is independent of the number of loaded nodes. Constant in the body's axes; DistributedLoad scales it
in time.

    const LoadShape push = LoadShape::pressure(part, "SEAT");            // 1 Pa
    DistributedLoad(flexible, body, push, [](Real t) { return 3e5 * t; });

Nodal forces f at positions s with mode shapes φ give the force Σf, the torque Σ s×f + Σ φ_i×f ξ_i
(the second sum as the nodes move) and the modal forces Σ φ_i·f. The forces turn with the body. **/

#include <functional>
#include <string>
#include <vector>

#include "Simbody.h"
#include "simflex/base/SimbodyBuild.h"
#include "simflex/part/ReducedBody.h"

namespace simflex {

struct LoadShape {
    SimTK::Vec3 force{0};         ///< in B
    SimTK::Vec3 torque{0};        ///< about B's origin in the undeformed shape, in B
    SimTK::Vector modal;          ///< n_f modal forces
    SimTK::Matrix torquePerMode;  ///< 3×n_f: torque added per unit of ξ_i

    /** Modal forces alone (as an MFORCE), without a resultant.
    @param forces  n_f modal forces **/
    static LoadShape fromModalForces(const SimTK::Vector& forces);

    /** Forces on nodes by mesh index, in B [N].
    @throws std::invalid_argument on a wrong number of forces or an index outside the mesh. **/
    static LoadShape fromNodalForces(const ReducedBody& part, const std::vector<int>& nodes,
                                     const std::vector<SimTK::Vec3>& forces);

    /** A total force shared equally by the nodes of a set, in B [N].
    @throws std::out_of_range that names the set requested and the sets that exist. **/
    static LoadShape nodeSetForce(const ReducedBody& part, const std::string& nodeSet,
                                  const SimTK::Vec3& force);

    /** @name The same on nodes given by mesh index **/
    /**@{**/
    static LoadShape nodeForce(const ReducedBody& part, const std::vector<int>& nodes,
                               const SimTK::Vec3& force);
    static LoadShape pressure(const ReducedBody& part, const std::vector<int>& nodes);
    static LoadShape traction(const ReducedBody& part, const std::vector<int>& nodes,
                              const SimTK::Vec3& forcePerArea);
    /**@}**/

    /** Pressure of 1 Pa on the skin's element faces whose nodes are all in a set. It pushes
    inwards; on shells that lie wholly in the set it acts on the upper side, along −n. Integrated
    with the elements' shape functions.
    @throws std::out_of_range that names the set, std::invalid_argument if no face lies in it. **/
    static LoadShape pressure(const ReducedBody& part, const std::string& nodeSet);

    /** The same for a traction in B [Pa]. **/
    static LoadShape traction(const ReducedBody& part, const std::string& nodeSet,
                              const SimTK::Vec3& forcePerArea);
};

}  // namespace simflex
