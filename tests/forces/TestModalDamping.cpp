/** @file
Modal damping against the decay of a free oscillation in closed form. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/ModalDamping.h"
#include "support/PointMassPart.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::HasSubstr;

class ModalDampingTest : public ::testing::Test {
protected:
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    const std::shared_ptr<const ReducedBody> part = makePointMassPart().body;
    const FlexibleBody body{flexible, part, "crank"};
};

TEST_F(ModalDampingTest, CoefficientsAreTwiceRatioTimesFrequencyAndAddUp) {
    Vector ratios(part->numModes);
    for (int i = 0; i < ratios.size(); ++i) ratios[i] = 0.01 * i;
    const ModalDamping perMode(flexible, body, ratios), uniform(flexible, body, 0.05);
    const FlexibleBody other(flexible, part, "other");
    const Eigen::VectorXd& damping = flexible.getGuts().body(body.getIndex()).damping;
    for (int i = 0; i < part->numModes; ++i)
        EXPECT_DOUBLE_EQ(damping[i], 2 * (0.01 * i + 0.05) * std::sqrt(part->omegaSquared[i]));
    EXPECT_TRUE(flexible.getGuts().body(other.getIndex()).damping.isZero(0));
}

/** One mode vibrates alone on a body whose frame is held: ξ = e^(−ζΩt)(cos Ω_d t + ζΩ/Ω_d sin Ω_d
 * t). **/
TEST_F(ModalDampingTest, FreeOscillationDecaysAsInClosedForm) {
    const double ratio = 0.04;
    const ModalDamping damping(flexible, body, ratio);
    State state = system.realizeTopology();
    body.getFrame().lock(state);
    const double xi0 = 1;  // linear however large, as the frame does not turn
    Vector xi(part->numModes, Real(0));
    xi[4] = xi0;
    body.setModalCoordinates(state, xi);
    RungeKuttaMersonIntegrator integrator(system);
    integrator.setAccuracy(1e-10);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    const double Omega = std::sqrt(part->omegaSquared[4]), rate = ratio * Omega;
    const double turned = Omega * std::sqrt(1 - ratio * ratio), end = 5.3 / Omega;
    stepper.stepTo(end);
    const double expected = xi0 * std::exp(-rate * end) *
                            (std::cos(turned * end) + rate / turned * std::sin(turned * end));
    EXPECT_NEAR(body.getModalCoordinates(stepper.getState())[4], expected, 1e-7 * xi0);
}

TEST_F(ModalDampingTest, BadRatiosAreNamed) {
    const auto messageOf = [](auto action) -> std::string {
        try {
            action();
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "";
    };
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, -0.02); }),
                ::testing::AllOf(HasSubstr("crank"), HasSubstr("-0.02"), HasSubstr("0 or more")));
    EXPECT_THAT(
        messageOf([&] { ModalDamping(flexible, body, std::numeric_limits<double>::quiet_NaN()); }),
        HasSubstr("nan"));
    Vector ratios(part->numModes, 0.01);
    ratios[3] = std::numeric_limits<double>::infinity();
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, ratios); }), HasSubstr("mode 4"));
    EXPECT_THAT(messageOf([&] { ModalDamping(flexible, body, Vector(3, 0.01)); }),
                ::testing::AllOf(HasSubstr("3 ratios"), HasSubstr("11 modes")));
}

}  // namespace
}  // namespace simflex::test
