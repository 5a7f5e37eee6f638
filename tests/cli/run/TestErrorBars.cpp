/** @file
Error bars against the true error: the same run with 200 modes. **/

#include <complex>
#include <fstream>
#include <sstream>

#include "cli/run/RunTest.h"
#include "fe/TestDecks.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

/** A pinned bar, started with a jerk, with a weight swinging at its end. **/
class ErrorBarTest : public RunTest {
protected:
    void SetUp() override {
        testing::Brick brick;
        brick.size = {0.4, 0.03, 0.02};
        brick.elements = {16, 2, 2};
        testing::writeText(folder / "bar.inp", brick.text());
        writeModel(R"YAML(simflex: 1
gravity: [0, -9.81, 0]
parts:
  bar: {deck: bar.inp, interfaces: {near: LEFT, far: RIGHT}, modes: 16, stress: all}
bodies:
  bar: {part: bar, damping: 0.02}
  weight: {mass: 0.1, shape: {box: [0.02, 0.02, 0.02]}, place: {at: bar.far}}
joints:
  bearing: {type: pin, axis: z, between: [ground, bar.near]}
  grip: {type: weld, between: [bar.far, weight]}
motions:
  drive: {joint: bearing, position: "step(t, 0, 0, 0.02, 0.4)"}
solver: {accuracy: 1e-10}
probes:
  tip: {position: bar.far}
  middle: {displacement: {body: bar, node: 77}, relative_to: bar.near}
  stress: {stress: {body: bar, node: 77, what: xx}}
  bearing: {reaction: bearing}
  torque: {driving: drive}
  xi: {modes: bar, select: [1]}
analyses:
  rest: {type: static}
  swing: {type: transient, duration: 0.04, interval: 1e-4}
)YAML");
    }

    /** Returns the share of samples at which the true error is within a factor of 2 of the bar.
    Samples whose error is lost in the run's last digits do not count. **/
    double calcTrusted(const Results::Analysis& run, const Results::Analysis& full,
                       const std::string& probe, size_t column) {
        const Results::Series &given = find(run, probe), &error = find(run, probe + " error"),
                              &truth = find(full, probe);
        double largest = 0;
        for (size_t k = 0; k < given.rows.size(); ++k)
            largest = std::max(largest, std::abs(truth.rows[k][column] - given.rows[k][column]));
        int within = 0, count = 0;
        for (size_t k = 0; k < given.rows.size(); ++k) {
            const double actual = std::abs(truth.rows[k][column] - given.rows[k][column]),
                         bar = std::abs(error.rows[k][column]);
            if (actual < 1e-3 * largest) continue;
            ++count;
            within += 0.5 * bar <= actual && actual <= 2 * bar;
        }
        EXPECT_GT(count, int(given.rows.size()) / 2) << probe;
        return double(within) / count;
    }
};

TEST_F(ErrorBarTest, TheErrorIsWithinAFactorOfTwoOfItsBarAtNineOfTenSamples) {
    ASSERT_EQ(runModel("--set parts.bar.modes=200 -o full.h5"), 0) << err;
    const Results::Analysis full = read("swing", "full.h5");
    for (const char* modes : {"12", "16", "24", "36"}) {
        ASSERT_EQ(runModel(std::string("--error-bar --set parts.bar.modes=") + modes), 0) << err;
        const Results::Analysis run = read("swing");
        for (const auto& [probe, column] : {std::pair{"tip", 0},
                                            {"tip", 1},
                                            {"middle", 1},
                                            {"stress", 0},
                                            {"bearing", 1},
                                            {"torque", 0}})
            EXPECT_GE(calcTrusted(run, full, probe, size_t(column)), 0.9)
                << probe << " with " << modes << " modes";
        const auto& rest = read("rest");
        EXPECT_EQ(find(rest, "middle error").rows.size(), 1u);
        EXPECT_EQ(find(rest, "middle error").column.unit, "m");
        for (const Results::Series& series : run.probes)
            EXPECT_NE(series.column.name, "xi error");  // other modes
    }
}

TEST_F(ErrorBarTest, TheModesThatAreAdvisedDo) {
    ASSERT_EQ(runModel("--error-bar --set parts.bar.modes=12"), 0) << err;
    const std::string wanted = " modes instead of 12 for 1 % of middle.y";
    const size_t at = out.find(wanted);
    ASSERT_NE(at, std::string::npos) << out;
    const size_t begin = out.rfind("bar: ", at) + 5;
    const std::string modes = out.substr(begin, at - begin);
    ASSERT_EQ(runModel("--error-bar --set parts.bar.modes=" + modes), 0) << err;
    EXPECT_EQ(out.find(" for 1 % of middle.y"), std::string::npos) << out;
}

TEST_F(ErrorBarTest, ResponsesHaveErrorsAndLinearModelsAreNamedAsHavingNone) {
    const std::string analyses =
        "--set 'loads={push: {on: bar.far, force: [0, 0, 0]}}' --set 'analyses={rest: {type: "
        "static}, modes: {type: eigen, about: rest, count: 2}, fr: {type: frequency_response, "
        "about: rest, inputs: [loads.push.force.y], outputs: [middle.y], adaptive: false, "
        "frequencies: {from: 10, to: 300, count: 30}}, lin: {type: linear, about: rest, inputs: "
        "[loads.push.force.y], outputs: [middle.y]}}' ";
    ASSERT_EQ(runModel(analyses + "--error-bar --set parts.bar.modes=12"), 0) << err;
    const Results::Analysis run = read("fr"), finer = read("fr", "model.results.finer.h5");
    double largest = 0, size = 0;
    for (size_t n = 0; n < 30; ++n) {
        const auto calc = [n](const Results::Analysis& of) {
            return std::polar(of.matrices.at("magnitude").at(n).at(0),
                              of.matrices.at("phase").at(n).at(0) * std::acos(-1.0) / 180);
        };
        largest = std::max(largest, std::abs(calc(finer) - calc(run)));
        size = std::max({size, std::abs(calc(finer)), std::abs(calc(run))});
    }
    const size_t at = out.find("  middle.y by loads.push.force.y [m/N]");
    ASSERT_NE(at, std::string::npos) << out;
    std::istringstream line(out.substr(at + 39));
    double told = 0, frequency = 0, rms = 0, percent = 0;
    line >> told >> frequency >> rms >> percent;
    EXPECT_GT(largest, 0);
    EXPECT_NEAR(told, largest, 1e-4 * largest);
    EXPECT_NEAR(percent, 100 * largest / size, 1e-2 * percent);
    EXPECT_EQ(out.find("frequency 3 [Hz]"), std::string::npos) << out;
    EXPECT_THAT(out, HasSubstr("no error bar: analysis 'lin' is a linear model"));
    // There are no steps to verify, and nothing that exists in a rigid model, too.
    ASSERT_EQ(runModel(analyses + "--verify --rigid -o rigid.h5"), 0) << err;
    EXPECT_THAT(out, HasSubstr("nothing to verify: "));
    EXPECT_THAT(out, HasSubstr("rest: flexible against rigid"));
    ASSERT_EQ(runModel(analyses + "--only lin --rigid -o lin.h5"), 0) << err;
    EXPECT_THAT(out, HasSubstr("nothing to compare: "));
}

TEST_F(ErrorBarTest, TheRunItselfIsNotChangedByItsBars) {
    ASSERT_EQ(runModel("-o alone.h5"), 0) << err;
    ASSERT_EQ(runModel("--error-bar"), 0) << err;
    const Results::Analysis alone = read("swing", "alone.h5"), run = read("swing");
    EXPECT_EQ(find(alone, "tip").rows, find(run, "tip").rows);
    EXPECT_EQ(alone.q, run.q);
    // Once more on top of its own results.
    ASSERT_EQ(runModel("--error-bar --resume"), 0) << err;
    EXPECT_EQ(find(read("swing"), "tip error").rows, find(run, "tip error").rows);
}

TEST_F(ErrorBarTest, PostProcessingKeepsThem) {
    ASSERT_EQ(runModel("--error-bar"), 0) << err;
    ASSERT_EQ(runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                         "post model.results.h5 -o post.h5 --set "
                         "'probes.new={velocity: bar.far, component: y}'"),
              0)
        << err;
    EXPECT_THAT(out + err, HasSubstr("new has no error bars"));
    const Results::Analysis run = read("swing"), post = read("swing", "post.h5");
    for (const char* name : {"tip error", "stress error", "torque error"})
        EXPECT_EQ(find(post, name).rows, find(run, name).rows);
    for (const Results::Series& series : post.probes) EXPECT_NE(series.column.name, "new error");
    EXPECT_EQ(find(read("rest", "post.h5"), "middle error").rows,
              find(read("rest"), "middle error").rows);
    // A changed probe keeps no error bar.
    ASSERT_EQ(runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                         "post model.results.h5 -q -o post.h5 --set "
                         "'probes.tip={velocity: bar.far}'"),
              0)
        << err;
    for (const Results::Series& series : read("swing", "post.h5").probes)
        EXPECT_NE(series.column.name, "tip error");
}

TEST_F(ErrorBarTest, PartFilesMustHaveFurtherModes) {
    const std::string reduce = "reduce bar.inp -i near=LEFT -i far=RIGHT --quiet -o bar.h5 ",
                      given = reduce + "--modes 16 ";
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", given), 0) << err;
    writeModel(R"(simflex: 1
parts: {bar: {file: bar.h5}}
bodies: {bar: {part: bar}}
joints: {bearing: {type: weld, between: [ground, bar.near]}}
gravity: [0, -9.81, 0]
probes: {tip: {displacement: {body: bar, node: 77}, relative_to: bar.near}}
analyses: {rest: {type: static}}
)");
    EXPECT_NE(runModel("--error-bar"), 0);
    EXPECT_THAT(err, HasSubstr("simflex reduce --further-modes 24"));
    EXPECT_FALSE(std::ifstream(folder / "model.results.h5").good());  // refused before the run
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", given + "--further-modes 24"), 0) << err;
    ASSERT_EQ(runModel("--error-bar"), 0) << err;
    // With inertia relief the weight is fully represented: the remaining error is round-off.
    const double error = find(read("rest"), "tip error").rows[0][1];
    EXPECT_GT(std::abs(error), 1e-9);
    ASSERT_EQ(runProgram("'" SIMFLEX_PROGRAM "'", reduce + "--modes 24 --inertia-relief"), 0)
        << err;
    const double before = find(read("rest"), "tip").rows[0][1];
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_NEAR(find(read("rest"), "tip").rows[0][1] - before, error, 1e-4 * std::abs(error));
}

TEST_F(ErrorBarTest, ModelsThatCannotBendHaveNone) {
    writeModel(makePendulum("0.3", "analyses: {rest: {type: transient, duration: 0.1}}\n"));
    EXPECT_NE(runModel("--error-bar"), 0);
    EXPECT_THAT(err, HasSubstr("no body of the model can bend"));
}

}  // namespace
}  // namespace simflex
