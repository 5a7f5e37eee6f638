/** @file
simflex post: probes and pictures of a finished run. **/

#include <cstdio>
#include <memory>
#include <optional>

#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/cli/ProgressBar.h"
#include "simflex/model/analyses/PostRun.h"

namespace simflex {
namespace cli {
namespace {

struct PostArguments {
    std::string results, model;
    std::vector<std::string> settings;
    model::PostOptions options;
    bool isQuiet = false;
};

void runPost(PostArguments& arguments) {
    model::PostOptions& options = arguments.options;
    options.listener = makeListener(arguments.isQuiet);
    options.resumeCommand = "simflex post " + arguments.results;
    std::optional<ModelText> text;
    if (!arguments.model.empty()) text = loadModelText(arguments.model);
    const std::string output =
        model::postProcess(arguments.results, text ? &*text : nullptr, arguments.settings, options);
    ProgressBar::clearLine();
    for (const Results::Analysis& analysis : readResults(output, ReadStates::No).analyses) {
        const std::string& name = analysis.name;
        if (analysis.type == "transient")
            writeOut("%s: %zu rows, %zu probes\n", name.c_str(), analysis.time.size(),
                     analysis.probes.size());
        else if (analysis.type == "static")
            writeOut("%s: %zu probes at rest%s\n", name.c_str(), analysis.probes.size(),
                     analysis.hasPath() ? ", along a path" : "");
        else
            writeOut("%s: as it was\n", name.c_str());
    }
    writeOut("results: %s\n", output.c_str());
}

}  // namespace

void addPostCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "post",
        "Evaluate other probes and draw other pictures of a finished run, from the states it kept");
    auto arguments = std::make_shared<PostArguments>();
    model::PostOptions* options = &arguments->options;
    command->add_option("results", arguments->results, "Result file of the run")
        ->required()
        ->check(CLI::ExistingFile)
        ->type_name("RESULTS.h5");
    command
        ->add_option("model", arguments->model,
                     "Model file with new probes and pictures (default: the model as it was run)")
        ->check(CLI::ExistingFile)
        ->type_name("MODEL.yaml");
    command
        ->add_option("-o,--output", options->output,
                     "Result file to write (default: RESULTS.post.h5)")
        ->type_name("FILE");
    addSettings(*command, arguments->settings,
                "Change the value of a key of probes or pictures, for example "
                "pictures.contour=von_mises");
    addAnalyses(*command, options->only, "Evaluate");
    command
        ->add_option("--vtk", options->vtk,
                     "Write the flexible bodies at each row for ParaView: this list, and files in "
                     "a folder beside it")
        ->type_name("FILE.pvd");
    addOutputs(*command, *options);
    addScriptsFlag(*command, options->code.scripts);
    addQuietFlag(*command, arguments->isQuiet, "warnings and results");
    command->callback([arguments] { runPost(*arguments); });
}

}  // namespace cli
}  // namespace simflex
