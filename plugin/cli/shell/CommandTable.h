#pragma once
/** @file
The commands of the prompt: one table, from which they are run, completed and explained. **/

#include <functional>
#include <string>
#include <vector>

#include "simflex/cli/shell/CommandText.h"

namespace simflex {
namespace cli {

class Shell;

/** What may stand after these arguments; all of it, or what begins like `word`. **/
using Completer = std::function<std::vector<std::string>(const Shell& shell, const Words& before,
                                                         const std::string& word)>;

struct Command {
    std::string group;  ///< heading in the help
    std::string name;
    std::string arguments;  ///< as in "PATH VALUE"
    std::string summary;    ///< one sentence
    std::string details;    ///< more of them, for `help COMMAND`
    int fewestArguments = 0, mostArguments = 0;
    std::function<void(Shell& shell, const Words& arguments)> run;
    Completer complete = {};  ///< empty: nothing is known
};

/** All, group by group. **/
const std::vector<Command>& getCommands();
/** @throws std::invalid_argument that proposes the nearest. **/
const Command& findCommand(const std::string& name);

/** All commands in a few lines each group, or one of them. **/
std::string formatHelp();
std::string formatHelp(const Command& command);
/** Tables for the user's guide. **/
std::string formatMarkdownHelp();

/** @name The groups, in files of their own **/
/**@{**/
void addMotionCommands(std::vector<Command>& commands);   ///< run, step, reset …
void addStateCommands(std::vector<Command>& commands);    ///< get, set, drag …
void addListCommands(std::vector<Command>& commands);     ///< list, probe, energy, eigen
void addPictureCommands(std::vector<Command>& commands);  ///< show, save, plot, camera …
void addGeneralCommands(std::vector<Command>& commands);  ///< open, source, help, quit …
/**@}**/

/** Files and folders that begin like this; folders end with a slash.
@param suffixes  of files wanted, with their dots; empty: all **/
std::vector<std::string> completePath(const std::string& begin,
                                      const std::vector<std::string>& suffixes = {});
/** Completes a first argument so. **/
Completer completeFile(const std::vector<std::string>& suffixes = {});

}  // namespace cli
}  // namespace simflex
