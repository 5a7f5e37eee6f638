#include "simflex/body/Assembly.h"

#include "simflex/base/FlushDenormals.h"
#include "simflex/body/LinearRangeReporter.h"
#include "simflex/body/StateCopy.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "simflex/solver/integration/Impulse.h"

namespace simflex {

void assemble(const SimTK::MultibodySystem& system, SimTK::State& state, SimTK::Real tolerance,
              SpeedJump jump) {
    const StandardArithmetic standard;
    system.realize(state, SimTK::Stage::Velocity);
    const SimTK::State given = copyState(state);
    Evaluation equations(system, state);
    std::vector<double> q(size_t(equations.getTopology().numQ)),
        u(size_t(equations.getTopology().numU));
    const SimTK::Real t = state.getTime();
    equations.getBlocks().getFromState(state, q.data(), u.data());
    std::vector<double> before = u;
    equations.prescribe(t, 0, nullptr, q.data(), u.data());
    // What begins to be prescribed by an event stops what moves; a run begins with it.
    if (jump == SpeedJump::Start) before = u;
    IntegratorStatistics statistics;
    ImplicitStep step(equations, statistics);
    if (equations.getTopology().numMultipliers > 0) step.assemble(t, tolerance, q, u);
    SimTK::State scratch = copyState(state);
    applyImpulse(
        system, equations, step, t, q, before, u, scratch,
        jump == SpeedJump::Start ? ImplicitStep::Shapes::Kept : ImplicitStep::Shapes::Free);
    equations.getBlocks().putIntoState(t, q.data(), u.data(), state);
    system.realize(state, SimTK::Stage::Velocity);
    if (const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system))
        requireUnforcedShapes(*flexible, given, state);
}

}  // namespace simflex
