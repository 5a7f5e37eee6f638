/** @file
Plots and pictures made of text characters. **/

#include <gmock/gmock.h>

#include <cmath>
#include <sstream>

#include "simflex/base/Base64.h"
#include "simflex/cli/Format.h"
#include "simflex/cli/shell/TerminalPicture.h"
#include "simflex/cli/shell/TerminalPlot.h"

namespace simflex {
namespace cli {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<std::string> splitLines(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
}

/** Decodes UTF-8 characters. **/
std::vector<unsigned> decode(const std::string& text) {
    std::vector<unsigned> codes;
    for (size_t i = 0; i < text.size();) {
        const auto lead = static_cast<unsigned char>(text[i]);
        const int more = lead < 0x80 ? 0 : lead < 0xe0 ? 1 : lead < 0xf0 ? 2 : 3;
        unsigned code = more ? lead & (0x3fu >> more) : lead;
        for (int k = 1; k <= more; ++k)
            code = code << 6 | (static_cast<unsigned char>(text[i + size_t(k)]) & 0x3fu);
        codes.push_back(code);
        i += size_t(more) + 1;
    }
    return codes;
}

Terminal makeTerminal(int columns, int rows, bool hasUnicode = true, bool hasColor = false) {
    Terminal terminal;
    terminal.columns = columns;
    terminal.rows = rows;
    terminal.hasUnicode = hasUnicode;
    terminal.isTerminal = terminal.hasColor = hasColor;
    return terminal;
}

TerminalCurve sample(const std::string& name, const std::string& unit, double (*function)(double),
                     int n = 400) {
    TerminalCurve curve{name, unit, {}, {}};
    for (int i = 0; i <= n; ++i) {
        curve.time.push_back(double(i) / n);
        curve.values.push_back(function(curve.time.back()));
    }
    return curve;
}

TEST(TerminalPlot, FillsTheTerminalButForTwoRows) {
    for (const bool hasUnicode : {false, true}) {
        const auto lines = splitLines(drawTerminalPlot(
            {sample("x", "m", [](double t) { return t * t; })}, makeTerminal(80, 24, hasUnicode)));
        EXPECT_EQ(lines.size(), 22u);
        EXPECT_EQ(lines[0], "x [m]");
        size_t widest = 0;
        for (const std::string& line : lines) widest = std::max(widest, decode(line).size());
        EXPECT_EQ(widest, 80u);
    }
}

TEST(TerminalPlot, ARampRisesFromTheLowerLeftToTheUpperRightCorner) {
    const auto lines = splitLines(drawTerminalPlot({sample("x", "", [](double t) { return t; })},
                                                   makeTerminal(62, 25, false)));
    std::vector<std::string> rows;  // without labels and axis
    for (size_t i = 1; i + 2 < lines.size(); ++i)
        rows.push_back(lines[i].substr(lines[i].find_first_of("+|") + 1));
    EXPECT_EQ(rows.front().find_last_of('*'), rows.front().size() - 1);
    EXPECT_EQ(rows.back().find('*'), 0u);
    for (size_t i = 1; i < rows.size(); ++i)
        EXPECT_LT(rows[i].find('*'), rows[i - 1].find('*')) << i;
    EXPECT_THAT(lines[1], HasSubstr(" 1 +"));
    EXPECT_THAT(lines.back(), EndsWith("1 s"));
}

TEST(TerminalPlot, BrailleDotsOfASineLieWhereItsValuesAre) {
    const auto sine = [](double t) { return std::sin(2 * M_PI * t); };
    const auto lines =
        splitLines(drawTerminalPlot({sample("s", "rad", sine)}, makeTerminal(83, 25)));
    const int numRows = int(lines.size()) - 3;
    int numDots = 0;
    for (int row = 0; row < numRows; ++row) {
        const std::vector<unsigned> codes = decode(lines[size_t(row) + 1]);
        const size_t axis = 5;  // "-0.5 ┤"
        ASSERT_TRUE(codes[axis] == 0x2524 || codes[axis] == 0x2502) << lines[size_t(row) + 1];
        for (size_t column = axis + 1; column < codes.size(); ++column) {
            if (codes[column] == ' ') continue;
            ASSERT_GE(codes[column], 0x2800u);
            ASSERT_LE(codes[column], 0x28ffu);
            ++numDots;
            const double cells = 83 - 6 - 1;
            const double t = double(column - axis - 1) / cells;
            const double y = 1 - 2 * double(row) / (numRows - 1);
            double nearest = 2;  // within a cell's width and height
            for (double s = -1.5; s <= 1.5; s += 0.01)
                nearest = std::min(nearest, std::abs(sine(t + s / cells) - y));
            EXPECT_LT(nearest, 1.1 * 2 / (numRows - 1)) << row << ' ' << column;
        }
    }
    EXPECT_GT(numDots, 70);
}

TEST(TerminalPlot, CurvesShareAPanelOnlyWhereColoursTellThemApart) {
    const std::vector<TerminalCurve> curves = {sample("a", "m", [](double t) { return t; }),
                                               sample("b", "m", [](double t) { return -t; }),
                                               sample("c", "N", [](double t) { return 5 + t; })};
    const std::string plain = drawTerminalPlot(curves, makeTerminal(80, 40));
    for (const char* title : {"a [m]\n", "b [m]\n", "c [N]\n"})
        EXPECT_THAT(plain, HasSubstr(title));
    EXPECT_THAT(plain, Not(HasSubstr("\033")));
    const std::string colored = drawTerminalPlot(curves, makeTerminal(80, 40, true, true));
    EXPECT_THAT(colored, HasSubstr("\033[34ma\033[0m  \033[31mb\033[0m [m]\n"));
    EXPECT_LE(splitLines(colored).size(), 40u);
}

TEST(TerminalPlot, ConstantsGapsAndNothingAreNoTrouble) {
    const Terminal terminal = makeTerminal(40, 12, false);
    EXPECT_THAT(drawTerminalPlot({{"x", "", {0, 1}, {3, 3}}}, terminal), HasSubstr("****"));
    const double nan = std::nan("");
    EXPECT_THAT(drawTerminalPlot({{"x", "", {0, 1, 2}, {0, nan, 1}}}, terminal), HasSubstr("*"));
    EXPECT_THROW(drawTerminalPlot({{"x", "", {0}, {nan}}}, terminal), std::invalid_argument);
    EXPECT_THROW(drawTerminalPlot({}, terminal), std::invalid_argument);
}

TEST(TerminalPicture, IsThePngInPiecesThatTheProtocolAllows) {
    Image image(400, 200, {0, 0, 0, 255});
    for (int y = 0; y < 200; ++y)  // noise, for a long file
        for (int x = 0; x < 400; ++x)
            image.setPixel(x, y, {std::uint8_t(x * y * 7), std::uint8_t(x * x + 3 * y), 9, 255});
    const std::string text = drawTerminalPicture(image, makeTerminal(100, 12));
    EXPECT_THAT(text, StartsWith("\033_Ga=T,f=100,c=40,m=1;"));  // 10 rows
    EXPECT_THAT(text, EndsWith("\033\\\n"));
    std::string base64;
    for (size_t begin = 0; (begin = text.find("\033_G", begin)) != std::string::npos;) {
        const size_t data = text.find(';', begin) + 1, end = text.find("\033\\", data);
        EXPECT_LE(end - data, 4096u);
        const bool isLast = text.find("\033_G", end) == std::string::npos;
        EXPECT_EQ(text.substr(data - 4, 4), isLast ? "m=0;" : "m=1;");
        base64 += text.substr(data, end - data);
        begin = end;
    }
    const std::vector<std::uint8_t> png = image.encodePng();
    EXPECT_EQ(base64, encodeBase64(png.data(), png.size()));
    EXPECT_THAT(drawTerminalPicture(image, makeTerminal(30, 40)), HasSubstr(",c=30,"));
}

TEST(TextTable, NumbersStandToTheRightAndTextToTheLeft) {
    TextTable table({"name", "value"});
    table.add({"a", "1"});
    table.add({"longer", "-20.5"});
    EXPECT_EQ(table.format(), "name    value\na           1\nlonger  -20.5\n");
    EXPECT_EQ(formatValues({1, -0.0, 0.5}, "m"), "[1, 0, 0.5] m");
    EXPECT_EQ(formatValues({1e-7}, ""), "1e-07");
}

}  // namespace
}  // namespace cli
}  // namespace simflex
