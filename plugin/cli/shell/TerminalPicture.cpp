#include "simflex/cli/shell/TerminalPicture.h"

#include <chafa.h>

#include <algorithm>
#include <memory>

namespace simflex {
namespace cli {
namespace {

template <class T>
using Handle = std::unique_ptr<T, void (*)(T*)>;

Handle<ChafaTermInfo> findTermInfo(const Terminal& terminal) {
    if (!terminal.isTerminal) return {chafa_term_info_new(), chafa_term_info_unref};
    gchar** environment = g_get_environ();
    Handle<ChafaTermInfo> info(chafa_term_db_detect(chafa_term_db_get_default(), environment),
                               chafa_term_info_unref);
    g_strfreev(environment);
    return info;
}

bool hasKitty(const ChafaTermInfo* info) {
    return chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_BEGIN_KITTY_IMMEDIATE_IMAGE_V1);
}
bool hasSixel(const ChafaTermInfo* info) {
    return chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_BEGIN_SIXELS);
}

ChafaPixelMode chooseMode(PictureKind kind, const Terminal& terminal, const ChafaTermInfo* info) {
    if (kind == PictureKind::Kitty) return CHAFA_PIXEL_MODE_KITTY;
    if (kind == PictureKind::Sixel) return CHAFA_PIXEL_MODE_SIXELS;
    if (kind == PictureKind::Automatic && terminal.hasColor) {
        if (hasKitty(info)) return CHAFA_PIXEL_MODE_KITTY;
        if (hasSixel(info)) return CHAFA_PIXEL_MODE_SIXELS;
    }
    return CHAFA_PIXEL_MODE_SYMBOLS;
}

ChafaCanvasMode chooseColors(ChafaPixelMode mode, const Terminal& terminal,
                             const ChafaTermInfo* info) {
    if (mode != CHAFA_PIXEL_MODE_SYMBOLS) return CHAFA_CANVAS_MODE_TRUECOLOR;
    if (!terminal.hasColor) return CHAFA_CANVAS_MODE_FGBG;
    if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_DIRECT))
        return CHAFA_CANVAS_MODE_TRUECOLOR;
    if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_256))
        return CHAFA_CANVAS_MODE_INDEXED_240;
    if (chafa_term_info_have_seq(info, CHAFA_TERM_SEQ_SET_COLOR_FGBG_16))
        return CHAFA_CANVAS_MODE_INDEXED_16;
    return CHAFA_CANVAS_MODE_FGBG;
}

ChafaSymbolTags chooseSymbols(const Terminal& terminal, ChafaCanvasMode colors) {
    if (!terminal.hasUnicode) return CHAFA_SYMBOL_TAG_ASCII;
    if (colors == CHAFA_CANVAS_MODE_FGBG)
        return ChafaSymbolTags(CHAFA_SYMBOL_TAG_BRAILLE | CHAFA_SYMBOL_TAG_SPACE);
    return ChafaSymbolTags(CHAFA_SYMBOL_TAG_BLOCK | CHAFA_SYMBOL_TAG_BORDER |
                           CHAFA_SYMBOL_TAG_SPACE);
}

}  // namespace

PictureKind choosePictureKind(PictureKind wanted, const Terminal& terminal) {
    const ChafaPixelMode mode = chooseMode(wanted, terminal, findTermInfo(terminal).get());
    return mode == CHAFA_PIXEL_MODE_KITTY    ? PictureKind::Kitty
           : mode == CHAFA_PIXEL_MODE_SIXELS ? PictureKind::Sixel
                                             : PictureKind::Symbols;
}

std::string drawTerminalPicture(const Image& image, const Terminal& terminal, PictureKind kind) {
    Handle<ChafaTermInfo> info = findTermInfo(terminal);
    const ChafaPixelMode mode = chooseMode(kind, terminal, info.get());
    const ChafaCanvasMode colors = chooseColors(mode, terminal, info.get());
    if (mode != CHAFA_PIXEL_MODE_SYMBOLS) {  // asked for of a terminal that may not know them
        const Handle<ChafaTermInfo> fallback(
            chafa_term_db_get_fallback_info(chafa_term_db_get_default()), chafa_term_info_unref);
        chafa_term_info_supplement(info.get(), fallback.get());
    } else if (!terminal.hasColor) {
        info = {chafa_term_info_new(), chafa_term_info_unref};
    }

    gint columns = std::max(terminal.columns, 4), rows = std::max(terminal.rows - 2, 2);
    chafa_calc_canvas_geometry(image.getWidth(), image.getHeight(), &columns, &rows,
                               float(terminal.cellWidth) / float(terminal.cellHeight), TRUE, FALSE);
    Handle<ChafaSymbolMap> symbols(chafa_symbol_map_new(), chafa_symbol_map_unref);
    chafa_symbol_map_add_by_tags(symbols.get(), chooseSymbols(terminal, colors));
    Handle<ChafaCanvasConfig> config(chafa_canvas_config_new(), chafa_canvas_config_unref);
    chafa_canvas_config_set_geometry(config.get(), columns, rows);
    chafa_canvas_config_set_cell_geometry(config.get(), terminal.cellWidth, terminal.cellHeight);
    chafa_canvas_config_set_pixel_mode(config.get(), mode);
    chafa_canvas_config_set_canvas_mode(config.get(), colors);
    chafa_canvas_config_set_symbol_map(config.get(), symbols.get());
    if (colors == CHAFA_CANVAS_MODE_FGBG)
        chafa_canvas_config_set_dither_mode(config.get(), CHAFA_DITHER_MODE_DIFFUSION);
    Handle<ChafaCanvas> canvas(chafa_canvas_new(config.get()), chafa_canvas_unref);
    chafa_canvas_draw_all_pixels(canvas.get(), CHAFA_PIXEL_RGBA8_UNASSOCIATED, image.getData(),
                                 image.getWidth(), image.getHeight(), 4 * image.getWidth());
    GString* printed = chafa_canvas_print(canvas.get(), info.get());
    std::string text(printed->str, printed->len);
    g_string_free(printed, TRUE);
    if (text.empty() || text.back() != '\n') text += '\n';
    return text;
}

}  // namespace cli
}  // namespace simflex
