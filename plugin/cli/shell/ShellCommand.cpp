/** @file
simflex shell: an interactive prompt, or commands from a file, a pipe or the command line. **/

#include <unistd.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>

#include "simflex/base/InputFile.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/shell/Shell.h"

namespace simflex {
namespace cli {
namespace {

struct ShellArguments {
    std::string model, script, commands;
    std::vector<std::string> settings;
    ShellOptions options;
};

/** Exits with the status of a script that continued after errors. **/
void leave(int status) {
    if (status) throw CLI::RuntimeError(status);
}

void runShell(const ShellArguments& arguments) {
    std::ifstream file;
    const bool readsInput = arguments.script == "/dev/stdin";
    if (!arguments.script.empty() && !readsInput) {
        file = openInputFile(arguments.script);
        if (!file.is_open()) throw std::runtime_error("'" + arguments.script + "' cannot be read");
    }
    if (arguments.model.empty() && !arguments.settings.empty())
        throw CLI::ValidationError("--set", "needs a model");

    Shell shell(arguments.options);
    const bool hasScript = !arguments.script.empty() || !arguments.commands.empty();
    const bool isPrompt = !hasScript && isatty(STDIN_FILENO) && isatty(STDOUT_FILENO);
    if (!arguments.model.empty()) {
        shell.open(loadModelText(arguments.model, arguments.settings));
        if (isPrompt) shell.printSummary();
    }
    if (isPrompt) {
        if (!arguments.options.isQuiet)
            writeOut("'help' lists the commands; the Tab key completes words.\n");
        return leave(shell.runPrompt());
    }
    int status = 0;
    if (!arguments.commands.empty()) {
        std::istringstream commands(arguments.commands);
        status = shell.runScript(commands, "--command");
    }
    if (!arguments.script.empty() && !shell.isOver())
        status |= shell.runScript(readsInput ? std::cin : file, arguments.script);
    if (!hasScript) status = shell.runScript(std::cin, "standard input");
    leave(status);
}

}  // namespace

void addShellCommand(CLI::App& app) {
    auto arguments = std::make_shared<ShellArguments>();
    CLI::App* command =
        app.add_subcommand("shell", "Move, inspect and change a model step by step at a prompt");
    command->add_option("MODEL", arguments->model, "Model file (YAML); or 'open' one later");
    command->add_option("-c,--command", arguments->commands,
                        "Run these commands, separated by ';', and exit");
    command
        ->add_option(
            "--script", arguments->script,
            "Run the commands of a file and exit; standard input is read if it is no terminal")
        ->type_name("FILE");
    ShellOptions& options = arguments->options;
    command->add_flag_callback(
        "--keep-going", [&options] { options.onError = ShellOptions::OnError::GoOn; },
        "Continue a script after an error; the exit status is 1 all the same");
    addSettings(*command, arguments->settings);
    command->add_flag_callback(
        "--rigid", [&options] { options.model.bodies = ModelOptions::Bodies::Rigid; },
        "Hold every flexible body rigid");
    addCodeOptions(*command, options.model.code);
    addQuietFlag(*command, options.isQuiet, "warnings and results");
    command->callback([arguments] { runShell(*arguments); });
}

}  // namespace cli
}  // namespace simflex
