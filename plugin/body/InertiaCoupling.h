#pragma once
/** @file
The inertia of flexible bodies that Simbody's own mass matrix lacks (private header): implemented in
plugin/solver, called by FlexibleBodySubsystem. **/

#include <memory>

#include "Simbody.h"

namespace simflex {

class InertiaCoupling {
public:
    virtual ~InertiaCoupling() = default;

    /** Computes the exact u̇ and adds −ΔM u̇, which makes Simbody's own solution exact. Several
    threads may call this, each with its own State.
    @param state  its matter subsystem is realized to Stage::Dynamics
    @param[in,out] bodyForces, mobilityForces  those of all force elements except the flexible
    subsystem's own
    @throws std::invalid_argument naming an unsupported feature
    @throws std::runtime_error if forces are not finite or a body has no mass. **/
    virtual void addInForces(const SimTK::State& state,
                             SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                             SimTK::Vector& mobilityForces) = 0;

    static std::shared_ptr<InertiaCoupling> make(const SimTK::MultibodySystem& system);
};

}  // namespace simflex
