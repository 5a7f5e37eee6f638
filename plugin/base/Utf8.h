#pragma once
/** @file
Text in UTF-8, character by character (Unicode 15, table 3-7). Internal. **/

#include <cstddef>
#include <string>
#include <string_view>

namespace simflex {

/** Bytes of the character that begins at `at`; 0 where none does: sequences that are cut off or
longer than needed, surrogates, numbers beyond U+10FFFF. **/
std::size_t calcUtf8Length(std::string_view text, std::size_t at);

/** Numbers of its characters; a byte that belongs to none stands for itself. **/
std::u32string decodeUtf8(std::string_view text);

/** UTF-16 of the same. **/
std::u16string convertToUtf16(std::string_view text);

/** The same without what a terminal would obey: control characters but for line feeds and tabs,
those that turn the direction of writing, and bytes that are not UTF-8, become '?'. For all text
that comes from files of others. **/
std::string makePrintable(std::string_view text);

/** How many there are. **/
std::size_t countCharacters(std::string_view text);

}  // namespace simflex
