#include <gtest/gtest.h>

#include <cmath>

#include "simflex/base/DisplayUnit.h"
#include "simflex/render/overlay/Overlay.h"
#include "simflex/render/overlay/Ticks.h"

namespace simflex {
namespace {

TEST(Units, SuitTheSizeOfTheNumber) {
    EXPECT_EQ(formatQuantity(0.0004, "m"), "0.4 mm");
    EXPECT_EQ(formatQuantity(0.5, "m"), "500 mm");
    EXPECT_EQ(formatQuantity(12.5, "m"), "12.5 m");
    EXPECT_EQ(formatQuantity(3.2e-5, "m"), "32 µm");
    EXPECT_EQ(formatQuantity(2.5e8, "Pa"), "250 MPa");
    EXPECT_EQ(formatQuantity(-1.5e9, "Pa"), "-1500 MPa");
    EXPECT_EQ(formatQuantity(4e4, "Pa"), "40 kPa");
    EXPECT_EQ(formatQuantity(1.6e4, "J/m^3"), "16 kJ/m³");
    EXPECT_EQ(formatQuantity(9.15, "m/s"), "9.15 m/s");
    EXPECT_EQ(formatQuantity(0.02, "m/s"), "20 mm/s");
    EXPECT_EQ(formatQuantity(1234, "N"), "1.23 kN");
    EXPECT_EQ(formatQuantity(35, "N m"), "35 N m");
}

TEST(Units, OfHugeAndTinyNumbersHaveAPowerOfTen) {
    EXPECT_EQ(formatQuantity(3e-16, "m"), "300 10⁻⁹ nm");
    EXPECT_EQ(formatQuantity(5e15, "Pa"), "5 10⁶ GPa");
    EXPECT_EQ(chooseDisplayUnit("Pa", 0).name, "MPa");
    EXPECT_EQ(chooseDisplayUnit("m", 0).name, "mm");
}

TEST(Units, OfAFactorAreAPowerOfTenOnlyWhereItIsLarge) {
    EXPECT_EQ(formatFactor(1), "1");
    EXPECT_EQ(formatFactor(2.5), "2.5");
    EXPECT_EQ(formatFactor(5000), "5000");
    EXPECT_EQ(formatFactor(5e4), "5·10⁴");
    EXPECT_EQ(formatFactor(1e12), "10¹²");
}

TEST(Ticks, EndOnBothEndsOfARoundRangeAndPassZero) {
    for (const double end : {1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0})
        for (const double decade : {1e-3, 1.0, 100.0}) {
            const double high = end * decade;
            for (const double low : {0.0, -high}) {
                const double step = chooseTickStep(low, high);
                const double intervals = (high - low) / step;
                EXPECT_GE(intervals, 3.5) << low << " to " << high;
                EXPECT_LE(intervals, 10.5) << low << " to " << high;
                EXPECT_NEAR(high / step, std::round(high / step), 1e-6) << low << " to " << high;
            }
        }
    EXPECT_DOUBLE_EQ(chooseTickStep(0, 1), 0.2);
    EXPECT_EQ(countDecimals(0.2), 1);
    EXPECT_EQ(countDecimals(0.25), 2);
    EXPECT_EQ(countDecimals(2.5), 1);
    EXPECT_EQ(countDecimals(50), 0);
}

}  // namespace
}  // namespace simflex
