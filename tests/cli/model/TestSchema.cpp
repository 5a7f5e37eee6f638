/** @file
The schema: its self-description, and agreement of the JSON schema with the reader. **/

#include <gmock/gmock.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "cli/model/ReadText.h"
#include "simflex/model/file/ModelNode.h"
#include "simflex/model/file/NearestName.h"
#include "simflex/model/schema/SchemaJson.h"
#include "simflex/model/schema/SchemaReference.h"
#include "simflex/model/schema/SchemaText.h"
#include "support/TestFolder.h"

using namespace simflex;
using namespace simflex::model;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;

namespace {

namespace fs = std::filesystem;

/** Calls `visit` for each key of the schema with its containing map and path. **/
void visitKeys(
    const SchemaForm& form, const std::string& path,
    const std::function<void(const SchemaForm&, const SchemaKey&, const std::string&)>& visit) {
    for (const SchemaKey& key : form.keys) {
        const std::string keyPath = (path.empty() ? "" : path + ".") + key.name;
        visit(form, key, keyPath);
        for (const SchemaForm& child : key.forms) visitKeys(child, keyPath, visit);
    }
    for (const SchemaForm& item : form.items)
        visitKeys(item, path + (form.kind == SchemaForm::Kind::List ? ".0" : ".NAME"), visit);
}

/** Frames, rotations and positions are the same everywhere. **/
std::string identify(const SchemaForm& form, const SchemaKey& key) {
    return form.title + ": " + key.name;
}

std::vector<std::string> findModels() {
    std::vector<std::string> paths;
    for (const char* folder : {"/tests/cli/model", "/tests/cli/run", "/examples/models"}) {
        if (!fs::is_directory(SIMFLEX_SOURCE_DIR + std::string(folder))) continue;
        for (const auto& file :
             fs::recursive_directory_iterator(SIMFLEX_SOURCE_DIR + std::string(folder)))
            if (file.path().extension() == ".yaml") paths.push_back(file.path().string());
    }
    std::sort(paths.begin(), paths.end());
    return paths;
}

void collectKeys(const ModelValue::Node& node, std::set<std::string>& found) {
    for (const auto& entry : node.entries) {
        if (entry.second->key) found.insert(identify(*node.form, *entry.second->key));
        collectKeys(*entry.second, found);
    }
    for (const auto& item : node.items) collectKeys(*item, found);
}

std::string read(const fs::path& path) {
    std::ostringstream text;
    text << std::ifstream(path).rdbuf();
    return text.str();
}

}  // namespace

TEST(Schema, EveryKeySaysWhatItMeans) {
    visitKeys(
        getModelSchema(), "", [](const SchemaForm&, const SchemaKey& key, const std::string& path) {
            SCOPED_TRACE(path);
            ASSERT_FALSE(key.meaning.empty());
            EXPECT_EQ(key.meaning.back(), '.');
            EXPECT_FALSE(key.forms.empty());
            EXPECT_FALSE(key.example.empty());
            EXPECT_TRUE(key.defaultText.empty() || key.defaultNote.empty()) << "two defaults";
            EXPECT_FALSE(key.isRequired && !key.defaultText.empty()) << "required, with a default";
        });
}

TEST(Schema, EveryExampleAndDefaultIsAllowed) {
    auto file = std::make_shared<ModelFile>();
    file->scope.constants = {{"pi", 3.14}, {"deg", 0.0175}, {"g", 9.81}, {"length", 1}};
    for (const char* word :
         {"angle", "target", "speed", "error", "height", "charge", "rate", "tip"})
        file->words[word] = word;
    file->scope.tables["engine"] = std::make_shared<formula::Table>(
        "engine", std::vector<double>{0, 1}, std::vector<double>{0, 1});
    visitKeys(getModelSchema(), "",
              [&](const SchemaForm&, const SchemaKey& key, const std::string& path) {
                  for (const std::string& text : {key.example, key.defaultText}) {
                      if (text.empty()) continue;
                      SCOPED_TRACE(path + ": " + text);
                      EXPECT_NO_THROW(checkModelValue(file, parseYaml(text, path), key.forms, &key,
                                                      path, key.name));
                  }
              });
}

TEST(Schema, KeysThatOthersNameAreThere) {
    visitKeys(getModelSchema(), "",
              [](const SchemaForm& form, const SchemaKey& key, const std::string& path) {
                  SCOPED_TRACE(path);
                  for (const auto* names : {&key.onlyWith, &key.notWith, &form.oneOf})
                      for (const std::string& name : *names)
                          EXPECT_TRUE(findSchemaKey(form, name)) << name;
                  const SchemaKey* type = findSchemaKey(form, "type");
                  for (const std::string& name : key.onlyFor) {
                      ASSERT_TRUE(type);
                      EXPECT_THAT(type->forms[0].choices, Contains(name));
                  }
                  int numLists = 0, numMaps = 0;
                  for (const SchemaForm& child : key.forms) {
                      numLists += child.kind == SchemaForm::Kind::List;
                      numMaps += child.kind == SchemaForm::Kind::Map ||
                                 child.kind == SchemaForm::Kind::Entries;
                  }
                  EXPECT_LE(numLists, 1);
                  EXPECT_LE(numMaps, 1);
              });
}

TEST(Schema, EveryKeyOccursInSomeModel) {
    std::set<std::string> found;
    for (const std::string& path : findModels()) {
        SCOPED_TRACE(path);
        ASSERT_NO_THROW(collectKeys(readModel(loadModelText(path)).getNode(), found));
    }
    visitKeys(getModelSchema(), "",
              [&](const SchemaForm& form, const SchemaKey& key, const std::string& path) {
                  EXPECT_EQ(found.count(identify(form, key)), 1u)
                      << "no model has the key " << path;
              });
}

TEST(Schema, ReferenceNamesEveryKeyOnce) {
    const std::string text = writeKeyReference("", ReferenceFormat::Text);
    const std::string markdown = writeKeyReference("", ReferenceFormat::Markdown);
    for (const SchemaKey& key : getModelSchema().keys) {
        EXPECT_THAT("\n" + text, HasSubstr("\n" + key.name + "\n"));
        EXPECT_THAT(markdown, HasSubstr("| `" + key.name + "` |"));
    }
    for (const char* section : {"bodies.NAME", "joints.NAME.wheels", "parts.NAME.interfaces.NAME"})
        EXPECT_THAT(markdown, HasSubstr("### `" + std::string(section) + "`\n"));
    visitKeys(getModelSchema(), "",
              [&](const SchemaForm&, const SchemaKey& key, const std::string& path) {
                  EXPECT_THAT(text, HasSubstr(key.meaning)) << path;
              });
    EXPECT_THAT(writeKeyReference("solver.accuracy", ReferenceFormat::Text),
                HasSubstr("value: a number greater than 0 [m]; default: 1e-6"));
    EXPECT_THAT(writeKeyReference("bodies.crank.place", ReferenceFormat::Text),
                HasSubstr("PLACE.at"));
    EXPECT_THAT(writeKeyReference("solver", ReferenceFormat::Text), Not(HasSubstr("gravity")));
}

TEST(Schema, ReferenceFillsInNamesThatAreLeftOut) {
    const std::string type = writeKeyReference("joints.NAME.type", ReferenceFormat::Text);
    EXPECT_THAT(type, StartsWith("joints.NAME.type\n"));
    EXPECT_EQ(writeKeyReference("joints.type", ReferenceFormat::Text), type);
    EXPECT_EQ(writeKeyReference("bodies.place.at", ReferenceFormat::Text),
              writeKeyReference("bodies.NAME.place.at", ReferenceFormat::Text));
    EXPECT_THAT(writeKeyReference("joints.axis.type", ReferenceFormat::Text),
                StartsWith("joints.axis.type\n"));
}

TEST(Schema, ReferenceOfUnknownKeysProposesTheNearest) {
    const auto refuse = [](const std::string& path) -> std::string {
        try {
            writeKeyReference(path, ReferenceFormat::Text);
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "accepted";
    };
    EXPECT_EQ(refuse("solvr"), "model files have no key 'solvr'; did you mean 'solver'?");
    EXPECT_THAT(refuse("nix"), AllOf(HasSubstr("there are simflex, title,"), HasSubstr("joints")));
    EXPECT_THAT(refuse("solver.mass"), HasSubstr("'mass' belongs to "));
    EXPECT_THAT(refuse("bodies.a.place.att"), HasSubstr("did you mean 'at'?"));
}

TEST(Schema, CompletionKnowsChildrenAndChoices) {
    EXPECT_THAT(getSchemaChildren(""), Contains("analyses"));
    EXPECT_THAT(getSchemaChildren("connectors.any"), Contains("free_length"));
    EXPECT_THAT(getSchemaChildren("joints.a.between.0"), Contains("node"));
    EXPECT_THAT(getSchemaChildren("no.such"), IsEmpty());
    EXPECT_THAT(getSchemaChoices("solver.method"),
                ElementsAre("bdf", "generalized_alpha", "radau"));
    EXPECT_THAT(getSchemaChoices("output.csv"), ElementsAre("true", "false"));
}

TEST(Schema, NearestNamesAreThoseOfFewestEdits) {
    const std::vector<std::string> known{"accuracy", "method", "threads", "constraint_tolerance"};
    EXPECT_EQ(findNearestName("acuracy", known), "accuracy");
    EXPECT_EQ(findNearestName("Method", known), "method");
    EXPECT_EQ(findNearestName("mehtod", known), "method");
    EXPECT_EQ(findNearestName("tolerance", known), "constraint_tolerance");
    EXPECT_EQ(findNearestName("banana", known), "");
    // An inserted, deleted, replaced or swapped letter is one edit each.
    EXPECT_EQ(findNearestName("tol", {"total", "tool"}), "tool");
    EXPECT_EQ(findNearestName("toool", {"to", "tool"}), "tool");
    EXPECT_EQ(findNearestName("masj", {"disk", "mash"}), "mash");
    EXPECT_EQ(findNearestName("mehtod", {"meht", "method"}), "method");
    EXPECT_EQ(findNearestName("", known), "");
    EXPECT_EQ(proposeName("banana", known),
              "there are accuracy, method, threads, constraint_tolerance");
}

/** check_model_schema.py validates all models and mutations of them, and stores each mutation with
its verdict; the reader must agree. **/
TEST(Schema, JsonSchemaAgreesWithTheReader) {
    const simflex::testing::TestFolder scratch;
    const fs::path folder = scratch.makeFolder("mutations");
    std::ofstream(folder / "schema.json") << writeJsonSchema();
    std::string command = "/usr/bin/python3 '" SIMFLEX_SOURCE_DIR
                          "/tests/cli/model/check_model_schema.py' '" +
                          folder.string() + "'";
    for (const std::string& path : findModels()) command += " '" + path + "'";
    ASSERT_EQ(std::system(command.c_str()), 0);
    int numRefused = 0;
    for (const auto& file : fs::directory_iterator(folder)) {
        const std::string name = file.path().filename().string();
        if (name == "schema.json") continue;
        SCOPED_TRACE(read(file.path()).substr(0, 3000));
        std::string verdict = "accept";
        try {
            // beside its original model, next to its tables
            readModel({SIMFLEX_SOURCE_DIR "/tests/cli/model/" + name, read(file.path()), {}});
        } catch (const ModelError& error) {
            verdict = error.what();
        }
        if (name.find("refuse") != std::string::npos) {
            ++numRefused;
            EXPECT_NE(verdict, "accept") << name;
        } else {
            EXPECT_EQ(verdict, "accept") << name;
        }
    }
    EXPECT_GT(numRefused, 100);
}
