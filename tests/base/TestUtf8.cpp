#include <gtest/gtest.h>

#include "simflex/base/Utf8.h"

namespace simflex {
namespace {

TEST(Utf8, CharactersOfAllLengthsAreWhatTheCompilerMakesOfThem) {
    EXPECT_EQ(decodeUtf8(u8"a größe 模態 🦀\U0010FFFF"), U"a größe 模態 🦀\U0010FFFF");
    EXPECT_EQ(convertToUtf16(u8"a größe 模態 🦀\U0010FFFF"),
              u"a größe 模態 🦀\U0010FFFF");
    EXPECT_EQ(countCharacters(u8"größe 🦀"), 7u);
    EXPECT_EQ(countCharacters(""), 0u);
}

TEST(Utf8, WhatIsNoCharacterHasNoLengthAndStandsForItself) {
    for (const char* text :
         {"\x80", "\xC0\x80", "\xC1\xBF", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
          "\xF4\x90\x80\x80", "\xF5\x80\x80\x80", "\xC3", "\xE6\xA8", "\xC3z"})
        EXPECT_EQ(calcUtf8Length(text, 0), 0u) << text;
    EXPECT_EQ(calcUtf8Length("a", 1), 0u);
    EXPECT_EQ(decodeUtf8("\xC3z\xFF"), U"\u00C3z\u00FF");
}

TEST(Utf8, WhatATerminalWouldObeyIsNotPrinted) {
    EXPECT_EQ(makePrintable("größe\t[m]\n樹"), "größe\t[m]\n樹");
    EXPECT_EQ(makePrintable("\x1b]0;title\a\x1b[31m\r\x7F\b"), "?]0;title??[31m???");
    EXPECT_EQ(makePrintable("\xC2\x9B"
                            "31m\xC2\xA0\xFF"),
              "?31m\xC2\xA0?");
    EXPECT_EQ(makePrintable("part_\u202Egnp.\u2066exe\u200F"), "part_?gnp.?exe?");
}

TEST(Utf8, EveryCodePointIsReadAsItIsWritten) {
    for (char32_t code = 0; code <= 0x10FFFF; ++code) {
        if (code >= 0xD800 && code <= 0xDFFF) continue;
        std::string text;
        if (code < 0x80)
            text = {char(code)};
        else if (code < 0x800)
            text = {char(0xC0 + code / 64), char(0x80 + code % 64)};
        else if (code < 0x10000)
            text = {char(0xE0 + code / 4096), char(0x80 + code / 64 % 64), char(0x80 + code % 64)};
        else
            text = {char(0xF0 + code / 262144), char(0x80 + code / 4096 % 64),
                    char(0x80 + code / 64 % 64), char(0x80 + code % 64)};
        ASSERT_EQ(calcUtf8Length(text, 0), text.size()) << unsigned(code);
        ASSERT_EQ(decodeUtf8(text), std::u32string(1, code)) << unsigned(code);
    }
}

}  // namespace
}  // namespace simflex
