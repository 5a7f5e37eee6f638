/** @file
CalculiX that fails half way: what is said, and that nothing is left behind. **/

#include <gmock/gmock.h>

#include <filesystem>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"

namespace simflex {
namespace {

using ::testing::IsEmpty;
using ::testing::MatchesRegex;
using ::testing::StartsWith;

class CalculixRunTest : public ::testing::Test {
protected:
    CalculixRunTest() {
        testing::Brick brick;
        brick.elements = {2, 1, 1};
        testing::writeText(folder / "deck.inp", brick.text());
    }

    /** What is said if this runs after CalculiX has written its files. **/
    std::string errorAfter(const std::string& commands) {
        const std::string program = folder / "my-ccx";
        testing::writeText(program,
                           "#!/bin/sh\nccx \"$@\"\n[ -f part.sti ] || exit 0\n" + commands + "\n");
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        CalculixOptions options;
        options.program = program;
        std::string message = "accepted";
        try {
            readCalculixDeck(folder / "deck.inp", options);
        } catch (const std::exception& error) {
            message = error.what();
        }
        EXPECT_THAT(folder.listTemporaryFiles(), IsEmpty());
        return message.compare(0, folder.path().size(), folder.path()) == 0
                   ? message.substr(folder.path().size() + 1)
                   : message;
    }

    testing::TestFolder folder;
};

TEST_F(CalculixRunTest, ThatEndsWellIsRead) {
    EXPECT_EQ(errorAfter("true"), "accepted");
}

TEST_F(CalculixRunTest, ThatIsKilledIsTold) {
    EXPECT_THAT(errorAfter("kill -9 $$"),
                StartsWith("deck.inp: CalculiX was ended by signal 9 (Killed); is memory short?, "
                           "and wrote no *ERROR line; the end of its output:\n"));
    EXPECT_THAT(errorAfter("kill -11 $$"),
                StartsWith("deck.inp: CalculiX was ended by signal 11 (Segmentation fault), and "
                           "wrote no *ERROR line; the end of its output:\n"));
}

TEST_F(CalculixRunTest, ThatFailsIsToldWithTheEndOfItsOutput) {
    EXPECT_THAT(
        errorAfter("echo 'no space left' >&2; exit 3"),
        MatchesRegex("deck.inp: CalculiX refused the deck \\(exit status 3\\), and wrote no "
                     "\\*ERROR line; the end of its output:\n(.*\n)*    no space left"));
}

/** As a full disk leaves them. **/
TEST_F(CalculixRunTest, FilesThatAreCutOffAreRefused) {
    EXPECT_THAT(errorAfter("head -c -3 part.sti > a; mv a part.sti"),
                MatchesRegex("deck.inp: part.sti is cut off, line [0-9]+"));
    EXPECT_THAT(errorAfter("head -n -3 part.mas > a; mv a part.mas"),
                MatchesRegex("deck.inp: part.mas has no diagonal entry of equation [0-9]+: is it "
                             "cut off\\?"));
    EXPECT_THAT(errorAfter("head -c 100 part.dof > a; mv a part.dof"),
                MatchesRegex("deck.inp: CalculiX left out .*"));
    EXPECT_EQ(errorAfter("rm part.sti"), "deck.inp: CalculiX did not write part.sti");
}

}  // namespace
}  // namespace simflex
