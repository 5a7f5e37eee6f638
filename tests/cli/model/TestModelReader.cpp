/** @file
Accepted model files, and messages for the others. **/

#include <gmock/gmock.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "cli/model/ReadText.h"
#include "simflex/model/file/ModelTexts.h"
#include "simflex/model/file/VariableFormula.h"

using namespace simflex;
using namespace simflex::model;
using simflex::testing::readModelText;
using simflex::testing::readRest;
using simflex::testing::refuse;
using simflex::testing::refuseRest;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(ModelReader, ValuesHaveTheirPlaceAndPath) {
    const ModelValue model = readModelText(
        "simflex: 1\njoints:\n  bearing:\n    type: pin\n    between: [ground, rod.end]\n");
    const ModelValue type = model.get("joints").get("bearing").get("type");
    EXPECT_EQ(type.getPlace(), "m.yaml:4:11");
    EXPECT_EQ(type.getPath(), "joints.bearing.type");
    EXPECT_EQ(type.getName(), "type");
    EXPECT_EQ(type.getText(), "pin");
    EXPECT_EQ(model.get("joints").get("bearing").get("between").at(1).getPlace(), "m.yaml:5:23");
    EXPECT_THAT(model.get("joints").getKeys(), ElementsAre("bearing"));
}

TEST(ModelReader, KeysKeepTheOrderOfTheFile) {
    const ModelValue model = readRest("bodies:\n  z: {mass: 1}\n  a: {mass: 2}\n  m: {mass: 3}\n");
    EXPECT_THAT(model.get("bodies").getKeys(), ElementsAre("z", "a", "m"));
}

TEST(ModelReader, MissingValuesHaveTheSchemasDefault) {
    const ModelValue model = readRest("");
    EXPECT_FALSE(model.get("solver").isGiven());
    EXPECT_FALSE(model.get("solver").get("accuracy").isGiven());
    EXPECT_EQ(model.get("solver").get("accuracy").getNumber(), 1e-6);
    EXPECT_EQ(model.get("solver").get("method").getText(), "radau");
    EXPECT_EQ(model.get("gravity").getVec3(), SimTK::Vec3(0));
    EXPECT_EQ(model.get("pictures").get("size").getSize(), 2);
    EXPECT_EQ(model.get("bodies").getSize(), 0);
    EXPECT_FALSE(model.get("output").get("csv").getBool());
}

TEST(ModelReader, MissingValueWithoutDefaultNamesTheMapThatLacksIt) {
    const ModelValue model = readRest("bodies:\n  rod: {part: p}\n");
    try {
        model.get("bodies").get("rod").get("mass").getNumber();
        FAIL() << "a value without default was made up";
    } catch (const ModelError& error) {
        EXPECT_STREQ(error.what(), "m.yaml:3:8: bodies.rod.mass: a value is missing here");
    }
}

TEST(ModelReader, KeysThatTheSchemaLacksAreMistakesOfTheProgram) {
    EXPECT_THROW(readRest("").get("nonsense"), std::logic_error);
}

TEST(ModelReader, NumbersAreConstantExpressions) {
    const ModelValue model = readRest(
        "parameters: {L: 0.18, half: L/2}\n"
        "gravity: [0, -g, half]\n"
        "frames: {a: {on: ground, rotation: [0, 30*deg, pi]}}\n");
    EXPECT_EQ(model.get("gravity").getVec3(), SimTK::Vec3(0, -9.80665, 0.09));
    const std::vector<double> angles = model.get("frames").get("a").get("rotation").getNumbers();
    EXPECT_DOUBLE_EQ(angles[1], SimTK::Pi / 6);
    EXPECT_DOUBLE_EQ(angles[2], SimTK::Pi);
}

TEST(ModelReader, RangesExpandToEvenNumbers) {
    const ModelValue speeds =
        readRest("analyses: {c: {type: campbell, speeds: {from: 0, to: 200, count: 5}}}\n")
            .get("analyses")
            .get("c")
            .get("speeds");
    EXPECT_THAT(speeds.getNumbers(), ElementsAre(0, 50, 100, 150, 200));
}

TEST(ModelReader, SettingsReplaceAndAdd) {
    const std::string text =
        "simflex: 1\nsolver: {accuracy: 1e-4}\njoints:\n  a: {type: pin, between: [ground, b], "
        "axis: x}\n"
        "gravity: [0, 0, -9.81]\nparameters: {speed: 1}\nmotions: {m: {joint: a, position: "
        "speed*t}}\n";
    const ModelValue model = readModelText(
        text, {"solver.accuracy=1e-5", "joints.a.axis=[0,0,1]", "output.csv=true",
               "joints.a.between.1=c", "parameters.speed=7", "gravity.x=2", "gravity.1=3"});
    EXPECT_EQ(model.get("gravity").getVec3(), SimTK::Vec3(2, 3, -9.81));
    EXPECT_EQ(model.get("solver").get("accuracy").getNumber(), 1e-5);
    EXPECT_EQ(model.get("joints").get("a").get("axis").getVec3(), SimTK::Vec3(0, 0, 1));
    EXPECT_TRUE(model.get("output").get("csv").getBool());
    EXPECT_EQ(model.get("joints").get("a").get("between").at(1).getText(), "c");
    EXPECT_EQ(model.get("motions").get("m").get("position").getExpression().calcValue(2), 14);
}

TEST(ModelReader, LaterSettingsWin) {
    const ModelValue model =
        readRest("", {"solver.accuracy=1e-3", "solver.accuracy=1e-5", "solver={threads: 2}"});
    EXPECT_FALSE(model.get("solver").get("accuracy").isGiven());
    EXPECT_EQ(model.get("solver").get("threads").getInteger(), 2);
}

TEST(ModelReader, SettingsOfParametersThatAreNotThereAreRefused) {
    EXPECT_EQ(
        refuseRest("parameters: {speed: 1}\n", {"parameters.sped=2"}),
        "setting 'parameters.sped=2': the model has no parameter 'sped'; did you mean 'speed'?");
    EXPECT_EQ(refuseRest("", {"parameters.speed=2"}),
              "setting 'parameters.speed=2': the model has no parameter 'speed'");
}

TEST(ModelReader, MistakesInSettingsNameTheSetting) {
    EXPECT_EQ(
        refuseRest("", {"solver.acuracy=1"}),
        "setting 'solver.acuracy=1': solver: unknown key 'acuracy'; did you mean 'accuracy'?");
    EXPECT_THAT(refuseRest("", {"accuracy"}), HasSubstr("PATH=VALUE"));
    EXPECT_THAT(refuseRest("", {"=3"}), HasSubstr("PATH=VALUE"));
    EXPECT_THAT(refuseRest("", {"solver..accuracy=3"}), HasSubstr("empty name"));
    EXPECT_THAT(refuseRest("title: x\n", {"title.size=3"}),
                HasSubstr("title is a single value and has no 'size'"));
    EXPECT_THAT(
        refuseRest("gravity: [0, 0, 0]\n", {"gravity.3=1"}),
        HasSubstr("gravity is a list: give the number of an item, 0 to 2, or x, y, z, not '3'"));
    EXPECT_THAT(refuseRest("", {"solver.accuracy=[1"}), StartsWith("setting 'solver.accuracy=[1'"));
}

TEST(ModelReader, UnknownKeysAreProposedTheNearestAndWhereTheyBelong) {
    EXPECT_EQ(refuse("simflex: 1\njoints:\n  b:\n    typ: pin\n"),
              "m.yaml:4:5: joints.b: unknown key 'typ'; did you mean 'type'?");
    EXPECT_EQ(refuse("simflex: 1\naccuracy: 1e-5\n"),
              "m.yaml:2:1: unknown key 'accuracy'; 'accuracy' belongs to solver");
    EXPECT_EQ(refuse("simflex: 1\nbodys: {}\n"),
              "m.yaml:2:1: unknown key 'bodys'; did you mean 'bodies'?");
}

TEST(ModelReader, FormatsThatAreNewerAreRefusedBeforeAnythingElse) {
    EXPECT_EQ(
        refuse("simflex: 2\nnew_thing: 1\n"),
        "m.yaml:1:10: the file has format 2 and needs a newer simflex; this one reads format 1");
    EXPECT_THAT(refuse("title: x\n"), HasSubstr("'simflex: 1' is missing"));
    EXPECT_THAT(refuse("simflex: 0\n"), HasSubstr("allowed is at least 1"));
    EXPECT_THAT(refuse("simflex: [1]\n"), HasSubstr("expected a whole number"));
}

TEST(ModelReader, WrongKindsSayWhatIsExpected) {
    EXPECT_THAT(refuseRest("gravity: 9.81\n"),
                AllOf(StartsWith("m.yaml:2:10: gravity: found '9.81'; expected a vector [x, y, z]"),
                      HasSubstr("[0, -g, 0]")));
    EXPECT_THAT(refuseRest("gravity: [0, 1]\n"), HasSubstr("has 2 values; it must have 3"));
    EXPECT_THAT(refuseRest("solver: [1]\n"), HasSubstr("found a list of 1; expected the solver's"));
    EXPECT_THAT(refuseRest("title: {a: 1}\n"), HasSubstr("expected a text"));
    EXPECT_THAT(refuseRest("output: {csv: yes}\n"), HasSubstr("found 'yes'; write true or false"));
    EXPECT_THAT(refuseRest("solver: {threads: 1.5}\n"),
                HasSubstr("found 1.5; expected a whole number"));
    EXPECT_THAT(refuseRest("gravity: []\n"), HasSubstr("0 values"));
    EXPECT_THAT(refuseRest("solver:\n  accuracy:\n"),
                StartsWith("m.yaml:3:3: solver.accuracy: the value is missing, for example"));
}

TEST(ModelReader, RangesAndChoicesAreChecked) {
    EXPECT_EQ(refuseRest("solver: {accuracy: -1}\n"),
              "m.yaml:2:20: solver.accuracy: found -1; allowed is greater than 0");
    EXPECT_THAT(refuseRest("solver: {spectral_radius: 1.5}\n"),
                HasSubstr("allowed is from 0 to 1"));
    EXPECT_EQ(refuseRest("solver: {method: bfd}\n"),
              "m.yaml:2:18: solver.method: 'bfd' is none of the choices: bdf, generalized_alpha, "
              "radau; did you "
              "mean 'bdf'?");
    EXPECT_THAT(refuseRest("solver: {threads: 99999999999}\n"),
                HasSubstr("allowed is from 1 to 1024"));
}

TEST(ModelReader, KeysThatDoNotGoTogetherAreNamed) {
    EXPECT_THAT(refuseRest("joints: {a: {type: ball, between: [a, b], teeth: [1, 2]}}\n"),
                HasSubstr("m.yaml:2:43: joints.a.teeth: 'teeth' is for type gear, not for ball"));
    EXPECT_THAT(refuseRest("joints: {a: {type: gear, wheels: [a, b], teeth: [2.5, 17]}}\n"),
                HasSubstr("joints.a.teeth.0: found 2.5; expected a whole number"));
    EXPECT_THAT(refuseRest("joints: {a: {type: gear, wheels: [a, b]}}\n"),
                HasSubstr("'teeth' is missing, which 'gear' needs"));
    EXPECT_THAT(refuseRest("joints: {a: {between: [a, b]}}\n"), HasSubstr("'type' is missing"));
    EXPECT_THAT(refuseRest("parts: {a: {modes: 3}}\n"),
                HasSubstr("one of these keys is needed: file"));
    EXPECT_THAT(refuseRest("parts: {a: {file: a.h5, deck: b.inp}}\n"),
                HasSubstr("'file' and 'deck' exclude each other"));
    EXPECT_THAT(refuseRest("parts: {a: {file: a.h5, modes: 3}}\n"),
                HasSubstr("'modes' has a meaning only together with deck or geometry or matrices"));
    EXPECT_THAT(refuseRest("bodies: {a: {part: p, mass: 1}}\n"),
                HasSubstr("'mass' and 'part' exclude each other"));
}

TEST(ModelReader, NumbersWithUnitsOrCommasSayWhatToWrite) {
    EXPECT_THAT(refuseRest("bodies: {a: {mass: 5 kg}}\n"),
                HasSubstr("all are SI: write 5 instead of 5 kg"));
    EXPECT_THAT(
        refuseRest("frames: {a: {on: ground, position: [5 mm, 0, 0]}}\n"),
        HasSubstr("m.yaml:2:37: frames.a.position.0: numbers have no units here, all are SI: write "
                  "5e-3 instead of 5 mm"));
    EXPECT_THAT(refuseRest("bodies: {a: {mass: 5e2 mm}}\n"), HasSubstr("write 5e2*1e-3 instead"));
    EXPECT_THAT(refuseRest("bodies: {a: {mass: 5 rpm}}\n"), HasSubstr("write 5*pi/30 instead"));
    EXPECT_THAT(refuseRest("bodies:\n  a: {mass: '10,5'}\n"),
                HasSubstr("decimals are written with a point"));
    EXPECT_THAT(refuseRest("bodies: {a: {mass: 3x}}\n"), HasSubstr("write 3*x"));
    EXPECT_THAT(refuseRest("bodies: {a: {mass: 1.2.3}}\n"), HasSubstr("'1.2.3' is not a number"));
}

TEST(ModelReader, NumbersMustBeFinite) {
    for (const char* number : {".nan", ".inf", "-.inf", "nan", "1e999", "1/0", "sqrt(-1)", "0/0"}) {
        SCOPED_TRACE(number);
        EXPECT_THAT(refuseRest("gravity: [0, 0, '" + std::string(number) + "']\n"),
                    ::testing::AnyOf(HasSubstr("finite"), HasSubstr("is not a number")));
    }
}

TEST(ModelReader, FormulaErrorsPointIntoTheText) {
    EXPECT_EQ(refuseRest("parameters: {speed: 1}\nmotions:\n  m: {joint: j, position: 2*sped*t}\n"),
              "m.yaml:4:29: motions.m.position: 'sped' is not a parameter, table or function; did "
              "you mean 'speed'?");
    EXPECT_EQ(refuseRest("motions:\n  m: {joint: j, position: \"2*tt\"}\n").substr(0, 33),
              "m.yaml:3:30: motions.m.position: ");
    // With folded lines or escaped characters, positions in the formula differ from those in the
    // file.
    for (const char* formula :
         {"|\n      2*t\n      + tt\n", "\"2*\\x74t\"\n", "2*t\n      + tt\n"})
        EXPECT_EQ(refuseRest("motions:\n  m:\n    joint: j\n    position: " + std::string(formula))
                      .substr(0, 33),
                  "m.yaml:5:15: motions.m.position: ");
    EXPECT_THAT(refuseRest("gravity: [0, t, 0]\n"), HasSubstr("cannot depend on the time t"));
}

TEST(ModelReader, ParametersUseThoseAboveThemOnly) {
    EXPECT_THAT(refuseRest("parameters: {a: b, b: 1}\n"), HasSubstr("'b' is not a parameter"));
    EXPECT_THAT(refuseRest("parameters: {sin: 1}\n"),
                HasSubstr("has a meaning in formulas already"));
    EXPECT_THAT(refuseRest("parameters: {t: 1}\n"), HasSubstr("has a meaning in formulas already"));
    EXPECT_THAT(refuseRest("parameters: {a-b: 1}\n"), HasSubstr("write _ instead of -"));
}

TEST(ModelReader, ParametersMayStandBelowWhatUsesThem) {
    EXPECT_EQ(readRest("gravity: [0, a, 0]\nparameters: {a: 3}\n").get("gravity").getVec3()[1], 3);
}

TEST(ModelReader, NamesAreChecked) {
    EXPECT_THAT(refuseRest("bodies: {ground: {mass: 1}}\n"), HasSubstr("inertial frame"));
    EXPECT_THAT(refuseRest("bodies: {a.b: {mass: 1}}\n"), HasSubstr("cannot be a name"));
    EXPECT_THAT(refuseRest("bodies: {1a: {mass: 1}}\n"), HasSubstr("cannot be a name"));
    EXPECT_THAT(refuseRest("bodies: {\"\": {mass: 1}}\n"), HasSubstr("cannot be a name"));
    EXPECT_THAT(refuseRest("joints: {a: {type: pin, between: [ground, 'b c']}}\n"),
                HasSubstr("'b c' is not a name: expected a frame"));
    EXPECT_THAT(refuseRest("loads: {a: {body: b, modes: {0: 1}}}\n"),
                HasSubstr("modes are numbered from 1"));
}

TEST(ModelReader, UnknownNamesAreProposedTheNearest) {
    const ModelValue value =
        readRest("bodies:\n  a: {part: cranck}\n").get("bodies").get("a").get("part");
    const auto fail = [&](const std::vector<std::string>& known) {
        try {
            value.failUnknown("part", value.getText(), known);
        } catch (const ModelError& error) {
            return std::string(error.what());
        }
    };
    EXPECT_EQ(fail({"rod", "crank"}),
              "m.yaml:3:13: bodies.a.part: there is no part 'cranck'; did you mean 'crank'?");
    EXPECT_EQ(fail({"rod", "slider"}),
              "m.yaml:3:13: bodies.a.part: there is no part 'cranck'; there are rod, slider");
    EXPECT_EQ(fail({}), "m.yaml:3:13: bodies.a.part: there is no part 'cranck'; there are none");
}

TEST(ModelReader, MistakesAreToldTogetherInTheOrderOfTheFile) {
    EXPECT_EQ(
        refuse("simflex: 1\n"
               "gravity: [0, 9, 81]\n"
               "solver: {method: bfd, accuracy: -1}\n"
               "bodies:\n"
               "  a: {mas: 1}\n"
               "  b: {mass: 1 kg, color: red}\n"
               "joints:\n"
               "  j: {type: pim, between: [ground]}\n"),
        "m.yaml:3:18: solver.method: 'bfd' is none of the choices: bdf, generalized_alpha, radau; "
        "did "
        "you mean 'bdf'?\n"
        "m.yaml:3:33: solver.accuracy: found -1; allowed is greater than 0\n"
        "m.yaml:5:7: bodies.a: unknown key 'mas'; did you mean 'mass'?\n"
        "m.yaml:6:13: bodies.b.mass: numbers have no units here, all are SI: write 1 instead of 1 "
        "kg\n"
        "m.yaml:8:13: joints.j.type: 'pim' is none of the choices: ball, pin, slider, weld, "
        "cylinder, universal, planar, screw, point_on_line, point_in_plane, rod, gear, coupler; "
        "did you mean 'pin'?\n"
        "m.yaml:8:27: joints.j.between: the list has 1 values; it must have 2, for example "
        "[ground, crank.shaft]");
}

TEST(ModelReader, NoMoreThanTenMistakesAreTold) {
    std::string text = "simflex: 1\nbodies:\n";
    for (int i = 0; i < 30; ++i) text += "  b" + std::to_string(i) + ": {mass: -1}\n";
    const std::string message = refuse(text);
    EXPECT_THAT(message, HasSubstr("bodies.b9.mass"));
    EXPECT_THAT(message, ::testing::Not(HasSubstr("bodies.b10.mass")));
    EXPECT_THAT(message, HasSubstr("There may be more errors"));
}

TEST(ModelReader, MistakesInParametersHideWhatTheyWouldCause) {
    EXPECT_EQ(
        refuseRest("parameters: {a: 1 mm}\ngravity: [0, a, 0]\n"),
        "m.yaml:2:17: parameters.a: numbers have no units here, all are SI: write 1e-3 instead "
        "of 1 mm");
}

TEST(ModelReader, DuplicateKeysAreRefused) {
    EXPECT_EQ(refuse("simflex: 1\ntitle: a\ntitle: b\n"),
              "m.yaml:3:1: the key 'title' stands here twice");
    EXPECT_EQ(refuse("simflex: 1\na: {b: step(t, 0, 0, 1, 2)}\n"),
              "m.yaml:2:19: the key '0' stands here twice: a formula with commas stands in quotes, "
              "decimals have a point");
}

TEST(ModelReader, AliasesAndMergesWork) {
    const ModelValue model = readRest(
        "bodies:\n  a: &base {mass: 2, inertia: [1, 1, 1], center_of_mass: [1, 2, 3]}\n  b: {<<: "
        "*base, mass: 3}\n  c: "
        "*base\n");
    EXPECT_EQ(model.get("bodies").get("b").get("mass").getNumber(), 3);
    EXPECT_EQ(model.get("bodies").get("b").get("center_of_mass").getVec3(), SimTK::Vec3(1, 2, 3));
    EXPECT_EQ(model.get("bodies").get("c").get("mass").getNumber(), 2);
}

TEST(ModelReader, ExplodingAliasesAreRefused) {
    std::string text = "simflex: 1\nx0: &x0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n";
    for (int i = 1; i < 12; ++i) {
        const std::string before = "*x" + std::to_string(i - 1);
        text += "x" + std::to_string(i) + ": &x" + std::to_string(i) + " [" + before;
        for (int k = 1; k < 10; ++k) text += ", " + before;
        text += "]\n";
    }
    EXPECT_THAT(refuse(text), HasSubstr("values once its aliases are expanded"));
    EXPECT_THAT(refuse("simflex: 1\ntitle: &a [*a]\n"),
                HasSubstr("m.yaml:2:12: this alias stands within its own anchor"));
}

TEST(ModelReader, DeepNestingIsRefused) {
    EXPECT_THAT(
        refuse("simflex: 1\ntitle: " + std::string(100, '[') + std::string(100, ']') + "\n"),
        HasSubstr("nested more than 64 deep"));
    EXPECT_THAT(refuse("simflex: 1\ntitle: " + std::string(100000, '[')), StartsWith("m.yaml"));
    EXPECT_THAT(refuse("simflex: 1\ngravity: [0, 0, '" + std::string(5000, '(') + "1']\n"),
                HasSubstr("nested more than 200 deep"));
}

TEST(ModelReader, TagsAreRefused) {
    EXPECT_THAT(refuseRest("title: !!python/object x\n"), HasSubstr("tags such as"));
    EXPECT_THAT(refuseRest("title: !include x.yaml\n"), HasSubstr("tags such as '!include'"));
}

TEST(ModelReader, TabsThatIndentAreNamed) {
    EXPECT_EQ(refuse("simflex: 1\nsolver:\n\taccuracy: 1\n"),
              "m.yaml:3:1: this line is indented by a tab: YAML needs spaces");
}

TEST(ModelReader, AMissingFileIsToldWithTheFolderThatWasSearched) {
    const ModelValue model =
        readModelText("simflex: 1\nparts: {rod: {geometry: shapes/../forms/rod.geo}}\n");
    try {
        failMissingFile(model.get("parts").get("rod").get("geometry"));
        FAIL();
    } catch (const ModelError& error) {
        EXPECT_THAT(error.what(),
                    AllOf(StartsWith("m.yaml:2:"),
                          HasSubstr("there is no file 'rod.geo' in '" +
                                    (std::filesystem::current_path() / "forms").string() + "'"),
                          HasSubstr("model file's folder")));
    }
}

TEST(ModelReader, TitlesComeFromTheFileIfItHasNone) {
    EXPECT_EQ(getModelTitle(readModelText("simflex: 1\ntitle: Crank\n")), "Crank");
    EXPECT_EQ(getModelTitle(readModelText("simflex: 1\n")), "m");
}

TEST(ModelReader, TabsAreNamedWhereOtherThingsAreWrongToo) {
    const std::string tab = "m.yaml:3:1: this line is indented by a tab: YAML needs spaces";
    EXPECT_EQ(refuse("simflex: 1\nbodies:\n\trod:\n\t  mass: 1\n\tarm: {mass: 1}\n"), tab);
    EXPECT_EQ(refuse("simflex: 1\nbodies:\n\trod: {mass: 1\n"), tab);
    EXPECT_THAT(refuse("simflex: 1\ntitle: A: b\nsolver:\n\taccuracy: 1\n"),
                StartsWith("m.yaml:2:"));
}

TEST(ModelReader, WhatIsNoYamlIsExplained) {
    EXPECT_THAT(refuse("simflex: 1\n# [\ntitle: it's [\nbodies: {a: {mass: [1, 2}\n"),
                AllOf(StartsWith("m.yaml:4:20:"), HasSubstr("'[' here has no ']'")));
    EXPECT_THAT(refuse("simflex: 1\ngravity: [0, 1, 0\nbodies: {}\n"),
                AllOf(StartsWith("m.yaml:2:10:"), HasSubstr("'[' here has no ']'")));
    EXPECT_THAT(refuse("simflex: 1\nbodies: {a#b: {mass: 1}\n"),
                AllOf(StartsWith("m.yaml:2:9:"), HasSubstr("'{' here has no '}'")));
    EXPECT_THAT(refuse("simflex: 1\ntitle: A: b\n"),
                AllOf(StartsWith("m.yaml:2:"), HasSubstr("in quotes")));
    EXPECT_THAT(refuse("simflex: 1\nbodies:\n    a: {mass: 1}\n  b: {mass: 1}\n"),
                AllOf(StartsWith("m.yaml:4:"), HasSubstr("same column")));
    EXPECT_THAT(refuse("simflex: 1\ntitle: \"\\q\"\n"), HasSubstr("single quotes"));
}

TEST(ModelReader, TextsOfOtherSystemsAreRead) {
    EXPECT_EQ(
        readModelText("\xEF\xBB\xBFsimflex: 1\r\ntitle: K\xC3\xB6rper\r\n").get("title").getText(),
        "K\xC3\xB6rper");
}

TEST(ModelReader, NoYamlSaysWhere) {
    EXPECT_THAT(refuse("simflex: 1\ntitle: 'a\n"),
                HasSubstr("m.yaml:2:8: the text that begins here has no closing '"));
    EXPECT_THAT(refuse("simflex: 1\n---\nsimflex: 1\n"),
                HasSubstr("a second document begins here"));
    EXPECT_THAT(refuse(std::string("simflex: 1\ntitle: a\0b\n", 22)),
                HasSubstr("m.yaml:2:9: this is not text in UTF-8"));
    EXPECT_THAT(refuse("simflex: 1\ntitle: K\xF6rper\n"),
                HasSubstr("m.yaml:2:9: this is not text in UTF-8"));
    EXPECT_THAT(refuse("simflex: 1\ntitle: \xC0\xAF\n"), HasSubstr("not text in UTF-8"));
    EXPECT_EQ(refuse("\x89HDF\r\n\x1a\n and more"),
              "m.yaml: this is an HDF5 file, as results and parts are, and not a model: a model is "
              "a text that begins with 'simflex: 1'");
    EXPECT_EQ(refuse(",si%"), "m.yaml:1:1: what begins here has no meaning");
    EXPECT_THAT(refuse("? [a, b]\n: 1\n"), HasSubstr("a key must be a single name"));
}

TEST(ModelReader, EmptyFilesAreRefused) {
    for (const char* text : {"", "\n\n", "# nothing\n", "---\n", "~\n"}) {
        SCOPED_TRACE(text);
        EXPECT_EQ(refuse(text), "m.yaml: the file is empty; a model begins with 'simflex: 1'");
    }
    EXPECT_THAT(refuse("just text\n"), HasSubstr("this is not a model"));
    EXPECT_THAT(refuse("- 1\n"), HasSubstr("this is not a model"));
}

TEST(ModelReader, HugeFilesAreRefusedUnread) {
    EXPECT_THAT(refuse("simflex: 1\n#" + std::string(16000000, 'x')),
                HasSubstr("large tables belong in CSV files"));
}

TEST(ModelReader, FilesThatAreNotThereAreNamed) {
    EXPECT_THROW(loadModelText("no/such/model.yaml"), std::runtime_error);
    EXPECT_THROW(loadModelText("/"), std::runtime_error);
}

TEST(ModelReader, ModelFilesWriteOnlyBelowTheCurrentFolder) {
    for (const char* path : {"/tmp/x.h5", "../x.h5", "a/../../x.h5", "~/x.h5", "''"}) {
        SCOPED_TRACE(path);
        EXPECT_THAT(refuseRest("output: {file: " + std::string(path) + "}\n"),
                    HasSubstr("must be a relative path without '..'"));
    }
    EXPECT_EQ(readRest("output: {file: results/x.h5}\n").get("output").get("file").getText(),
              "results/x.h5");
}

TEST(ModelReader, PathsOfFilesBeginAtTheModelsFolder) {
    const std::string text = "simflex: 1\nparts: {a: {file: x.h5}, b: {file: /parts/y.h5}}\n";
    const ModelValue parts = readModel({"models/crank.yaml", text, {}}).get("parts");
    EXPECT_EQ(parts.get("a").get("file").getFilePath(), "models/x.h5");
    EXPECT_EQ(parts.get("b").get("file").getFilePath(), "/parts/y.h5");
}

TEST(ModelReader, TablesOfFilesAreRead) {
    const ModelText text = loadModelText(SIMFLEX_SOURCE_DIR "/tests/cli/model/keys.yaml");
    const ModelValue scale = readModel(text).get("loads").get("modal").get("scale");
    EXPECT_DOUBLE_EQ(scale.getExpression().calcValue(2), 4);
    EXPECT_THAT(refuseRest("tables:\n  a: {file: no_such.csv}\n"),
                HasSubstr("m.yaml:3:13: tables.a.file: cannot read the file"));
}

TEST(ModelReader, TablesAreChecked) {
    EXPECT_THAT(refuseRest("tables: {a: {x: [0, 1, 1], y: [0, 1, 2]}}\n"),
                HasSubstr("x must increase, but 1 follows 1"));
    EXPECT_THAT(refuseRest("tables: {a: {x: [0, 1], y: [0, 1, 2]}}\n"),
                HasSubstr("x has 2 values and y has 3"));
    EXPECT_THAT(refuseRest("tables: {a: {x: [0], y: [0]}}\n"), HasSubstr("at least two points"));
    EXPECT_THAT(refuseRest("tables: {a: {x: [0, 1]}}\n"), HasSubstr("only together with y"));
    EXPECT_THAT(refuseRest("parameters: {a: 1}\ntables: {a: {x: [0, 1], y: [0, 1]}}\n"),
                HasSubstr("a parameter has the name 'a' already"));
}

TEST(ModelReader, VariablesOfAUnitHaveAnyNames) {
    const ModelValue model = readRest(
        "controllers: {s: {fmu: f.fmu, inputs: {'y[1]': t, der(x): 2*t}, outputs: {u: 'u[1]'}, "
        "period: 1, start: {'k[1,2]': 3}}}\n");
    const ModelValue controller = model.get("controllers").get("s");
    EXPECT_THAT(controller.get("inputs").getKeys(), ElementsAre("y[1]", "der(x)"));
    EXPECT_EQ(controller.get("start").get("k[1,2]").getNumber(), 3);
    EXPECT_THAT(refuseRest("connectors: {'y[1]': {type: spring}}\n"),
                HasSubstr("'y[1]' cannot be a name"));
}

TEST(ModelReader, SettingsAreFormulasWithChoicesAndNegations) {
    for (const auto& [value, number] : std::vector<std::pair<std::string, double>>{
             {"2 > 1 ? 3 : 4", 3}, {"b > 2 ? 3 : b > 0 ? 4 : 5", 4}, {"!(2 > 1)", 0}, {"!0", 1}}) {
        const ModelValue model = readRest("parameters: {b: 1, a: 7}\n", {"parameters.a=" + value});
        EXPECT_EQ(model.get("parameters").get("a").getNumber(), number) << value;
    }
}

TEST(ModelReader, ConstantsAsTypedUseTheModelsParameters) {
    const ModelValue model = readRest("parameters: {L: 0.5}\n");
    EXPECT_DOUBLE_EQ(calcConstant(model, "L/2 + 180*deg"), 0.25 + SimTK::Pi);
    EXPECT_THROW(calcConstant(model, "K/2"), std::invalid_argument);
    EXPECT_THROW(calcConstant(model, "1/0"), std::invalid_argument);
}

TEST(ModelReader, NamesOfFormulasThatAreProbesAndSomethingElseAreRefused) {
    const std::string probes =
        "probes:\n  load: {energy: kinetic}\n  g: {energy: total}\n  road: {energy: strain}\n";
    const std::string known =
        "parameters: {load: 2}\ntables: {road: {x: [0, 1], y: [0, 1]}}\n" + probes;
    EXPECT_THAT(refuseRest(known + "  sum: {expression: 1e3 + 2*load}\n"),
                AllOf(StartsWith("m.yaml:8:29: probes.sum.expression: "),
                      HasSubstr("'load' is a parameter and a probe: write parameters.load or "
                                "probes.load, or rename one of them")));
    EXPECT_THAT(refuseRest(known + "  sum: {expression: 2*g}\n"),
                HasSubstr("'g' is a word of formulas and a probe"));
    EXPECT_THAT(refuseRest(known + "  sum: {expression: road - 1}\n"),
                HasSubstr("'road' is a table and a probe"));
    // Names with only one meaning.
    readRest(known + "  sum: {expression: 'road(t)*load.x + step(t, 0, 0, 1, 1)'}\n");
    readRest("parameters: {load: 2}\nprobes: {load: {expression: 3*load}}\n");
}

/** All places for laws and expressions, with '@' for the formula. **/
const std::vector<std::string> kPlacesOfLaws{
    "loads: {l: {on: a, force: ['@', 0, 0]}}\n",
    "loads: {l: {on: a, torque: [0, 0, '@']}}\n",
    "loads: {l: {body: a, nodes: N, pressure: '@'}}\n",
    "connectors: {c: {type: spring, between: [ground, a], law: '@'}}\n",
    "connectors: {c: {type: motor, joint: j, law: '@'}}\n",
    "states: {s: {rate: '@'}}\n",
    "states: {s: {pid: {input: '@', proportional: 1}}}\n",
    "states: {s: {state_space: {A: [[0]], B: [[1]], C: [[1]], inputs: ['@'], outputs: [y]}}}\n",
    "controllers: {s: {fmu: f.fmu, inputs: {u: '@'}, outputs: [y], period: 1}}\n",
    "events: {e: {when: '@ > 1'}}\n",
    "events: {e: {when: t > 1, do: [{set: s, to: '@'}]}}\n",
    "probes: {sum: {expression: '@'}}\n"};
const std::vector<std::pair<std::string, std::string>> kQuantities{
    {"probes", "{function: t}"},
    {"inputs", "1"},
    {"states", "{rate: 1}"},
    {"controllers", "{fmu: f.fmu, outputs: [y], period: 1}"},
    {"events", "{when: t > 1}"}};

TEST(ModelReader, EveryPairOfNamesIsToldApartWhereverFormulasStand) {
    for (const std::string& place : kPlacesOfLaws)
        for (const auto& [section, entry] : kQuantities) {
            const auto write = [&, &key = section, &value = entry](const std::string& others,
                                                                   const std::string& name,
                                                                   const std::string& formula) {
                std::string text = place;
                text.replace(text.find('@'), 1, formula);
                const std::string quantity = name + ": " + value;
                if (text.compare(0, key.size() + 3, key + ": {") == 0)
                    text.insert(key.size() + 3, quantity + ", ");
                else
                    text += key + ": {" + quantity + "}\n";
                return others + text;
            };
            const std::string parameter = "parameters: {load: 2}\n",
                              table = "tables: {load: {x: [0, 1], y: [0, 1]}}\n",
                              quantity = section + ".load";
            SCOPED_TRACE(place + section);
            readRest(write("", "load", "load"));
            readRest(write("", "load", quantity));
            readRest(write("", "load", quantity + ".x"));
            readRest(write(parameter, "load", "parameters.load + 2*" + quantity));
            EXPECT_THAT(
                refuseRest(write(parameter, "load", "1 + load")),
                AllOf(HasSubstr("'load' is a parameter and a"),
                      HasSubstr(": write parameters.load or " + quantity + ", or rename one")));
            readRest(write(table, "load", "load(t) + tables.load(t) + " + quantity));
            EXPECT_THAT(refuseRest(write(table, "load", "1 + load")),
                        HasSubstr("'load' is a table and a"));
            EXPECT_THAT(refuseRest(write("", "g", "1 + g")),
                        HasSubstr("'g' is a word of formulas and a"));
            readRest(write("", "g", section + ".g"));
            readRest(write("", "sin", "sin(t) + " + section + ".sin"));
            // Entries named like a section.
            readRest(write("", "probes", "probes.y"));
            EXPECT_THAT(refuseRest(write("parameters: {y: 1}\n", "parameters", "parameters.y")),
                        HasSubstr("'parameters.y' could be "));
        }
}

TEST(ModelReader, ConstantsAndFunctionsOfTimeKnowParametersWhateverElseIsCalledSo) {
    for (const auto& [section, entry] : kQuantities)
        for (const std::string word : {"load", "parameters.load"}) {
            const ModelValue model =
                readRest("parameters: {load: 2, twice: 2*" + word + "}\n" + section +
                         ": {load: " + entry + "}\nbodies: {a: {mass: 3*" + word +
                         "}}\nmotions: {m: {joint: j, position: '" + word + "*t + twice'}}\n");
            EXPECT_EQ(model.get("bodies").get("a").get("mass").getNumber(), 6);
            const Expression position =
                model.get("motions").get("m").get("position").getExpression();
            EXPECT_EQ(position.calcValue(5), 14);
        }
    EXPECT_THAT(refuseRest("probes: {load: {function: t}}\nbodies: {a: {mass: load}}\n"),
                HasSubstr("it is a quantity of the motion, and this is a constant"));
    EXPECT_THAT(refuseRest("parameters: {load: 2}\nbodies: {a: {mass: parameters.lod}}\n"),
                HasSubstr("did you mean 'parameters.load'?"));
    EXPECT_THAT(refuseRest("bodies: {a: {mass: parameters.pi}}\n"),
                HasSubstr("'parameters.pi' is not a parameter"));
}

TEST(ModelReader, FormulasOfOtherProbesUseNamesAndColumns) {
    const ModelValue model = readRest(
        "parameters: {k: 2}\nprobes:\n  a: {expression: tip.x - k*crank + 10*t}\n  b: {expression: "
        "tipp.x}\n");
    const std::vector<std::string> names{"tip.x", "tip.y", "a-b", "crank"};
    const VariableFormula formula(model.get("probes").get("a").get("expression"), names);
    ASSERT_THAT(formula.getUsed(), ElementsAre("tip.x", "crank"));
    const double values[] = {1, 0.25};
    EXPECT_DOUBLE_EQ(formula.calcValue(3, values), 1 - 0.5 + 30);
    double slopes[2];
    formula.calcSlopes(3, values, slopes);
    EXPECT_THAT(slopes, ElementsAre(1, -2));
    try {
        const VariableFormula wrong(model.get("probes").get("b").get("expression"), names);
        FAIL() << "an unknown name was accepted";
    } catch (const ModelError& error) {
        EXPECT_THAT(error.what(), AllOf(StartsWith("m.yaml:5:19: probes.b.expression: 'tipp.x'"),
                                        HasSubstr("did you mean 'tip.x'?")));
    }
}
