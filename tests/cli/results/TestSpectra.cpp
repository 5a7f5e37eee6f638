/** @file
Spectra, waterfalls and orders against closed forms. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>

#include "simflex/model/Spectra.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using Values = std::vector<double>;

constexpr double Pi = 3.14159265358979323846;

struct Signal {
    Values time, values, speed;
};

Signal sample(
    double interval, int count, const std::function<double(double)>& value,
    const std::function<double(double)>& speed = [](double) { return 0.0; }) {
    Signal signal;
    for (int k = 0; k < count; ++k) {
        const double t = k * interval;
        signal.time.push_back(t);
        signal.values.push_back(value(t));
        signal.speed.push_back(speed(t));
    }
    return signal;
}

template <class Work>
std::string getRefusal(const Work& work) {
    try {
        work();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(Spectrum, SinesHaveTheirAmplitudesAtTheirFrequencies) {
    // 1000 rows per second, so that each frequency is an integer; a mean, which is removed.
    const Signal signal = sample(1e-3, 1000, [](double t) {
        return 7 + 2 * std::sin(2 * Pi * 50 * t + 0.3) + 0.25 * std::cos(2 * Pi * 123 * t);
    });
    const AmplitudeSpectrum spectrum = calcSpectrum(signal.time, signal.values);
    ASSERT_EQ(spectrum.frequency.size(), 501u);
    EXPECT_NEAR(spectrum.frequency[50], 50, 1e-9);
    EXPECT_NEAR(spectrum.amplitude[50], 2, 1e-9);
    EXPECT_NEAR(spectrum.amplitude[49], 1, 1e-9);  // of a Hann window, half
    EXPECT_NEAR(spectrum.amplitude[123], 0.25, 1e-9);
    for (const size_t k : {size_t(0), size_t(10), size_t(80), size_t(300), size_t(500)})
        EXPECT_NEAR(spectrum.amplitude[k], 0, 1e-9) << k;
    EXPECT_FALSE(isAliased(spectrum));
}

TEST(Spectrum, APeakBetweenTwoFrequenciesIsNotMuchLower) {
    // 997 is a prime number. The lowest peak of a Hann window is 8/(3π) of the amplitude.
    const Signal signal =
        sample(1e-3, 997, [](double t) { return 3 * std::sin(2 * Pi * 100.5 / 0.997 * t); });
    const AmplitudeSpectrum spectrum = calcSpectrum(signal.time, signal.values);
    EXPECT_NEAR(*std::max_element(spectrum.amplitude.begin(), spectrum.amplitude.end()),
                3 * 8 / (3 * Pi), 2e-3);
}

TEST(Spectrum, WhatIsFasterThanHalfTheRateOfRowsIsWarnedOfWhereItComesNear) {
    const auto isSeen = [](double hertz) {
        const Signal signal =
            sample(1e-3, 1000, [&](double t) { return std::sin(2 * Pi * hertz * t); });
        return isAliased(calcSpectrum(signal.time, signal.values));
    };
    EXPECT_TRUE(isSeen(480));
    EXPECT_TRUE(isSeen(530));
    EXPECT_FALSE(isSeen(300));
}

TEST(Spectrum, RefusesWhatHasNoFrequencies) {
    const Signal signal = sample(1e-3, 100, [](double t) { return t; });
    Values uneven = signal.time;
    uneven[40] += 2e-4;
    EXPECT_THAT(getRefusal([&] { calcSpectrum(uneven, signal.values); }),
                HasSubstr("rows are not evenly spaced: 0.0012 s before t = 0.0402 s"));
    Values missing = signal.values;
    missing[3] = std::nan("");
    EXPECT_THAT(getRefusal([&] { calcSpectrum(signal.time, missing); }),
                HasSubstr("there is no value at t = 0.003 s"));
    EXPECT_THAT(getRefusal([] { calcSpectrum({0, 1, 2}, {0, 1, 2}); }), HasSubstr("too few"));
    // The motion may end early.
    Values early = signal.time;
    early.back() -= 5e-4;
    EXPECT_EQ(calcSpectrum(early, signal.values).frequency.size(), 50u);
}

TEST(Waterfall, ALineFollowsTheSpeed) {
    // From 50 to 150 rad/s in 20 s: twice the speed at any time.
    const auto speed = [](double t) { return 50 + 5 * t; };
    const Signal signal = sample(
        2e-3, 10001, [](double t) { return 4 * std::cos(2 * (50 * t + 2.5 * t * t)); }, speed);
    const Waterfall waterfall = calcWaterfall(signal.time, signal.values, signal.speed, 39);
    ASSERT_EQ(waterfall.amplitude.size(), 39u);
    for (size_t i = 0; i < 39; ++i) {
        EXPECT_NEAR(waterfall.speed[i], speed(waterfall.time[i]), 1e-9);
        const Values& row = waterfall.amplitude[i];
        const size_t peak = size_t(std::max_element(row.begin(), row.end()) - row.begin());
        EXPECT_NEAR(waterfall.frequency[peak], 2 * waterfall.speed[i] / (2 * Pi),
                    1.01 * waterfall.frequency[1]);
        EXPECT_NEAR(row[peak], 4, 0.2 * 4);
    }
    EXPECT_THAT(getRefusal([&] { calcWaterfall(signal.time, signal.values, {}, 5000); }),
                HasSubstr("at least 8 each are needed"));
}

TEST(Orders, SteadyAmplitudesAndPhasesAreFoundExactlyInARunUp) {
    const auto angle = [](double t) { return 30 * t + 4 * t * t; };
    const Signal signal = sample(
        1e-3, 8001,
        [&](double t) {
            return 5 - 0.2 * t + 2 * std::cos(angle(t) + 0.5) + 0.3 * std::cos(2.5 * angle(t) - 2);
        },
        [](double t) { return 30 + 8 * t; });
    const auto tracks = trackOrders(signal.time, signal.values, signal.speed, {1, 2, 2.5});
    ASSERT_EQ(tracks.size(), 3u);
    ASSERT_GT(tracks[0].amplitude.size(), 15u);
    for (size_t i = 0; i < tracks[0].amplitude.size(); ++i) {
        EXPECT_NEAR(tracks[0].amplitude[i], 2, 1e-9);
        EXPECT_NEAR(tracks[0].phase[i], 0.5 * 180 / Pi, 1e-7);
        EXPECT_NEAR(tracks[1].amplitude[i], 0, 1e-9);
        EXPECT_NEAR(tracks[2].amplitude[i], 0.3, 1e-9);
        EXPECT_NEAR(tracks[2].phase[i], -2 * 180 / Pi, 1e-7);
        EXPECT_NEAR(tracks[0].speed[i], 30 + 8 * tracks[0].time[i], 1e-6);
    }
}

/** In a slow run-up, the amplitude of a Jeffcott rotor over speed is that of steady motions. **/
TEST(Orders, ASlowRunUpShowsTheResonanceOfAnUnbalance) {
    constexpr double omega = 100, zeta = 0.05, start = 80, rate = 0.5;
    const auto calcResponse = [&](double speed) {
        const double r = speed / omega;
        return r * r / std::hypot(1 - r * r, 2 * zeta * r);
    };
    // ÿ + 2ζω ẏ + ω² y = Ω² cos θ by Runge-Kutta.
    const double h = 2.5e-4;
    Values time, values, speed;
    double y = 0, v = 0;
    const auto acceleration = [&](double t, double a, double b) {
        const double Omega = start + rate * t;
        return Omega * Omega * std::cos(start * t + 0.5 * rate * t * t) - 2 * zeta * omega * b -
               omega * omega * a;
    };
    for (int k = 0; k < 320000; ++k) {
        const double t = k * h;
        if (k % 8 == 0) {
            time.push_back(t);
            values.push_back(y);
            speed.push_back(start + rate * t);
        }
        const double a1 = acceleration(t, y, v), v2 = v + 0.5 * h * a1,
                     a2 = acceleration(t + 0.5 * h, y + 0.5 * h * v, v2), v3 = v + 0.5 * h * a2,
                     a3 = acceleration(t + 0.5 * h, y + 0.5 * h * v2, v3), v4 = v + h * a3,
                     a4 = acceleration(t + h, y + h * v3, v4);
        y += h / 6 * (v + 2 * v2 + 2 * v3 + v4);
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
    }
    const OrderTrack track = trackOrders(time, values, speed, {1})[0];
    double largest = 0, at = 0;
    for (size_t i = 10; i < track.speed.size(); ++i) {
        const double expected = calcResponse(track.speed[i]);
        EXPECT_NEAR(track.amplitude[i], expected, 0.02 * expected) << track.speed[i];
        if (track.amplitude[i] > largest) largest = track.amplitude[i], at = track.speed[i];
    }
    EXPECT_NEAR(at, omega / std::sqrt(1 - 2 * zeta * zeta), 0.5);
    EXPECT_NEAR(largest, 1 / (2 * zeta * std::sqrt(1 - zeta * zeta)), 0.01 * 10);
}

TEST(Orders, RefuseWhatWouldGiveWrongNumbers) {
    const auto refuse = [](double interval, int count, double start, double rate,
                           const Values& orders) {
        const Signal signal = sample(
            interval, count, [](double t) { return t; },
            [&](double t) { return start + rate * t; });
        return getRefusal([&] { trackOrders(signal.time, signal.values, signal.speed, orders); });
    };
    EXPECT_EQ(refuse(1e-3, 2000, 100, 0, {1}), "");
    EXPECT_THAT(refuse(1e-2, 2000, 100, 0, {7}),
                HasSubstr("rows 0.01 s apart are too few for order 7 at 100 rad/s"));
    EXPECT_THAT(refuse(1e-3, 2000, 100, -120, {1}), HasSubstr("the speed changes its sign"));
    EXPECT_THAT(refuse(1e-3, 200, 100, 0, {1}), HasSubstr("fewer than a piece of 8"));
    EXPECT_THAT(refuse(1e-3, 2000, 100, 0, {1, 1}), HasSubstr("positive and different"));
    EXPECT_THAT(refuse(1e-3, 2000, 100, 0, {-1}), HasSubstr("positive and different"));
}

}  // namespace
}  // namespace simflex
