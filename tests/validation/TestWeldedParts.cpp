// Two reduced bricks welded into an L, against one CalculiX model of the whole with the same rigid
// ties.

#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>

#include "simflex/body/FlexibleBody.h"
#include "simflex/body/Joint.h"
#include "simflex/solver/Eigenmodes.h"
#include "validation/BrickParts.h"

namespace simflex {
namespace {

using namespace SimTK;
using simflex::testing::Brick;

/** A second brick's mesh, turned by a quarter about z and moved to (x, 0, 0); sets and elements
 * have names of their own. **/
std::string makeUpright(const Brick& brick, double x) {
    std::istringstream lines(brick.meshText(50001, 50001));
    std::ostringstream text;
    text << std::setprecision(14);
    bool inNodes = false;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] == '*') {
            inNodes = line.rfind("*NODE", 0) == 0;
            for (const std::string key : {"NSET=", "ELSET="}) {
                const size_t at = line.find(key);
                if (at == std::string::npos) continue;
                line.insert(at + key.size(), "UP_");
                break;
            }
        } else if (inNodes) {
            std::istringstream numbers(line);
            int node;
            double s[3];
            char comma;
            numbers >> node >> comma >> s[0] >> comma >> s[1] >> comma >> s[2];
            text << node << "," << x - s[1] << "," << s[0] << "," << s[2] << "\n";
            continue;
        }
        text << line << "\n";
    }
    return text.str();
}

TEST(WeldedParts, FrequenciesAreThoseOfTheWholeFiniteElementModel) {
    Brick foot, upright;
    upright.size = {0.15, 0.02, 0.02};
    upright.elements = {6, 2, 2};
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(
        folder / "whole.inp",
        foot.meshText() + makeUpright(upright, foot.size[0]) + foot.materialText() +
            "*SOLID SECTION, ELSET=UP_BODY, MATERIAL=METAL\n*NSET, NSET=CORNER\nRIGHT, UP_LEFT\n");
    const double x = foot.size[0];
    const std::vector<double> expected = simflex::testing::calcCalculixFrequencies(
        folder, folder / "whole.inp",
        {{"LEFT", {0, 0, 0}}, {"CORNER", {x, 0, 0}}, {"UP_RIGHT", {x, upright.size[0], 0}}}, 8, 1);

    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody first(flexible, test::reduceBrick(foot, 40), "foot");
    const FlexibleBody second(flexible, test::reduceBrick(upright, 40), "upright");
    const Rotation quarter(Pi / 2, ZAxis);
    Joint::Weld clamp(flexible, matter.Ground(), first.interface("left"), "clamp");
    Joint::Weld corner(flexible, first.interface("right", quarter), second.interface("left"),
                       "corner");
    State state = system.realizeTopology();
    first.setPoseByInterface(state, "left", Transform());
    second.setPoseByInterface(state, "left", Transform(quarter, Vec3(x, 0, 0)));
    const std::vector<Eigenmode> modes = calcEigenmodes(calcLinearization(system, state));
    for (size_t k = 0; k < 6; ++k) {
        // Reduced parts are never softer than their meshes.
        EXPECT_GT(modes[k].frequency, expected[k] * (1 - 1e-5)) << k;
        EXPECT_LT(modes[k].frequency, expected[k] * 1.005) << k;
    }
}

}  // namespace
}  // namespace simflex
