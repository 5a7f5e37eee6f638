/** @file
simflex export: a part file in the formats of other programs. **/

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "Commands.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/part/VtuFile.h"

namespace simflex {
namespace cli {
namespace {

namespace fs = std::filesystem;

/** A format, chosen by the suffix of the file to write. **/
struct ExportFormat {
    const char* suffix;  ///< in lower case
    const char* description;
    std::function<void(const std::string& path, const ReducedBody& part)> write;
};

const std::vector<ExportFormat>& getFormats() {
    static const std::vector<ExportFormat> formats = {
        {".vtu", "VTK unstructured grid with every mode, for ParaView", writeVtu},
        {".h5", "part file of this version of simflex", writeReducedBody}};
    return formats;
}

std::string describeFormats() {
    std::string text;
    for (const ExportFormat& format : getFormats())
        text += (text.empty() ? "" : "; ") + std::string(format.suffix) + ": " + format.description;
    return text;
}

struct ExportArguments {
    std::string part, output;
    bool quiet = false;
};

void runExport(const ExportArguments& arguments) {
    std::string suffix = fs::path(arguments.output).extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    for (const ExportFormat& format : getFormats()) {
        if (suffix != format.suffix) continue;
        const fs::path folder = fs::absolute(arguments.output).parent_path();
        if (!fs::is_directory(folder))
            throw std::runtime_error("there is no folder '" + folder.string() + "' to write to");
        const ReducedBody part = readReducedBody(arguments.part);
        format.write(arguments.output, part);
        if (!arguments.quiet)
            std::printf("%s: %d modes, %d nodes -> %s\n", part.name.c_str(), part.numModes,
                        part.mesh.numNodes(), arguments.output.c_str());
        return;
    }
    throw CLI::ValidationError(
        "--output",
        "'" + arguments.output + "' has no suffix of a known format (" + describeFormats() + ")");
}

}  // namespace

void addExportCommand(CLI::App& app) {
    auto arguments = std::make_shared<ExportArguments>();
    CLI::App* command =
        app.add_subcommand("export", "Write a part file in the format of another program");
    command->add_option("PART", arguments->part, "part file (.h5)")->required();
    command
        ->add_option("-o,--output", arguments->output,
                     "file to write; its suffix says what: " + describeFormats())
        ->type_name("FILE")
        ->required();
    command->add_flag("-q,--quiet", arguments->quiet, "print errors only");
    command->callback([arguments] { runExport(*arguments); });
}

}  // namespace cli
}  // namespace simflex
