/** @file
simflex report: a run as a single page for a browser. **/

#include <cstdio>
#include <memory>

#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/model/Results.h"
#include "simflex/model/report/Report.h"

namespace simflex {
namespace cli {
namespace {

struct ReportArguments {
    std::string results, page;
    RunOptions options;
    bool isQuiet = false;
};

void report(ReportArguments& arguments) {
    arguments.options.listener = makeListener(arguments.isQuiet);
    const std::string page =
        !arguments.page.empty() ? arguments.page : makePathBeside(arguments.results, ".html");
    const std::string content = model::writeReport(arguments.results, page, arguments.options);
    ProgressBar::clearLine();
    writeOut("report: %s, %s\n", page.c_str(), content.c_str());
}

}  // namespace

void addReportCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "report",
        "Write a run as one page for a browser: motion, curves and tables, without a network");
    auto arguments = std::make_shared<ReportArguments>();
    command->add_option("results", arguments->results, "Result file of the run")
        ->required()
        ->check(CLI::ExistingFile)
        ->type_name("RESULTS.h5");
    command->add_option("-o,--output", arguments->page, "Page to write (default: RESULTS.html)")
        ->type_name("FILE.html");
    addAnalyses(*command, arguments->options.only, "Report");
    addScriptsFlag(*command, arguments->options.code.scripts);
    addQuietFlag(*command, arguments->isQuiet, "warnings and results");
    command->callback([arguments] { report(*arguments); });
}

}  // namespace cli
}  // namespace simflex
