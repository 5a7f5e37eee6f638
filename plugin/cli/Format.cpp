#include "simflex/cli/Format.h"
#include "simflex/base/NumberText.h"

#include <algorithm>
#include <sstream>

namespace simflex {
namespace cli {

std::string formatNumber(double value) {
    return writeGeneral(value == 0 ? 0.0 : value, 6);  // no -0
}

std::string formatValues(const std::vector<double>& values, const std::string& unit) {
    std::string text;
    for (const double value : values) text += (text.empty() ? "" : ", ") + formatNumber(value);
    if (values.size() != 1) text = "[" + text + "]";
    return unit.empty() ? text : text + ' ' + unit;
}

std::string formatCount(size_t number, const std::string& one, const std::string& many) {
    return std::to_string(number) + ' ' + (number == 1 ? one : many);
}

std::string wrapText(const std::string& text, size_t width, const std::string& indent) {
    std::string lines;
    size_t used = 0;  // of the last line
    std::istringstream words(text);
    for (std::string word; words >> word;) {
        const bool fits = used == 0 || used + 1 + word.size() <= width;
        if (used > 0) lines += fits ? " " : '\n' + indent;
        used = fits && used > 0 ? used + 1 + word.size() : word.size();
        lines += word;
    }
    return lines;
}

std::string TextTable::format(const std::string& indent) const {
    std::vector<size_t> widths(m_rows.front().size(), 0);
    std::vector<bool> areNumbers(widths.size(), m_rows.size() > 1);
    for (size_t i = 0; i < m_rows.size(); ++i)
        for (size_t j = 0; j < widths.size(); ++j) {
            const std::string& cell = m_rows[i][j];
            widths[j] = std::max(widths[j], cell.size());
            const bool isNumber = cell.find_first_not_of("0123456789.+-e %*") == std::string::npos;
            if (i > 0 && !isNumber) areNumbers[j] = false;
        }
    std::string text;
    for (const std::vector<std::string>& row : m_rows) {
        std::string line = indent;
        for (size_t j = 0; j < widths.size(); ++j) {
            const std::string pad(widths[j] - row[j].size(), ' ');
            line += (j ? "  " : "") + (areNumbers[j] ? pad + row[j] : row[j] + pad);
        }
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + '\n';
    }
    return text;
}

}  // namespace cli
}  // namespace simflex
