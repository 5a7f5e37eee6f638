#include "simflex/body/Assembly.h"

#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

void assemble(const SimTK::MultibodySystem& system, SimTK::State& state, SimTK::Real tolerance) {
    const StandardArithmetic standard;
    system.realize(state, SimTK::Stage::Velocity);
    MultibodyEquations equations(system, state);
    std::vector<double> q(size_t(equations.numQ())), u(size_t(equations.numU()));
    equations.getFromState(state, q.data(), u.data());
    equations.prescribe(state.getTime(), 0, nullptr, q.data(), u.data());
    if (equations.numMultipliers() > 0) {
        IntegratorStatistics statistics;
        ImplicitStep(equations, statistics).assemble(state.getTime(), tolerance, q, u);
    }
    equations.putIntoState(state.getTime(), q.data(), u.data(), state);
    system.realize(state, SimTK::Stage::Velocity);
}

}  // namespace simflex
