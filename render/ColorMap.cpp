#include "simflex/render/ColorMap.h"

#include <algorithm>
#include <cmath>

#include "simflex/render/overlay/ColorTables.h"

namespace simflex {

using SimTK::Vec3;

namespace {

// Evenly spaced, with lightness L* = 36, 51, 66, 81 and 92 from both ends; linear interpolation.
constexpr std::array<int, 9> blueWhiteRed = {0x2B4FA8, 0x4F77C4, 0x7FA3DB, 0xB3CBEA, 0xECE9E8,
                                             0xF0BFA8, 0xDF8C73, 0xC65648, 0xA51F2B};

Vec3 unpack(int rgb) {
    return Vec3((rgb >> 16) & 255, (rgb >> 8) & 255, rgb & 255) / 255.0;
}

template <std::size_t size>
Vec3 interpolate(const std::array<int, size>& table, double fraction) {
    const double x = fraction * (size - 1);
    const int i = std::min(int(x), int(size) - 2);
    const Vec3 low = unpack(table[i]), high = unpack(table[i + 1]);
    return low + (x - i) * (high - low);
}

// Moreland's Msh space: CIELAB in spherical coordinates, hue as angle.
Vec3 convertMshToColor(double M, double s, double h) {
    const double L = M * std::cos(s), a = M * std::sin(s) * std::cos(h),
                 b = M * std::sin(s) * std::sin(h);
    const auto invert = [](double f) {
        return f > 6.0 / 29 ? f * f * f : 3 * (6.0 / 29) * (6.0 / 29) * (f - 4.0 / 29);
    };
    const double fy = (L + 16) / 116;
    const Vec3 xyz(0.9505 * invert(fy + a / 500), invert(fy), 1.089 * invert(fy - b / 200));
    const SimTK::Mat33 toLinear(3.2406, -1.5372, -0.4986,  //
                                -0.9689, 1.8758, 0.0415,   //
                                0.0557, -0.2040, 1.0570);
    Vec3 rgb = toLinear * xyz;
    for (int k = 0; k < 3; ++k) {
        const double c = rgb[k];
        rgb[k] = c > 0.0031308 ? 1.055 * std::pow(c, 1 / 2.4) - 0.055 : 12.92 * c;
        rgb[k] = std::min(1.0, std::max(0.0, rgb[k]));
    }
    return rgb;
}

// From an end of magnitude 80 to a white of magnitude 88, with a hue spin that makes the transition
// look uniform.
Vec3 calcCoolWarm(double fraction) {
    constexpr double M = 80, white = 88, s = 1.08;
    const double hue = fraction < 0.5 ? -1.1 : 0.5;
    const double spin = s * std::sqrt(white * white - M * M) / (M * std::sin(s));
    const double whiteHue = hue > -SimTK::Pi / 3 ? hue + spin : hue - spin;
    const double t = std::abs(2 * fraction - 1);
    return convertMshToColor(white + t * (M - white), t * s, whiteHue + t * (hue - whiteHue));
}

}  // namespace

SimTK::Vec3 calcColor(ColorMap map, double fraction) {
    const double f = std::min(1.0, std::max(0.0, fraction));
    switch (map) {
        case ColorMap::Viridis:
            return interpolate(viridisTable, f);
        case ColorMap::Plasma:
            return interpolate(plasmaTable, f);
        case ColorMap::Inferno:
            return interpolate(infernoTable, f);
        case ColorMap::Magma:
            return interpolate(magmaTable, f);
        case ColorMap::Cividis:
            return interpolate(cividisTable, f);
        case ColorMap::Gray:
            return Vec3(f);
        case ColorMap::CoolWarm:
            return calcCoolWarm(f);
        case ColorMap::BlueWhiteRed:
            break;
    }
    return interpolate(blueWhiteRed, f);
}

bool isDiverging(ColorMap map) {
    return map == ColorMap::CoolWarm || map == ColorMap::BlueWhiteRed;
}

}  // namespace simflex
