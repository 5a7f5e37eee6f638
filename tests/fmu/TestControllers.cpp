/** @file
FMUs that control a model. **/

#include <filesystem>

#include "cli/run/RunTest.h"
#include "fmu/RunningFmus.h"
#include "simflex/base/Progress.h"
#include "simflex/base/ZipFile.h"
#include "simflex/fmi/FmuUnit.h"
#include "simflex/fmu/FmuExport.h"
#include "simflex/model/Session.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using Values = std::vector<double>;

/** Outputs gain·(0.5 − angle), and an integral of it. **/
const char* const kController =
    "simflex: 1\n"
    "parameters: {gain: 30}\n"
    "bodies: {idle: {mass: 1, shape: {sphere: 0.1}, mobilizer: {type: slider}}}\n"
    "inputs: {angle: {unit: rad}}\n"
    "states: {sum: {rate: 0.5 - angle}}\n"
    "probes: {torque: {expression: gain*(0.5 - angle), unit: N m}, integral: {state: sum}}\n";

const char* const kPendulum =
    "controllers:\n"
    "  pid: {fmu: controller.fmu, inputs: {angle: turned}, outputs: {moment: torque, sum: "
    "integral},\n"
    "    period: 0.01, start: {parameters.gain: 40}}\n"
    "connectors: {motor: {type: motor, joint: pivot, law: pid.moment + 20*pid.sum - 4*speed}}\n"
    "probes: {turned: {coordinate: pivot}, moment: {expression: pid.moment}}\n"
    "solver: {accuracy: 1e-7}\n"
    "analyses: {run: {type: transient, duration: 0.5, interval: 0.01}}\n";

class ControllerTest : public RunTest {
protected:
    void SetUp() override {
        RunTest::SetUp();
        for (const int version : {2, 3}) {
            writeModel(kController);
            FmuExportOptions options;
            options.version = version;
            options.isThin = true;
            exportFmu(loadModelText(folder / "model.yaml"),
                      folder / (version == 2 ? "controller.fmu" : "third.fmu"), options);
        }
    }

    ModelText write(const std::string& model = kPendulum) {
        writeModel(makePendulum("0", model));
        return loadModelText(folder / "model.yaml");
    }

    std::string findMistake(const std::string& from, const std::string& to) {
        std::string text = kPendulum;
        const size_t place = text.find(from);
        EXPECT_NE(place, text.npos) << from;
        try {
            const Session session(write(text.replace(place, from.size(), to)),
                                  allow(inChildProcess()));
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }
};

TEST_F(ControllerTest, ASampledUnitIsASampleAndHold) {
    Session own(write(
        "states:\n"
        "  moment: {sample_and_hold: {input: 40*(0.5 - turned), period: 0.01}}\n"
        "  sum: {sample_and_hold: {input: \"sum + (t > 0 ? 0.01*(0.5 - turned) : 0)\", period: "
        "0.01}}\n"
        "connectors: {motor: {type: motor, joint: pivot, law: moment + 20*sum - 4*speed}}\n"
        "probes: {turned: {coordinate: pivot}}\n"
        "solver: {accuracy: 1e-7}\n"));
    own.runTo(0.5, 0.1);
    for (const char* file : {"controller.fmu", "third.fmu"}) {
        std::string text = kPendulum;
        text.replace(text.find("controller.fmu"), 14, file);
        Session session(write(text), allow(inChildProcess()));
        session.runTo(0.5, 0.1);
        EXPECT_NEAR(session.get("turned")[0], own.get("turned")[0], 1e-9) << file;
        EXPECT_GT(session.get("turned")[0], 0.1);
    }
}

TEST_F(ControllerTest, SessionsAndRunsGoBackAndOnWithTheSameBits) {
    Session session(write(), allow(inChildProcess()));
    const double begin = session.get("moment")[0];
    EXPECT_EQ(begin, 20);
    session.runTo(0.205, 0.1);
    const SavedState saved = session.save();
    session.runTo(0.5, 0.1);
    const double end = session.get("turned")[0];
    session.restore(saved);
    session.runTo(0.5, 0.1);
    EXPECT_EQ(session.get("turned")[0], end);
    // In a separate Session, whose FMU is in its initial state.
    Session other(session.getText(), allow(inChildProcess()));
    other.restore(other.unpack(session.pack(saved)));
    other.runTo(0.5, 0.1);
    EXPECT_EQ(other.get("turned")[0], end);
    session.reset();
    EXPECT_EQ(session.get("moment")[0], begin);
    session.runTo(0.5, 0.01);
    ASSERT_EQ(runModel("--allow-fmus"), 0) << err;
    EXPECT_EQ(find(read("run"), "turned").rows.back()[0], session.get("turned")[0]);
    session.set("joints.pivot.angle", {0.1});  // the controller is unchanged
    session.runTo(0.6, 0.1);
}

TEST_F(ControllerTest, WhatItRemembersGoesToTheNextAnalysisOfARunAndIsNeverMadeUp) {
    std::string text = kPendulum;
    text.replace(text.find("duration: 0.5"), text.npos,
                 "duration: 0.2, interval: 0.01},\n"
                 "  more: {type: transient, from: run, duration: 0.3, interval: 0.01}}\n");
    write(text);
    ASSERT_EQ(runModel("--allow-fmus"), 0) << err;
    Session session(loadModelText(folder / "model.yaml"), allow(inChildProcess()));
    session.runTo(0.2, 0.01);
    session.runTo(0.5, 0.01);
    EXPECT_NEAR(find(read("more"), "turned").rows.back()[0], session.get("turned")[0], 1e-5);
    EXPECT_NEAR(find(read("more"), "moment").rows.back()[0], session.get("moment")[0], 1e-3);
    EXPECT_NE(runModel("--only more --allow-fmus"), 0);
    EXPECT_THAT(err, HasSubstr("analysis 'more' cannot begin at the end of 'run': the result file "
                               "does not have what controller 'pid' remembers"));
    EXPECT_THROW(session.keepState(folder / "kept.state"), std::runtime_error);
}

TEST_F(ControllerTest, AUnitThatCannotSayWhatItRemembersGoesForwardOnly) {
    const std::string place = folder.makeFolder("unpacked");
    unpackZip(folder / "controller.fmu", place);
    std::string xml = testing::readText(place + "/modelDescription.xml");
    const std::string flag = " canSerializeFMUstate=\"true\"";
    xml.erase(xml.find(flag), flag.size());
    ZipWriter zip(folder / "controller.fmu");
    zip.add("modelDescription.xml", xml);
    for (const char* file :
         {"resources/simflex.txt", "resources/model.yaml", "binaries/linux64/model.so"})
        zip.addFile(file, place + '/' + file);
    zip.finish();
    Session session(write(), allow(inChildProcess()));
    session.runTo(0.3, 0.1);
    const SavedState saved = session.save();
    session.runTo(0.5, 0.1);
    const double end = session.get("turned")[0];
    session.restore(saved);
    try {
        session.runTo(0.5, 0.1);
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("controller 'pid' cannot be restored"));
    }
    session.reset();
    session.runTo(0.3, 0.1);
    session.runTo(0.5, 0.1);
    EXPECT_EQ(session.get("turned")[0], end);
}

TEST_F(ControllerTest, AModelWithAControllerIsAUnitItself) {
    const ModelText text = write();
    FmuExportOptions options;
    options.isThin = true;
    EXPECT_THROW(exportFmu(text, folder / "whole.fmu", options), std::runtime_error);
    options.code = inChildProcess();
    exportFmu(text, folder / "whole.fmu", options);
    Session session(text, allow(inChildProcess()));
    session.runTo(0.3, 0.3);
    std::filesystem::remove(folder / "controller.fmu");
    FmuSlave slave(std::make_shared<const FmuUnit>(folder / "whole.fmu"), "whole",
                   inChildProcess());
    slave.enterInitialization(0);
    slave.exitInitialization();
    EXPECT_TRUE(slave.doStep(0, 0.3));
    EXPECT_EQ(slave.get("turned"), session.get("turned")[0]);
}

TEST_F(ControllerTest, WhatDoesNotFitIsRefusedByName) {
    EXPECT_EQ(findMistake("period", "period"), "");
    EXPECT_THAT(findMistake("fmu: controller.fmu", "fmu: missing.fmu"), HasSubstr("missing.fmu"));
    EXPECT_THAT(findMistake("fmu: controller.fmu", "fmu: model.yaml"),
                HasSubstr("model.yaml' is no ZIP archive"));
    EXPECT_THAT(findMistake("inputs: {angle:", "inputs: {angel:"),
                HasSubstr("controllers.pid.inputs.angel: "));
    EXPECT_THAT(findMistake("moment: torque", "moment: torqe"), HasSubstr("'torque'"));
    EXPECT_THAT(findMistake("parameters.gain", "parameters.gian"), HasSubstr("parameters.gain"));
    EXPECT_THAT(findMistake("pid.moment + 20", "pid.momentum + 20"), HasSubstr("pid.moment"));
    EXPECT_THAT(findMistake("period: 0.01", "period: 0"), HasSubstr("period"));
    EXPECT_THAT(findMistake("angle: turned", "angle: nothing"), HasSubstr("nothing"));
    Session session(write(), allow(inChildProcess()));
    try {
        session.settle();
        FAIL();
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("'pid."));
    }
}

}  // namespace
}  // namespace simflex
