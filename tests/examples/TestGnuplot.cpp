// How the examples have gnuplot draw.

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "simflex/base/TemporaryFolder.h"
#include "support/Gnuplot.h"

namespace simflex {
namespace {

/** An environment variable, for a while. **/
class Variable {
public:
    Variable(const char* name, const std::string& value) : m_name(name) {
        const char* before = std::getenv(name);
        m_before = before ? before : "";
        setenv(name, value.c_str(), 1);
    }
    ~Variable() { setenv(m_name, m_before.c_str(), 1); }
    Variable(const Variable&) = delete;
    Variable& operator=(const Variable&) = delete;

private:
    const char* m_name;
    std::string m_before;
};

std::string read(const std::filesystem::path& path) {
    std::ifstream file(path);
    return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Gnuplot, DrawsTheScriptAloneWhateverSettingsThePersonHas) {
    if (!examples::isGnuplotAvailable()) GTEST_SKIP() << "gnuplot is not installed";
    const TemporaryFolder folder;
    std::ofstream(folder.path() / ".gnuplot") << "mine = 1\n";
    const Variable home("HOME", folder.path().string());
    const std::string file = (folder.path() / "it's drawn").string();
    examples::runGnuplot(
        "set print " + examples::quoteForGnuplot(file) + "\nprint exists('mine')\n", file);
    EXPECT_EQ(read(file), "0\n");
}

TEST(Gnuplot, AScriptThatFailsIsToldByItsPicture) {
    if (!examples::isGnuplotAvailable()) GTEST_SKIP() << "gnuplot is not installed";
    EXPECT_THAT([] { examples::runGnuplot("plot nothing_of_that_name\n", "picture.png"); },
                ::testing::ThrowsMessage<std::runtime_error>("gnuplot could not draw picture.png"));
}

TEST(Gnuplot, IsFoundOnThePathAlone) {
    const TemporaryFolder folder;
    const Variable path("PATH", folder.path().string());
    EXPECT_FALSE(examples::isGnuplotAvailable());
}

}  // namespace
}  // namespace simflex
