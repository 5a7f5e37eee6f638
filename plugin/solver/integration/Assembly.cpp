#include "simflex/body/Assembly.h"

#include "simflex/base/FlushDenormals.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

void assemble(const SimTK::MultibodySystem& system, SimTK::State& state, SimTK::Real tolerance) {
    const StandardArithmetic standard;
    system.realize(state, SimTK::Stage::Velocity);
    Evaluation equations(system, state);
    std::vector<double> q(size_t(equations.getTopology().numQ)),
        u(size_t(equations.getTopology().numU));
    equations.getBlocks().getFromState(state, q.data(), u.data());
    equations.prescribe(state.getTime(), 0, nullptr, q.data(), u.data());
    if (equations.getTopology().numMultipliers > 0) {
        IntegratorStatistics statistics;
        ImplicitStep(equations, statistics).assemble(state.getTime(), tolerance, q, u);
    }
    equations.getBlocks().putIntoState(state.getTime(), q.data(), u.data(), state);
    system.realize(state, SimTK::Stage::Velocity);
}

}  // namespace simflex
