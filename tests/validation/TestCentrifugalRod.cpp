// A rod rotating steadily about its end (after Code_Aster's test SSLV104): the tip moves out by
// ρω²L³/3E or, since the force grows with the displacement, tan(kL)/k − L with k² = ρω²/E.

#include <gtest/gtest.h>

#include <cmath>

#include "validation/Beam.h"
#include "validation/SteadyRotation.h"

namespace simflex::test {
namespace {

class CentrifugalRod : public ::testing::Test {
protected:
    static BeamOptions makeOptions() {
        BeamOptions options;
        options.length = 0.5;
        options.height = options.width = 0.02;
        options.E = 2e11;
        options.density = 7800;
        options.numModes = 60;  // several axial ones: 3000 rad/s is a tenth of the first
        return options;
    }

    static double calcTip(double speed, SteadyRotation::Stiffening stiffening) {
        static const auto rod = makeBeam(makeOptions());
        return SteadyRotation(rod, speed, stiffening).calcTipDisplacement()[0];
    }

    static double calcExactTip(double speed) {
        const BeamOptions o = makeOptions();
        const double k = speed * std::sqrt(o.density / o.E);
        return std::tan(k * o.length) / k - o.length;
    }
};

TEST_F(CentrifugalRod, TipMovesOutByTheClosedForm) {
    // The stress, 0.04 % of E, stiffens and the growing force softens by the same amount.
    for (const auto stiffening : {SteadyRotation::Stiffening::Off, SteadyRotation::Stiffening::On})
        EXPECT_NEAR(calcTip(300, stiffening), 1.4625e-4, 1e-3 * 1.4625e-4);
}

TEST_F(CentrifugalRod, ForceThatGrowsWithTheDisplacementSoftens) {
    for (const double speed : {300.0, 1000.0, 3000.0})
        EXPECT_NEAR(calcTip(speed, SteadyRotation::Stiffening::Off) / calcExactTip(speed), 1, 1e-4);
}

/** Returns u' at which the force over the undeformed section is `stress`: E (1 + u')(u' + ½u'²),
Green's strain. **/
double calcSlope(double stress, double E) {
    double g = stress / E;
    for (int k = 0; k < 20; ++k)
        g -= (E * (1 + g) * (g + 0.5 * g * g) - stress) / (E * (1 + 3 * g + 1.5 * g * g));
    return g;
}

/** Returns the tip displacement of P' + ρω²(x + u) = 0, u(0) = 0, P(L) = 0 with the law above, by
shooting. **/
double shootTip(const BeamOptions& o, double speed) {
    constexpr int kSteps = 500;
    const double h = o.length / kSteps, load = o.density * speed * speed;
    const auto integrate = [&](double stressAtRoot) {  // u and P at L
        const auto rate = [&](double x, const Eigen::Vector2d& y) {
            return Eigen::Vector2d(calcSlope(y[1], o.E), -load * (x + y[0]));
        };
        Eigen::Vector2d y(0, stressAtRoot);
        for (int k = 0; k < kSteps; ++k) {
            const double x = k * h;
            const Eigen::Vector2d a = rate(x, y), b = rate(x + h / 2, y + h / 2 * a),
                                  c = rate(x + h / 2, y + h / 2 * b), d = rate(x + h, y + h * c);
            y += h / 6 * (a + 2 * b + 2 * c + d);
        }
        return y;
    };
    double low = 0, high = load * o.length * o.length;
    for (int k = 0; k < 60; ++k) {
        const double middle = 0.5 * (low + high);
        (integrate(middle)[1] < 0 ? low : high) = middle;
    }
    return integrate(low)[0];
}

// With geometric stiffness, strains equal Green's to second order.
TEST_F(CentrifugalRod, ItsOwnTensionStiffensTheRodLengthwiseToo) {
    const BeamOptions o = makeOptions();
    for (const double speed : {300.0, 1000.0, 3000.0}) {
        const double strain = 0.5 * o.density * speed * speed * o.length * o.length / o.E;
        EXPECT_NEAR(calcTip(speed, SteadyRotation::Stiffening::On) / shootTip(o, speed), 1,
                    1e-5 + 2 * strain * strain)
            << "at a strain of " << strain;
        if (speed > 500) {  // and differs from the linear rod's
            EXPECT_GT(std::abs(shootTip(o, speed) / calcExactTip(speed) - 1), strain / 2);
        }
    }
}

}  // namespace
}  // namespace simflex::test
