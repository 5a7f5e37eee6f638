#pragma once
/** @file
The commands of the prompt: one table for running, completion and help. **/

#include <functional>
#include <string>
#include <vector>

#include "simflex/cli/shell/CommandText.h"

namespace simflex {
namespace cli {

class Shell;

/** Returns the possible next arguments after `before`; all, or those that begin with `word`. **/
using Completer = std::function<std::vector<std::string>(const Shell& shell, const Words& before,
                                                         const std::string& word)>;

struct Command {
    std::string group;  ///< heading in the help
    std::string name;
    std::string arguments;  ///< as in "PATH VALUE"
    std::string summary;    ///< one sentence
    std::string details;    ///< further sentences for `help COMMAND`
    int fewestArguments = 0, mostArguments = 0;
    std::function<void(Shell& shell, const Words& arguments)> run;
    Completer complete = {};  ///< empty: no completion
};

/** Returns all commands, group by group. **/
const std::vector<Command>& getCommands();
/** @throws std::invalid_argument suggesting the nearest command. **/
const Command& findCommand(const std::string& name);

/** Formats a short list of all commands by group, or the help of one. **/
std::string formatHelp();
std::string formatHelp(const Command& command);
/** Formats tables for the user's guide. **/
std::string formatMarkdownHelp();

/** @name Command groups, each in its own file **/
/**@{**/
void addMotionCommands(std::vector<Command>& commands);   ///< run, step, reset …
void addStateCommands(std::vector<Command>& commands);    ///< get, set, drag …
void addListCommands(std::vector<Command>& commands);     ///< list, probe, energy, eigen
void addPictureCommands(std::vector<Command>& commands);  ///< show, save, plot, camera …
void addGeneralCommands(std::vector<Command>& commands);  ///< open, source, help, quit …
/**@}**/

/** Returns files and folders that begin with `begin`; folders end with a slash.
@param suffixes  file suffixes including the dot; empty: all **/
std::vector<std::string> completePath(const std::string& begin,
                                      const std::vector<std::string>& suffixes = {});
/** Returns a completer that completes a first argument this way. **/
Completer completeFile(const std::vector<std::string>& suffixes = {});

}  // namespace cli
}  // namespace simflex
