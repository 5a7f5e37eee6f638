#pragma once
/** @file
The subcommands of the simflex program: one function and one file each. **/

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

namespace simflex {

class ReducedBody;
class StiffnessSolver;

namespace cli {

/** Each function adds its subcommand to `app`, which runs if it is chosen. On failure a subcommand
throws a std::exception, whose text the program prints. **/
/** @param draw  draws a picture of a part's interfaces into a file; null: no option for it **/
void addReduceCommand(CLI::App& app, const std::shared_ptr<StiffnessSolver>& solver = {},
                      const std::function<void(const ReducedBody&, const std::string&)>& draw = {});
void addInfoCommand(CLI::App& app);
void addExportCommand(CLI::App& app);
void addModesCommand(CLI::App& app);
void addRunCommand(CLI::App& app);
void addSchemaCommand(CLI::App& app);
void addKeysCommand(CLI::App& app);
void addPlotCommand(CLI::App& app);
void addPostCommand(CLI::App& app);
void addReportCommand(CLI::App& app);
void addCompareCommand(CLI::App& app);
void addMacCommand(CLI::App& app);
void addFmuCommand(CLI::App& app);
void addSweepCommand(CLI::App& app);
void addCacheCommand(CLI::App& app);
void addShellCommand(CLI::App& app);

}  // namespace cli
}  // namespace simflex
