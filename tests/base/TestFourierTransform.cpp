/** @file
The discrete Fourier transform against its sum and a closed form. **/

#include <gtest/gtest.h>

#include <cmath>

#include "simflex/base/FourierTransform.h"

namespace simflex {
namespace {

using Complex = std::complex<double>;

constexpr double Pi = 3.14159265358979323846;

TEST(FourierTransform, IsTheSumForEveryLength) {
    for (int n = 0; n <= 130; ++n) {
        std::vector<double> x;
        for (int j = 0; j < n; ++j) x.push_back(std::cos(1.3 * j) + 0.1 * j);
        const std::vector<Complex> transformed = calcFourierTransform(x);
        ASSERT_EQ(int(transformed.size()), n);
        for (int k = 0; k < n; ++k) {
            Complex sum = 0;
            for (int j = 0; j < n; ++j) sum += std::polar(x[size_t(j)], -2 * Pi * (j * k % n) / n);
            EXPECT_NEAR(std::abs(transformed[size_t(k)] - sum), 0, 1e-13 * n * (1 + 0.1 * n))
                << n << ' ' << k;
        }
    }
}

TEST(FourierTransform, OfAGeometricSeriesIsItsSumAlsoForAMillionAndALargePrime) {
    // 100 003 and 999 983 are prime: with kissfft alone the second would take an hour and a half.
    for (const int n : {65536, 100000, 100003, 999983}) {
        const double ratio = 1 - 5.0 / n;
        std::vector<double> x(1, 1.0);
        while (int(x.size()) < n) x.push_back(x.back() * ratio);
        const std::vector<Complex> transformed = calcFourierTransform(x);
        for (const int k : {-7, -1, 0, 1, 7, n / 3, n / 2}) {
            // 1 − r exp(iθ), without cancellation
            const double theta = -2 * Pi * k / n, half = std::sin(theta / 2);
            const Complex expected =
                (1 - ratio * x.back()) /
                Complex(1 - ratio + 2 * ratio * half * half, -ratio * std::sin(theta));
            const Complex found = transformed[size_t(k < 0 ? k + n : k)];
            EXPECT_NEAR(std::abs(found - expected), 0, 1e-13 * n) << n << ' ' << k;
        }
    }
}

}  // namespace
}  // namespace simflex
