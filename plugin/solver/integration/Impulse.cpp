#include "simflex/solver/integration/Impulse.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "simflex/body/FlexibleBodySubsystem.h"
#include "simflex/solver/integration/ImplicitStep.h"

namespace simflex {

void applyImpulse(const SimTK::MultibodySystem& system, const Evaluation& equations,
                  ImplicitStep& step, double t, const std::vector<double>& q,
                  const std::vector<double>& before, std::vector<double>& u, SimTK::State& scratch,
                  ImplicitStep::Shapes shapes) {
    using Shapes = ImplicitStep::Shapes;
    constexpr double LargestError = 1e-6;  // of the kinetic energy
    const auto calcKineticEnergy = [&](const std::vector<double>& speeds) {
        equations.getBlocks().putIntoState(t, q.data(), speeds.data(), scratch);
        system.realize(scratch, SimTK::Stage::Velocity);
        const FlexibleBodySubsystem* flexible = FlexibleBodySubsystem::find(system);
        return flexible ? flexible->calcKineticEnergy(scratch)
                        : system.getMatterSubsystem().calcKineticEnergy(scratch);
    };
    const auto jump = [&](Shapes chosen) {
        const ImplicitStep::Impulse impulse = step.applyImpulse(t, q, before, u, chosen);
        if (u == before) return;
        const double energyBefore = calcKineticEnergy(before), energy = calcKineticEnergy(u);
        const double allowed = LargestError * (energyBefore + energy + std::abs(impulse.work));
        const bool isWork = std::abs(energy - energyBefore - impulse.work) <= allowed;
        const bool isPossible = impulse.isDriven || energy <= energyBefore + allowed;
        if (isWork && isPossible) return;
        std::ostringstream text;
        text << "speeds that jump at t = " << t << " s change the kinetic energy from "
             << energyBefore << " to " << energy << " J, by the work of impulses it would be "
             << energyBefore + impulse.work
             << " J. The results would be wrong; this is a mistake of simflex's, or masses differ "
                "by too many orders of magnitude";
        throw std::runtime_error(text.str());
    };
    if (shapes == Shapes::Kept) {
        const std::vector<double> given = u;
        try {
            return jump(Shapes::Kept);
        } catch (const std::runtime_error&) {  // joints or constraints that only modes can meet
            u = given;
        }
    }
    jump(Shapes::Free);
}

}  // namespace simflex
