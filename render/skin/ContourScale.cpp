#include "ContourScale.h"

#include <algorithm>

#include "simflex/render/overlay/Overlay.h"

namespace simflex {

const ContourTraits& getTraits(Contour contour) {
    static const ContourTraits none{"", "m", false, false, false},
        displacement{"displacement", "m", false, false, false},
        displacementX{"displacement x", "m", true, false, false},
        displacementY{"displacement y", "m", true, false, false},
        displacementZ{"displacement z", "m", true, false, false},
        speed{"speed", "m/s", false, true, false},
        velocityX{"velocity x", "m/s", true, true, false},
        velocityY{"velocity y", "m/s", true, true, false},
        velocityZ{"velocity z", "m/s", true, true, false},
        energy{"strain energy", "J/m^3", false, false, true},
        vonMises{"von Mises stress", "Pa", false, false, true},
        signedVonMises{"signed von Mises", "Pa", true, false, true},
        largest{"largest principal stress", "Pa", true, false, true},
        smallest{"smallest principal stress", "Pa", true, false, true};
    switch (contour) {
        case Contour::None:
            break;
        case Contour::Displacement:
            return displacement;
        case Contour::DisplacementX:
            return displacementX;
        case Contour::DisplacementY:
            return displacementY;
        case Contour::DisplacementZ:
            return displacementZ;
        case Contour::Speed:
            return speed;
        case Contour::VelocityX:
            return velocityX;
        case Contour::VelocityY:
            return velocityY;
        case Contour::VelocityZ:
            return velocityZ;
        case Contour::StrainEnergyDensity:
            return energy;
        case Contour::VonMises:
            return vonMises;
        case Contour::SignedVonMises:
            return signedVonMises;
        case Contour::LargestPrincipalStress:
            return largest;
        case Contour::SmallestPrincipalStress:
            return smallest;
    }
    return none;
}

void Extremes::include(const Extremes& other) {
    low = std::min(low, other.low);
    high = std::max(high, other.high);
}

ColorMap ContourSettings::getColorMap() const {
    if (isColorMapFixed) return colorMap;
    return getTraits(contour).isSigned ? ColorMap::CoolWarm : ColorMap::Viridis;
}

SimTK::Vec2 calcContourRange(const ContourSettings& settings, const Extremes& frame,
                             const Extremes& run) {
    if (settings.isRangeFixed) return {settings.fixedLow, settings.fixedHigh};
    const ContourTraits& traits = getTraits(settings.contour);
    const bool isPerFrame = settings.range == ContourRange::PerFrame;
    const Extremes& values = isPerFrame ? frame : run;
    double largest = values.isEmpty() ? 0 : std::max(values.high, 0.0);
    if (traits.isSigned && !values.isEmpty()) largest = std::max(largest, -values.low);
    // End of an empty bar: 1 mm, 1 MPa …
    if (!(largest > 0))
        largest = chooseDisplayUnit(traits.unit, 0).size;
    else if (!isPerFrame)
        largest = roundUpToRange(largest);
    return {traits.isSigned ? -largest : 0, largest};
}

}  // namespace simflex
