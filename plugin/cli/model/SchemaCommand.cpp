/** @file
simflex schema and simflex keys: the keys of a model file, for editors and users. **/

#include <cstdio>
#include <memory>
#include <string>

#include "simflex/cli/Commands.h"
#include "simflex/model/schema/SchemaJson.h"
#include "simflex/model/schema/SchemaReference.h"

namespace simflex {
namespace cli {

using namespace model;

void addSchemaCommand(CLI::App& app) {
    CLI::App* command = app.add_subcommand(
        "schema", "Print the JSON schema of model files, for completion and validation in editors");
    command->callback([] { std::fputs(writeJsonSchema().c_str(), stdout); });
}

void addKeysCommand(CLI::App& app) {
    struct Arguments {
        std::string path;
        bool isMarkdown = false;
    };
    const auto arguments = std::make_shared<Arguments>();
    CLI::App* command = app.add_subcommand(
        "keys", "List the keys of model files: value, unit, default and meaning");
    command->add_option("PATH", arguments->path,
                        "List only keys below this one, for example solver or bodies.NAME.place");
    command->add_flag("--markdown", arguments->isMarkdown, "Print tables in Markdown");
    command->callback([arguments] {
        const ReferenceFormat format =
            arguments->isMarkdown ? ReferenceFormat::Markdown : ReferenceFormat::Text;
        std::fputs(writeKeyReference(arguments->path, format).c_str(), stdout);
    });
}

}  // namespace cli
}  // namespace simflex
