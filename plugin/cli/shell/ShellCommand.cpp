/** @file
simflex shell: a model at a prompt, or commands from a file, a pipe or the command line. **/

#include <unistd.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <sstream>

#include "simflex/cli/Commands.h"
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

/** Leaves with the status of a script that went on after errors. **/
void leave(int status) {
    if (status) throw CLI::RuntimeError(status);
}

void runShell(const ShellArguments& arguments) {
    std::ifstream script;
    if (!arguments.script.empty()) {
        script.open(arguments.script);
        if (!script) throw std::runtime_error("'" + arguments.script + "' cannot be read");
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
            std::printf("'help' lists the commands; the Tab key completes words.\n");
        return leave(shell.runPrompt());
    }
    int status = 0;
    if (!arguments.commands.empty()) {
        std::istringstream commands(arguments.commands);
        status = shell.runScript(commands, "--command");
    }
    if (!arguments.script.empty() && !shell.isOver())
        status |= shell.runScript(script, arguments.script);
    if (!hasScript) status = shell.runScript(std::cin, "standard input");
    leave(status);
}

}  // namespace

void addShellCommand(CLI::App& app) {
    auto arguments = std::make_shared<ShellArguments>();
    CLI::App* command = app.add_subcommand(
        "shell", "Move a model step by step, look at it and change it at a prompt");
    command->add_option("MODEL", arguments->model, "model file (.yaml); or 'open' one later");
    command->add_option("-c,--command", arguments->commands,
                        "run these commands, separated by ';', and leave");
    command
        ->add_option("--script", arguments->script,
                     "run the commands of a file and leave; standard input is read if it is no "
                     "terminal")
        ->type_name("FILE");
    ShellOptions& options = arguments->options;
    command->add_flag_callback(
        "--keep-going", [&options] { options.onError = ShellOptions::OnError::GoOn; },
        "of scripts: go on after an error; the exit status is 1 all the same");
    addRepeated(*command, "--set", arguments->settings,
                "change a value of the model file for this run", "PATH=VALUE");
    command->add_flag_callback(
        "--rigid", [&options] { options.model.bodies = ModelOptions::Bodies::Rigid; },
        "every flexible body is held rigid");
    addScriptsFlag(*command, options.model.allowsScripts);
    command->add_flag("-q,--quiet", options.isQuiet, "no notes and no progress");
    command->callback([arguments] { runShell(*arguments); });
}

}  // namespace cli
}  // namespace simflex
