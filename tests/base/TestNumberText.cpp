#include <gtest/gtest.h>

#include <string>

#include "simflex/base/NumberText.h"
#include "support/GermanLocale.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

TEST(NumberText, IsTheSameInEveryLocale) {
    const testing::TestFolder folder;
    const test::GermanLocale german(folder.path());
    EXPECT_EQ(writeGeneral(-1234.5), "-1234.5");
    EXPECT_EQ(writeGeneral(1e-7 / 3, 6), "3.33333e-08");
    EXPECT_EQ(writeFixed(2.0 / 3, 2), "0.67");
    EXPECT_EQ(writeScientific(1234.5, 3), "1.234e+03");
    EXPECT_EQ(writeFortran(1234.5, 3), "1.234E+03");
    EXPECT_EQ(writeFileSize(123456), "123.5 kB");
    EXPECT_EQ(writeFileSize(1.25e8), "125.0 MB");
    double value = 0;
    EXPECT_TRUE(readNumber("-1234.5", value));
    EXPECT_EQ(value, -1234.5);
    EXPECT_FALSE(readNumber("1,5", value));
}

TEST(NumberText, FieldsOfDecksAreNumbersWholeAndFinite) {
    double value = 1;
    EXPECT_TRUE(readNumber("+1.5D+3", value));
    EXPECT_EQ(value, 1500);
    EXPECT_TRUE(readNumber("1e-400", value));
    EXPECT_EQ(value, 0);
    for (const std::string field : {"", "+", "+-1", "1e400", "inf", "nan", "1.5 ", "1.5x", "0x10"})
        EXPECT_FALSE(readNumber(field, value)) << field;
    EXPECT_FALSE(readNumber(std::string(100, '1'), value));
    int count = 0;
    EXPECT_TRUE(readInteger("+12", count));
    EXPECT_EQ(count, 12);
    for (const std::string field : {"", "1.0", "+-1", "99999999999", "12 "})
        EXPECT_FALSE(readInteger(field, count)) << field;
}

}  // namespace
}  // namespace simflex
