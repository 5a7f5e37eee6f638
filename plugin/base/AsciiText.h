#pragma once
/** @file
Classification and case conversion of ASCII characters, independent of the locale (the functions of
<cctype> follow the process's locale). Bytes outside ASCII belong to no class and are left
unchanged. Internal. **/

#include <string>
#include <string_view>
#include <vector>

namespace simflex {

constexpr bool isDigit(char c) {
    return c >= '0' && c <= '9';
}
constexpr bool isLetter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
constexpr bool isBlank(char c) {
    return c == ' ' || (c >= '\t' && c <= '\r');
}
constexpr char toUpper(char c) {
    return c >= 'a' && c <= 'z' ? char(c - 'a' + 'A') : c;
}
constexpr char toLower(char c) {
    return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c;
}
inline std::string upperCase(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = toUpper(c);
    return result;
}
inline std::string lowerCase(std::string_view text) {
    std::string result(text);
    for (char& c : result) c = toLower(c);
    return result;
}

/** Splits at every separator. Empty pieces are kept. **/
inline std::vector<std::string> splitAt(std::string_view text, char separator) {
    std::vector<std::string> pieces{""};
    for (const char c : text)
        if (c == separator)
            pieces.emplace_back();
        else
            pieces.back() += c;
    return pieces;
}

/** Splits at commas outside brackets and trims blanks. **/
inline std::vector<std::string> splitAtCommas(std::string_view text) {
    std::vector<std::string> pieces{""};
    int depth = 0;
    for (const char c : text) {
        depth += (c == '(' || c == '[' || c == '{') - (c == ')' || c == ']' || c == '}');
        if (c == ',' && depth == 0)
            pieces.emplace_back();
        else if (!isBlank(c) || !pieces.back().empty())
            pieces.back() += c;
    }
    for (std::string& piece : pieces)
        while (!piece.empty() && isBlank(piece.back())) piece.pop_back();
    return pieces;
}

}  // namespace simflex
