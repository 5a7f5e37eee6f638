#pragma once
/** @file
Text and symbols over a frame: title, time, colour bar, axis names. Internal to the renderer. **/

#include <memory>
#include <string>
#include <vector>

#include "ColorBar.h"
#include "Font.h"
#include "simflex/render/scene/FrameStyle.h"

namespace simflex {

struct OverlayContent {
    std::string title;
    std::vector<std::string> captions;     ///< below the title
    std::vector<std::string> screenTexts;  ///< from the system's decorations
    std::string footnote;                  ///< lower right corner
    double unit = 1;                       ///< as in FrameStyle
    bool hasScaleBar = false;
    double pixelSize = 1;  ///< at the distance of the scale bar [m]
    bool hasColorBar = false;
    ColorBar colorBar;
    bool hasBorder = false;  ///< for a view on top of another
    bool hasTriad = false;
    SimTK::Rotation R_GC;  ///< orientation of the camera, for the axis names

    struct PlacedLabel {
        std::string text;
        double x = 0, y = 0;  ///< labelled point [pixel]
        SimTK::Vec3 color{0};
    };
    std::vector<PlacedLabel> labels;
};

class Overlay {
public:
    void draw(Image& image, const OverlayContent& content, const Palette& palette);

private:
    void drawLabel(Image& image, const OverlayContent::PlacedLabel& label, const Palette& palette,
                   double unit);
    void drawScaleBar(Image& image, double right, double baseline, const OverlayContent& content,
                      const Palette& palette);

    std::unique_ptr<Font> regular, bold;  // loaded for the first text
};

/** Rounds up to 1, 2 or 5 times a power of ten. **/
double roundUpToStep(double value);

/** Rounds up to the end of a range, in finer steps: 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10. **/
double roundUpToRange(double value);

/** Formats a length with a suitable unit: "20 mm". **/
std::string formatLength(double meters);

/** Formats a number without trailing zeros: "50" or "2.5". **/
std::string formatNumber(double value);

/** As formatNumber(), with a power of ten for large numbers: "5·10⁵". **/
std::string formatFactor(double value);

}  // namespace simflex
