/** @file
simflex post: probes and pictures of a run that is over. **/

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
            std::printf("%s: %zu rows, %zu probes\n", name.c_str(), analysis.time.size(),
                        analysis.probes.size());
        else if (analysis.type == "static")
            std::printf("%s: %zu probes at rest\n", name.c_str(), analysis.probes.size());
        else
            std::printf("%s: as it was\n", name.c_str());
    }
    std::printf("results: %s\n", output.c_str());
}

}  // namespace

void addPostCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "post", "Other probes and pictures of a run that is over, from the states it has kept");
    auto arguments = std::make_shared<PostArguments>();
    model::PostOptions* options = &arguments->options;
    command->add_option("results", arguments->results, "Result file of the run")
        ->required()
        ->check(CLI::ExistingFile)
        ->type_name("RESULTS.h5");
    command
        ->add_option("model", arguments->model,
                     "The model with its new probes and pictures (default: as it was run)")
        ->check(CLI::ExistingFile)
        ->type_name("MODEL.yaml");
    command
        ->add_option("-o,--output", options->output,
                     "Result file with the new probes (default: RESULTS.post.h5)")
        ->type_name("FILE");
    addRepeated(*command, "--set", arguments->settings,
                "Another value for a key of probes or pictures, as pictures.contour=von_mises",
                "PATH=VALUE");
    command->add_option("--only", options->only, "Only this analysis, or these: NAME,NAME")
        ->delimiter(',')
        ->type_name("NAME")
        ->allow_extra_args(false);
    command
        ->add_option(
            "--vtk", options->vtk,
            "Flexible bodies at each row for ParaView: this list, and files in a folder beside it")
        ->type_name("FILE.pvd");
    command
        ->add_option("--animation", options->animation,
                     "The motion as one file that moves in browsers, Blender and ParaView (glTF)")
        ->type_name("FILE.glb");
    command->add_flag("--csv", options->writesCsv, "A CSV file of each analysis as well");
    command->add_flag_callback(
        "--no-pictures", [arguments] { arguments->options.drawsPictures = false; },
        "Leave the model's pictures out");
    addScriptsFlag(*command, options->allowsScripts);
    command->add_flag("-q,--quiet", arguments->isQuiet,
                      "No progress and notes: only warnings and what came out");
    command->callback([arguments] { runPost(*arguments); });
}

}  // namespace cli
}  // namespace simflex
