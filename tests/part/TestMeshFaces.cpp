// Selection of a part's faces for a load per area.

#include <gtest/gtest.h>

#include <algorithm>

#include "simflex/part/MeshFaces.h"

namespace simflex {
namespace {

/** Two hexahedra side by side along x, z upwards. **/
class TwoPlates : public ::testing::Test {
protected:
    TwoPlates() {
        ElementBlock block;
        block.isShell = true;
        for (int z = 0; z < 2; ++z)
            for (int y = 0; y < 2; ++y)
                for (int x = 0; x < 3; ++x) {
                    mesh.nodeNumbers.push_back(int(mesh.nodeNumbers.size()) + 1);
                    for (const int at : {x, y, z}) mesh.positions.push_back(at);
                }
        for (const int first : {0, 1})
            for (const int z : {0, 6})
                for (const int corner : {0, 1, 4, 3}) block.nodes.push_back(first + z + corner);
        mesh.elements.push_back(block);
    }

    /** Returns the mean heights of the faces with nodes from first to last. **/
    std::vector<double> listHeights(int first, int last) const {
        std::vector<char> isChosen(12, 0);
        std::fill(isChosen.begin() + first, isChosen.begin() + last + 1, char(1));
        std::vector<double> heights;
        for (const MeshFace& face : listLoadedFaces(mesh, isChosen)) {
            heights.push_back(0);
            for (const int node : face.corners) heights.back() += mesh.position(node)[2] / 4;
        }
        return heights;
    }

    Mesh mesh;
};

TEST_F(TwoPlates, OfWholeShellsTheUpperSideIsLoaded) {
    EXPECT_EQ(listHeights(0, 11), (std::vector<double>{1, 1}));
}

TEST_F(TwoPlates, ASideThatIsChosenIsLoaded) {
    EXPECT_EQ(listHeights(0, 5), (std::vector<double>{0, 0}));
    EXPECT_EQ(listHeights(6, 11), (std::vector<double>{1, 1}));
}

TEST_F(TwoPlates, OfSolidsTheWholeSkinIsLoaded) {
    mesh.elements[0].isShell = false;
    EXPECT_EQ(listHeights(0, 11).size(), 10u);
}

}  // namespace
}  // namespace simflex
