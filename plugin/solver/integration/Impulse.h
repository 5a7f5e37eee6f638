#pragma once
/** @file
Impulsive changes of speed (private header), which make speeds consistent where an event locks,
engages or prescribes something, and where a run begins with speeds that violate joints.

    M (u⁺ − u⁻) + GᵀΛ = p,    ġ(q, u⁺) = 0

Λ are the impulses of joints and constraints, p those of prescribed speeds. Forces have no impulse:
see ImplicitStep::applyImpulse(). **/

#include <vector>

#include "Simbody.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

class Evaluation;

/** Makes u consistent. As an independent check, Simbody's kinetic energy must change by the work of
the impulses, and must not grow where nothing moves that is prescribed.
@param q        assembled
@param before   u⁻
@param u        u⁻ except for prescribed speeds; receives u⁺
@param shapes   Free for an impact at an event; Kept for the start of a run
@param scratch  a State of the system with its variables; its t, q and u are overwritten
@throws std::runtime_error naming the joints if there are no such speeds, or the energy **/
void applyImpulse(const SimTK::MultibodySystem& system, const Evaluation& equations,
                  ImplicitStep& step, double t, const std::vector<double>& q,
                  const std::vector<double>& before, std::vector<double>& u, SimTK::State& scratch,
                  ImplicitStep::Shapes shapes);

}  // namespace simflex
