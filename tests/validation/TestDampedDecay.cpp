// A damped part in motion decays according to its complex eigenvalue; damping ratios are recovered
// from free decay.

#include <gtest/gtest.h>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/forces/ModalDamping.h"
#include "simflex/solver/Eigenmodes.h"
#include "simflex/solver/GeneralizedAlphaIntegrator.h"
#include "support/PointMassPart.h"
#include "validation/FreeDecay.h"

namespace simflex {
namespace {

using namespace SimTK;

TEST(DampedDecay, TransientFollowsTheComplexMode) {
    constexpr Real Amplitude = 1e-5;
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody body(flexible, test::makePointMassPart().body);
    Joint::Weld weld(flexible, matter.Ground(), body.interface("A"));
    // Unequal ratios couple the welded modes, so mode shapes are truly complex.
    Vector ratios(body.getNumModes());
    for (int i = 0; i < ratios.size(); ++i) ratios[i] = i % 2 ? 0.06 : 0.01;
    ModalDamping(flexible, body, ratios);
    State state = system.realizeTopology();
    body.setPoseByInterface(state, "A", Transform());
    const Linearization linear = calcLinearization(system, state);
    const Eigenmode mode = calcEigenmodes(linear).front();
    EXPECT_GT(mode.dampingRatio, 0.01);

    // δ = Re(c x e^{λt})
    State start = calcModeStates(system, linear, mode, Amplitude, 1)[0];
    const Vector xi = body.getModalCoordinates(start);
    Vector_<Complex> shape(xi.size());
    int largest = 0;
    for (int i = 0; i < xi.size(); ++i) {
        shape[i] = mode.shape[int(body.getModalMobilizer(i / 6).getFirstUIndex(state)) + i % 6];
        if (std::abs(xi[i]) > std::abs(xi[largest])) largest = i;
    }
    const Real c = xi[largest] / shape[largest].real();
    for (int i = 0; i < linear.M.nrow(); ++i)
        start.updU()[i] = std::real(c * mode.eigenvalue * mode.shape[i]);
    GeneralizedAlphaIntegrator integrator(system);
    integrator.setAccuracy(1e-12);
    integrator.initialize(start);
    const Real period = 2 * Pi / mode.eigenvalue.imag();
    for (int k = 1; k <= 4; ++k) {
        const Real time = 1.3 * k * period;
        integrator.stepTo(time);
        const Vector found = body.getModalCoordinates(integrator.getState());
        for (int i = 0; i < xi.size(); ++i)
            // accuracy^(2/3) of the amplitude, and second-order effects of the joint.
            EXPECT_NEAR(found[i], std::real(c * shape[i] * std::exp(mode.eigenvalue * time)),
                        3e-4 * std::abs(xi[largest]))
                << "mode " << i << " after " << 1.3 * k << " periods";
    }
}

TEST(DampedDecay, RatiosAreRecoveredFromIt) {
    for (const Real ratio : {0.005, 0.02, 0.05}) {
        const auto history = test::FreeDecay(ratio).run(10, 3e-10);
        EXPECT_NEAR(history.tip.front(), test::FreeDecay::Deflection,
                    1e-3 * test::FreeDecay::Deflection);
        EXPECT_NEAR(test::recoverDampingRatio(history), ratio, 5e-3 * ratio);
    }
}

}  // namespace
}  // namespace simflex
