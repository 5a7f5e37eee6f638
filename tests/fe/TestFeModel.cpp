#include <gmock/gmock.h>

#include <limits>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

class FeModelTest : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        testing::TestFolder folder;
        testing::writeText(folder / "brick.inp", testing::Brick().text());
        model = new FeModel(readCalculixDeck(folder / "brick.inp"));
    }
    static void TearDownTestSuite() { delete model; }

    template <class Change>
    static std::string messageAfter(Change change) {
        FeModel changed = *model;
        change(changed);
        try {
            changed.validate();
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "accepted";
    }

    static FeModel* model;
};

FeModel* FeModelTest::model = nullptr;

TEST_F(FeModelTest, MassAndCenterAreThoseOfTheBox) {
    const testing::Brick brick;
    EXPECT_NEAR(model->calcMass(), brick.mass(), 1e-12 * brick.mass());
    const auto center = model->calcCenterOfMass();
    EXPECT_NEAR(center[0], brick.size[0] / 2, 1e-12);
    EXPECT_NEAR(center[1], 0, 1e-12);
    EXPECT_NEAR(center[2], 0, 1e-12);
}

TEST_F(FeModelTest, NotANumberInStiffnessIsRefused) {
    EXPECT_THAT(
        messageAfter([](FeModel& m) { m.K.values[7] = std::numeric_limits<double>::quiet_NaN(); }),
        HasSubstr("stiffness matrix has nan"));
}

TEST_F(FeModelTest, InfinityInMassIsRefused) {
    EXPECT_THAT(
        messageAfter([](FeModel& m) { m.m.values[7] = std::numeric_limits<double>::infinity(); }),
        HasSubstr("mass matrix has inf"));
}

TEST_F(FeModelTest, AHeldPartIsRefused) {
    EXPECT_THAT(messageAfter([](FeModel& m) { m.K.values[m.K.columnStarts[3]] *= 1.01; }),
                HasSubstr("not free"));
}

TEST_F(FeModelTest, MatricesOfAnotherMeshAreRefused) {
    EXPECT_THAT(messageAfter([](FeModel& m) {
                    m.mesh.nodeNumbers.pop_back();
                    m.mesh.positions.resize(3 * m.mesh.nodeNumbers.size());
                }),
                HasSubstr("expected"));
}

TEST_F(FeModelTest, MatrixFromEntriesAddsDuplicatesAndSorts) {
    const auto A =
        SymmetricMatrix::fromEntries(3, {0, 2, 1, 0, 1}, {0, 0, 1, 2, 2}, {1, 2, 3, 4, 0});
    EXPECT_EQ(A.columnStarts, (std::vector<std::int64_t>{0, 2, 3, 3}));
    EXPECT_EQ(A.rows, (std::vector<std::int32_t>{0, 2, 1}));
    EXPECT_EQ(A.values, (std::vector<double>{1, 6, 3}));
    EXPECT_THAT([] { SymmetricMatrix::fromEntries(2, {2}, {0}, {1}); },
                ThrowsMessage<std::invalid_argument>(HasSubstr("outside")));
}

}  // namespace
}  // namespace simflex
