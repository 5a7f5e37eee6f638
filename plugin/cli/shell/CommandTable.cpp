#include "simflex/cli/shell/CommandTable.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "simflex/base/AsciiText.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace cli {

using namespace model;

namespace fs = std::filesystem;

namespace {

std::string padRight(const std::string& text, size_t width) {
    return text + std::string(width > text.size() ? width - text.size() : 0, ' ');
}

std::string formatUsage(const Command& command) {
    return command.arguments.empty() ? command.name : command.name + ' ' + command.arguments;
}

std::string escapeForTable(const std::string& text) {
    std::string escaped;
    for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
    return escaped;
}

}  // namespace

const std::vector<Command>& getCommands() {
    static const std::vector<Command> commands = [] {
        std::vector<Command> all;
        addMotionCommands(all);
        addStateCommands(all);
        addListCommands(all);
        addPictureCommands(all);
        addGeneralCommands(all);
        return all;
    }();
    return commands;
}

const Command& findCommand(const std::string& name) {
    if (const Command* command = seekNamed(getCommands(), name)) return *command;
    const std::string proposal = proposeName(name, getNames(getCommands()));
    throw std::invalid_argument("there is no command '" + name + "'; " +
                                (proposal.empty() ? "'help' lists all" : proposal));
}

std::string formatHelp() {
    size_t width = 0;
    for (const Command& command : getCommands())
        width = std::max(width, formatUsage(command).size());
    width = std::min<size_t>(width, 26);
    std::string text, group;
    for (const Command& command : getCommands()) {
        if (command.group != group) {
            text += (group.empty() ? "" : "\n") + command.group + "\n";
            group = command.group;
        }
        const std::string usage = formatUsage(command);
        text += usage.size() <= width ? "  " + padRight(usage, width + 2)
                                      : "  " + usage + "\n" + std::string(width + 4, ' ');
        text += command.summary + "\n";
    }
    return text +
           "\n"
           "'help COMMAND' explains one. Numbers may be expressions: 30*deg, L/2. Commands may "
           "share a\n"
           "line, separated by ';'; '#' starts a comment.\n";
}

std::string formatHelp(const Command& command) {
    std::string text = formatUsage(command) + "\n  " + command.summary + "\n";
    for (const std::string& line : splitAt(command.details, '\n'))
        if (!line.empty()) text += "  " + line + "\n";
    return text;
}

std::string formatMarkdownHelp() {
    std::string text, group;
    for (const Command& command : getCommands()) {
        if (command.group != group) {
            text += (group.empty() ? "" : "\n") + std::string("**") + command.group + "**\n\n" +
                    "| command | what it does |\n|---|---|\n";
            group = command.group;
        }
        std::string details = command.details;
        std::replace(details.begin(), details.end(), '\n', ' ');
        text += "| `" + escapeForTable(formatUsage(command)) + "` | " +
                escapeForTable(command.summary) +
                (details.empty() ? "" : ". " + escapeForTable(details)) + " |\n";
    }
    return text;
}

std::vector<std::string> completePath(const std::string& begin,
                                      const std::vector<std::string>& suffixes) {
    const size_t slash = begin.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : begin.substr(0, slash + 1);
    const std::string name = begin.substr(folder.size());
    std::vector<std::string> found;
    std::error_code error;
    for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end;
         !error && entry != end; entry.increment(error)) {
        const std::string file = entry->path().filename().string();
        if (file.compare(0, name.size(), name) != 0) continue;
        if (name.empty() && file[0] == '.') continue;
        std::error_code ignored;
        const bool isFolder = entry->is_directory(ignored);
        const std::string suffix = entry->path().extension().string();
        if (!isFolder && !suffixes.empty() &&
            std::find(suffixes.begin(), suffixes.end(), suffix) == suffixes.end())
            continue;
        found.push_back(folder + file + (isFolder ? "/" : ""));
    }
    std::sort(found.begin(), found.end());
    return found;
}

Completer completeFile(const std::vector<std::string>& suffixes) {
    return [suffixes](const Shell&, const Words& before, const std::string& word) {
        return before.empty() ? completePath(word, suffixes) : std::vector<std::string>();
    };
}

}  // namespace cli
}  // namespace simflex
