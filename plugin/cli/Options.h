#pragma once
/** @file Options shared by several commands: validators and common flags. **/

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "simflex/base/AllowedCode.h"
#include "simflex/base/AsciiText.h"
#include "simflex/base/NumberText.h"

namespace simflex {
namespace cli {

/** @param isAllowed  test of a number; @param what  the allowed numbers, "positive" **/
template <class IsAllowed>
CLI::Validator makeNumberCheck(IsAllowed isAllowed, const std::string& what) {
    return {[isAllowed, what](const std::string& text) -> std::string {
                double value = 0;
                if (!readNumber(text, value))
                    return "'" + text + "' is not a number" +
                           (text.find(',') == std::string::npos
                                ? ""
                                : "; decimals are written with a point");
                return isAllowed(value) ? "" : "'" + text + "' is not " + what;
            },
            ""};
}

inline CLI::Validator makePositiveCheck() {
    return makeNumberCheck([](double value) { return value > 0; }, "positive");
}

inline CLI::Validator makeNonNegativeCheck() {
    return makeNumberCheck([](double value) { return value >= 0; }, "positive or zero");
}

/** Adds an option that may be repeated, with one value each time. **/
inline CLI::Option* addRepeated(CLI::App& command, const std::string& name,
                                std::vector<std::string>& values, const std::string& help,
                                const std::string& type) {
    return command.add_option(name, values, help)->type_name(type)->expected(1)->take_all();
}

/** Splits "NAME=VALUE". @throws CLI::ValidationError if the form is different. **/
inline std::pair<std::string, std::string> splitAssignment(const std::string& option,
                                                           const std::string& text,
                                                           const char* form = "NAME=VALUE") {
    const size_t equals = text.find('=');
    if (equals == 0 || equals == std::string::npos || equals + 1 == text.size())
        throw CLI::ValidationError(option, "'" + text + "' is not of the form " + form);
    return {text.substr(0, equals), text.substr(equals + 1)};
}

/** Parses width and height [pixel] of --size WIDTHxHEIGHT. @throws CLI::ValidationError. **/
inline std::pair<int, int> readSize(const std::string& text, std::pair<int, int> least, int most) {
    const std::vector<std::string> sides = splitAt(text, 'x');
    std::pair<int, int> size;
    if (sides.size() != 2 || !readInteger(sides[0], size.first) ||
        !readInteger(sides[1], size.second) || size.first < least.first ||
        size.second < least.second || std::max(size.first, size.second) > most)
        throw CLI::ValidationError("--size", "'" + text + "' is not WIDTHxHEIGHT in pixels, " +
                                                 std::to_string(least.first) + "x" +
                                                 std::to_string(least.second) + " to " +
                                                 std::to_string(most) + "x" + std::to_string(most));
    return size;
}

/** Adds --allow-scripts, which runs Gmsh scripts outside the sandbox. **/
inline void addScriptsFlag(CLI::App& command, bool& isAllowed) {
    command.add_flag("--allow-scripts", isAllowed,
                     "Run Gmsh scripts (.geo) outside the sandbox: they may start programs and "
                     "read and write any file");
}

/** Adds the options that allow a model to run code. **/
inline void addCodeOptions(CLI::App& command, AllowedCode& code) {
    using Fmus = AllowedCode::Fmus;
    addScriptsFlag(command, code.scripts);
    command.add_flag_callback(
        "--allow-fmus",
        [&code] {
            if (code.fmus == Fmus::Refused) code.fmus = Fmus::ChildProcess;
        },
        "Run FMUs of the model's controllers, each in a process of its own: they may do all that "
        "you may");
    command.add_flag_callback(
        "--fmus-in-process", [&code] { code.fmus = Fmus::ThisProcess; },
        "Run them in this process: faster by some microseconds a sample, but an FMU that crashes "
        "ends the run");
    command
        .add_option("--fmu-timeout", code.fmuTimeout,
                    "Longest time that an FMU in a process of its own may take for one answer "
                    "(default: 60 s)")
        ->check(makePositiveCheck())
        ->type_name("SECONDS");
}

/** Returns the options that allow another command to run the same code. **/
inline std::vector<std::string> listCodeOptions(const AllowedCode& code) {
    std::vector<std::string> options;
    if (code.scripts) options.push_back("--allow-scripts");
    if (code.fmus == AllowedCode::Fmus::ChildProcess) options.push_back("--allow-fmus");
    if (code.fmus == AllowedCode::Fmus::ThisProcess) options.push_back("--fmus-in-process");
    if (code.fmuTimeout != AllowedCode().fmuTimeout) {
        options.push_back("--fmu-timeout");
        options.push_back(writeGeneral(code.fmuTimeout));
    }
    return options;
}

inline void addModelFile(CLI::App& command, std::string& path) {
    command.add_option("model", path, "Model file (YAML)")
        ->required()
        ->check(CLI::ExistingFile)
        ->type_name("MODEL.yaml");
}

/** Adds --set for keys of the model file. **/
inline void addSettings(CLI::App& command, std::vector<std::string>& settings,
                        const char* help =
                            "Change the value of a key of the model, for example "
                            "solver.accuracy=1e-5") {
    addRepeated(command, "--set", settings, help, "PATH=VALUE");
}

/** Adds --only. @param verb  action on the named analyses, "Run" **/
inline void addAnalyses(CLI::App& command, std::vector<std::string>& names,
                        const std::string& verb) {
    command.add_option("--only", names, verb + " only these analyses: NAME,NAME (default: all)")
        ->delimiter(',')
        ->type_name("NAME")
        ->allow_extra_args(false);
}

/** Adds the output options of `run` and `post`, besides results. **/
template <class Options>
void addOutputs(CLI::App& command, Options& options) {
    command.add_flag("--csv", options.writesCsv, "Write a CSV file for each analysis as well");
    command.add_flag_callback(
        "--no-pictures", [&options] { options.drawsPictures = false; },
        "Do not draw the model's pictures");
    command
        .add_option("--animation", options.animation,
                    "Write the motion as one glTF file for browsers, Blender and ParaView")
        ->type_name("FILE.glb");
}

/** Adds -q, which suppresses progress and notes. @param what  output that remains **/
inline void addQuietFlag(CLI::App& command, bool& isQuiet, const std::string& what) {
    command.add_flag("-q,--quiet", isQuiet, "Print only " + what + ", no progress and no notes");
}

}  // namespace cli
}  // namespace simflex
