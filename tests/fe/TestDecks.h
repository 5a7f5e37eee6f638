#pragma once
/** @file
Decks for tests: bricks written node by node, example parts meshed coarsely by Gmsh, and CalculiX's
results for them. **/

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <string>
#include <vector>

#include "support/TestFolder.h"

namespace simflex {
namespace testing {

/** A box along x from the origin, centred in y and z; node sets LEFT and RIGHT (end faces), ALL,
ONE (a node), TWO (two nodes), LINE (an edge along x), CORNERS (all eight). **/
struct Brick {
    std::array<double, 3> size{0.2, 0.03, 0.02};  ///< [m]
    std::array<int, 3> elements{8, 2, 2};
    std::string type = "C3D8";  ///< C3D8, C3D8R, C3D20 or C3D20R
    double E = 70e9, nu = 0.3, rho = 2700;

    double mass() const { return rho * size[0] * size[1] * size[2]; }
    /** Returns nodes and elements, numbered from firstNode and firstElement. **/
    std::string meshText(int firstNode = 1, int firstElement = 1) const;
    std::string materialText() const;
    std::string text() const { return meshText() + materialText(); }
};

/** Two distorted hexahedra (C3D8, C3D8R, C3D20, C3D20R), or a distorted cube of two wedges (C3D6,
C3D15) or five tetrahedra (C3D4, C3D10, C3D10T), optionally with mid-edge nodes off the straight
edge; one element set BODY, and ONE of element 1. **/
struct DistortedCube {
    std::vector<std::array<double, 3>> nodes;  ///< numbers from 1
    std::vector<std::vector<int>> elements;    ///< indices of nodes

    explicit DistortedCube(const std::string& type);
    std::string meshText() const;
    std::string text() const { return meshText() + Brick().materialText(); }

private:
    void addMiddles(const std::vector<std::pair<int, int>>& edges);

    std::string _type;
};

/** Meshes examples/parts/NAME.geo with elements of size h [m] into folder/NAME.inp.
@returns the path of the deck. **/
std::string meshExamplePart(const TestFolder& folder, const std::string& name,
                            const std::string& elementType, double h);

/** Whether CalculiX is available. **/
bool hasCalculix();

/** First line of a test that compares with CalculiX. **/
#define SIMFLEX_NEEDS_CALCULIX() \
    if (!::simflex::testing::hasCalculix()) GTEST_SKIP() << "CalculiX (ccx) is not installed"

/** Runs a shell command. @throws std::runtime_error with its output if it fails. **/
void runOrThrow(const std::string& command, const std::string& log);

/** Returns CalculiX's frequencies [Hz] of a deck whose node sets are tied as *RIGID BODY to the
given points, with everything else free; includes the six rigid modes.
@param numHeld  number of ties, from the first, that are held **/
std::vector<double> calcCalculixFrequencies(
    const TestFolder& folder, const std::string& deck,
    const std::vector<std::pair<std::string, std::array<double, 3>>>& ties, int numModes,
    int numHeld = 0);

/** Returns CalculiX's displacement and rotation (6 numbers) of the tie `loaded` under a force and a
moment at its point, with the tie `held` fixed. **/
std::array<double, 6> calcCalculixDeflection(
    const TestFolder& folder, const std::string& deck,
    const std::pair<std::string, std::array<double, 3>>& held,
    const std::pair<std::string, std::array<double, 3>>& loaded, const std::array<double, 6>& load);

/** The same under gravity [m/s²] along a direction. **/
std::array<double, 6> calcCalculixSag(const TestFolder& folder, const std::string& deck,
                                      const std::pair<std::string, std::array<double, 3>>& held,
                                      const std::pair<std::string, std::array<double, 3>>& watched,
                                      double gravity, const std::array<double, 3>& direction);

/** Returns the displacements [m] of the nodes of `set` by number in a *STATIC step with further
cards; both ends are tied. **/
std::map<int, std::array<double, 3>> calcCalculixDisplacements(
    const TestFolder& folder, const std::string& deck,
    const std::pair<std::string, std::array<double, 3>>& held,
    const std::pair<std::string, std::array<double, 3>>& tied, const std::string& set,
    const std::string& stepCards);

/** Stress and strain (tensors, xx yy zz xy xz yz) as output by CalculiX. **/
struct CalculixStress {
    using Tensor = std::array<double, 6>;
    std::map<int, Tensor> stress, strain;            ///< at nodes by number, from the .frd
    std::map<std::pair<int, int>, Tensor> atPoints;  ///< by element and integration point
};

/** Returns the results of a linear *STATIC step on a deck with further cards of the model and of
the step. The points are those of element set BODY. **/
CalculixStress calcCalculixStress(const TestFolder& folder, const std::string& deck,
                                  const std::string& modelCards, const std::string& stepCards);

/** Returns nodes REF and ROT of tie `index` (set TIE`index`) and the *RIGID BODY card of a node
set. **/
std::string makeTieCards(int index, const std::string& set, const std::array<double, 3>& point);

/** Returns the number of the node for forces on the tie; moments act on the next. **/
int getTieNode(int index);

}  // namespace testing
}  // namespace simflex
