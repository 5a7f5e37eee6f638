/** @file
Descriptions of FMUs: written and refused ones. **/

#include <gmock/gmock.h>

#include <filesystem>
#include <set>

#include "cli/run/RunTest.h"
#include "fmu/RunningFmus.h"
#include "simflex/base/ZipFile.h"
#include "simflex/fmi/FmuUnit.h"
#include "simflex/fmi/FmuUnits.h"
#include "simflex/fmu/FmuExport.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::Optional;
namespace fs = std::filesystem;

class FmuFileTest : public RunTest {
protected:
    std::string describe(int version) {
        writeModel(
            "simflex: 1\n"
            "title: Rod & \"load\" <1>\n"
            "parameters: {mass: 2, heavy: 3*mass}\n"
            "bodies: {rod: {mass: mass, shape: {sphere: 0.1}}}\n"
            "inputs: {push: {start: 0.25, unit: kN}, wind: 1}\n"
            "loads: {push: {on: rod, force: [push, wind, 0]}}\n"
            "probes:\n"
            "  place: {position: rod}\n"
            "  acceleration: {acceleration: rod, component: x}\n"
            "  mixed: {expression: place.x + 2*wind, unit: furlong}\n"
            "analyses: {run: {type: transient, duration: 3, interval: 0.02}}\n");
        FmuExportOptions options;
        options.version = version;
        options.isThin = true;
        exportFmu(loadModelText(folder / "model.yaml"), folder / "model.fmu", options);
        unpackZip(folder / "model.fmu", folder.path());
        return testing::readText(folder / "modelDescription.xml");
    }

    std::string findMistake() {
        try {
            const FmuUnit unit(folder / "model.fmu");
            const FmuSlave slave(std::make_shared<const FmuUnit>(folder / "model.fmu"), "one",
                                 inThisProcess());
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }

    void pack(const std::string& xml, const std::string& library = "") {
        ZipWriter zip(folder / "model.fmu");
        zip.add("modelDescription.xml", xml);
        if (!library.empty()) zip.addFile("binaries/linux64/model.so", library);
        zip.finish();
    }
};

TEST_F(FmuFileTest, DescriptionsSayWhatTheModelHas) {
    for (const int version : {2, 3}) {
        const std::string xml = describe(version);
        const FmuDescription read = readFmuDescription(folder / "modelDescription.xml");
        EXPECT_EQ(read.version, version);
        EXPECT_EQ(read.name, "Rod & \"load\" <1>");
        EXPECT_EQ(read.identifier, "model");
        EXPECT_TRUE(read.canKeepState && read.canSerializeState && read.hasDerivatives);
        std::vector<std::string> names;
        std::set<unsigned> references;
        for (const FmuVariable& variable : read.variables) {
            names.push_back(variable.name);
            references.insert(variable.reference);
            const bool isGiven = variable.causality == FmuVariable::Causality::Parameter ||
                                 variable.causality == FmuVariable::Causality::Input;
            EXPECT_EQ(variable.start.has_value(), isGiven) << variable.name;
        }
        EXPECT_THAT(names,
                    ElementsAre("time", "parameters.mass", "parameters.heavy", "push", "wind",
                                "place.x", "place.y", "place.z", "acceleration", "mixed"));
        EXPECT_EQ(references.size(), names.size());
        EXPECT_THAT(read.find("push")->start, Optional(0.25));
        EXPECT_EQ(read.find("push")->unit, "kN");
        EXPECT_EQ(read.find("acceleration")->unit, "m/s^2");
        // Positions depend directly on no input, accelerations on all, formulas on those they name.
        const std::string key = version == 3 ? "<Output valueReference=\"" : "<Unknown index=\"";
        const auto number = [&](int index) {
            return std::to_string(version == 3 ? index : index + 1);
        };
        EXPECT_THAT(xml, HasSubstr(key + number(5) + "\" dependencies=\"\"/>"));
        EXPECT_THAT(xml, HasSubstr(key + number(8) + "\"/>"));
        EXPECT_THAT(xml, HasSubstr(key + number(9) + "\" dependencies=\"" + number(4) + "\"/>"));
        EXPECT_THAT(xml, HasSubstr("<Unit name=\"kN\"><BaseUnit kg=\"1\" m=\"1\" s=\"-2\" "
                                   "factor=\"1000\"/></Unit>"));
        EXPECT_THAT(xml, HasSubstr("<Unit name=\"furlong\"/>"));
        EXPECT_THAT(xml, HasSubstr("stopTime=\"3\" stepSize=\"0.02\""));
#ifdef SIMFLEX_FMI_SCHEMA
        if (version == 3 && runProgram("command", "-v xmllint") == 0) {
            EXPECT_EQ(runProgram("xmllint",
                                 "--noout --schema '" SIMFLEX_FMI_SCHEMA "' modelDescription.xml"),
                      0)
                << err;
        }
#endif
    }
}

TEST_F(FmuFileTest, TheSameModelGivesTheSameBytes) {
    describe(3);
    const std::string first = testing::readText(folder / "model.fmu");
    describe(3);
    EXPECT_EQ(testing::readText(folder / "model.fmu"), first);
}

TEST_F(FmuFileTest, UnitsAreThoseOfSI) {
    const auto expect = [](const char* unit, std::array<int, 8> powers, double factor) {
        const auto found = findBaseUnit(unit);
        ASSERT_TRUE(found) << unit;
        EXPECT_EQ(found->powers, powers) << unit;
        EXPECT_DOUBLE_EQ(found->factor, factor) << unit;
    };
    expect("N m", {1, 2, -2}, 1);
    expect("N*m/rad", {1, 2, -2, 0, 0, 0, 0, -1}, 1);
    expect("m/s^2", {0, 1, -2}, 1);
    expect("MPa", {1, -1, -2}, 1e6);
    expect("mm", {0, 1}, 1e-3);
    expect("min", {0, 0, 1}, 60);
    expect("deg", {0, 0, 0, 0, 0, 0, 0, 1}, 0.017453292519943295);
    expect("1/s", {0, 0, -1}, 1);
    EXPECT_FALSE(findBaseUnit("furlong"));
    EXPECT_FALSE(findBaseUnit("m/s/s"));
    EXPECT_FALSE(findBaseUnit("m^"));
    EXPECT_FALSE(findBaseUnit("m kg^0.5"));
}

TEST_F(FmuFileTest, BrokenUnitsAreRefusedByName) {
    EXPECT_THAT(findMistake(), HasSubstr("model.fmu': there is no such file"));
    testing::writeText(folder / "model.fmu", "nothing of the kind");
    EXPECT_THAT(findMistake(), HasSubstr("model.fmu' is no ZIP archive"));
    std::filesystem::remove(folder / "model.fmu");
    const std::string good = describe(2), bytes = testing::readText(folder / "model.fmu");
    EXPECT_EQ(findMistake(), "");
    std::string damaged = bytes;
    damaged[80] = char(~damaged[80]);
    testing::writeText(folder / "model.fmu", damaged);
    EXPECT_THAT(findMistake(), HasSubstr("model.fmu' is damaged"));
    for (const size_t size : {bytes.size() / 2, bytes.size() - 30}) {
        testing::writeText(folder / "model.fmu", bytes.substr(0, size));
        EXPECT_THAT(findMistake(), HasSubstr("model.fmu'"));
    }

    const auto change = [&](const std::string& from, const std::string& to) {
        std::string xml = good;
        const size_t place = xml.find(from);
        EXPECT_NE(place, xml.npos) << from;
        return xml.replace(place, from.size(), to);
    };
    pack(good);
    EXPECT_THAT(findMistake(), HasSubstr("it has no library linux64/model.so"));
    pack(change("fmiVersion=\"2.0\"", "fmiVersion=\"1.0\""));
    EXPECT_THAT(findMistake(), HasSubstr("it is of FMI 1.0"));
    pack(change("<CoSimulation", "<ModelExchange"));
    EXPECT_THAT(findMistake(), HasSubstr("it is not for co-simulation"));
    pack(change("fmiVersion=\"2.0\"", ""));
    EXPECT_THAT(findMistake(), HasSubstr("has no fmiVersion"));
    pack(good.substr(0, good.size() / 2));
    EXPECT_THAT(findMistake(),
                AllOf(HasSubstr("cannot be read: Error"), Not(HasSubstr("Simbody"))));
    pack("<html/>");
    EXPECT_THAT(findMistake(), HasSubstr("describes no FMU"));
    pack(good, folder / "modelDescription.xml");
    EXPECT_THAT(findMistake(), HasSubstr("its library linux64/model.so is damaged or cut off"));
    pack(good, SIMFLEX_BINARY_DIR "/lib/libsimflex_part.so");
    EXPECT_THAT(findMistake(), HasSubstr("has no function fmi2Instantiate"));
    pack(change("guid=\"{simflex", "guid=\"{other"), SIMFLEX_BINARY_DIR "/lib/libsimflex_fmu.so");
    EXPECT_THAT(findMistake(), HasSubstr("it gives no instance"));

    ZipWriter zip(folder / "model.fmu");
    zip.add("../outside.txt", "text");
    zip.finish();
    EXPECT_THAT(findMistake(), HasSubstr("would write outside of its folder: '../outside.txt'"));
}

TEST_F(FmuFileTest, ContentsOfFilesAreInTheTokenAndTheirNamesMayHoldWhatTheyLike) {
    const std::string table = "a #1: [x].csv";
    std::set<std::string> tokens;
    for (const char* rows : {"0 1\n1 2\n", "0 1\n1 3\n"}) {
        testing::writeText(folder / table, rows);
        writeModel(
            "simflex: 1\n"
            "bodies: {rod: {mass: 1, shape: {sphere: 0.1}}}\n"
            "tables: {curve: {file: '" +
            table +
            "'}}\n"
            "probes: {height: {expression: curve(1)}}\n");
        FmuExportOptions options;
        options.isThin = true;
        exportFmu(loadModelText(folder / "model.yaml"), folder / "model.fmu", options);
        const auto unit = std::make_shared<const FmuUnit>(folder / "model.fmu");
        tokens.insert(unit->getDescription().token);
        FmuSlave slave(unit, "one", inThisProcess());
        slave.enterInitialization(0);
        slave.exitInitialization();
        EXPECT_EQ(slave.get("height"), rows[6] - '0');
    }
    EXPECT_EQ(tokens.size(), 2u);
}

TEST_F(FmuFileTest, WhatCannotBeExportedIsRefused) {
    writeModel("simflex: 1\nbodies: {rod: {mass: 1, shape: {sphere: 0.1}}}\n");
    EXPECT_NE(runProgram("'" SIMFLEX_PROGRAM "'", "fmu model.yaml --fmi 1"), 0);
    EXPECT_NE(runProgram("'" SIMFLEX_PROGRAM "'", "fmu model.yaml -o nowhere/model.fmu"), 0);
    EXPECT_THAT(err, HasSubstr("nowhere/model.fmu"));
    FmuExportOptions options;
    options.library = folder / "missing.so";
    EXPECT_THROW(exportFmu(loadModelText(folder / "model.yaml"), folder / "model.fmu", options),
                 std::runtime_error);
    EXPECT_FALSE(fs::exists(folder / "model.fmu"));
}

}  // namespace
}  // namespace simflex
