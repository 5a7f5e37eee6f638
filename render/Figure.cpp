#include "simflex/render/Figure.h"

#include <cairo-pdf.h>
#include <cairo-svg.h>

#include <filesystem>
#include <limits>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/render/overlay/PlotPainter.h"

namespace simflex {

namespace {

constexpr int usualWidth = 1000, panelHeight = 340, lonePanelHeight = 560, roomForTitle = 60;

cairo_status_t append(void* text, const unsigned char* bytes, unsigned int count) {
    static_cast<std::string*>(text)->append(reinterpret_cast<const char*>(bytes), count);
    return CAIRO_STATUS_SUCCESS;
}

std::string escapeXml(const std::string& text) {
    std::string escaped;
    for (const char c : text)
        escaped += c == '<'            ? "&lt;"
                   : c == '>'          ? "&gt;"
                   : c == '&'          ? "&amp;"
                   : c >= 0 && c < ' ' ? " "
                                       : std::string(1, c);
    return escaped;
}

/** cairo's SVG draws letters as shapes, so the text is added separately. **/
void addWords(std::string& svg, const Figure& figure) {
    std::string words = figure.xLabel;
    for (const FigurePanel& panel : figure.panels) {
        words += "\n" + panel.label;
        if (!panel.map.isEmpty()) words += "\n" + panel.map.label;
        for (const FigureCurve& curve : panel.curves)
            if (!curve.name.empty()) words += "\n" + curve.name;
    }
    std::string lines;
    for (size_t begin = 0; begin <= words.size();) {
        const size_t end = std::min(words.find('\n', begin), words.size());
        lines += escapeXml(words.substr(begin, end - begin)) + "\n";
        begin = end + 1;
    }
    const size_t root = svg.find('>', svg.find("<svg"));
    if (root == std::string::npos) return;
    svg.insert(root + 1,
               "\n<title>" + escapeXml(figure.title) + "</title>\n<desc>\n" + lines + "</desc>");
}

}  // namespace

void drawFigure(const std::string& path, const Figure& figure) {
    const std::string kind = lowerCase(std::filesystem::path(path).extension().string());
    if (kind != ".png" && kind != ".svg" && kind != ".pdf")
        throw std::runtime_error("cannot draw '" + path +
                                 "': its name must end in .png, .svg or .pdf");
    if (figure.panels.empty())
        throw std::runtime_error("cannot draw '" + path + "': there is nothing to draw");
    const int numPanels = int(figure.panels.size());
    const int width = figure.width > 0 ? figure.width : usualWidth;
    const int height =
        figure.height > 0
            ? figure.height
            : (numPanels == 1 ? lonePanelHeight : numPanels * panelHeight) + roomForTitle;
    const PlotTheme& theme = PlotTheme::light();
    if (kind == ".png")  // doubled resolution: sharp on paper and high-resolution screens
        return PlotPainter(figure, theme, 2 * width, 2 * height, 2)
            .paint(std::numeric_limits<double>::quiet_NaN())
            .writePng(path);
    std::string bytes;
    {
        constexpr double point = 0.75;  // PDF points per pixel
        cairo_surface_t* surface =
            kind == ".svg" ? cairo_svg_surface_create_for_stream(append, &bytes, width, height)
                           : cairo_pdf_surface_create_for_stream(append, &bytes, point * width,
                                                                 point * height);
        PlotCanvas canvas(surface, 1);
        if (kind == ".svg")
            cairo_svg_surface_set_document_unit(surface, CAIRO_SVG_UNIT_PX);
        else
            cairo_scale(canvas.getPen(), point, point);
        PlotPainter(figure, theme, width, height, 1).paintOn(canvas);
        cairo_surface_finish(surface);
        canvas.check();
    }
    if (kind == ".svg") addWords(bytes, figure);
    replaceFile(path, bytes, Durability::ProcessEnd);
}

const PlotTheme& PlotTheme::light() {
    static const PlotTheme theme = {{255, 255, 255, 255},
                                    {28, 34, 44, 255},
                                    {88, 97, 110, 255},
                                    {224, 228, 233, 255},
                                    {{{0, 114, 178, 255},
                                      {213, 94, 0, 255},
                                      {0, 158, 115, 255},
                                      {204, 121, 167, 255},
                                      {230, 159, 0, 255},
                                      {86, 180, 233, 255},
                                      {90, 96, 104, 255}}}};
    return theme;
}

const PlotTheme& PlotTheme::dark() {
    static const PlotTheme theme = {{27, 31, 38, 255},
                                    {236, 240, 245, 255},
                                    {160, 171, 184, 255},
                                    {58, 65, 75, 255},
                                    {{{86, 180, 233, 255},
                                      {240, 134, 60, 255},
                                      {40, 195, 150, 255},
                                      {221, 150, 190, 255},
                                      {240, 195, 60, 255},
                                      {60, 140, 210, 255},
                                      {170, 178, 188, 255}}}};
    return theme;
}

}  // namespace simflex
