#pragma once
/** @file
What Simbody's own mass matrix lacks of flexible bodies (private header): implemented in
plugin/solver, called by FlexibleBodySubsystem. **/

#include <memory>

#include "Simbody.h"

namespace simflex {

class InertiaCoupling {
public:
    virtual ~InertiaCoupling() = default;

    /** Finds the exact u̇ and adds −ΔM u̇, with which Simbody's own solution is exact. May be called
    by several threads, each with its own State.
    @param state  its matter subsystem is realized to Stage::Dynamics
    @param[in,out] bodyForces, mobilityForces  those of all force elements but the flexible
    subsystem's own
    @throws std::invalid_argument that names what cannot be supported
    @throws std::runtime_error if forces are not finite numbers or a body has no mass. **/
    virtual void addInForces(const SimTK::State& state,
                             SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                             SimTK::Vector& mobilityForces) = 0;

    static std::shared_ptr<InertiaCoupling> make(const SimTK::MultibodySystem& system);
};

}  // namespace simflex
