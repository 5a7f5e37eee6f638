/** @file
The prompt at a terminal: editing, completion, history, Ctrl-C. **/

#include "Pseudoterminal.h"
#include "ShellTest.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
using testing::Pseudoterminal;
using ::testing::StartsWith;

class PromptTest : public ShellTest {
protected:
    Pseudoterminal start(const std::vector<std::string>& arguments = {},
                         std::map<std::string, std::string> variables = {}) {
        std::vector<std::string> command = {SIMFLEX_PROGRAM, "shell"};
        command.insert(command.end(), arguments.begin(), arguments.end());
        variables.insert({{"TERM", "xterm-256color"},
                          {"LC_ALL", "C.UTF-8"},
                          {"HOME", folder.path()},
                          {"NO_COLOR", ""},
                          {"COLORTERM", ""},
                          {"XDG_STATE_HOME", folder / "state"}});
        return Pseudoterminal(command, folder.path(), variables);
    }
    static constexpr const char* kPrompt = "simflex> ";
};

TEST_F(PromptTest, CommandsAreCompleted) {
    Pseudoterminal terminal = start();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("hel\t--markdown\n");
    EXPECT_TRUE(terminal.waitFor("| command | what it does |")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt));
    terminal.type("s\t\t");  // several: a list
    EXPECT_TRUE(terminal.waitFor("source")) << terminal.getOutput();
    EXPECT_TRUE(terminal.waitFor("static")) << terminal.getOutput();
    terminal.type("\x15quit\n");
    EXPECT_EQ(terminal.waitForEnd(), 0) << terminal.getOutput();
}

TEST_F(PromptTest, NamesOfTheModelAndFilesAreCompleted) {
    writePendulum("probes: {place: {position: rod}}\n");
    Pseudoterminal terminal = start({"model.yaml"});
    ASSERT_TRUE(terminal.waitFor("Pendulum: 1 body, 1 joint, 1 probe")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt));
    terminal.type("drag pi\t0.25\n");
    EXPECT_TRUE(terminal.waitFor("joints.pivot.angle = 0.25 rad")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("get joint.pivot.angle_\t\n");
    EXPECT_TRUE(terminal.waitFor("joints.pivot.angle_rate = ")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("get sol\tacc\t\n");
    EXPECT_TRUE(terminal.waitFor("solver.accuracy = 1e-8")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("probe pl\t\n");
    EXPECT_TRUE(terminal.waitFor("place = [")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("open mo\t\n");
    EXPECT_TRUE(terminal.waitFor("Pendulum: 1 body")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    testing::writeText(folder / "a plan", "get joint.pivot.angle");
    terminal.type("source a\t\n");  // put in quotes
    EXPECT_TRUE(terminal.waitFor("joints.pivot.angle = ")) << terminal.getOutput();
    EXPECT_TRUE(terminal.waitFor(kPrompt));
    terminal.type("\x04");
    EXPECT_EQ(terminal.waitForEnd(), 0);
}

TEST_F(PromptTest, HistoryIsKeptOverSessions) {
    const std::string text = "Exit, as Ctrl-D does";
    {
        Pseudoterminal terminal = start();
        ASSERT_TRUE(terminal.waitFor(kPrompt));
        terminal.type("help quit\n");
        ASSERT_TRUE(terminal.waitFor(text)) << terminal.getOutput();
        ASSERT_TRUE(terminal.waitFor(kPrompt));
        terminal.type("\x10\n");  // the previous line
        EXPECT_TRUE(terminal.waitFor(text)) << terminal.getOutput();
        EXPECT_TRUE(terminal.waitFor(kPrompt));
        terminal.type("\x04");
        EXPECT_EQ(terminal.waitForEnd(), 0);
    }
    EXPECT_THAT(testing::readText(folder / "state/simflex/history"), HasSubstr("quit"));
    Pseudoterminal terminal = start();
    ASSERT_TRUE(terminal.waitFor(kPrompt));
    terminal.type("\x10\n");
    EXPECT_TRUE(terminal.waitFor(text)) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("history\n");
    EXPECT_TRUE(terminal.waitFor("help quit\r\nhistory\r\n")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("quit\n");
    EXPECT_EQ(terminal.waitForEnd(), 0);
}

TEST_F(PromptTest, InterruptClearsTheLineAndErrorsDoNotEndTheSession) {
    Pseudoterminal terminal = start();
    ASSERT_TRUE(terminal.waitFor(kPrompt));
    for (int i = 0; i < 2; ++i) {
        terminal.type("gar");
        ASSERT_TRUE(terminal.waitFor("gar"));
        terminal.type("\x03");
        ASSERT_TRUE(terminal.waitFor("^C")) << terminal.getOutput();
        ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    }
    terminal.type("runn 1\n");
    EXPECT_TRUE(terminal.waitFor("did you mean 'run'?")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("run 1\n");
    EXPECT_TRUE(terminal.waitFor("there is no model yet")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt));
    terminal.type("quit\n");
    EXPECT_EQ(terminal.waitForEnd(), 0) << terminal.getOutput();
}

TEST_F(PromptTest, InterruptStopsARunAndKeepsItsState) {
    writePendulum();
    Pseudoterminal terminal = start({"model.yaml"});
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    for (int i = 0; i < 2; ++i) {  // a second time, too
        terminal.type("drag pivot 1; run for 1e5\n");
        ASSERT_TRUE(terminal.waitFor("] to t = ")) << terminal.getOutput();
        terminal.type("\x03");
        ASSERT_TRUE(terminal.waitFor("stopped; the time is ")) << terminal.getOutput();
        ASSERT_TRUE(terminal.waitFor(kPrompt));
    }
    terminal.type("get time\n");
    ASSERT_TRUE(terminal.waitFor("time = ")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(" s\r\n"));
    const std::string& output = terminal.getOutput();
    const double time = std::stod(output.substr(output.rfind("time = ") + 7));
    EXPECT_GT(time, 0);
    EXPECT_LT(time, 1e5);
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("run for 0.1\n");
    EXPECT_TRUE(terminal.waitFor(" Newton iterations")) << terminal.getOutput();
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("quit\n");
    EXPECT_EQ(terminal.waitForEnd(), 0);
}

TEST_F(PromptTest, ShowSendsAPictureToTheTerminal) {
    writePendulum("pictures: {size: [160, 90]}\n");
    Pseudoterminal terminal = start({"model.yaml"});
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("show; get time\n");
    ASSERT_TRUE(terminal.waitFor("time = 0 s\r\n")) << terminal.getOutput();
    EXPECT_THAT(terminal.getOutput(), HasSubstr("\033_Ga=T,f=100,"));
    ASSERT_TRUE(terminal.waitFor(kPrompt)) << terminal.getOutput();
    terminal.type("quit\n");
    EXPECT_EQ(terminal.waitForEnd(), 0);
}

}  // namespace
}  // namespace simflex
