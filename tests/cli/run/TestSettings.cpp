/** @file
Settings of model files that must not change a result, or must change a picture. **/

#include "cli/run/RunTest.h"

namespace simflex {
namespace {

class RunSettingsTest : public RunTest {};

/** Returns the angle after `duration` of the pendulum of makePendulum(), released at `angle`, by
Runge-Kutta. **/
double swing(double angle, double duration) {
    const auto accelerate = [](double phi) {
        return -2 * 9.81 * 0.5 / (1.0 / 6 + 2 * 0.25) * std::sin(phi);
    };
    const int numSteps = 20000;
    const double h = duration / numSteps;
    double phi = angle, rate = 0;
    for (int i = 0; i < numSteps; ++i) {
        const double k1 = rate, l1 = accelerate(phi);
        const double k2 = rate + h / 2 * l1, l2 = accelerate(phi + h / 2 * k1);
        const double k3 = rate + h / 2 * l2, l3 = accelerate(phi + h / 2 * k2);
        const double k4 = rate + h * l3, l4 = accelerate(phi + h * k3);
        phi += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
        rate += h / 6 * (l1 + 2 * l2 + 2 * l3 + l4);
    }
    return phi;
}

TEST_F(RunSettingsTest, SolversAgreeOnTheMotion) {
    const double exact = swing(1, 0.5) - 1;  // relative to the placement
    for (const char* solver :
         {"{accuracy: 1e-8, block_form: arrow}", "{accuracy: 1e-8, block_form: dense, threads: 1}",
          "{accuracy: 1e-8, method: bdf, formulation: index3}",
          "{accuracy: 1e-8, method: generalized_alpha, spectral_radius: 0.9}",
          "{accuracy: 1e-8, initial_step: 1e-5, maximum_step: 1e-3, minimum_step: 1e-12, "
          "maximum_iterations: 20, constraint_tolerance: 1e-11}",
          "{fixed_step: 1e-4, method: bdf, maximum_order: 2}"}) {
        SCOPED_TRACE(solver);
        writeModel(
            makePendulum("1", std::string("description: one of several\n"
                                          "probes: {angle: {coordinate: pivot}}\n"
                                          "output: {states: none}\n"
                                          "analyses: {run: {type: transient, duration: 0.5}}\n"
                                          "solver: ") +
                                  solver + "\n"));
        ASSERT_EQ(runModel(), 0) << err;
        const Results::Analysis run = read("run");
        EXPECT_NEAR(find(run, "angle").rows.back()[0], exact, 2e-5);
        EXPECT_TRUE(run.q.empty());
    }
}

TEST_F(RunSettingsTest, RunsThatStartStaticStayAtRest) {
    writeModel(makePendulum("1",
                            "probes: {tip: {position: {on: rod, position: [0, -0.5, 0]}}}\n"
                            "initial: {start: static}\n"
                            "solver: {accuracy: 1e-8}\n"
                            "analyses: {run: {type: transient, duration: 0.2}}\n"));
    ASSERT_EQ(runModel(), 0) << err;
    const Results::Analysis run = read("run");
    for (const std::vector<double>& row : find(run, "tip").rows) {
        EXPECT_NEAR(row[0], 0, 1e-6);
        EXPECT_NEAR(row[1], -1, 1e-6);
    }
}

TEST_F(RunSettingsTest, EverySettingOfPicturesShows) {
    const auto draw = [&](const std::string& settings) {
        writeModel(
            "simflex: 1\n"
            "bodies: {box: {shape: {box: [0.2, 0.3, 0.1]}, density: 1000, color: steel}}\n"
            "joints: {pivot: {type: pin, between: [ground, {on: box, position: [0, 0.15, 0]}]}}\n"
            "analyses: {run: {type: transient, duration: 0.1}}\n"
            "pictures: {size: [96, 72], rate: 10, folder: shots" +
            settings + "}\n");
        EXPECT_EQ(runModel(), 0) << settings << ": " << err;
        const std::vector<std::string> files = testing::listFiles(folder / "shots");
        return files.empty() ? std::string()
                             : testing::readText(folder / ("shots/" + files.back()));
    };
    const std::string plain = draw("");
    ASSERT_EQ(plain.substr(1, 3), "PNG");
    EXPECT_EQ(draw(""), plain);
    const char* const camera = ", cameras: [{view: isometric";
    const std::string viewed = draw(std::string(camera) + "}]");
    for (const char* setting : {", theme: dark", ", up: z", ", wireframe: true", ", ground: -1",
                                ", transparent: true", ", joints: true", ", axes: false"})
        EXPECT_NE(draw(setting), plain) << setting;
    for (const char* setting :
         {", orbit: 5}]", ", perspective: 10*deg}]", ", orthographic: true}]"})
        EXPECT_NE(draw(camera + std::string(setting)), viewed) << setting;
    const std::string placed = ", cameras: [{position: [1, 1, 1], look_at: [0, 0, 0]";
    EXPECT_NE(draw(placed + "}]"), draw(placed + ", up: x}]"));
}

}  // namespace
}  // namespace simflex
