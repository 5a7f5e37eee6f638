/** @file
simflex fmu: a model as an FMU, for other simulators. **/

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
    std::printf("  %-11s %s\n", what, list.empty() ? "none" : list.c_str());
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
    std::printf("%s: FMI %d.0 for co-simulation, %s\n", output.c_str(), options.version,
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
    CLI::App* command = app.add_subcommand(
        "fmu",
        "Write a model as an FMU, which other simulators run: its parameters, inputs, probes");
    auto arguments = std::make_shared<FmuArguments>();
    FmuExportOptions* options = &arguments->options;
    command->add_option("model", arguments->model, "The model (YAML)")
        ->required()
        ->check(CLI::ExistingFile)
        ->type_name("MODEL.yaml");
    command->add_option("-o,--output", arguments->output, "The unit (default: MODEL.fmu here)")
        ->type_name("FILE.fmu");
    command
        ->add_option("--fmi", options->version,
                     "Version of FMI: 2 (default; what most programs read) or 3")
        ->check(CLI::IsMember({2, 3}))
        ->type_name("N");
    command->add_flag("--thin", options->isThin,
                      "Without a copy of simflex's libraries: it needs simflex where it runs");
    addRepeated(*command, "--set", arguments->settings,
                "Another value for a key of the model, as solver.accuracy=1e-5", "PATH=VALUE");
    addScriptsFlag(*command, options->allowsScripts);
    command->add_flag("-q,--quiet", arguments->isQuiet, "No progress and notes");
    command->callback([arguments] { perform(*arguments); });
}

}  // namespace cli
}  // namespace simflex
