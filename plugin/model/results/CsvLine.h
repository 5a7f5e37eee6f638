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
    /** A field, in quotation marks where it needs them. **/
    CsvLine& add(const std::string& field) {
        if (!_isEmpty) _text += ',';
        _isEmpty = false;
        if (field.find_first_of(",\"\r\n") == std::string::npos) {
            _text += field;
            return *this;
        }
        _text += '"';
        for (const char c : field) _text += c == '"' ? std::string("\"\"") : std::string(1, c);
        _text += '"';
        return *this;
    }
    /** With 17 digits. **/
    CsvLine& add(double value) { return add(writeGeneral(value)); }
    template <class Values>
    CsvLine& addAll(const Values& values) {
        for (const auto& value : values) add(value);
        return *this;
    }
    /** The whole line. **/
    std::string end() const { return _text + '\n'; }

private:
    std::string _text;
    bool _isEmpty = true;
};

}  // namespace model
}  // namespace simflex
