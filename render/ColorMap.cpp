#include "simflex/render/ColorMap.h"

#include <algorithm>
#include <array>

namespace simflex {

namespace {

// Ten evenly spaced colours of each map; linear between them.
using Anchors = std::array<int, 10>;
constexpr Anchors viridis = {0x440154, 0x482878, 0x3E4A89, 0x31688E, 0x26828E,
                             0x1F9E89, 0x35B779, 0x6DCD59, 0xB4DE2C, 0xFDE725};
constexpr Anchors plasma = {0x0D0887, 0x47039F, 0x7301A8, 0x9C179E, 0xBD3786,
                            0xD8576B, 0xED7953, 0xFA9E3B, 0xFDC926, 0xF0F921};
constexpr Anchors blueWhiteRed = {0x2B4FA8, 0x4F77C4, 0x7FA3DB, 0xB3CBEA, 0xE4EBF2,
                                  0xF5E5DE, 0xF0BFA8, 0xDF8C73, 0xC65648, 0xA51F2B};

SimTK::Vec3 unpack(int rgb) {
    return SimTK::Vec3((rgb >> 16) & 255, (rgb >> 8) & 255, rgb & 255) / 255.0;
}

}  // namespace

SimTK::Vec3 calcColor(ColorMap map, double fraction) {
    const Anchors& anchors =
        map == ColorMap::Viridis ? viridis : (map == ColorMap::Plasma ? plasma : blueWhiteRed);
    const double x = std::min(1.0, std::max(0.0, fraction)) * (anchors.size() - 1);
    const int i = std::min(int(x), int(anchors.size()) - 2);
    const SimTK::Vec3 low = unpack(anchors[i]), high = unpack(anchors[i + 1]);
    return low + (x - i) * (high - low);
}

}  // namespace simflex
