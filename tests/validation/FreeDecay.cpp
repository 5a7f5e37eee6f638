#include "validation/FreeDecay.h"

#include <cmath>

#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "simflex/solver/StaticEquilibrium.h"
#include "validation/BrickParts.h"

namespace simflex::test {

using namespace SimTK;

namespace {

const simflex::testing::Brick& getBrick() {
    static const auto brick = [] {
        simflex::testing::Brick result;
        result.size = {1, 0.01, 0.013};
        result.elements = {50, 1, 1};
        result.type = "C3D20";
        result.nu = 0;
        return result;
    }();
    return brick;
}

const std::shared_ptr<const ReducedBody>& getPart() {
    static const auto part = reduceBrick(getBrick(), 30);
    return part;
}

}  // namespace

FreeDecay::FreeDecay(Real ratio) : m_model(getPart(), Vec3(0)) {
    ModalDamping::rayleigh(m_model.flexible, m_model.beam, 0, 2 * ratio / calcFrequency());
    const auto& brick = getBrick();
    const Real EI = brick.E * brick.size[2] * std::pow(brick.size[1], 3) / 12;
    const Real force = 3 * EI * Deflection / std::pow(brick.size[0], 3);
    AttachmentForce(m_model.flexible, m_model.beam.interface("right"),
                    [force](Real t) { return SpatialVec(Vec3(0), Vec3(0, t > 0 ? 0 : force, 0)); });
}

Real FreeDecay::calcFrequency() {
    const auto& brick = getBrick();
    return square(1.8751 / brick.size[0]) * brick.size[1] * std::sqrt(brick.E / (12 * brick.rho));
}

FreeDecay::History FreeDecay::run(Real numPeriods, Real accuracy) {
    StaticEquilibrium equilibrium(m_model.system);
    equilibrium.setTolerance(1e-13);
    State state = m_model.makeState();
    state.setTime(0);
    equilibrium.solve(state);
    state = equilibrium.getState();
    state.setTime(1e-12);  // released
    GeneralizedAlphaIntegrator integrator(m_model.system);
    integrator.setAccuracy(accuracy);
    integrator.initialize(state);
    History history;
    const Real interval = 2 * Pi / calcFrequency() / 100;
    for (int k = 0; k <= 100 * numPeriods; ++k) {
        if (k > 0) integrator.stepTo(k * interval);
        const State& now = integrator.getState();
        m_model.system.realize(now, Stage::Velocity);
        history.time.push_back(now.getTime());
        history.tip.push_back(m_model.beam.interface("right").calcMotion(now).X.p()[1]);
    }
    return history;
}

double recoverDampingRatio(const FreeDecay::History& history) {
    std::vector<double> peaks;
    for (size_t k = 50; k + 50 < history.tip.size(); ++k) {
        // Highest within half a period on both sides: other oscillations are small.
        const auto begin = history.tip.begin();
        if (std::max_element(begin + long(k) - 50, begin + long(k) + 50) != begin + long(k))
            continue;
        const double a = history.tip[k - 1], b = history.tip[k], c = history.tip[k + 1];
        peaks.push_back(b + square(c - a) / (8 * (2 * b - a - c)));
    }
    if (peaks.size() < 5) throw std::runtime_error("too few peaks to recover damping from");
    const double decrement = std::log(peaks[3] / peaks.back()) / double(peaks.size() - 4);
    return decrement / std::hypot(2 * Pi, decrement);
}

}  // namespace simflex::test
