/** @file
simflex export: converts a part file to formats of other programs. **/

#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>

#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"
#include "simflex/base/UnfinishedFile.h"
#include "simflex/cli/Commands.h"
#include "simflex/cli/Messages.h"
#include "simflex/cli/Options.h"
#include "simflex/part/MbdynFem.h"
#include "simflex/part/PartArrays.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/part/SidFile.h"
#include "simflex/part/VtuFile.h"

namespace simflex {
namespace cli {
namespace {

namespace fs = std::filesystem;

/** A format, selected by the output file's suffix. **/
struct ExportFormat {
    const char* suffix;  ///< lower case
    const char* description;
    std::function<void(const std::string& path, const ReducedBody& part)> write;
};

const std::vector<ExportFormat>& getFormats() {
    static const std::vector<ExportFormat> formats = {
        {".vtu", "VTK unstructured grid with every mode, for ParaView", writeVtu},
        {".fem", "MBDyn's modal data, for its modal joint",
         [](const std::string& path, const ReducedBody& part) { writeMbdynFem(path, part); }},
        {".sid_fem", "standard input data (SID) of flexible bodies, for Simpack and others",
         [](const std::string& path, const ReducedBody& part) { writeSid(path, part); }},
        {".mat", "K, M and interfaces of the reduced part, for MATLAB", writePartArrays},
        {".npz", "the same for NumPy", writePartArrays},
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
    std::vector<std::string> interfaces;
    bool quiet = false;
};

std::string lowerSuffix(const std::string& path) {
    return lowerCase(fs::path(path).extension().string());
}

/** Reads a part file, or MBDyn's modal data with their interface nodes. **/
ReducedBody readPart(const ExportArguments& arguments) {
    if (lowerSuffix(arguments.part) != ".fem") {
        if (!arguments.interfaces.empty())
            throw CLI::ValidationError("--interface", "belongs to .fem files");
        return readReducedBody(arguments.part);
    }
    MbdynFemOptions options;
    for (const std::string& text : arguments.interfaces) {
        const auto [name, number] = splitAssignment("--interface", text, "NAME=NODE");
        int node = 0;
        if (!readInteger(number, node))
            throw CLI::ValidationError("--interface",
                                       "'" + text + "' is not of the form NAME=NODE");
        options.interfaces.emplace_back(name, node);
    }
    const Listener listener = makeListener(arguments.quiet);
    std::vector<std::string> notes, warnings;
    ReducedBody part = readMbdynFem(arguments.part, options, &notes, &warnings);
    for (const std::string& note : notes) listener.tellNote(note);
    for (const std::string& warning : warnings) listener.tellWarning(warning);
    return part;
}

void runExport(const ExportArguments& arguments) {
    const std::string suffix = lowerSuffix(arguments.output);
    for (const ExportFormat& format : getFormats()) {
        if (suffix != format.suffix) continue;
        checkWritable(arguments.output);
        const ReducedBody part = readPart(arguments);
        format.write(arguments.output, part);
        if (!arguments.quiet)
            writeOut("%s: %d modes, %d nodes -> %s\n", part.name.c_str(), part.numModes,
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
    command->add_option("PART", arguments->part, "Part file (.h5) or MBDyn's modal data (.fem)")
        ->required();
    addRepeated(*command, "-i,--interface", arguments->interfaces,
                "Make a node of a .fem file an interface (default: those that its comments name)",
                "NAME=NODE");
    command
        ->add_option("-o,--output", arguments->output,
                     "File to write; its suffix chooses the format: " + describeFormats())
        ->type_name("FILE")
        ->required();
    addQuietFlag(*command, arguments->quiet, "warnings");
    command->callback([arguments] { runExport(*arguments); });
}

}  // namespace cli
}  // namespace simflex
