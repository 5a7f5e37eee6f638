#pragma once
/** @file
A text file line by line, with messages that name file and line. (Private header.) **/

#include <string>
#include <string_view>
#include <vector>

namespace simflex {

class TextLines {
public:
    /** Reads the whole file. @param kind  what the file is, for the message: "node table".
    @throws std::runtime_error if it cannot be read. **/
    TextLines(std::string path, const std::string& kind);
    TextLines(const TextLines&) = delete;
    TextLines& operator=(const TextLines&) = delete;

    /** Goes to the next line (at first: to the first one). @returns false at the end. **/
    bool next();
    /** The next line that holds something other than blanks. **/
    bool nextFilled();
    /** Makes the line at hand the next one again. **/
    void stepBack() { m_at = m_begin, --m_number; }

    std::string_view line() const { return m_line; }
    int number() const { return m_number; }
    const std::string& path() const { return m_path; }
    /** Part of the file that is read, 0…1. **/
    double fraction() const { return double(m_at) / double(m_text.size() + 1); }

    /** "FILE:LINE: ". **/
    std::string where() const { return m_path + ":" + std::to_string(m_number) + ": "; }
    /** @throws std::invalid_argument that begins with where(). **/
    [[noreturn]] void refuse(const std::string& why) const;

    /** A field of the line at hand as a finite number (D exponents too) or a whole number.
    @param what  for the message: "the x coordinate". **/
    double parseNumber(std::string_view field, const char* what) const;
    int parseInteger(std::string_view field, const char* what) const;

private:
    std::string m_path, m_text;
    std::string_view m_line;
    size_t m_begin = 0, m_at = 0;
    int m_number = 0;
};

/** The line without blanks at either end. **/
std::string_view trimBlanks(std::string_view text);

/** Splits a line at blanks, tabs, commas and semicolons, several of them counting as one. **/
void splitFields(std::string_view line, std::vector<std::string_view>& fields);

/** A field as messages show it: quoted, cut short, without what a terminal would obey. **/
std::string quoteField(std::string_view field);

}  // namespace simflex
