/** @file
General commands of the prompt: open, source, history, help, quit. **/

#include <algorithm>

#include "simflex/cli/Messages.h"
#include "simflex/cli/shell/Shell.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace cli {
namespace {

using Names = std::vector<std::string>;

void open(Shell& shell, const Words& words) {
    if (!words.empty())
        shell.open(loadModelText(words[0]));
    else
        shell.open(loadModelText(shell.updSession().getText().path,
                                 shell.updSession().getText().settings));
    shell.printSummary();
}

void printHistory(Shell& shell, const Words& words) {
    const Names lines = shell.getHistory();
    const size_t count = words.empty()
                             ? lines.size()
                             : std::min(lines.size(), size_t(shell.calcCount(words[0], 100000)));
    for (size_t i = lines.size() - count; i < lines.size(); ++i) writeOut("%s\n", lines[i].c_str());
}

void help(Shell&, const Words& words) {
    if (words.empty())
        writeOut("%s", formatHelp().c_str());
    else if (words[0] == "--markdown")
        writeOut("%s", formatMarkdownHelp().c_str());
    else
        writeOut("%s", formatHelp(findCommand(words[0])).c_str());
}

}  // namespace

void addGeneralCommands(std::vector<Command>& commands) {
    const std::string group = "The prompt";
    commands.push_back({group, "open", "[MODEL.yaml]",
                        "Open another model; alone: read this one again",
                        "If the file has an error, the present model stays. Values that were set "
                        "are kept when it is read again.",
                        0, 1, open, completeFile({".yaml", ".yml"})});
    commands.push_back({group, "source", "FILE", "Run the commands of a file", "", 1, 1,
                        [](Shell& shell, const Words& words) { shell.runFile(words[0]); },
                        completeFile()});
    commands.push_back({group, "history", "[N]", "Print the lines typed, or the last few", "", 0, 1,
                        printHistory});
    commands.push_back({group, "help", "[COMMAND]", "Explain all commands, or one",
                        "'help --markdown' prints them as tables.", 0, 1, help,
                        [](const Shell&, const Words& before, const std::string&) {
                            return before.empty() ? getNames(getCommands()) : Names{};
                        }});
    commands.push_back({group, "quit", "", "Exit, as Ctrl-D does", "", 0, 0,
                        [](Shell& shell, const Words&) { shell.quit(); }});
}

}  // namespace cli
}  // namespace simflex
