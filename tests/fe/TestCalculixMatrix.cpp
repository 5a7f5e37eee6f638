#include <gmock/gmock.h>

#include <numeric>
#include <random>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/calculix/CalculixMatrix.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class CalculixMatrixTest : public ::testing::Test {
protected:
    SymmetricMatrix read(const std::string& text, const std::vector<int>& dofs) {
        testing::writeText(folder / "part.sti", text);
        return readCalculixMatrix(folder / "part.sti", dofs, "reading K", {});
    }

    std::string errorOf(const std::string& text) {
        try {
            read(text, {0, 1, 2});
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    testing::TestFolder folder;
};

TEST_F(CalculixMatrixTest, EntriesComeInTheOrderOfTheDegreesOfFreedom) {
    const SymmetricMatrix A = read(
        "1 1  1.0E+00\n1 2  2.5e+00\n2 2 -3.0e+00\n1 3  0.0000e+00\n3 3  0.0e+00\n\n", {2, 0, 1});
    EXPECT_EQ(A.size, 3);
    EXPECT_THAT(A.columnStarts, ElementsAre(0, 2, 3, 4));
    EXPECT_THAT(A.rows, ElementsAre(0, 2, 1, 2));
    EXPECT_THAT(A.values, ElementsAre(-3, 2.5, 0, 1));
}

TEST_F(CalculixMatrixTest, EntriesGivenTwiceAreAdded) {
    const SymmetricMatrix A = read("1 1 1\n2 1 3\n1 2 4\n2 2 5\n1 1 0.5\n", {0, 1});
    EXPECT_THAT(A.rows, ElementsAre(0, 1, 1));
    EXPECT_THAT(A.values, ElementsAre(1.5, 7, 5));
}

TEST_F(CalculixMatrixTest, FilesLongerThanTheBufferAreWhole) {
    std::mt19937 generator(1);
    const int n = 4000;
    std::vector<int> dofs(n);
    std::iota(dofs.begin(), dofs.end(), 0);
    std::shuffle(dofs.begin(), dofs.end(), generator);
    std::vector<std::int32_t> rows, columns;
    std::vector<double> values;
    std::ostringstream text;
    text.precision(17);
    for (int column = 1; column <= n; ++column)
        for (int k = 0; k < 60; ++k) {
            const int row = k ? std::max(1, column - 7 * k) : column;
            const double value = double(generator()) / 1e3;
            text << row << ' ' << column << "  " << value << '\n';
            rows.push_back(dofs[size_t(row - 1)]);
            columns.push_back(dofs[size_t(column - 1)]);
            values.push_back(value);
        }
    ASSERT_GT(text.str().size(), size_t(5) << 20);
    const SymmetricMatrix A = read(text.str(), dofs);
    const SymmetricMatrix expected = SymmetricMatrix::fromEntries(n, rows, columns, values);
    EXPECT_EQ(A.columnStarts, expected.columnStarts);
    EXPECT_EQ(A.rows, expected.rows);
    ASSERT_EQ(A.values.size(), expected.values.size());
    for (size_t k = 0; k < A.values.size(); ++k)
        ASSERT_NEAR(A.values[k], expected.values[k], 1e-14 * std::abs(expected.values[k]));
}

TEST_F(CalculixMatrixTest, BadLinesAreNamed) {
    EXPECT_THAT(errorOf("1 1 1\n2 x 3\n"), AllOf(HasSubstr("part.sti"), HasSubstr("line 2")));
    EXPECT_THAT(errorOf("1 1 1\n2 2 1.0+300\n"), HasSubstr("line 2"));
    EXPECT_THAT(errorOf("1 1 1\n2 2\n"), HasSubstr("line 2"));
    EXPECT_THAT(errorOf("1 4 1\n"), HasSubstr("outside"));
    EXPECT_THAT(errorOf("0 1 1\n"), HasSubstr("outside"));
    EXPECT_THAT(errorOf("1 1 1\n1 2 inf\n"), AllOf(HasSubstr("inf"), HasSubstr("row 1, column 2")));
    EXPECT_EQ(errorOf("1 1 1\n2 2 1\n3 3 1.2"), "part.sti is cut off, line 2");
    EXPECT_EQ(errorOf("1 1 1\n2 1 1\n2 2 1\n3 2 1\n"),
              "part.sti has no diagonal entry of equation 3: is it cut off?");
    EXPECT_THAT(errorOf(std::string(2000, '1')), HasSubstr("part.sti"));
    EXPECT_THROW(readCalculixMatrix(folder / "none.sti", {0}, "reading K", {}), std::runtime_error);
}

}  // namespace
}  // namespace simflex
