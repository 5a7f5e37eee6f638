#include "support/Table.h"

#include <algorithm>
#include <cstdio>

namespace simflex::examples {

void Table::addHeading(const std::string& text) {
    m_rows.push_back({text, "", "", true});
}

void Table::add(const std::string& label, const std::string& value, const std::string& unit) {
    m_rows.push_back({label, value, unit, false});
}

void Table::add(const std::string& label, double value, const std::string& unit,
                int significantDigits) {
    char text[40];
    std::snprintf(text, sizeof text, "%.*g", significantDigits, value);
    add(label, text, unit);
}

std::string Table::toString() const {
    size_t labelWidth = 0, valueWidth = 0;
    for (const Row& row : m_rows)
        if (!row.isHeading) {
            labelWidth = std::max(labelWidth, row.label.size());
            valueWidth = std::max(valueWidth, row.value.size());
        }
    std::string text;
    for (const Row& row : m_rows) {
        if (row.isHeading) {
            text += (text.empty() ? "" : "\n") + row.label + "\n";
            continue;
        }
        text += "  " + row.label + std::string(labelWidth - row.label.size() + 2, ' ') +
                std::string(valueWidth - row.value.size(), ' ') + row.value;
        text += (row.unit.empty() ? "" : " " + row.unit) + "\n";
    }
    return text;
}

}  // namespace simflex::examples
