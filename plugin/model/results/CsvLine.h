#pragma once
/** @file
A line of a CSV file.

    text += CsvLine().add("tip.x [m]").add(0.25).end();   // tip.x [m],0.25 **/

#include <string>

#include "simflex/base/NumberText.h"

namespace simflex {
namespace model {

class CsvLine {
public:
    /** Adds a field, with quotation marks if needed. A field that a spreadsheet would read as a
    formula, which may start programs, is prefixed by an apostrophe. **/
    CsvLine& add(const std::string& text) {
        double number = 0;
        const bool isFormula = !text.empty() && std::string("=+-@").find(text[0]) != text.npos &&
                               !readNumber(text, number);
        return put(isFormula ? "'" + text : text);
    }
    /** Writes 17 digits. **/
    CsvLine& add(double value) { return put(writeGeneral(value)); }
    template <class Values>
    CsvLine& addAll(const Values& values) {
        for (const auto& value : values) add(value);
        return *this;
    }
    /** The whole line. **/
    std::string end() const { return m_text + '\n'; }

private:
    CsvLine& put(const std::string& field) {
        if (!m_isEmpty) m_text += ',';
        m_isEmpty = false;
        if (field.find_first_of(",\"\r\n") == std::string::npos) {
            m_text += field;
            return *this;
        }
        m_text += '"';
        for (const char c : field) m_text += c == '"' ? std::string("\"\"") : std::string(1, c);
        m_text += '"';
        return *this;
    }

    std::string m_text;
    bool m_isEmpty = true;
};

}  // namespace model
}  // namespace simflex
