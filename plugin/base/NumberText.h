#pragma once
/** @file
Locale-independent conversion between numbers and text, for files. (printf, strtod and streams
follow the process's locale, which a program that links the library may have set: "1,3".) Streams
that write files need file.imbue(std::locale::classic()). **/

#include <charconv>
#include <string>
#include <string_view>

namespace simflex {

/** Formats as printf's %.*g, %.*f and %.*e do in the locale "C". **/
inline std::string writeAs(double value, std::chars_format format, int digits) {
    char text[400];  // enough for the largest number with 80 decimals
    return std::string(text, std::to_chars(text, text + sizeof text, value, format, digits).ptr);
}
inline std::string writeGeneral(double value, int digits = 17) {
    return writeAs(value, std::chars_format::general, digits);
}
inline std::string writeFixed(double value, int decimals) {
    return writeAs(value, std::chars_format::fixed, decimals);
}
inline std::string writeScientific(double value, int decimals) {
    return writeAs(value, std::chars_format::scientific, decimals);
}

/** "0.2 kB", "12.3 MB". **/
inline std::string writeFileSize(double bytes) {
    return bytes < 1e6 ? writeFixed(bytes / 1e3, 1) + " kB" : writeFixed(bytes / 1e6, 1) + " MB";
}

/** Formats as %.*E, for Fortran programs. **/
inline std::string writeFortran(double value, int decimals) {
    std::string text = writeScientific(value, decimals);
    for (char& c : text)
        if (c == 'e') c = 'E';
    return text;
}

/** Reads a whole field as a finite number. A leading + and Fortran's exponent D are accepted.
Numbers too small for a double become zero. @returns false if the field is not a number. **/
bool readNumber(std::string_view field, double& value);
bool readInteger(std::string_view field, int& value);

}  // namespace simflex
