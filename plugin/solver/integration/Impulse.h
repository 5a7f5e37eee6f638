#pragma once
/** @file
Speeds that jump (private header): the one way in which they are made consistent, where an event
locks, engages or prescribes something, and where a run begins with speeds that joints do not allow.

    M (u⁺ − u⁻) + GᵀΛ = p,    ġ(q, u⁺) = 0

Λ are the impulses of joints and constraints, p those where speeds are prescribed. Forces have no
part in it: see ImplicitStep::applyImpulse(). **/

#include <vector>

#include "Simbody.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

class Evaluation;

/** Makes u consistent. Simbody's kinetic energy, which the solver has no part in, has to change by
the work of the impulses, and may not grow where nothing moves that is prescribed.
@param q        assembled
@param before   u⁻
@param u        u⁻ but for what is prescribed; receives u⁺
@param shapes   Free where an event makes an impact; Kept where a run begins
@param scratch  a State of the system with its variables; its t, q and u are written over
@throws std::runtime_error naming the joints if there are no such speeds, or the energy **/
void applyImpulse(const SimTK::MultibodySystem& system, const Evaluation& equations,
                  ImplicitStep& step, double t, const std::vector<double>& q,
                  const std::vector<double>& before, std::vector<double>& u, SimTK::State& scratch,
                  ImplicitStep::Shapes shapes);

}  // namespace simflex
