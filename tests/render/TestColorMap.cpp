#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "simflex/render/ColorMap.h"

namespace simflex {
namespace {

using SimTK::Vec3;

const std::vector<ColorMap> sequential = {ColorMap::Viridis, ColorMap::Plasma,  ColorMap::Inferno,
                                          ColorMap::Magma,   ColorMap::Cividis, ColorMap::Gray};
const std::vector<ColorMap> diverging = {ColorMap::CoolWarm, ColorMap::BlueWhiteRed};

// L* of CIELAB.
double calcLightness(const Vec3& color) {
    double linear[3];
    for (int k = 0; k < 3; ++k)
        linear[k] =
            color[k] <= 0.04045 ? color[k] / 12.92 : std::pow((color[k] + 0.055) / 1.055, 2.4);
    const double Y = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    return Y > 216.0 / 24389 ? 116 * std::cbrt(Y) - 16 : Y * 24389 / 27;
}

TEST(ColorMaps, AreThePublishedOnes) {
    struct Entry {
        ColorMap map;
        int index;  // of 256
        Vec3 color;
    };
    // From matplotlib's tables.
    const Entry entries[] = {{ColorMap::Viridis, 0, {0.267004, 0.004874, 0.329415}},
                             {ColorMap::Viridis, 128, {0.127568, 0.566949, 0.550556}},
                             {ColorMap::Viridis, 255, {0.993248, 0.906157, 0.143936}},
                             {ColorMap::Plasma, 64, {0.494877, 0.01199, 0.657865}},
                             {ColorMap::Plasma, 200, {0.984199, 0.629718, 0.224595}},
                             {ColorMap::Inferno, 64, {0.3415, 0.062325, 0.429425}},
                             {ColorMap::Inferno, 255, {0.988362, 0.998364, 0.644924}},
                             {ColorMap::Magma, 128, {0.716387, 0.214982, 0.47529}},
                             {ColorMap::Magma, 200, {0.992785, 0.594891, 0.410283}},
                             {ColorMap::Cividis, 0, {0.0, 0.135112, 0.304751}},
                             {ColorMap::Cividis, 128, {0.488697, 0.485318, 0.471008}},
                             {ColorMap::Cividis, 255, {0.995737, 0.909344, 0.217772}}};
    for (const Entry& entry : entries) {
        const Vec3 found = calcColor(entry.map, entry.index / 255.0);
        for (int k = 0; k < 3; ++k)
            EXPECT_NEAR(found[k], entry.color[k], 0.5 / 255 + 1e-9) << int(entry.map);
    }
    // Moreland's own table of eight intervals.
    const Vec3 coolWarm[] = {
        {0.2298057, 0.298717966, 0.753683153},   {0.38301334, 0.50941904, 0.917387822},
        {0.552953156, 0.688929332, 0.995375608}, {0.722193294, 0.813952739, 0.976574709},
        {0.865395197, 0.86541021, 0.865395561},  {0.958852946, 0.769767752, 0.678007945},
        {0.958003065, 0.602842431, 0.481775914}, {0.869186849, 0.378313092, 0.300267182},
        {0.705673158, 0.01555616, 0.150232812}};
    for (int i = 0; i <= 8; ++i) {
        const Vec3 found = calcColor(ColorMap::CoolWarm, i / 8.0);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(found[k], coolWarm[i][k], 0.5 / 255) << i;
    }
}

TEST(ColorMaps, LightnessOfSequentialOnesGrows) {
    for (const ColorMap map : sequential) {
        EXPECT_FALSE(isDiverging(map));
        double before = calcLightness(calcColor(map, 0));
        // Plasma's and Cividis' 8-bit colours are even to a third of a unit of L*.
        for (int i = 4; i <= 256; i += 4) {
            const double now = calcLightness(calcColor(map, i / 256.0));
            EXPECT_GT(now, before) << int(map) << " at " << i;
            before = now;
        }
        EXPECT_GT(before - calcLightness(calcColor(map, 0)), 60);
    }
}

TEST(ColorMaps, DivergingOnesAreEquallyLightOnBothSidesOfTheirMiddle) {
    for (const ColorMap map : diverging) {
        EXPECT_TRUE(isDiverging(map));
        double before = 101;
        for (int i = 0; i <= 64; ++i) {
            const double low = calcLightness(calcColor(map, 0.5 - i / 128.0)),
                         high = calcLightness(calcColor(map, 0.5 + i / 128.0));
            EXPECT_NEAR(low, high, 1.0) << int(map) << " at " << i;
            EXPECT_LT(std::max(low, high), before);  // lightest in the middle
            before = std::max(low, high);
        }
        EXPECT_GT(calcLightness(calcColor(map, 0.5)), 85);
    }
}

TEST(ColorMaps, EndWithTheirEndsAndHaveNoJumps) {
    for (int m = 0; m <= int(ColorMap::BlueWhiteRed); ++m) {
        const ColorMap map = ColorMap(m);
        EXPECT_EQ(calcColor(map, -2), calcColor(map, 0));
        EXPECT_EQ(calcColor(map, 1.5), calcColor(map, 1));
        for (int i = 0; i < 2000; ++i)
            EXPECT_LT((calcColor(map, (i + 1) / 2000.0) - calcColor(map, i / 2000.0)).norm(), 0.01);
    }
}

}  // namespace
}  // namespace simflex
