#pragma once
/** @file
UTF-8 decoding (Unicode 15, table 3-7). Internal. **/

#include <cstddef>
#include <string>
#include <string_view>

namespace simflex {

/** Returns the number of bytes of the character at `at`; 0 if it is invalid: truncated or overlong
sequences, surrogates, code points beyond U+10FFFF. **/
std::size_t calcUtf8Length(std::string_view text, std::size_t at);

/** Returns the code points; an invalid byte is kept as its own value. **/
std::u32string decodeUtf8(std::string_view text);

/** Converts to UTF-16, with invalid bytes as in decodeUtf8(). **/
std::u16string convertToUtf16(std::string_view text);

/** Replaces everything that a terminal would interpret by '?': control characters except line feeds
and tabs, bidirectional controls and invalid UTF-8. For all text from untrusted files. **/
std::string makePrintable(std::string_view text);

std::size_t countCharacters(std::string_view text);

}  // namespace simflex
