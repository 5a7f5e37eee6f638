/** @file
Equilibrium paths: messages and results of a run. **/

#include <cmath>

#include "cli/run/RunTest.h"
#include "simflex/model/results/Comparison.h"
#include "simflex/model/results/ResultFigure.h"

namespace simflex {
namespace {

using namespace model;
using ::testing::HasSubstr;
using ::testing::Not;

// F(w) = 2k (l₀/l − 1) y, y = 0.3 − w, l² = 1 + y²; its maximum is where l³ = l₀.
constexpr double Stiffness = 2e4, Push = 1500;
double calcForce(double y) {
    return 2 * Stiffness * (std::hypot(1, 0.3) / std::hypot(1, y) - 1) * y;
}

class PathTest : public RunTest {
protected:
    static std::string makeTruss(const std::string& path, const std::string& more = "") {
        return R"(simflex: 1
bodies:
  mass: {mass: 1, inertia: [0.01, 0.01, 0.01], mobilizer: {type: slider, parent: ground, inboard: {position: [0, 0.3, 0], rotation: [0, 0, 90*deg]}, outboard: {rotation: [0, 0, 90*deg]}}}
connectors:
  left: {type: spring, between: [{on: ground, position: [-1, 0, 0]}, {on: mass}], stiffness: 2e4}
  right: {type: spring, between: [{on: ground, position: [1, 0, 0]}, {on: mass}], stiffness: 2e4}
loads:
  push: {on: mass, force: [0, -1500, 0]}
)" + more + "probes: {place: {position: mass}}\nanalyses:\n  snap: {type: static, path: {" +
               path + "}}\n";
    }
};

TEST_F(PathTest, PathsAreComparedAtAllPointsThatTheyShareOrAtTheEnd) {
    writeModel(makeTruss("step: 0.05"));
    ASSERT_EQ(runModel("-o one.h5"), 0) << err;
    ASSERT_EQ(runModel("-o two.h5"), 0) << err;
    ASSERT_EQ(runModel("-o fine.h5 --set analyses.snap.path.step=0.02"), 0) << err;
    Results one = readResults(folder / "one.h5"), two = readResults(folder / "two.h5");
    two.analyses[0].probes[0].rows[3][1] += 0.125;
    const auto compare = [&](const Results& other) {
        return compareResults(one, other, {"place.y"}, "one", "other");
    };
    const ResultComparison all = compare(two), last = compare(readResults(folder / "fine.h5"));
    ASSERT_EQ(all.columns.size(), 1u);
    EXPECT_EQ(all.columns[0].axis, "load factor");
    EXPECT_EQ(all.columns[0].x.size(), one.analyses[0].matrices.at("path").size());
    EXPECT_EQ(all.columns[0].largest, 0.125);
    EXPECT_EQ(all.columns[0].time, one.analyses[0].matrices.at("path")[3][0]);
    EXPECT_TRUE(all.notes.empty());
    ASSERT_EQ(last.columns.size(), 1u);
    EXPECT_EQ(last.columns[0].first.size(), 1u);
    EXPECT_LT(last.columns[0].largest, 1e-6);
    EXPECT_THAT(last.notes, ::testing::Contains(HasSubstr("only the last one is compared")));
}

TEST_F(PathTest, EveryPointHasARowAndTheLastIsTheResult) {
    writeModel(makeTruss("step: 0.05") + "  modes: {type: eigen, about: snap}\n");
    ASSERT_EQ(runModel("--csv"), 0) << err;
    const Results::Analysis snap = read("snap");
    ASSERT_TRUE(snap.hasPath());
    const auto& path = snap.matrices.at("path");
    const Results::Series& place = find(snap, "place");
    ASSERT_EQ(place.rows.size(), path.size());
    ASSERT_EQ(snap.q.size(), path.size());
    std::vector<double> limits;
    for (size_t k = 0; k < path.size(); ++k) {
        EXPECT_NEAR(path[k][0] * Push, calcForce(place.rows[k][1]), 1e-7 * Push) << k;
        if (path[k][2] == 1) limits.push_back(path[k][0]);
    }
    const double y = std::sqrt(std::pow(1.09, 1.0 / 3) - 1), largest = calcForce(y) / Push;
    ASSERT_EQ(limits.size(), 2u);
    EXPECT_NEAR(limits[0], largest, 1e-9);
    EXPECT_NEAR(limits[1], -largest, 1e-9);
    EXPECT_EQ(path.back()[0], 1);
    EXPECT_THAT(out, HasSubstr("limit point: the path turns at 13.2666 % of the loads"));
    EXPECT_THAT(out, HasSubstr("limit point  -"));

    // The summary table and the modes are those of the last point.
    char text[100];
    std::snprintf(text, sizeof text, "place.y [m]  %.6g\n", place.rows.back()[1]);
    EXPECT_THAT(out, HasSubstr(text));
    const double slope =
        (calcForce(place.rows.back()[1] + 1e-6) - calcForce(place.rows.back()[1] - 1e-6)) / -2e-6;
    EXPECT_NEAR(read("modes").frequency.at(0).at(0), std::sqrt(slope) / (2 * M_PI), 1e-4);

    const std::string csv = testing::readText(folder / "model.results.snap.csv");
    EXPECT_EQ(csv.substr(0, csv.find('\n')),
              "load factor,unstable motions,kind,place.x [m],place.y [m],place.z [m]");
    EXPECT_EQ(size_t(std::count(csv.begin(), csv.end(), '\n')), path.size() + 1);
    FigureWishes wishes;
    wishes.probes = {"place.y"};
    const Figure figure = makeResultFigure({{"a", &snap}}, wishes);
    ASSERT_EQ(figure.panels.at(0).curves.size(), 1u);
    EXPECT_EQ(figure.xLabel, "load factor");
    EXPECT_EQ(figure.panels[0].curves[0].x.size(), path.size());

    // Other probes added later, along the whole path.
    writeModel(makeTruss("step: 0.05") + "  modes: {type: eigen, about: snap}\n");
    ASSERT_EQ(runProgram("SIMFLEX_CACHE=cache '" SIMFLEX_PROGRAM "'",
                         "post --quiet model.results.h5 --set probes.high='{position: mass, "
                         "component: y}'"),
              0)
        << err;
    const Results::Analysis again = read("snap", "model.results.post.h5");
    EXPECT_EQ(again.matrices.at("path"), path);
    ASSERT_EQ(find(again, "high").rows.size(), path.size());
    for (size_t k = 0; k < path.size(); ++k)
        EXPECT_EQ(find(again, "high").rows[k][0], place.rows[k][1]);
}

TEST_F(PathTest, OneThatEndsEarlyIsWarnedOf) {
    writeModel(makeTruss("points: 4"));
    ASSERT_EQ(runModel(), 0) << err;
    EXPECT_EQ(read("snap").matrices.at("path").size(), 4u);
    EXPECT_EQ(find(read("snap"), "place").rows.size(), 4u);
    EXPECT_THAT(err + out, HasSubstr("the path ends after 4 points, at "));
}

TEST_F(PathTest, LoadsThatDoNotGrowAreRefused) {
    writeModel(makeTruss("", "  brake: {on: mass, force: [0, \"-3*place.y\", 0]}\n"));
    EXPECT_EQ(runModel(), 1);
    EXPECT_THAT(err, HasSubstr("load 'brake' depends on the motion: it acts in full"));
}

}  // namespace
}  // namespace simflex
