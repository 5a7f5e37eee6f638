/** @file
simflex fmu: exports a model as an FMU for other simulators. **/

#include <cstdio>
#include <filesystem>
#include <memory>

#include "simflex/base/NumberText.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/fmu/FmuExport.h"
#include "simflex/model/file/NearestName.h"

namespace simflex {
namespace cli {

namespace {

struct FmuArguments {
    std::string model, output;
    std::vector<std::string> settings;
    FmuExportOptions options;
    bool isQuiet = false;
};

void printVariables(const char* what, const std::vector<std::string>& names) {
    std::string list;
    for (const std::string& name : names) list += (list.empty() ? "" : ", ") + name;
    writeOut("  %-11s %s\n", what, list.empty() ? "none" : list.c_str());
}

void perform(const FmuArguments& arguments) {
    FmuExportOptions options = arguments.options;
    options.listener = makeListener(arguments.isQuiet);
    const std::string output = arguments.output.empty()
                                   ? std::filesystem::path(arguments.model).stem().string() + ".fmu"
                                   : arguments.output;
    const FmuExportReport report =
        exportFmu(loadModelText(arguments.model, arguments.settings), output, options);
    ProgressBar::clearLine();
    writeOut("%s: FMI %d.0 for co-simulation, %s\n", output.c_str(), options.version,
             writeFileSize(report.bytes).c_str());
    printVariables("parameters", report.parameters);
    printVariables("inputs", report.inputs);
    printVariables("outputs", report.outputs);
    if (!report.fixed.empty())
        options.listener.tellNote("parts were reduced with the parameters " +
                                  model::joinNames(report.fixed) + ": these are fixed in the unit");
    if (report.inputs.empty())
        options.listener.tellNote("the model has no inputs: what they are, `inputs:` says");
    if (options.isThin)
        options.listener.tellNote("without the libraries: it runs where simflex is installed");
}

}  // namespace

void addFmuCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand("fmu",
                                           "Export a model as an FMU with its parameters, inputs "
                                           "and probes, to run in other simulators");
    auto arguments = std::make_shared<FmuArguments>();
    FmuExportOptions* options = &arguments->options;
    addModelFile(*command, arguments->model);
    command
        ->add_option("-o,--output", arguments->output,
                     "FMU to write (default: MODEL.fmu in the current folder)")
        ->type_name("FILE.fmu");
    command
        ->add_option("--fmi", options->version,
                     "FMI version: 2, which most programs read, or 3 (default: 2)")
        ->check(CLI::IsMember({2, 3}))
        ->type_name("N");
    command->add_flag(
        "--thin", options->isThin,
        "Leave simflex's libraries out: simflex must be installed where the FMU runs");
    addSettings(*command, arguments->settings);
    addCodeOptions(*command, options->code);
    addQuietFlag(*command, arguments->isQuiet, "warnings");
    command->callback([arguments] { perform(*arguments); });
}

}  // namespace cli
}  // namespace simflex
