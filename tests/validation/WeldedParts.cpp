#include "validation/WeldedParts.h"

#include <iomanip>
#include <sstream>

namespace simflex::test {

using namespace SimTK;
using simflex::testing::Brick;

namespace {

/** Returns a second brick's mesh, rotated by 90° about z and moved to (x, 0, 0); sets and elements
have separate names. **/
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

Brick makeUprightBrick() {
    Brick brick;
    brick.size = {0.15, 0.02, 0.02};
    brick.elements = {6, 2, 2};
    return brick;
}

const Rotation& getQuarter() {
    static const Rotation quarter(Pi / 2, ZAxis);
    return quarter;
}

}  // namespace

WeldedParts::WeldedParts(int numModes)
    : uprightBrick(makeUprightBrick()),
      foot(flexible, reduceBrick(footBrick, numModes), "foot"),
      upright(flexible, reduceBrick(uprightBrick, numModes), "upright"),
      clamp(flexible, matter.Ground(), foot.interface("left"), "clamp"),
      corner(flexible, foot.interface("right", getQuarter()), upright.interface("left"), "corner") {
}

State WeldedParts::makeState() {
    State state = system.realizeTopology();
    foot.setPoseByInterface(state, "left", Transform());
    upright.setPoseByInterface(state, "left",
                               Transform(getQuarter(), Vec3(footBrick.size[0], 0, 0)));
    return state;
}

std::vector<double> WeldedParts::calcCalculixFrequencies(int numFrequencies) const {
    const double x = footBrick.size[0];
    const simflex::testing::TestFolder folder;
    simflex::testing::writeText(
        folder / "whole.inp",
        footBrick.meshText() + makeUpright(uprightBrick, x) + footBrick.materialText() +
            "*SOLID SECTION, ELSET=UP_BODY, MATERIAL=METAL\n*NSET, NSET=CORNER\nRIGHT, UP_LEFT\n");
    return simflex::testing::calcCalculixFrequencies(
        folder, folder / "whole.inp",
        {{"LEFT", {0, 0, 0}}, {"CORNER", {x, 0, 0}}, {"UP_RIGHT", {x, uprightBrick.size[0], 0}}},
        numFrequencies, 1);
}

}  // namespace simflex::test
