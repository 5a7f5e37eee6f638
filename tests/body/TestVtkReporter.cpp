/** @file
VTK series of a run, read back by the rules of VTK's file formats. **/

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/VtkReporter.h"
#include "support/PointMassPart.h"
#include "support/TestFolder.h"
#include "support/VtuReader.h"

namespace simflex::test {
namespace {

using namespace SimTK;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

std::shared_ptr<const ReducedBody> makePartWithStress() {
    auto part = std::make_shared<ReducedBody>(*makePointMassPart().body);
    part->modalStress.emplace();
    part->modalStress->nodes = {1, 6};
    for (int i = 0; i < 12 * part->numModes; ++i)
        part->modalStress->stress.push_back(float(std::sin(1.0 + i)));
    part->modalStress->strain.assign(size_t(12 * part->numModes), 0);
    return part;
}

class VtkReporterTest : public ::testing::Test {
protected:
    VtkReporterTest() { system.realizeTopology(); }

    State makeState(Real time) const {
        State state = system.getDefaultState();
        state.setTime(time);
        for (int i = 0; i < state.getNQ(); ++i) state.updQ()[i] = 0.02 * std::sin(1.7 * i + time);
        for (int i = 0; i < state.getNU(); ++i) state.updU()[i] = std::cos(2.3 * i + time);
        boom.setFramePose(state, Transform(Rotation(0.7, UnitVec3(1, 2, -1)), Vec3(3, -2, 1)));
        system.realize(state, Stage::Velocity);
        return state;
    }

    std::string read(const fs::path& path) const {
        std::ostringstream text;
        text << std::ifstream(path).rdbuf();
        return text.str();
    }

    const testing::TestFolder scratch;
    const fs::path folder = scratch.path();
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    FlexibleBody boom{flexible, makePartWithStress(), "boom"};
    FlexibleBody other{flexible, makePointMassPart().body, "boom"};
    FlexibleBody odd{flexible, makePointMassPart().body, "../<Rädchen> & \"Co\""};
};

TEST_F(VtkReporterTest, PointsAreWhereSimbodyHasTheNodesAndVelocitiesTheirDerivatives) {
    VtkReporter(flexible, 0.1, (folder / "run.pvd").string()).handleEvent(makeState(0.25));
    const VtuContent found = readVtu((folder / "run/boom_00000.vtu").string());
    EXPECT_THAT(found["TimeValue"].values, ElementsAre(0.25));

    const State state = makeState(0.25);
    constexpr Real h = 1e-5;
    State before = state, after = state;
    before.updQ() -= h * state.getQDot();
    after.updQ() += h * state.getQDot();
    system.realize(before, Stage::Position);
    system.realize(after, Stage::Position);
    const Rotation R_GB = boom.getFramePose(state).R();
    const Mesh& mesh = boom.getPart().mesh;
    ASSERT_EQ(found.numPoints, mesh.numNodes());
    for (size_t node = 0; node < size_t(mesh.numNodes()); ++node) {
        const int number = mesh.nodeNumbers[node];
        const auto at = [&](const char* name) {
            const auto& values = found[name].values;
            return Vec3(values[3 * node], values[3 * node + 1], values[3 * node + 2]);
        };
        EXPECT_EQ(found["node number"].values[node], number);
        EXPECT_LT((at("Points") - boom.calcNodeLocation(state, number)).norm(), 1e-14);
        // Single precision.
        const Vec3 u_G = R_GB * boom.calcNodeDisplacement(state, number);
        EXPECT_LT((at("displacement [m]") - u_G).norm(), 1e-7 * (1 + u_G.norm()));
        // Central differences: O(h²).
        const Vec3 v_G =
            (boom.calcNodeLocation(after, number) - boom.calcNodeLocation(before, number)) /
            (2 * h);
        EXPECT_LT((at("velocity [m/s]") - v_G).norm(), 1e-6 * v_G.norm());
    }
}

TEST_F(VtkReporterTest, StressIsThatOfTheModesTogether) {
    VtkReporter(flexible, 0.1, (folder / "run.pvd").string()).handleEvent(makeState(0));
    const VtuContent found = readVtu((folder / "run/boom_00000.vtu").string());
    const ReducedBody& part = boom.getPart();
    const Vector xi = boom.getModalCoordinates(makeState(0));
    std::array<Real, 6> s{};  // xx yy zz xy xz yz of the second node with stress
    for (int i = 0; i < part.numModes; ++i)
        for (size_t c = 0; c < 6; ++c)
            s[c] += Real(part.modalStress->stress[size_t(12 * i) + 6 + c]) * xi[i];
    const VtuArray& stress = found["stress [Pa]"];
    ASSERT_EQ(stress.components, 6);
    const size_t vtkOrder[] = {0, 1, 2, 3, 5, 4};
    for (size_t c = 0; c < 6; ++c) EXPECT_NEAR(stress.values[36 + c], s[vtkOrder[c]], 1e-6);
    const Real vonMises =
        std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] - s[0] * s[1] - s[1] * s[2] -
                  s[2] * s[0] + 3 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
    EXPECT_NEAR(found["von Mises [Pa]"].values[6], vonMises, 1e-6);
    EXPECT_TRUE(std::isnan(stress.values[0]));
    EXPECT_TRUE(std::isnan(found["von Mises [Pa]"].values[0]));
    EXPECT_EQ(readVtu((folder / "run/boom_2_00000.vtu").string()).arrays.count("stress [Pa]"), 0u);
}

TEST_F(VtkReporterTest, TheListIsWholeAfterEveryFrameAndNamesFilesThatExist) {
    VtkReporter reporter(flexible, 0.1, (folder / "out/run.pvd").string());
    fs::create_directories(folder / "out/run");
    std::ofstream(folder / "out/run/boom_00007.vtu") << "of an earlier run";
    std::ofstream(folder / "out/run/boom_notes.vtu") << "somebody's own";
    for (int frame = 0; frame < 3; ++frame) {
        reporter.handleEvent(makeState(0.1 * frame));
        const std::string text = read(folder / "out/run.pvd");
        EXPECT_THAT(text,
                    ::testing::StartsWith("<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\""));
        EXPECT_THAT(text, ::testing::EndsWith("</Collection>\n</VTKFile>\n"));
        const std::regex entries("<DataSet [^>]*/>");
        int count = 0;
        for (std::sregex_iterator tag(text.begin(), text.end(), entries), last; tag != last;
             ++tag) {
            EXPECT_TRUE(fs::exists(folder / "out" / findAttribute(tag->str(), "file")))
                << tag->str();
            EXPECT_EQ(std::stod(findAttribute(tag->str(), "timestep")), 0.1 * (count / 3));
            EXPECT_EQ(findAttribute(tag->str(), "part"), std::to_string(count % 3));
            ++count;
        }
        EXPECT_EQ(count, 3 * (frame + 1));
    }
    EXPECT_EQ(reporter.getNumFrames(), 3);
    EXPECT_THAT(read(folder / "out/run.pvd"),
                HasSubstr("name=\"../&lt;Rädchen&gt; &amp; &quot;Co&quot;\" "
                          "file=\"run/_.__R__dchen_____Co__00000.vtu\""));
    EXPECT_FALSE(fs::exists(folder / "out/run/boom_00007.vtu"));
    EXPECT_TRUE(fs::exists(folder / "out/run/boom_notes.vtu"));
}

TEST_F(VtkReporterTest, ARunUnderSimbodysTimeStepperHasAFrameEveryInterval) {
    auto reporter = new VtkReporter(flexible, 0.001, (folder / "run.pvd").string());
    system.addEventReporter(reporter);
    State state = system.realizeTopology();
    RungeKuttaMersonIntegrator integrator(system);
    TimeStepper stepper(system, integrator);
    stepper.initialize(state);
    stepper.stepTo(0.0045);
    EXPECT_EQ(reporter->getNumFrames(), 5);
    EXPECT_NEAR(readVtu((folder / "run/boom_00003.vtu").string())["TimeValue"].values[0], 0.003,
                1e-12);
}

TEST_F(VtkReporterTest, RefusalsNameWhatIsWrong) {
    EXPECT_THROW(VtkReporter(flexible, 0, "run.pvd"), std::invalid_argument);
    EXPECT_THROW(VtkReporter(flexible, 0.1, "run.vtu"), std::invalid_argument);
    std::ofstream(folder / "taken") << "a file";
    const VtkReporter reporter(flexible, 0.1, (folder / "taken/run.pvd").string());
    try {
        reporter.handleEvent(makeState(0));
        ADD_FAILURE() << "accepted";
    } catch (const std::runtime_error& error) {
        EXPECT_THAT(error.what(), HasSubstr("taken/run"));
    }
}

}  // namespace
}  // namespace simflex::test
