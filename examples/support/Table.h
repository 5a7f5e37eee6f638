#pragma once
/** @file
A two-column table for people: label, value, unit; with headings. **/

#include <string>
#include <vector>

namespace simflex::examples {

class Table {
public:
    void addHeading(const std::string& text);
    void add(const std::string& label, const std::string& value, const std::string& unit = "");
    void add(const std::string& label, double value, const std::string& unit = "",
             int significantDigits = 4);
    void add(const std::string& label, long value) { add(label, std::to_string(value)); }

    /** Labels to the left, values to the right, one line each. **/
    std::string toString() const;

private:
    struct Row {
        std::string label, value, unit;
        bool isHeading;
    };
    std::vector<Row> m_rows;
};

}  // namespace simflex::examples
