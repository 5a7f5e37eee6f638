/** @file
Derivatives of the reduced stiffness and mass with respect to numbers of a deck: against
eighth-order differences of the full K and M, against reductions at other values, and against closed
forms. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>

#include "fe/TestDecks.h"
#include "fe/ThinDeck.h"
#include "simflex/base/NumberText.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/ModelSource.h"
#include "simflex/part/ModeSelection.h"
#include "simflex/part/ReducedBodyFile.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ::testing::AllOf;
using testing::Brick;
using testing::DistortedCube;
using ::testing::HasSubstr;
using testing::TestFolder;
using testing::ThinDeck;
using Point = ThinDeck::Point;

/** A deck with one varying number. **/
struct VariedDeck {
    std::string name;       ///< of the test
    std::string parameter;  ///< "thickness:PLATE"
    double value;
    std::function<std::string(const std::string&)> text;
    bool isTied = false;  ///< by constraints that move with the parameter
};

std::ostream& operator<<(std::ostream& out, const VariedDeck& deck) {
    return out << deck.name;
}

std::string shellDeck(const std::string& type, const std::string& cards) {
    ThinDeck deck;
    deck.addPatch(type, "PLATE", 4, 3, [](double u, double v) -> Point {
        return {u + 0.06 * u * v, 0.7 * v + 0.05 * u * u, 0.15 * u * u - 0.1 * v * v};
    });
    deck.addNodeSet("SEAT", [](const Point& x) { return x[0] < 1e-9; });
    deck.add(cards);
    return deck.text();
}

std::string shellSection(const std::string& data, const std::string& more = "") {
    return "*SHELL SECTION, ELSET=PLATE" + more + "\n" + data + "\n";
}

std::string beamDeck(const std::string& shape, const std::string& data) {
    ThinDeck deck;
    deck.addBeam("B32R", "BEAM", 4, {0, 0, 0}, {1, 0.2, 0.1});
    deck.add("*BEAM SECTION, ELSET=BEAM, MATERIAL=METAL, SECTION=" + shape + "\n" + data +
             "\n0,0,-1\n");
    return deck.text();
}

/** Returns a bent plate with a thickness step and a beam across its fold, so with knots. **/
std::string foldedDeck(const std::string& type, const std::string& upright,
                       const std::string& flat) {
    ThinDeck deck;
    deck.addPatch(type, "FLAT", 3, 2, [](double u, double v) -> Point {
        return {0.5 * u, 0.4 * v, 0};
    });
    deck.addPatch(type, "UPRIGHT", 2, 2, [](double u, double v) -> Point {
        return {0.5 + 0.1 * u, 0.4 * v, 0.3 * u};
    });
    deck.add("*SHELL SECTION, ELSET=FLAT, MATERIAL=METAL\n" + flat +
             "\n*SHELL SECTION, ELSET=UPRIGHT, MATERIAL=METAL, OFFSET=0.1\n" + upright + "\n");
    return deck.text();
}

std::string materialCards(const std::string& elastic, const std::string& density) {
    return "*MATERIAL, NAME=OTHER\n" + elastic + "\n*DENSITY\n" + density + "\n";
}

std::string solidDeck(const std::string& type, const std::string& elastic,
                      const std::string& density) {
    return DistortedCube(type).meshText() + materialCards(elastic, density) +
           "*SOLID SECTION, ELSET=BODY, MATERIAL=OTHER\n";
}

const std::string Ply =
    "*ELASTIC, TYPE=ENGINEERING CONSTANTS\n120e9,9e9,8e9,0.3,0.28,0.4,5e9,4e9\n3e9";

std::string layers(const std::string& first, const std::string& second) {
    return shellSection(first + ",,OTHER,A\n" + second + ",,METAL,A\n0.003,,OTHER,A",
                        ", COMPOSITE") +
           "*ORIENTATION, NAME=A\n1,0.3,0,0,1,0\n";
}

std::string onFeet(const std::string& elements, const std::string& section) {
    Brick brick;
    brick.elements = {3, 2, 2};
    return brick.meshText() + brick.materialText() + elements + section;
}

std::vector<VariedDeck> listDecks() {
    const auto shell = [](const std::string& type) {
        return [type](const std::string& t) {
            return shellDeck(type, shellSection(t, ", MATERIAL=METAL, OFFSET=0.2"));
        };
    };
    const auto layered = [](const std::string& type, const std::string& elastic) {
        return [type, elastic](const std::string& t) {
            return shellDeck(type, materialCards(elastic, "1600") + layers("0.004", t));
        };
    };
    const auto beam = [](const std::string& shape, const std::string& before,
                         const std::string& after) {
        return [=](const std::string& a) { return beamDeck(shape, before + a + after); };
    };
    // E at G = 1.3e11, or both: far from E = 3G, near which no difference is good.
    const auto general = [](const std::string& moduli) {
        ThinDeck deck;
        deck.addBeam("B32R", "BEAM", 4, {0, 0, 0}, {1, 0.2, 0.1});
        deck.add(
            "*BEAM GENERAL SECTION, ELSET=BEAM, SECTION=RECT, DENSITY=7800\n0.05,0.03\n0,0,-1\n" +
            moduli + (moduli.find(',') == std::string::npos ? ",1.3e11\n" : "\n"));
        return deck.text();
    };
    const std::string box = "0.06,0.05,0.004,0.005,0.006,0.007";
    return {
        {"ThicknessOfS4", "thickness:PLATE", 0.02, shell("S4")},
        {"ThicknessOfS3", "thickness:PLATE", 0.02, shell("S3")},
        {"ThicknessOfS8R", "thickness:PLATE", 0.02, shell("S8R")},
        {"ThicknessOfS6", "thickness:PLATE", 0.02, shell("S6")},
        {"LayerOfS4", "thickness:PLATE:2", 0.006, layered("S4", Ply)},
        {"LayerOfS3", "thickness:PLATE:2", 0.006, layered("S3", Ply)},
        {"LayerOfS8R", "thickness:PLATE:2", 0.006, layered("S8R", Ply)},
        {"StiffnessOfALayerOfS4", "youngs_modulus:CORE", 2e8,
         [](const std::string& E) {
             return shellDeck(
                 "S4", "*MATERIAL, NAME=CORE\n*ELASTIC\n" + E + ",0.3\n*DENSITY\n90\n" +
                           shellSection("0.002,,METAL\n0.02,,CORE\n0.001,,METAL", ", COMPOSITE"));
         }},
        {"SideOfARectangle", "section:BEAM:b", 0.03, beam("RECT", "0.05,", "")},
        {"RadiusOfACircle", "section:BEAM:r", 0.02, beam("CIRC", "", "")},
        {"RadiusOfAPipe", "section:BEAM:r", 0.03, beam("PIPE", "", ",0.004")},
        {"WallOfAPipe", "section:BEAM:t", 0.004, beam("PIPE", "0.03,", "")},
        {"SideOfABox", "section:BEAM:a", 0.06, beam("BOX", "", box.substr(4))},
        {"WallOfABox", "section:BEAM:t3", 0.006, beam("BOX", box.substr(0, 22), ",0.007")},
        {"OwnModulusOfABeam", "youngs_modulus:BEAM", 2e11, general},
        {"OwnShearModulusOfABeam", "shear_modulus:BEAM", 1.3e11,
         [general](const std::string& G) { return general("2e11," + G); }},
        {"ModulusOfC3D8R", "youngs_modulus:OTHER", 70e9,
         [](const std::string& E) {
             Brick brick;
             brick.type = "C3D8R";
             brick.elements = {4, 2, 2};
             return brick.meshText() + materialCards("*ELASTIC\n" + E + ",0.3", "2700") +
                    "*SOLID SECTION, ELSET=BODY, MATERIAL=OTHER\n";
         }},
        {"ModulusOfC3D20R", "youngs_modulus:OTHER", 70e9,
         [](const std::string& E) {
             return solidDeck("C3D20R", "*ELASTIC\n" + E + ",0.3", "2700");
         }},
        {"ModulusOfC3D10", "youngs_modulus:OTHER", 70e9,
         [](const std::string& E) {
             return solidDeck("C3D10", "*ELASTIC\n" + E + ",0.3", "2700");
         }},
        {"DensityOfC3D15", "density:OTHER", 1600,
         [](const std::string& rho) { return solidDeck("C3D15", Ply, rho); }},
        {"AreaOfATruss", "area:ROD", 2e-4,
         [](const std::string& A) {
             return onFeet("*ELEMENT, TYPE=T3D2, ELSET=ROD\n9001,1,36\n",
                           "*SOLID SECTION, ELSET=ROD, MATERIAL=STEEL\n" + A +
                               "\n*MATERIAL, NAME=STEEL\n*ELASTIC\n2e11,0.3\n*DENSITY\n7800\n");
         }},
        {"StepAndFoldOfS8R", "thickness:UPRIGHT", 0.012,
         [](const std::string& t) { return foldedDeck("S8R", t, "0.02"); }, true},
        {"StepAndFoldOfS4", "thickness:FLAT", 0.02,
         [](const std::string& t) { return foldedDeck("S4", "0.012", t); }, true},
        {"RigidBodyInAShell", "thickness:PLATE", 0.03,
         [](const std::string& t) {
             return shellDeck("S8R", shellSection(t, ", MATERIAL=METAL") +
                                         "*NODE\n9001,0,0.3,0.2\n"
                                         "*RIGID BODY, NSET=SEAT, REF NODE=9001\n");
         },
         true},
    };
}

class Derivatives : public ::testing::TestWithParam<VariedDeck> {
protected:
    FeModel read(double value, const std::vector<std::string>& derivatives = {}) {
        testing::writeText(folder / "deck.inp", GetParam().text(writeGeneral(value, 13)));
        CalculixOptions options;
        options.derivatives = derivatives;
        return readCalculixDeck(folder / "deck.inp", options);
    }

    ReducedBody reduceAt(double value, const ReductionOptions& options) {
        return reduce(read(value), options);
    }

    ReducedBody reduceWithDerivative(const ReductionOptions& options) {
        return reduce(read(GetParam().value, {GetParam().parameter}), options);
    }

    TestFolder folder;
};

Eigen::Map<const MatrixXd> squareOf(const ReducedBody& body, const std::vector<double>& values) {
    return {values.data(), body.numModes, body.numModes};
}

Eigen::Map<const VectorXd> omegaSquaredOf(const ReducedBody& body) {
    return {body.omegaSquared.data(), body.numModes};
}

/** Returns XᵀAX with A ⊗ 1 for the given number of directions. **/
MatrixXd calcForm(const SymmetricMatrix& A, int directions, const MatrixXd& X) {
    MatrixXd AX = MatrixXd::Zero(X.rows(), X.cols());
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[size_t(column)]; k < A.columnStarts[size_t(column) + 1]; ++k)
            for (int a = 0; a < directions; ++a) {
                const int i = directions * A.rows[size_t(k)] + a, j = directions * column + a;
                AX.row(i) += A.values[size_t(k)] * X.row(j);
                if (i != j) AX.row(j) += A.values[size_t(k)] * X.row(i);
            }
    return X.transpose() * AX;
}

/** Returns f′ by an eighth-order central difference. **/
template <class Calc>
auto differentiate(double value, double step, const Calc& calc) {
    constexpr double Weights[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    auto sum = ((calc(value + step) - calc(value - step)) * (Weights[0] / step)).eval();
    for (int k = 1; k < 4; ++k)
        sum += (calc(value + (k + 1) * step) - calc(value - (k + 1) * step)) * (Weights[k] / step);
    return sum;
}

/** Decks whose node motions do not depend on the parameter. **/
class DerivativesOfFreeNodes : public Derivatives {};

TEST_P(DerivativesOfFreeNodes, AreThoseOfTheFullMatrices) {
    ReductionOptions options;
    options.numModes = 30;
    const ReducedBody body = reduceWithDerivative(options);
    ASSERT_EQ(body.derivatives.size(), 1u);
    const ReducedBody::Derivative& derivative = body.getDerivative(GetParam().parameter);
    EXPECT_DOUBLE_EQ(derivative.value, GetParam().value);
    const Eigen::Map<const MatrixXd> Phi(body.Phi.data(), 3 * body.mesh.numNodes(), body.numModes);
    const double step = 0.02 * GetParam().value;
    const MatrixXd K = differentiate(GetParam().value, step,
                                     [&](double value) { return calcForm(read(value).K, 1, Phi); });
    const MatrixXd M = differentiate(GetParam().value, step,
                                     [&](double value) { return calcForm(read(value).m, 3, Phi); });
    const double value = GetParam().value;
    // Relative to K and M themselves, for quantities that do not depend on the parameter.
    const double sizeOfK = std::max(K.cwiseAbs().maxCoeff(),
                                    1e-3 * omegaSquaredOf(body).maxCoeff() / value),
                 sizeOfM = std::max(M.cwiseAbs().maxCoeff(), 1e-3 / value);
    EXPECT_LT((squareOf(body, derivative.K) - K).cwiseAbs().maxCoeff(), 1e-8 * sizeOfK);
    EXPECT_LT((squareOf(body, derivative.M) - M).cwiseAbs().maxCoeff(), 1e-8 * sizeOfM);
}

/** Compares each mode with reductions at other values. **/
void compareFrequencies(const ReducedBody& body, const VariedDeck& deck, int count,
                        const std::function<ReducedBody(double)>& reduceAt) {
    const ReducedBody::Derivative& derivative = body.getDerivative(deck.parameter);
    const VectorXd slopes = differentiate(deck.value, 2e-3 * deck.value, [&](double value) {
        const ReducedBody other = reduceAt(value);
        return omegaSquaredOf(other).head(count).eval();
    });
    for (int i = 0; i < count; ++i) {
        const double own = squareOf(body, derivative.K)(i, i) -
                           body.omegaSquared[size_t(i)] * squareOf(body, derivative.M)(i, i),
                     size = body.omegaSquared[size_t(i)] / deck.value;
        EXPECT_NEAR(own, slopes[i], 1e-6 * std::max(std::abs(slopes[i]), 0.1 * size))
            << "mode " << i + 1;
    }
}

TEST_P(Derivatives, AreThoseOfReductionsAtOtherValues) {
    ReductionOptions options;
    options.numModes = 6 + 8;
    const ReducedBody body = reduceWithDerivative(options);
    compareFrequencies(body, GetParam(), 6, [&](double value) { return reduceAt(value, options); });
}

/** Thin parts with a SEAT, all of whose modes have mass. **/
class DerivativesWithAnInterface : public Derivatives {};

TEST_P(DerivativesWithAnInterface, AreThoseOfReductionsAtOtherValues) {
    ReductionOptions options;  // all modes, so no selection
    options.interfaces = {{"seat", "SEAT"}};
    options.highestFrequency = 1e12;
    const ReducedBody body = reduceWithDerivative(options);
    compareFrequencies(body, GetParam(), 6, [&](double value) { return reduceAt(value, options); });
}

std::vector<VariedDeck> chooseDecks(const std::function<bool(const VariedDeck&)>& isTaken) {
    std::vector<VariedDeck> decks;
    for (const VariedDeck& deck : listDecks())
        if (isTaken(deck)) decks.push_back(deck);
    return decks;
}

const auto nameOfDeck = [](const auto& test) { return test.param.name; };

INSTANTIATE_TEST_SUITE_P(All, Derivatives, ::testing::ValuesIn(listDecks()), nameOfDeck);
INSTANTIATE_TEST_SUITE_P(All, DerivativesOfFreeNodes,
                         ::testing::ValuesIn(chooseDecks([](const VariedDeck& deck) {
                             return !deck.isTied;
                         })),
                         nameOfDeck);
INSTANTIATE_TEST_SUITE_P(All, DerivativesWithAnInterface,
                         ::testing::ValuesIn(chooseDecks([](const VariedDeck& deck) {
                             return (!deck.isTied &&
                                     deck.text("1").find("TYPE=S4") != std::string::npos) ||
                                    deck.name == "ThicknessOfS3";
                         })),
                         nameOfDeck);

class DerivativesOfAPart : public ::testing::Test {
protected:
    ReducedBody reduceText(const std::string& text, const std::vector<std::string>& derivatives,
                           const std::string& units = "m-kg-s", int numModes = 16) {
        testing::writeText(folder / "deck.inp", text);
        SourceOptions source;
        source.path = folder / "deck.inp";
        source.units = units;
        source.calculix.derivatives = derivatives;
        ReductionOptions options;
        options.numModes = numModes;
        return reduce(readModelSource(source), options);
    }

    std::string refuse(const std::string& text, const std::vector<std::string>& derivatives) {
        try {
            reduceText(text, derivatives);
        } catch (const std::invalid_argument& error) {
            return error.what();
        }
        return "it is taken";
    }

    TestFolder folder;
};

TEST_F(DerivativesOfAPart, ByModulusAndDensityOfItsOneMaterialAreItsStiffnessAndMass) {
    Brick brick;
    brick.type = "C3D8R";
    const ReducedBody body =
        reduceText(brick.text(), {"youngs_modulus:METAL", "Density:metal", "stiffness:METAL"});
    const MatrixXd Omega2 = omegaSquaredOf(body).asDiagonal(),
                   one = MatrixXd::Identity(body.numModes, body.numModes);
    const double largest = Omega2.maxCoeff();
    for (const auto& [parameter, value, unit] : {std::tuple("youngs_modulus:METAL", brick.E, "Pa"),
                                                 std::tuple("stiffness:METAL", 1.0, "1")}) {
        const ReducedBody::Derivative& derivative = body.getDerivative(parameter);
        EXPECT_DOUBLE_EQ(derivative.value, value);
        EXPECT_EQ(derivative.unit, unit);
        EXPECT_LT((value * squareOf(body, derivative.K) - Omega2).cwiseAbs().maxCoeff(),
                  1e-11 * largest);
        EXPECT_EQ(squareOf(body, derivative.M).cwiseAbs().maxCoeff(), 0);
    }
    const ReducedBody::Derivative& density = body.getDerivative("density:METAL");
    EXPECT_EQ(density.unit, "kg/m^3");
    EXPECT_LT((brick.rho * squareOf(body, density.M) - one).cwiseAbs().maxCoeff(), 1e-11);
    EXPECT_EQ(squareOf(body, density.K).cwiseAbs().maxCoeff(), 0);
}

TEST_F(DerivativesOfAPart, ByAllThatIsInMetresTogetherAreThoseOfSimilarity) {
    // For a part scaled by s, Ω² ~ s⁻², by nodes and section together. Nodes alone are not a
    // parameter, but a straight Euler-Bernoulli beam with ν = 0 has Ω² ~ b².
    ThinDeck deck;
    deck.nu = 0;
    deck.addBeam("B32R", "BEAM", 20, {0, 0, 0}, {1, 0, 0});
    deck.add("*BEAM SECTION, ELSET=BEAM, MATERIAL=METAL, SECTION=RECT\n0.002,0.001\n0,0,-1\n");
    const ReducedBody body = reduceText(deck.text(), {"section:BEAM:a", "section:BEAM:b"});
    const auto slope = [&](const char* parameter, int mode) {
        const ReducedBody::Derivative& d = body.getDerivative(parameter);
        return d.value * (squareOf(body, d.K)(mode, mode) / body.omegaSquared[size_t(mode)] -
                          squareOf(body, d.M)(mode, mode));
    };
    EXPECT_NEAR(slope("section:BEAM:b", 0), 2, 1e-4);  // the lowest bends across b
    EXPECT_NEAR(slope("section:BEAM:a", 0), 0, 1e-4);
}

TEST_F(DerivativesOfAPart, PredictAReductionWithAThicknessOfAPercentMore) {
    const auto plate = [](double t) {
        ThinDeck deck;
        deck.addPatch("S4", "PLATE", 12, 8, [](double u, double v) -> Point {
            return {0.5 * u, 0.3 * v, 0};
        });
        deck.addShellSection("PLATE", t);
        return deck.text();
    };
    const double t = 0.004;
    const ReducedBody body = reduceText(plate(t), {"thickness:PLATE"}),
                      thicker = reduceText(plate(1.01 * t), {});
    const ReducedBody::Derivative& d = body.getDerivative("thickness:PLATE");
    const MatrixXd K = MatrixXd(omegaSquaredOf(body).asDiagonal()) + 0.01 * t * squareOf(body, d.K),
                   M = MatrixXd::Identity(body.numModes, body.numModes) +
                       0.01 * t * squareOf(body, d.M);
    const VectorXd predicted =
        Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M).eigenvalues();
    for (int i = 0; i < 3; ++i) {
        const double change = thicker.omegaSquared[size_t(i)] / body.omegaSquared[size_t(i)] - 1;
        EXPECT_NEAR(change, 0.02, 1e-3);  // a plate's Ω² ~ t²
        EXPECT_NEAR(predicted[i] / body.omegaSquared[size_t(i)] - 1, change, 0.02 * change);
    }
}

TEST_F(DerivativesOfAPart, AreInSIWhateverTheUnitsOfTheDeck) {
    const auto deck = [](double length, const std::string& E, const std::string& rho,
                         const std::string& t) {
        ThinDeck plate;
        plate.addPatch("S8R", "PLATE", 3, 2, [&](double u, double v) -> Point {
            return {length * u, 0.7 * length * v, 0.1 * length * u * v};
        });
        plate.add("*MATERIAL, NAME=STEEL\n*ELASTIC\n" + E + ",0.3\n*DENSITY\n" + rho +
                  "\n*SHELL SECTION, ELSET=PLATE, MATERIAL=STEEL\n" + t + "\n");
        return plate.text();
    };
    const std::vector<std::string> names = {"youngs_modulus:STEEL", "density:STEEL",
                                            "thickness:PLATE"};
    const ReducedBody metres = reduceText(deck(1, "2.1e11", "7850", "0.02"), names),
                      millimetres =
                          reduceText(deck(1e3, "2.1e5", "7.85e-9", "20"), names, "mm-t-s");
    for (const std::string& name : names) {
        const ReducedBody::Derivative &a = metres.getDerivative(name),
                                      &b = millimetres.getDerivative(name);
        EXPECT_NEAR(b.value, a.value, 1e-12 * a.value) << name;
        EXPECT_EQ(b.unit, a.unit);
        const VectorXd ofA = squareOf(metres, a.K).diagonal(),
                       ofB = squareOf(millimetres, b.K).diagonal();
        EXPECT_LE((ofA - ofB).cwiseAbs().maxCoeff(), 1e-7 * ofA.cwiseAbs().maxCoeff()) << name;
        const VectorXd massOfA = squareOf(metres, a.M).diagonal(),
                       massOfB = squareOf(millimetres, b.M).diagonal();
        EXPECT_LE((massOfA - massOfB).cwiseAbs().maxCoeff(), 1e-7 * massOfA.cwiseAbs().maxCoeff())
            << name;
    }
}

TEST_F(DerivativesOfAPart, GoWithItsModesAndItsStiffness) {
    const ReducedBody body = reduceText(Brick().text(), {"density:METAL", "youngs_modulus:METAL"});
    const ReducedBody few = selectModes(body, {1, 3});
    ASSERT_EQ(few.derivatives.size(), 2u);
    few.validate();
    EXPECT_EQ(squareOf(few, few.derivatives[0].M)(0, 1),
              squareOf(body, body.derivatives[0].M)(1, 3));
    const ReducedBody softer = body.withScaledStiffness(0.5);
    EXPECT_EQ(softer.derivatives[1].K[0], 0.5 * body.derivatives[1].K[0]);
    EXPECT_EQ(softer.derivatives[0].M, body.derivatives[0].M);
    writeReducedBody(folder / "part.h5", body);
    const ReducedBody read = readReducedBody(folder / "part.h5");
    ASSERT_EQ(read.derivatives.size(), 2u);
    for (size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(read.derivatives[k].parameter, body.derivatives[k].parameter);
        EXPECT_EQ(read.derivatives[k].unit, body.derivatives[k].unit);
        EXPECT_EQ(read.derivatives[k].value, body.derivatives[k].value);
        EXPECT_EQ(read.derivatives[k].K, body.derivatives[k].K);
        EXPECT_EQ(read.derivatives[k].M, body.derivatives[k].M);
    }
    try {
        read.getDerivative("thickness:SKIN");
        FAIL() << "it has no thickness";
    } catch (const std::out_of_range& error) {
        EXPECT_THAT(error.what(),
                    AllOf(HasSubstr("'thickness:SKIN'"), HasSubstr("'density:METAL'")));
    }
}

TEST_F(DerivativesOfAPart, ThatCannotBeAreRefusedByName) {
    const std::string brick = Brick().text();
    EXPECT_THAT(
        refuse(brick, {"density:METL"}),
        AllOf(HasSubstr("deck.inp"), HasSubstr("'density:METL'"),
              HasSubstr("did you mean 'density:METAL'?"), HasSubstr("youngs_modulus:METAL")));
    EXPECT_THAT(refuse(brick, {"density:METAL", "density:metal"}), HasSubstr("asked for twice"));
    EXPECT_THAT(refuse(brick + materialCards("*ELASTIC\n1e9,0.3", "900"), {"density:OTHER"}),
                HasSubstr("nothing in the part depends on it"));
    EXPECT_THAT(refuse(Brick().meshText() + materialCards("*ELASTIC\n1e9,0.3", "0") +
                           "*SOLID SECTION, ELSET=BODY, MATERIAL=OTHER\n",
                       {"density:OTHER"}),
                HasSubstr("*DENSITY is 0; it must be positive"));
    // Sets of equal thickness share their border nodes.
    ThinDeck deck;
    for (const double side : {0.0, 1.0}) {
        const std::string set = side == 0 ? "LEFT" : "RIGHT";
        deck.addPatch("S8R", set, 2, 2, [&](double u, double v) -> Point {
            return {u + side, v, 0};
        });
        deck.addShellSection(set, 0.02);
    }
    EXPECT_THAT(refuse(deck.text(), {"thickness:LEFT"}),
                AllOf(HasSubstr("'thickness:LEFT'"), HasSubstr("share nodes with these")));
    testing::writeText(folder / "K.mtx",
                       "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n");
    SourceOptions source;
    source.path = folder / "K.mtx";
    source.massMatrix = source.path;
    source.nodes = source.path;
    source.calculix.derivatives = {"density:METAL"};
    try {
        readModelSource(source);
        FAIL() << "matrices are taken";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), AllOf(HasSubstr("'density:METAL'"), HasSubstr("matrices")));
    }
}

}  // namespace
}  // namespace simflex
