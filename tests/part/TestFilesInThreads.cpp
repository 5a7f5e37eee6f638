// Several threads read and write HDF5 files at once.

#include <gtest/gtest.h>
#include <hdf5.h>

#include <cmath>
#include <thread>

#include "fe/TestDecks.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/part/TableFile.h"
#include "support/PointMassPart.h"

namespace simflex {
namespace {

using testing::TestFolder;

constexpr int kThreads = 6, kTurns = 8;

/** Calls a function with each thread's number, in all threads at once. **/
template <class Function>
void inThreads(const Function& function) {
    std::vector<std::thread> threads;
    for (int k = 0; k < kThreads; ++k) threads.emplace_back(function, k);
    for (std::thread& thread : threads) thread.join();
}

TEST(FilesInThreads, TheLibraryIsBuiltForThem) {
    hbool_t safe = false;
    ASSERT_GE(H5is_library_threadsafe(&safe), 0);
    EXPECT_TRUE(safe);
}

TEST(FilesInThreads, PartsAreWrittenAndReadWithTheBytesOfOneThread) {
    const TestFolder folder;
    std::vector<std::shared_ptr<const ReducedBody>> parts;
    for (int k = 0; k < kThreads; ++k) {
        test::PointMassPartOptions options;
        options.seed = unsigned(k + 1);
        options.numModes = 8 + k;
        parts.push_back(test::makePointMassPart(options).body);
        writeReducedBody(folder / ("alone" + std::to_string(k)), *parts.back());
    }
    std::vector<int> failures(kThreads, 0);
    inThreads([&](int k) {
        const std::string own = folder / ("together" + std::to_string(k));
        for (int turn = 0; turn < kTurns; ++turn) {
            writeReducedBody(own, *parts[size_t(k)]);
            const int other = (k + turn) % kThreads;  // several threads also share a file
            const ReducedBody read = readReducedBody(folder / ("alone" + std::to_string(other)));
            failures[size_t(k)] += read.Phi != parts[size_t(other)]->Phi ||
                                   read.mesh.positions != parts[size_t(other)]->mesh.positions;
            try {
                readReducedBody(folder / "missing");
                ++failures[size_t(k)];
            } catch (const std::runtime_error&) {
            }
        }
    });
    for (int k = 0; k < kThreads; ++k) {
        EXPECT_EQ(failures[size_t(k)], 0) << k;
        EXPECT_EQ(testing::readText(folder / ("together" + std::to_string(k))),
                  testing::readText(folder / ("alone" + std::to_string(k))))
            << k;
    }
}

TEST(FilesInThreads, HistoriesGrowSideBySide) {
    const TestFolder folder;
    const auto path = [&](int k) { return folder / ("run" + std::to_string(k) + ".h5"); };
    inThreads([&](int k) {
        TableFile table(path(k), {{"x", "m"}, {"y", "m"}});
        for (int row = 0; row < 100; ++row) {
            const double values[2] = {std::sin(row + k), double(k)};
            table.append(row * 1e-3, values);
            if (row % 10 == 0) table.flush();
        }
    });
    for (int k = 0; k < kThreads; ++k) {
        const Table table = readTable(path(k));
        ASSERT_EQ(table.times.size(), 100u);
        const std::vector<double> x = table.getColumn("x"), y = table.getColumn("y");
        for (int row = 0; row < 100; ++row) {
            EXPECT_EQ(x[size_t(row)], std::sin(row + k));
            EXPECT_EQ(y[size_t(row)], double(k));
        }
    }
}

}  // namespace
}  // namespace simflex
