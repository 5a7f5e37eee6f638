#pragma once
/** @file
A text file line by line, with messages that name file and line. Internal to part and fe. **/

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
    void stepBack() { _at = _begin, --_number; }

    std::string_view line() const { return _line; }
    int number() const { return _number; }
    const std::string& path() const { return _path; }
    /** Part of the file that is read, 0…1. **/
    double fraction() const { return double(_at) / double(_text.size() + 1); }

    /** "FILE:LINE: ". **/
    std::string where() const { return _path + ":" + std::to_string(_number) + ": "; }
    /** @throws std::invalid_argument that begins with where(). **/
    [[noreturn]] void refuse(const std::string& why) const;

    /** A field of the line at hand as a finite number (D exponents too) or a whole number.
    @param what  for the message: "the x coordinate". **/
    double parseNumber(std::string_view field, const char* what) const;
    int parseInteger(std::string_view field, const char* what) const;

private:
    std::string _path, _text;
    std::string_view _line;
    size_t _begin = 0, _at = 0;
    int _number = 0;
};

/** The line without blanks at either end. **/
std::string_view trimBlanks(std::string_view text);

/** Splits a line at blanks, tabs, commas and semicolons, several of them counting as one. **/
void splitFields(std::string_view line, std::vector<std::string_view>& fields);

/** Reads a whole field as a finite number. Too small a number is zero. @returns false if it is
 *none.
 **/
bool readNumber(std::string_view field, double& value);
bool readInteger(std::string_view field, int& value);

/** A field as messages show it: quoted, cut short, without what a terminal would obey. **/
std::string quoteField(std::string_view field);

}  // namespace simflex
