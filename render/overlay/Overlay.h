#pragma once
/** @file
What is written over a frame: title, time, colour bar, axis names. Internal to the renderer. **/

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
    std::vector<std::string> screenTexts;  ///< of the system's own
    std::string footnote;                  ///< in the lower right corner
    double unit = 1;                       ///< as in FrameStyle
    bool hasScaleBar = false;
    double pixelSize = 1;  ///< at the distance that the scale bar is for [m]
    bool hasColorBar = false;
    ColorBar colorBar;
    bool hasBorder = false;  ///< of a view that lies over another
    bool hasTriad = false;
    SimTK::Rotation R_GC;  ///< orientation of the camera, for the axis names

    struct PlacedLabel {
        std::string text;
        double x = 0, y = 0;  ///< of the point that it belongs to [pixel]
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

    std::unique_ptr<Font> regular, bold;  // loaded when the first text is drawn
};

/** The nearest of 1, 2 and 5 times a power of ten that is not below `value`. **/
double roundUpToStep(double value);

/** The same with finer steps, for the end of a range: 1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10. **/
double roundUpToRange(double value);

/** A length with a unit that suits it, such as "20 mm". **/
std::string formatLength(double meters);

/** A number without needless digits, such as "50" or "2.5". **/
std::string formatNumber(double value);

/** The same with a power of ten where it is large: "5·10⁵". **/
std::string formatFactor(double value);

}  // namespace simflex
