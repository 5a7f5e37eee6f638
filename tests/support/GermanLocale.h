#pragma once
/** @file
During its lifetime, numbers are written as "1.234,5": by new streams, and by printf if the C
library's German locale can be generated. **/

#include <gtest/gtest.h>

#include <clocale>
#include <cstdlib>
#include <locale>
#include <string>

namespace simflex::test {

class GermanLocale {
public:
    /** @param folder  a folder of the test, for the C library's locale **/
    explicit GermanLocale(const std::string& folder)
        : _before(std::locale::global(std::locale(std::locale::classic(), new Numbers))) {
        const std::string command =
            "localedef -i de_DE -f UTF-8 '" + folder + "/de_DE.UTF-8' >/dev/null 2>&1";
        if (std::system(command.c_str()) != 0) return;
        setenv("LOCPATH", folder.c_str(), 1);
        _hasC = std::setlocale(LC_NUMERIC, "de_DE.UTF-8") != nullptr;
        if (_hasC) {
            EXPECT_EQ(std::to_string(0.5), "0,500000");
        }
    }
    ~GermanLocale() {
        std::locale::global(_before);
        std::setlocale(LC_NUMERIC, "C");
        unsetenv("LOCPATH");
    }
    GermanLocale(const GermanLocale&) = delete;
    GermanLocale& operator=(const GermanLocale&) = delete;

    /** Whether printf uses the German format, too. **/
    bool hasC() const { return _hasC; }

private:
    struct Numbers : std::numpunct<char> {
        char do_decimal_point() const override { return ','; }
        char do_thousands_sep() const override { return '.'; }
        std::string do_grouping() const override { return "\3"; }
    };
    std::locale _before;
    bool _hasC = false;
};

}  // namespace simflex::test
