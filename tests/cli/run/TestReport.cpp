/** @file
The HTML report of a run. **/

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "cli/run/RunTest.h"
#include "simflex/render/Image.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class ReportTest : public RunTest {
protected:
    /** Returns a red bar rotating about a pin at its end. **/
    static std::string makeBar(const std::string& analyses, const std::string& pictures = "") {
        return R"(simflex: 1
title: A bar </script> & <more>
gravity: [0, -9.81, 0]
parts: {bar: {deck: bar.inp, interfaces: {root: LEFT, tip: RIGHT}, modes: 14}}
bodies: {bar: {part: bar, damping: 0.1, color: [1, 0, 0]}}
joints: {pivot: {type: pin, between: [ground, bar.root], axis: z}}
connectors: {spring: {type: spring, between: [{on: ground, position: [0, 0.1, 0]}, bar.tip], stiffness: 0.01, free_length: 0.1}}
solver: {accuracy: 1e-7}
initial: {rates: {pivot: 40}}
probes: {tip: {position: bar.tip}, angle: {coordinate: pivot}}
analyses: {)" + analyses +
               "}\npictures: {size: [640, 360], shadows: false" + pictures + "}\n";
    }
    int report(const std::string& arguments) {
        return runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                          "report --quiet " + arguments);
    }
    void SetUp() override {
        RunTest::SetUp();
        testing::Brick soft;
        soft.E = 2e6;
        testing::writeText(folder / "bar.inp", soft.text());
    }
    const std::string swing = "swing: {type: transient, duration: 0.25, interval: 1/64}";
};

TEST_F(ReportTest, ThePageHasTheMotionTheCurvesAndTheTables) {
    writeModel(makeBar(swing + ", modes: {type: eigen, count: 2, about: static}"));
    ASSERT_EQ(runModel("--no-pictures"), 0) << err;
    ASSERT_EQ(report("model.results.h5"), 0) << err;
    EXPECT_THAT(out, HasSubstr("report: model.results.html, 2 analyses, "));
    const std::string page = testing::readText(folder / "model.results.html");
    EXPECT_THAT(page, HasSubstr("<h1>A bar &lt;/script&gt; &amp; &lt;more&gt;</h1>"));
    EXPECT_THAT(page, HasSubstr("<td>angle [rad]</td>"));
    EXPECT_THAT(page, HasSubstr("<th>frequency [Hz]</th>"));
    EXPECT_THAT(page, HasSubstr("joints: {pivot: {type: pin"));
    ASSERT_EQ(runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                         "post -q model.results.h5 --no-pictures --vtk run.pvd"),
              0)
        << err;
    const std::string command =
        "cd '" + (folder / "") + "' && /usr/bin/python3 '" + SIMFLEX_SOURCE_DIR +
        "/tests/cli/run/check_report.py' model.results.html run bar >out 2>&1";
    EXPECT_EQ(std::system(command.c_str()), 0) << testing::readText(folder / "out");
    EXPECT_THAT(testing::readText(folder / "out"), HasSubstr(" vertices at 17 times"));
    // The same results give identical bytes.
    ASSERT_EQ(report("model.results.h5 -o again.html"), 0) << err;
    EXPECT_TRUE(page == testing::readText(folder / "again.html"));
}

TEST_F(ReportTest, TextsOfTheModelAreNeverPartOfThePage) {
    writeModel(R"(simflex: 1
bodies: {mass: {mass: 1, inertia: [1, 1, 1]}}
probes: {ramp: {function: t, unit: "<b> \" ' onfocus=alert(1) &"}}
analyses: {run: {type: transient, duration: 0.1, interval: 0.05}}
)");
    ASSERT_EQ(runModel("--no-pictures"), 0) << err;
    ASSERT_EQ(report("model.results.h5"), 0) << err;
    const std::string page = testing::readText(folder / "model.results.html");
    EXPECT_THAT(page, HasSubstr("&lt;b&gt; &quot; &#39; onfocus=alert(1) &amp;"));
    EXPECT_THAT(page, Not(HasSubstr("<b> ")));
    EXPECT_THAT(page, HasSubstr("script-src 'sha256-"));
}

TEST_F(ReportTest, ResponsesOverFrequencyAreCurves) {
    writeModel(R"(simflex: 1
bodies:
  mass: {mass: 2, inertia: [1, 1, 1], mobilizer: {type: slider}}
connectors: {spring: {type: spring, between: [{on: ground, position: [-1, 0, 0]}, mass], stiffness: 200, damping: 1, free_length: 1}}
loads: {push: {on: mass, force: [0, 0, 0]}}
probes: {place: {position: mass, component: x}}
analyses: {shake: {type: frequency_response, inputs: [loads.push.force.x], frequencies: {from: 0.5, to: 20, count: 20}}}
)");
    ASSERT_EQ(runModel(), 0) << err;
    ASSERT_EQ(report("model.results.h5"), 0) << err;
    const std::string page = testing::readText(folder / "model.results.html");
    EXPECT_THAT(page, HasSubstr("<b>place [m/N] over Hz</b>"));
    EXPECT_THAT(page, HasSubstr("\"log\": true"));
}

TEST_F(ReportTest, WhatCannotBeShownIsTold) {
    writeModel(makeBar(swing));
    ASSERT_EQ(runModel("--no-pictures --set output.states=none -o none.h5"), 0) << err;
    ASSERT_EQ(report("none.h5"), 0) << err;
    EXPECT_THAT(testing::readText(folder / "none.html"), HasSubstr("the run has kept no states"));
    ASSERT_EQ(runModel("--no-pictures"), 0) << err;
    EXPECT_NE(report("model.results.h5 -o page.pdf"), 0);
    EXPECT_THAT(err, HasSubstr("'page.pdf' is not a page that can be written: name it .html"));
    EXPECT_NE(report("model.results.h5 --only walk"), 0);
    EXPECT_THAT(err, HasSubstr("there is no analysis 'walk'"));
    std::filesystem::remove(folder / "bar.inp");
    ASSERT_EQ(report("model.results.h5 -o without.html"), 0) << err;
    EXPECT_THAT(err, HasSubstr("the page shows no motion: "));
    const std::string page = testing::readText(folder / "without.html");
    EXPECT_THAT(page, HasSubstr("<p class=\"warning\">The motion is not shown: "));
    EXPECT_THAT(page, HasSubstr("bar.inp"));
    EXPECT_THAT(page, Not(HasSubstr("\"geometries\":")));
}

#ifdef SIMFLEX_CHROMIUM

TEST_F(ReportTest, ABrowserPlaysTurnsAndDrawsWhatPicturesShow) {
    writeModel(makeBar(
        swing,
        ", contour: none, exaggeration: 4, ghost: false, axes: false, connectors: false, rate: "
        "64, folder: shots"));
    ASSERT_EQ(runModel(), 0) << err;
    ASSERT_EQ(report("model.results.h5 -o page.html"), 0) << err;
    const std::string page = testing::readText(folder / "page.html");
    const auto open = [&](const std::string& script, const std::string& arguments) {
        testing::writeText(folder / "driven.html", page + "<script>" + script + "</script>\n");
        const std::string command =
            "cd '" + (folder / "") +
            "' && timeout 120 '" SIMFLEX_CHROMIUM
            "' --headless --no-sandbox --use-angle=swiftshader --enable-unsafe-swiftshader "
            "--user-data-dir=profile --window-size=640,360 --hide-scrollbars "
            "--virtual-time-budget=5000 " +
            arguments + " 'file://" + (folder / "driven.html") + "' >dom 2>log";
        EXPECT_EQ(std::system(command.c_str()), 0) << testing::readText(folder / "log");
        return testing::readText(folder / "dom");
    };
    const std::string dom = open(R"(
        (async () => {
          const is = name => document.querySelector(`[data-is="${name}"]`), found = [];
          const scene = is("scene"), clock = () => Number(is("clock").textContent.slice(4, -2));
          const look = () => scene.toDataURL(), box = scene.getBoundingClientRect();
          const drag = (type, x, y) => scene.dispatchEvent(new PointerEvent(type,
              {pointerId: 1, buttons: 1, clientX: box.left + x, clientY: box.top + y, bubbles: true}));
          const press = key => scene.dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true}));
          const check = (name, isTrue) => found.push(name + "=" + isTrue);
          check("ready", document.documentElement.dataset.ready === "yes");
          const first = look();
          drag("pointerdown", 100, 100); drag("pointermove", 180, 120); drag("pointerup", 180, 120);
          check("turned", look() !== first);
          scene.dispatchEvent(new MouseEvent("dblclick"));
          check("back", look() === first);
          press("End");
          check("end", Math.abs(clock() - 0.25) < 1e-9 && look() !== first);
          press("Home"); press("ArrowRight");
          check("stepped", clock() > 0);
          const slider = is("time");
          slider.value = 5000; slider.dispatchEvent(new Event("input"));
          check("slid", Math.abs(clock() - 0.125) < 1e-4);
          const before = look(), factor = is("factor");
          factor.value = 0; factor.dispatchEvent(new Event("change"));
          check("unexaggerated", look() !== before);
          const plot = document.querySelector("figure canvas"), at = plot.getBoundingClientRect();
          plot.dispatchEvent(new PointerEvent("pointerdown", {buttons: 1, clientX: at.right - 8, clientY: at.top + 50}));
          check("sought", Math.abs(clock() - 0.25) < 1e-3);
          press("Home");
          is("play").click();
          await new Promise(done => setTimeout(done, 400));
          check("played", clock() > 0);
          is("play").click();
          const held = clock();
          await new Promise(done => setTimeout(done, 200));
          check("held", clock() === held);
          document.body.dataset.found = found.join(" ");
        })();)",
                                 "--dump-dom");
    for (const char* const what : {"ready", "turned", "back", "end", "stepped", "slid",
                                   "unexaggerated", "sought", "played", "held"})
        EXPECT_THAT(dom, HasSubstr(std::string(what) + "=true"))
            << testing::readText(folder / "log");

    // The same pixels are red as in the picture of the same time.
    open(R"(
        const is = name => document.querySelector(`[data-is="${name}"]`), scene = is("scene");
        document.querySelector("main").replaceChildren(document.querySelector("section"));
        scene.style.cssText = "position: fixed; left: 0; top: 0; width: 640px; height: 360px; z-index: 9";
        document.querySelector(".stage").style.position = "static";
        scene.dispatchEvent(new KeyboardEvent("keydown", {key: "End", bubbles: true}));)",
         "--screenshot=shot.png");
    const Image shot = Image::readPng(folder / "shot.png"),
                picture = Image::readPng(folder / "shots/frame_00016.png");
    const auto isRed = [](const Image::Pixel& p) { return p[0] > 2 * p[1] && p[0] > 2 * p[2]; };
    int numBoth = 0, numEither = 0;
    for (int y = 0; y < 360; ++y)
        for (int x = 0; x < 640; ++x) {
            const bool inShot = isRed(shot.getPixel(x, y)),
                       inPicture = isRed(picture.getPixel(x, y));
            numBoth += inShot && inPicture;
            numEither += inShot || inPicture;
        }
    EXPECT_GT(numBoth, 1000);
    EXPECT_GT(numBoth, 0.9 * numEither);  // except for edges
}

#endif

}  // namespace
}  // namespace simflex
