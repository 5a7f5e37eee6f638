#pragma once
/** @file
Numbers and tables for display. **/

#include <string>
#include <vector>

namespace simflex {
namespace cli {

/** Formats with at most six digits; files have full precision. **/
std::string formatNumber(double value);
/** "0.5 rad", "[1, 2, 3] m". **/
std::string formatValues(const std::vector<double>& values, const std::string& unit);

/** "1 body", "3 bodies". **/
std::string formatCount(size_t number, const std::string& one, const std::string& many);

/** Breaks a text at spaces into lines of at most `width` bytes, where words allow it; lines after
the first begin with `indent`. **/
std::string wrapText(const std::string& text, size_t width, const std::string& indent);

/** Rows in aligned columns; numbers are right-aligned. **/
class TextTable {
public:
    explicit TextTable(std::vector<std::string> head) : m_rows{std::move(head)} {}
    void add(std::vector<std::string> row) { m_rows.push_back(std::move(row)); }
    bool isEmpty() const { return m_rows.size() == 1; }
    /** @param indent  prefix of each line **/
    std::string format(const std::string& indent = "") const;

private:
    std::vector<std::vector<std::string>> m_rows;
};

}  // namespace cli
}  // namespace simflex
