#include "BulkCards.h"
#include "InpCards.h"

#include <algorithm>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace {

constexpr size_t NameWidth = 8, SmallWidth = 8, LargeWidth = 16;
constexpr size_t SmallFields = 8, LargeFields = 4;

/** Expands tabs to multiples of eight columns. **/
std::string withoutTabs(std::string_view line) {
    std::string text;
    for (const char c : line) {
        if (c == '\t') {
            text.append(NameWidth - text.size() % NameWidth, ' ');
        } else {
            text += c;
        }
    }
    return text;
}

std::string_view takeColumns(const std::string& line, size_t begin, size_t width) {
    if (begin >= line.size()) return {};
    return trimBlanks(std::string_view(line).substr(begin, width));
}

/** Appends the fields of a line after its name or continuation mark. **/
void addFields(const TextLines& lines, const std::string& line, bool isLarge,
               std::vector<std::string>& fields) {
    const size_t count = isLarge ? LargeFields : SmallFields;
    if (line.find(',') != std::string::npos) {
        size_t at = line.find(',') + 1;
        for (size_t k = 0; k < count; ++k) {
            const size_t comma = std::min(line.find(',', at), line.size());
            fields.emplace_back(at > line.size()
                                    ? std::string_view()
                                    : trimBlanks(std::string_view(line).substr(at, comma - at)));
            at = comma + 1;
        }
        // An additional field is the continuation mark.
        at = std::min(line.find(',', std::min(at, line.size())), line.size());
        if (!trimBlanks(std::string_view(line).substr(std::min(at + 1, line.size()))).empty())
            lines.refuse("the line has more than the " + std::to_string(count) +
                         " fields that Nastran reads; continue it on the next");
        return;
    }
    const size_t width = isLarge ? LargeWidth : SmallWidth;
    for (size_t k = 0; k < count; ++k)
        fields.emplace_back(takeColumns(line, NameWidth + k * width, width));
}

/** Returns the name in the first field: up to a comma or eight columns. **/
std::string takeName(const std::string& line) {
    const size_t comma = std::min(line.find(','), NameWidth);
    return upperCase(trimBlanks(std::string_view(line).substr(0, comma)));
}

}  // namespace

BulkCards::BulkCards(const std::string& path, const std::string& kind, std::set<std::string> names)
    : m_lines(path, kind), m_names(std::move(names)) {}

bool BulkCards::next(BulkCard& card) {
    while (m_lines.next()) {
        if (m_lines.line().empty() || m_lines.line()[0] == '$') continue;
        std::string line = withoutTabs(m_lines.line());
        std::string name = takeName(line);
        bool isLarge = !name.empty() && name.back() == '*';
        if (isLarge) name.pop_back();
        name.resize(trimBlanks(name).size());
        if (m_names.empty() ? name.empty() || name[0] == '+' : !m_names.count(name)) continue;

        card.name = name;
        card.fields.clear();
        card.line = m_lines.number();
        addFields(m_lines, line, isLarge, card.fields);
        while (m_lines.next()) {
            if (!m_lines.line().empty() && m_lines.line()[0] == '$') continue;
            line = withoutTabs(m_lines.line());
            const char mark = line.empty() ? 'x' : line[0];
            const bool continues = mark == '*' || mark == '+' || mark == ',' ||
                                   (mark == ' ' && !trimBlanks(line).empty());
            if (!continues) {
                m_lines.stepBack();
                break;
            }
            addFields(m_lines, line, mark == '*', card.fields);
        }
        return true;
    }
    return false;
}

void BulkCards::refuse(const BulkCard& card, const std::string& why) const {
    throw std::invalid_argument(m_lines.path() + ":" + std::to_string(card.line) + ": " +
                                card.name + ": " + why);
}

double BulkCards::parseNumber(const BulkCard& card, std::string_view field,
                              const char* what) const {
    if (field.empty()) return 0;
    double value = 0;
    if (!readNumber(withExponentLetter(field), value))
        refuse(card,
               std::string(what) + " is " + quoteField(field) + "; it must be a finite number");
    return value;
}

int BulkCards::parseInteger(const BulkCard& card, std::string_view field, const char* what) const {
    int value = 0;
    if (!field.empty() && !readInteger(field, value))
        refuse(card,
               std::string(what) + " is " + quoteField(field) + "; it must be a whole number");
    return value;
}

}  // namespace simflex
