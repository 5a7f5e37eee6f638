// A part with selected modes has exactly the data of those modes.

#include <gmock/gmock.h>

#include <cmath>

#include "simflex/part/ModeSelection.h"

namespace simflex {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int NumModes = 5;

double entryOf(int what, int i, int j) {
    return 100 * what + 10 * i + j + 0.25;
}

/** Returns a column of numbers whose digits encode `what`, row and column. **/
std::vector<double> makeColumns(int what, int rows) {
    std::vector<double> values;
    for (int j = 0; j < NumModes; ++j)
        for (int i = 0; i < rows; ++i) values.push_back(entryOf(what, i, j));
    return values;
}

/** The same for a symmetric or antisymmetric matrix. **/
std::vector<double> makeSquare(int what, int sign) {
    std::vector<double> values = makeColumns(what, NumModes);
    for (int j = 0; j < NumModes; ++j)
        for (int i = j; i < NumModes; ++i)
            values[size_t(i + NumModes * j)] =
                i == j && sign < 0 ? 0 : sign * values[size_t(j + NumModes * i)];
    if (sign > 0)
        for (int i = 0; i < NumModes; ++i) values[size_t(i * (NumModes + 1))] = entryOf(what, i, i);
    return values;
}

/** Modes of 10, 20, 30, 40 and 50 Hz. **/
ReducedBody makePart() {
    ReducedBody part;
    part.name = "blade";
    part.mass = 2;
    part.inertia = {1, 2, 2.5, 0.1, 0.2, 0.3};
    part.numModes = NumModes;
    for (int i = 0; i < NumModes; ++i)
        part.omegaSquared.push_back(std::pow(2 * M_PI * 10 * (i + 1), 2));
    part.I1 = makeColumns(1, 6);
    for (size_t c = 0; c < 6; ++c) part.I2[c] = makeSquare(2 + int(c), +1);
    for (size_t k = 0; k < part.I2[2].size(); ++k)  // modal masses of 1
        part.I2[2][k] = (k % (NumModes + 1) == 0 ? 2 : 0) - part.I2[0][k] - part.I2[1][k];
    for (size_t a = 0; a < 3; ++a) part.N[a] = makeSquare(8 + int(a), -1);
    part.mesh.nodeNumbers = {3, 7, 9};
    part.mesh.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    part.mesh.nodeSets = {{"TIP", {1}}};
    part.Phi = makeColumns(11, 9);
    part.interfaces = {
        {"root", {1, 2, 3}, makeColumns(12, 3), makeColumns(13, 3), {0}},
        {"tip", {4, 5, 6}, makeColumns(14, 3), makeColumns(15, 3), {1, 2}},
    };
    part.stiffening.emplace();
    for (size_t c = 0; c < 6; ++c) part.stiffening->turning[c] = makeSquare(16 + int(c), +1);
    part.stiffening->interfaces.resize(2);
    for (int k = 0; k < 2; ++k)
        for (size_t c = 0; c < 6; ++c)
            part.stiffening->interfaces[size_t(k)][c] = makeSquare(22 + 6 * k + int(c), +1);
    part.provenance.source = "blade.inp";
    return part;
}

void expectColumns(const std::vector<double>& found, const std::vector<double>& full, int rows,
                   const std::vector<int>& modes) {
    ASSERT_EQ(found.size(), size_t(rows) * modes.size());
    for (size_t k = 0; k < modes.size(); ++k)
        for (int i = 0; i < rows; ++i)
            EXPECT_EQ(found[k * size_t(rows) + size_t(i)], full[size_t(modes[k] * rows + i)]);
}

void expectSquares(const std::vector<double>& found, const std::vector<double>& full,
                   const std::vector<int>& modes) {
    const size_t n = modes.size();
    ASSERT_EQ(found.size(), n * n);
    for (size_t k = 0; k < n; ++k)
        for (size_t l = 0; l < n; ++l)
            EXPECT_EQ(found[l + n * k], full[size_t(modes[l] + NumModes * modes[k])]);
}

void expectModes(const ReducedBody& found, const std::vector<int>& modes) {
    const ReducedBody full = makePart();
    found.validate();
    EXPECT_EQ(found.numModes, int(modes.size()));
    expectColumns(found.omegaSquared, full.omegaSquared, 1, modes);
    expectColumns(found.I1, full.I1, 6, modes);
    expectColumns(found.Phi, full.Phi, 9, modes);
    for (size_t c = 0; c < 6; ++c) expectSquares(found.I2[c], full.I2[c], modes);
    for (size_t a = 0; a < 3; ++a) expectSquares(found.N[a], full.N[a], modes);
    ASSERT_EQ(found.interfaces.size(), 2u);
    ASSERT_TRUE(found.stiffening);
    for (size_t c = 0; c < 6; ++c)
        expectSquares(found.stiffening->turning[c], full.stiffening->turning[c], modes);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(found.interfaces[k].name, full.interfaces[k].name);
        EXPECT_EQ(found.interfaces[k].position, full.interfaces[k].position);
        EXPECT_EQ(found.interfaces[k].nodes, full.interfaces[k].nodes);
        expectColumns(found.interfaces[k].Phi, full.interfaces[k].Phi, 3, modes);
        expectColumns(found.interfaces[k].Psi, full.interfaces[k].Psi, 3, modes);
        for (size_t c = 0; c < 6; ++c)
            expectSquares(found.stiffening->interfaces[k][c], full.stiffening->interfaces[k][c],
                          modes);
    }
    EXPECT_EQ(found.name, full.name);
    EXPECT_EQ(found.mass, full.mass);
    EXPECT_EQ(found.inertia, full.inertia);
    EXPECT_EQ(found.mesh.positions, full.mesh.positions);
    EXPECT_EQ(found.mesh.nodeSets, full.mesh.nodeSets);
    EXPECT_EQ(found.provenance.source, full.provenance.source);
}

TEST(ModeSelection, HasTheNumbersOfTheListedModesInAscendingOrder) {
    expectModes(selectModes(makePart(), {1, 3, 4}), {1, 3, 4});
    expectModes(selectModes(makePart(), {4, 0}), {0, 4});
    expectModes(selectModes(makePart(), {}), {});
    expectModes(selectModes(makePart(), {0, 1, 2, 3, 4}), {0, 1, 2, 3, 4});
}

TEST(ModeSelection, TakesTheLowestModes) {
    expectModes(selectLowestModes(makePart(), 2), {0, 1});
    expectModes(selectLowestModes(makePart(), 0), {});
    expectModes(selectLowestModes(makePart(), 5), {0, 1, 2, 3, 4});
}

TEST(ModeSelection, TakesTheModesOfABand) {
    EXPECT_THAT(findModesInBand(makePart(), 15, 40.5), ElementsAre(1, 2, 3));
    EXPECT_THAT(findModesInBand(makePart(), 51, 60), IsEmpty());
    expectModes(selectModesInBand(makePart(), 15, 40.5), {1, 2, 3});
    expectModes(selectModesInBand(makePart(), 0, INFINITY), {0, 1, 2, 3, 4});
}

TEST(ModeSelection, WithoutGeometricStiffnessThereIsNoneAfterwards) {
    ReducedBody part = makePart();
    part.stiffening.reset();
    EXPECT_FALSE(selectModes(part, {2}).stiffening);
}

template <class Ask>
void expectRefused(Ask ask, const std::string& what) {
    try {
        ask();
        ADD_FAILURE() << "accepted: " << what;
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("'blade'"), HasSubstr(what),
                                        HasSubstr("5 modes (0 to 4), of 10 to 50 Hz")));
    }
}

TEST(ModeSelection, RefusalsNameThePartItsModesAndFrequencies) {
    const ReducedBody part = makePart();
    expectRefused([&] { selectModes(part, {0, 5}); }, "mode 5");
    expectRefused([&] { selectModes(part, {-1}); }, "mode -1");
    expectRefused([&] { selectModes(part, {2, 1, 2}); }, "mode 2 is listed twice");
    expectRefused([&] { selectLowestModes(part, 6); }, "the lowest 6 modes");
    expectRefused([&] { selectLowestModes(part, -1); }, "the lowest -1 modes");
    expectRefused([&] { selectModesInBand(part, 41, 49.5); }, "from 41 to 49.5 Hz");
    expectRefused([&] { selectModesInBand(part, 40, 10); }, "from 40 to 10 Hz");
    expectRefused([&] { selectModesInBand(part, NAN, 10); }, "from nan to 10 Hz");
}

}  // namespace
}  // namespace simflex
