/** @file
The language of the prompt, and its table of commands. **/

#include <gmock/gmock.h>

#include <cctype>
#include <fstream>
#include <set>

#include "fe/TestDecks.h"
#include "simflex/cli/shell/CommandTable.h"
#include "simflex/cli/shell/CommandText.h"

namespace simflex {
namespace cli {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(CommandText, SemicolonsSeparateCommandsAndBlanksWords) {
    EXPECT_THAT(splitCommands(" run 1;;  get\ttime ; "),
                ElementsAre(Words{"run", "1"}, Words{"get", "time"}));
    EXPECT_THAT(splitCommands(""), IsEmpty());
    EXPECT_THAT(splitCommands(" ; ;"), IsEmpty());
    EXPECT_THAT(splitCommands("run 1\r"), ElementsAre(Words{"run", "1"}));
}

TEST(CommandText, HashBeginsACommentOnlyWhereAWordBegins) {
    EXPECT_THAT(splitCommands("run 1 # then; stop"), ElementsAre(Words{"run", "1"}));
    EXPECT_THAT(splitCommands("# nothing"), IsEmpty());
    EXPECT_THAT(splitCommands("save a#b.png"), ElementsAre(Words{"save", "a#b.png"}));
    EXPECT_THAT(splitCommands("set color '#ff0000'"),
                ElementsAre(Words{"set", "color", "#ff0000"}));
}

TEST(CommandText, QuotesAndBracketsKeepBlanksTogether) {
    EXPECT_THAT(splitCommands("set a [0, 0, 1]; set b {x: 1; y: 2}"),
                ElementsAre(Words{"set", "a", "[0, 0, 1]"}, Words{"set", "b", "{x: 1; y: 2}"}));
    EXPECT_THAT(splitCommands("save 'my picture.png'"),
                ElementsAre(Words{"save", "my picture.png"}));
    EXPECT_THAT(splitCommands("set title \"it's\" ''"),
                ElementsAre(Words{"set", "title", "it's", ""}));
    EXPECT_THAT(splitCommands("get max(1, [2, 3])"), ElementsAre(Words{"get", "max(1, [2, 3])"}));
    EXPECT_THROW(splitCommands("save 'my"), std::invalid_argument);
    EXPECT_THROW(splitCommands("set a [1, (2]"), std::invalid_argument);
}

TEST(CommandText, QuotedWordsAreReadBackAsTheyWere) {
    for (const std::string word : {"plain", "with blank", "it's", "a;b", "#c", "[", "{x", ""})
        EXPECT_THAT(splitCommands("save " + quoteWord(word)), ElementsAre(Words{"save", word}));
}

TEST(CommandText, WhatIsBeingTypedIsTheLastCommandsLastWord) {
    const UnfinishedCommand typed = splitUnfinished("run 1; set joint.be");
    EXPECT_THAT(typed.words, ElementsAre("set"));
    EXPECT_EQ(typed.word, "joint.be");
    EXPECT_EQ(splitUnfinished("save 'my pic").word, "my pic");
    EXPECT_EQ(splitUnfinished("save 'my pic").quote, '\'');
    EXPECT_EQ(splitUnfinished("run ").word, "");
    EXPECT_TRUE(splitUnfinished("run 1 # co").isComment);
}

TEST(CommandText, ListsAreDividedAtTheirOwnCommas) {
    EXPECT_THAT(splitList("[1, max(2, 3), [4, 5]]"), ElementsAre("1", "max(2, 3)", "[4, 5]"));
    EXPECT_THAT(splitList("30*deg"), ElementsAre("30*deg"));
}

TEST(CommandTable, EveryCommandIsNamedOnceAndExplained) {
    std::set<std::string> names;
    for (const Command& command : getCommands()) {
        EXPECT_TRUE(names.insert(command.name).second) << command.name;
        EXPECT_FALSE(command.summary.empty()) << command.name;
        EXPECT_TRUE(std::isupper(command.summary.front())) << command.name;
        EXPECT_NE(command.summary.back(), '.') << command.name;
        EXPECT_TRUE(command.run) << command.name;
        EXPECT_LE(command.fewestArguments, command.mostArguments) << command.name;
        EXPECT_EQ(command.arguments.empty(), command.mostArguments == 0) << command.name;
        EXPECT_THAT(formatHelp(), HasSubstr("\n  " + command.name));
        EXPECT_THAT(formatMarkdownHelp(), HasSubstr("\n| `" + command.name));
        EXPECT_THAT(formatHelp(command), HasSubstr(command.summary));
    }
}

TEST(CommandTable, UnknownCommandsGetTheNearestProposed) {
    try {
        findCommand("stpe");
        FAIL();
    } catch (const std::invalid_argument& error) {
        EXPECT_STREQ(error.what(), "there is no command 'stpe'; did you mean 'step'?");
    }
}

TEST(CommandTable, PathsAreCompletedWithFoldersAndWantedFiles) {
    const testing::TestFolder folder;
    for (const char* name : {"crank.yaml", "crank.png", "cross.yaml", ".hidden.yaml"})
        std::ofstream(folder / name) << "x";
    EXPECT_THAT(completePath(folder / "cr", {".yaml"}),
                ElementsAre(folder / "crank.yaml", folder / "cross.yaml"));
    EXPECT_THAT(completePath(folder / "crank"),
                ElementsAre(folder / "crank.png", folder / "crank.yaml"));
    EXPECT_THAT(completePath(folder / ".h"), ElementsAre(folder / ".hidden.yaml"));
    const std::string parent = folder.path().substr(0, folder.path().size() - 1);
    EXPECT_THAT(completePath(parent), ::testing::Contains(folder.path() + "/"));
    EXPECT_THAT(completePath("/no/such/folder/x"), IsEmpty());
}

}  // namespace
}  // namespace cli
}  // namespace simflex
