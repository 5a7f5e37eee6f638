// Time histories in CSV and HDF5.

#include "simflex/part/TableFile.h"

#include <gmock/gmock.h>
#include <hdf5.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

class TableFileTest : public ::testing::TestWithParam<const char*> {
protected:
    const testing::TestFolder folder;
    const std::string path = folder / ("run" + std::string(GetParam()));
    const std::vector<TableColumn> columns{{"crank.7.von_mises", "Pa"}, {"odd, \"name\"", "m"}};
};

TEST_P(TableFileTest, IsReadBackBitForBit) {
    std::vector<double> expected;
    {
        TableFile table(path, columns);
        for (int k = 0; k < 1000; ++k) {
            const double row[2] = {1e7 * std::sin(k), std::exp(-double(k))};
            table.append(k * 1e-3, row);
            expected.insert(expected.end(), row, row + 2);
        }
    }
    const Table back = readTable(path);
    ASSERT_EQ(back.columns.size(), 2u);
    EXPECT_EQ(back.columns[1].name, columns[1].name);
    EXPECT_EQ(back.columns[1].unit, "m");
    EXPECT_EQ(back.values, expected);
    ASSERT_EQ(back.times.size(), 1000u);
    EXPECT_EQ(back.times[999], 999 * 1e-3);
    EXPECT_EQ(back.getColumn("crank.7.von_mises")[3], expected[6]);
    EXPECT_THROW(back.getColumn("rod"), std::out_of_range);
}

TEST_P(TableFileTest, WhatWasFlushedStaysIfTheProgramEndsThere) {
    TableFile table(path, columns);
    const double row[2] = {1, 2};
    for (int k = 0; k < 3; ++k) table.append(k, row);
    table.flush();
    // A copy made now equals the file left by a killed program.
    const std::string copy = folder / ("copy" + std::string(GetParam()));
    std::filesystem::copy_file(path, copy);
    EXPECT_EQ(readTable(copy).times, (std::vector<double>{0, 1, 2}));
    table.append(3, row);
    table.flush();
    EXPECT_EQ(readTable(path).times.size(), 4u);
}

TEST_P(TableFileTest, ANewRunReplacesTheFile) {
    const double row[2] = {1, 2};
    for (int run = 0; run < 2; ++run) TableFile(path, columns).append(run, row);
    EXPECT_EQ(readTable(path).times, std::vector<double>{1});
}

TEST_P(TableFileTest, FilesThatCannotBeWrittenOrReadAreNamed) {
    for (const auto& work : {+[](const std::string& p) { TableFile(p, {}); },
                             +[](const std::string& p) { readTable(p); }})
        try {
            work(folder / ("none/run" + std::string(GetParam())));
            FAIL() << "accepted";
        } catch (const std::runtime_error& error) {
            EXPECT_THAT(error.what(), HasSubstr("none/run"));
        }
}

TEST_P(TableFileTest, NumbersThatAreNotFiniteAreKept) {
    {
        const double row[2] = {std::numeric_limits<double>::infinity(), std::nan("")};
        TableFile(path, columns).append(0, row);
    }
    const Table back = readTable(path);
    EXPECT_TRUE(std::isinf(back.values[0]));
    EXPECT_TRUE(std::isnan(back.values[1]));
}

INSTANTIATE_TEST_SUITE_P(Formats, TableFileTest, ::testing::Values(".csv", ".h5"));

TEST(TableFile, OtherEndingsAreRefused) {
    EXPECT_THROW(TableFile("run.txt", {}), std::invalid_argument);
}

TEST(TableFile, ALineBeingWrittenWhenTheProgramEndedIsLeftOut) {
    const testing::TestFolder folder;
    const std::string path = folder / "cut.csv";
    std::ofstream(path) << "time [s],a [m]\n0,1\n1,2\n2,3.5";
    EXPECT_EQ(readTable(path).times, (std::vector<double>{0, 1}));
}

TEST(TableFile, NumbersAreDividedByCommas) {
    const testing::TestFolder folder;
    const std::string path = folder / "other.csv";
    std::ofstream(path) << "time [s],a [m]\n0,1\n1;2\n";
    EXPECT_THROW(readTable(path), std::runtime_error);
}

TEST(TableFile, TimesWithoutValuesAreRefused) {
    const testing::TestFolder folder;
    const std::string path = folder / "short.h5";
    {
        TableFile table(path, {{"a", "m"}});
        for (const double value : {1.0, 2.0, 3.0}) table.append(value, &value);
    }
    {
        const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
        const hid_t values = H5Dopen2(file, "values", H5P_DEFAULT);
        const hsize_t fewer[2] = {2, 1};
        EXPECT_GE(H5Dset_extent(values, fewer), 0);
        H5Dclose(values);
        H5Fclose(file);
    }
    EXPECT_THROW(readTable(path), std::runtime_error);
}

}  // namespace
}  // namespace simflex
