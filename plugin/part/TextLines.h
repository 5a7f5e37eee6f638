#pragma once
/** @file
Reads a text file line by line, with messages that name file and line. (Private header.) **/

#include <string>
#include <string_view>
#include <vector>

namespace simflex {

class TextLines {
public:
    /** Reads the whole file. @param kind  kind of file for the message: "node table".
    @throws std::runtime_error if it cannot be read. **/
    TextLines(std::string path, const std::string& kind);
    TextLines(const TextLines&) = delete;
    TextLines& operator=(const TextLines&) = delete;

    /** Moves to the next line (initially to the first). @returns false at the end. **/
    bool next();
    /** Moves to the next non-blank line. @returns false at the end. **/
    bool nextFilled();
    /** Makes the current line the next one again. **/
    void stepBack() { m_at = m_begin, --m_number; }

    std::string_view line() const { return m_line; }
    int number() const { return m_number; }
    const std::string& path() const { return m_path; }
    /** Fraction of the file that has been read, 0…1. **/
    double fraction() const { return double(m_at) / double(m_text.size() + 1); }

    /** "FILE:LINE: ". **/
    std::string where() const { return m_path + ":" + std::to_string(m_number) + ": "; }
    /** @throws std::invalid_argument starting with where(). **/
    [[noreturn]] void refuse(const std::string& why) const;

    /** Parses a field of the current line as a finite number (D exponents are accepted) or an
    integer.
    @param what  for the message: "the x coordinate". **/
    double parseNumber(std::string_view field, const char* what) const;
    int parseInteger(std::string_view field, const char* what) const;

private:
    std::string m_path, m_text;
    std::string_view m_line;
    size_t m_begin = 0, m_at = 0;
    int m_number = 0;
};

std::string_view trimBlanks(std::string_view text);

/** Splits a line at blanks, tabs, commas and semicolons; consecutive separators count as one. **/
void splitFields(std::string_view line, std::vector<std::string_view>& fields);

/** Formats a field for messages: quoted, truncated, without terminal control characters. **/
std::string quoteField(std::string_view field);

}  // namespace simflex
