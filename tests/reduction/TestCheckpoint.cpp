#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/Checkpoint.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;
using ::testing::StartsWith;
using testing::TestFolder;

class CheckpointTest : public ::testing::Test {
protected:
    CheckpointTest() : checkpoint(kept(), 0, [this](const std::string& n) { notes.push_back(n); }) {
        testing::writeText(folder / "brick.inp", testing::Brick().text());
    }

    std::string kept() const { return folder / "brick.h5.resume"; }

    /** Reads and reduces the deck; stops at the start of `phase`. **/
    ReducedBody run(const ReductionCheckpoint* keep, const std::string& stopAt = "",
                    int numModes = 24) {
        phases.clear();
        notes.clear();
        const ProgressCallback progress = [&](const std::string& phase, double) {
            if (phases.empty() || phases.back() != phase) phases.push_back(phase);
            return phase != stopAt;
        };
        CalculixOptions calculix;
        calculix.checkpoint = keep;
        calculix.progress = progress;
        ReductionOptions options;
        options.name = "brick";
        options.interfaces = {{"left", "LEFT"}, {"right", "RIGHT"}};
        options.numModes = numModes;
        options.checkpoint = keep;
        return reduce(readCalculixDeck(folder / "brick.inp", calculix), options, progress);
    }

    static void expectSame(const ReducedBody& a, const ReducedBody& b) {
        EXPECT_EQ(a.omegaSquared, b.omegaSquared);
        EXPECT_EQ(a.Phi, b.Phi);
        EXPECT_EQ(a.I1, b.I1);
        EXPECT_EQ(a.N, b.N);
    }

    TestFolder folder;
    std::vector<std::string> phases, notes;
    ReductionCheckpoint checkpoint;
};

TEST_F(CheckpointTest, ResumedAfterEachPhaseTheReductionHasTheSameBits) {
    const ReducedBody whole = run(nullptr);
    const std::vector<std::string> all = phases;
    ASSERT_THAT(all, Contains("normal modes"));
    for (const std::string& phase : all) {
        EXPECT_THROW(run(&checkpoint, phase), Cancelled) << phase;
        const bool isKept = fs::exists(kept());
        const ReducedBody resumed = run(&checkpoint);
        EXPECT_EQ(notes.empty(), !isKept) << phase;
        expectSame(resumed, whole);
        checkpoint.remove();
        EXPECT_FALSE(fs::exists(kept()));
    }
}

TEST_F(CheckpointTest, WhatIsKeptIsNotDoneAgain) {
    EXPECT_THROW(run(&checkpoint, "orthonormal modes"), Cancelled);
    EXPECT_THAT(testing::listFiles(kept()),
                ElementsAre("constraint modes", "factor", "matrices", "normal modes"));
    run(&checkpoint);
    EXPECT_THAT(notes, AllOf(SizeIs(4), Each(StartsWith("resumed from"))));
    EXPECT_THAT(phases, Not(Contains("CalculiX assembles K and M")));
    EXPECT_THAT(phases, Not(Contains("factoring K")));
}

TEST_F(CheckpointTest, OtherDecksAndOptionsAreNotResumed) {
    run(&checkpoint);
    const ReducedBody more = run(&checkpoint, "", 30);
    EXPECT_THAT(notes, Contains(HasSubstr("normal modes is of another part or other options")));
    expectSame(more, run(nullptr, "", 30));

    testing::Brick stiffer;
    stiffer.E *= 2;
    testing::writeText(folder / "brick.inp", stiffer.text());
    const ReducedBody resumed = run(&checkpoint);
    EXPECT_THAT(notes, Contains(HasSubstr("matrices is of another part")));
    expectSame(resumed, run(nullptr));
}

TEST_F(CheckpointTest, DamagedFilesAreNotResumed) {
    const ReducedBody whole = run(nullptr);
    for (const char* name : {"matrices", "factor", "constraint modes", "normal modes"})
        for (const bool cut : {true, false}) {
            run(&checkpoint);
            const std::string path = kept() + "/" + name;
            const auto size = fs::file_size(path);
            if (cut) {
                fs::resize_file(path, size / 2);
            } else {
                std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
                file.seekp(std::streamoff(size - size / 3));
                file.put(char(0x5a));
                file.put(char(0xa5));
            }
            expectSame(run(&checkpoint), whole);
            EXPECT_THAT(notes, Contains(HasSubstr(std::string(name) + " is damaged"))) << cut;
            checkpoint.remove();
        }
}

TEST_F(CheckpointTest, ShortPhasesAreNotKept) {
    const ReductionCheckpoint patient(kept(), 1000);
    run(&patient);
    EXPECT_FALSE(fs::exists(kept()));
}

TEST_F(CheckpointTest, AFolderThatCannotBeWrittenIsNoted) {
    testing::writeText(kept(), "a file in the way");
    const ReducedBody body = run(&checkpoint);
    EXPECT_THAT(notes, Contains(HasSubstr("cannot keep")));
    expectSame(body, run(nullptr));
}

}  // namespace
}  // namespace simflex
