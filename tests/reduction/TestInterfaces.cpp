/** @file
Interfaces, load points, constraints and the reduction report against dense linear algebra on the
same K and M; distributing ties against CalculiX's distributing coupling. **/

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <fstream>
#include <sstream>

#include "fe/TestDecks.h"
#include "simflex/fe/CalculixDeck.h"
#include "simflex/fe/NodeSelection.h"
#include "simflex/reduction/Reduction.h"

namespace simflex {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using ::testing::AllOf;
using testing::Brick;
using ::testing::HasSubstr;
using testing::TestFolder;

MatrixXd toDense(const SymmetricMatrix& A, int dofsPerRow = 1) {
    MatrixXd dense = MatrixXd::Zero(dofsPerRow * A.size, dofsPerRow * A.size);
    for (int column = 0; column < A.size; ++column)
        for (auto k = A.columnStarts[column]; k < A.columnStarts[column + 1]; ++k)
            for (int a = 0; a < dofsPerRow; ++a) {
                dense(dofsPerRow * A.rows[k] + a, dofsPerRow * column + a) = A.values[k];
                dense(dofsPerRow * column + a, dofsPerRow * A.rows[k] + a) = A.values[k];
            }
    return dense;
}

/** Returns the rigid motions about a point at all nodes, or some. **/
MatrixXd rigidMotions(const Mesh& mesh, const Vector3d& about, std::vector<int> nodes = {}) {
    if (nodes.empty())
        for (int node = 0; node < mesh.numNodes(); ++node) nodes.push_back(node);
    MatrixXd R = MatrixXd::Zero(3 * Eigen::Index(nodes.size()), 6);
    for (size_t k = 0; k < nodes.size(); ++k) {
        const Vector3d r =
            Eigen::Map<const Vector3d>(&mesh.positions[3 * size_t(nodes[k])]) - about;
        for (int j = 0; j < 3; ++j) {
            R.block<3, 1>(3 * Eigen::Index(k), j) = Vector3d::Unit(j);
            R.block<3, 1>(3 * Eigen::Index(k), 3 + j) = Vector3d::Unit(j).cross(r);
        }
    }
    return R;
}

Vector3d meanOf(const Mesh& mesh, const std::string& set) {
    Vector3d mean = Vector3d::Zero();
    for (const int node : mesh.nodeSets.at(set))
        mean += Eigen::Map<const Vector3d>(&mesh.positions[3 * size_t(node)]);
    return mean / double(mesh.nodeSets.at(set).size());
}

/** Returns ∫ N Nᵀ over an end of the brick, 2×2 bilinear faces, up to a factor. **/
MatrixXd integrateEnd(const Mesh& mesh, const std::vector<int>& nodes) {
    constexpr double OfLine[3][3] = {{2, 1, 0}, {1, 4, 1}, {0, 1, 2}};
    const auto placeOf = [&](int node, size_t axis) {
        const double x = mesh.position(node)[axis];
        return x < -1e-9 ? 0 : x < 1e-9 ? 1 : 2;
    };
    MatrixXd W(nodes.size(), nodes.size());
    for (size_t i = 0; i < nodes.size(); ++i)
        for (size_t j = 0; j < nodes.size(); ++j) {
            double& to = W(Eigen::Index(i), Eigen::Index(j)) = 1;
            for (const size_t axis : {1, 2})
                to *= OfLine[placeOf(nodes[i], axis)][placeOf(nodes[j], axis)];
        }
    return W;
}

/** Returns the area-weighted best-fit rigid motion of a set's mean point: 6×numDofs. **/
MatrixXd meanMotion(const Mesh& mesh, const std::string& set) {
    const auto& nodes = mesh.nodeSets.at(set);
    const MatrixXd R = rigidMotions(mesh, meanOf(mesh, set), nodes), W = integrateEnd(mesh, nodes);
    MatrixXd weighted = MatrixXd::Zero(R.rows(), 6);
    for (Eigen::Index i = 0; i < W.rows(); ++i)
        for (Eigen::Index j = 0; j < W.cols(); ++j)
            weighted.middleRows<3>(3 * i) += W(i, j) * R.middleRows<3>(3 * j);
    const MatrixXd fit = (weighted.transpose() * R).inverse() * weighted.transpose();
    MatrixXd D = MatrixXd::Zero(6, 3 * mesh.numNodes());
    for (size_t k = 0; k < nodes.size(); ++k)
        D.middleCols<3>(3 * nodes[k]) = fit.middleCols<3>(3 * Eigen::Index(k));
    return D;
}

/** Returns columns that span the shapes with the set rigidly tied: its 6 motions first, then the
other DOF. **/
MatrixXd tieRigidly(const Mesh& mesh, const std::string& set) {
    const auto& nodes = mesh.nodeSets.at(set);
    const Eigen::Index n = 3 * mesh.numNodes();
    MatrixXd T = MatrixXd::Zero(n, 6 + n - 3 * Eigen::Index(nodes.size()));
    const MatrixXd R = rigidMotions(mesh, meanOf(mesh, set), nodes);
    for (size_t k = 0; k < nodes.size(); ++k)
        T.block(3 * nodes[k], 0, 3, 6) = R.middleRows<3>(3 * Eigen::Index(k));
    Eigen::Index column = 6;
    for (int node = 0; node < mesh.numNodes(); ++node)
        if (!std::binary_search(nodes.begin(), nodes.end(), node))
            for (int a = 0; a < 3; ++a) T(3 * node + a, column++) = 1;
    return T;
}

/** Returns the frequencies [Hz] of a pencil, ascending. **/
VectorXd frequenciesOf(const MatrixXd& K, const MatrixXd& M) {
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(K, M, Eigen::EigenvaluesOnly);
    return solver.eigenvalues().cwiseMax(0).cwiseSqrt() / (2 * M_PI);
}

/** Returns an orthonormal basis of the shapes with D u = 0. **/
MatrixXd nullSpace(const MatrixXd& D) {
    const Eigen::FullPivLU<MatrixXd> lu(D);
    const MatrixXd kernel = lu.kernel();
    const Eigen::HouseholderQR<MatrixXd> qr(kernel);
    return qr.householderQ() * MatrixXd::Identity(kernel.rows(), kernel.cols());
}

double hertzOf(const ReducedBody& body, int mode) {
    return std::sqrt(body.omegaSquared[size_t(mode)]) / (2 * M_PI);
}

class InterfacesTest : public ::testing::Test {
protected:
    static void SetUpTestSuite() {
        TestFolder folder;
        testing::writeText(folder / "brick.inp", Brick().text());
        model = new FeModel(readCalculixDeck(folder / "brick.inp"));
        K = toDense(model->K);
        M = toDense(model->m, 3);
    }
    static void TearDownTestSuite() { delete model; }

    static ReductionOptions twoEnds(TieType left, TieType right, int numModes) {
        ReductionOptions options;
        options.name = "brick";
        options.interfaces = {{"left", "LEFT", left}, {"right", "RIGHT", right}};
        options.numModes = numModes;
        return options;
    }

    static std::string errorOf(const ReductionOptions& options) {
        try {
            reduce(*model, options);
        } catch (const std::exception& error) {
            return error.what();
        }
        return "accepted";
    }

    /** Returns the displacement of all nodes under f with interface 'left' of the part held. **/
    static VectorXd deflect(const ReducedBody& body, const VectorXd& f, const FeModel& of) {
        const Eigen::Index n = body.numModes, numDofs = 3 * body.mesh.numNodes();
        const MatrixXd R =
            rigidMotions(of.mesh, Eigen::Map<const Vector3d>(body.centerOfMass.data()));
        MatrixXd B(numDofs, 6 + n);
        B << R, Eigen::Map<const MatrixXd>(body.Phi.data(), numDofs, n);
        const auto& left = body.getInterface("left");
        MatrixXd A(6, 6 + n);
        A << MatrixXd::Identity(6, 6), MatrixXd::Zero(6, n);
        for (int j = 0; j < 3; ++j)
            A.block<3, 1>(0, 3 + j) =
                Vector3d::Unit(j).cross(Eigen::Map<const Vector3d>(left.position.data()));
        A.block(0, 6, 3, n) = Eigen::Map<const MatrixXd>(left.Phi.data(), 3, n);
        A.block(3, 6, 3, n) = Eigen::Map<const MatrixXd>(left.Psi.data(), 3, n);
        MatrixXd system = MatrixXd::Zero(12 + n, 12 + n);
        VectorXd scale = VectorXd::Ones(12 + n);
        for (Eigen::Index i = 0; i < n; ++i) {
            system(6 + i, 6 + i) = body.omegaSquared[size_t(i)];
            scale[6 + i] = 1 / std::sqrt(body.omegaSquared[size_t(i)]);
        }
        system.bottomLeftCorner(6, 6 + n) = A;
        system.topRightCorner(6 + n, 6) = A.transpose();
        VectorXd right = VectorXd::Zero(12 + n);
        right.head(6 + n) = B.transpose() * f;
        const MatrixXd scaled = scale.asDiagonal() * system * scale.asDiagonal();
        const VectorXd x =
            scale.asDiagonal() * scaled.fullPivLu().solve(scale.asDiagonal() * right).eval();
        return B * x.head(6 + n);
    }

    /** The same by dense linear algebra, with D u = 0 (rows of D). **/
    static VectorXd deflectDense(const MatrixXd& D, const VectorXd& f) {
        const MatrixXd Z = nullSpace(D);
        return Z * (Z.transpose() * K * Z).ldlt().solve(Z.transpose() * f);
    }

    static FeModel* model;
    static MatrixXd K, M;
};

FeModel* InterfacesTest::model = nullptr;
MatrixXd InterfacesTest::K, InterfacesTest::M;

TEST_F(InterfacesTest, DistributingTiesStiffenNothing) {
    // With all modes, the part equals the whole model.
    const ReducedBody body = reduce(
        *model, twoEnds(TieType::Distributing, TieType::Distributing, 3 * model->mesh.numNodes()));
    const VectorXd expected = frequenciesOf(K, M);
    ASSERT_EQ(body.numModes, expected.size() - 6);
    for (int i = 0; i < body.numModes; ++i)
        EXPECT_NEAR(hertzOf(body, i), expected[6 + i], 1e-8 * expected[6 + i]) << "mode " << i + 1;
}

TEST_F(InterfacesTest, RigidAndDistributingTiesTogetherMatchDenseAlgebra) {
    const MatrixXd T = tieRigidly(model->mesh, "LEFT");
    const ReducedBody body =
        reduce(*model, twoEnds(TieType::Rigid, TieType::Distributing, int(T.cols())));
    const VectorXd expected = frequenciesOf(T.transpose() * K * T, T.transpose() * M * T);
    ASSERT_EQ(body.numModes, expected.size() - 6);
    for (int i = 0; i < body.numModes; ++i)
        EXPECT_NEAR(hertzOf(body, i), expected[6 + i], 1e-8 * expected[6 + i]) << "mode " << i + 1;
    EXPECT_EQ(body.getInterface("left").tie, TieType::Rigid);
    EXPECT_TRUE(body.getInterface("left").weights.empty());
    EXPECT_EQ(body.getInterface("right").tie, TieType::Distributing);
    EXPECT_THAT(body.getInterface("right").weights, ::testing::Each(::testing::DoubleEq(1.0 / 9)));
}

TEST_F(InterfacesTest, ADistributingInterfaceMovesAsTheMeanOfItsNodes) {
    const ReducedBody body = reduce(*model, twoEnds(TieType::Distributing, TieType::Rigid, 30));
    const MatrixXd D = meanMotion(model->mesh, "LEFT");
    const Eigen::Map<const MatrixXd> Phi(body.Phi.data(), 3 * body.mesh.numNodes(), body.numModes);
    const auto& left = body.getInterface("left");
    MatrixXd master(6, body.numModes);
    master << Eigen::Map<const MatrixXd>(left.Phi.data(), 3, body.numModes),
        Eigen::Map<const MatrixXd>(left.Psi.data(), 3, body.numModes);
    EXPECT_LT((D * Phi - master).cwiseAbs().maxCoeff(), 1e-9 * master.cwiseAbs().maxCoeff());
}

TEST_F(InterfacesTest, LoadsOnInterfacesBendThePartAsTheFullModel) {
    for (const TieType left : {TieType::Rigid, TieType::Distributing})
        for (const TieType right : {TieType::Rigid, TieType::Distributing}) {
            const ReducedBody body = reduce(*model, twoEnds(left, right, 14));
            VectorXd load(6);
            load << 100, 40, -25, 0.3, -0.2, 0.5;
            const VectorXd f = meanMotion(model->mesh, "RIGHT").transpose() * load;
            // A rigid tie is a distributing tie whose nodes follow it: all their non-rigid motion
            // is constrained.
            MatrixXd held = meanMotion(model->mesh, "LEFT");
            for (const auto& [set, tie] : {std::pair{"LEFT", left}, std::pair{"RIGHT", right}}) {
                if (tie == TieType::Distributing) continue;
                const auto& nodes = model->mesh.nodeSets.at(set);
                const MatrixXd R = rigidMotions(model->mesh, meanOf(model->mesh, set), nodes),
                               others = nullSpace(R.transpose()).transpose();
                MatrixXd rows = MatrixXd::Zero(others.rows(), 3 * model->mesh.numNodes());
                for (size_t k = 0; k < nodes.size(); ++k)
                    rows.middleCols<3>(3 * nodes[k]) = others.middleCols<3>(3 * Eigen::Index(k));
                MatrixXd both(held.rows() + rows.rows(), held.cols());
                both << held, rows;
                held = both;
            }
            const VectorXd expected = deflectDense(held, f), found = deflect(body, f, *model);
            EXPECT_LT((found - expected).norm(), 1e-8 * expected.norm())
                << int(left) << " " << int(right);
        }
}

TEST_F(InterfacesTest, NormalModesAndEffectiveMassesMatchDenseAlgebra) {
    const ReducedBody body =
        reduce(*model, twoEnds(TieType::Distributing, TieType::Distributing, 30));
    MatrixXd D(12, K.cols());
    D << meanMotion(model->mesh, "LEFT"), meanMotion(model->mesh, "RIGHT");
    const MatrixXd Z = nullSpace(D);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> solver(Z.transpose() * K * Z,
                                                                    Z.transpose() * M * Z);
    ASSERT_TRUE(body.report);
    ASSERT_EQ(body.report->normalFrequencies.size(), 18u);
    ASSERT_EQ(body.report->effectiveMasses.size(), 6 * 18u);
    const MatrixXd R =
        rigidMotions(model->mesh, Eigen::Map<const Vector3d>(body.centerOfMass.data()));
    const MatrixXd L = R.transpose() * M * Z * solver.eigenvectors();
    for (int k = 0; k < 18; ++k) {
        const double hertz = std::sqrt(solver.eigenvalues()[k]) / (2 * M_PI);
        EXPECT_NEAR(body.report->normalFrequencies[size_t(k)], hertz, 1e-8 * hertz);
        for (int j = 0; j < 6; ++j)
            EXPECT_NEAR(body.report->effectiveMasses[size_t(6 * k + j)], L(j, k) * L(j, k),
                        1e-7 * body.report->rigidMasses[size_t(j)])
                << "mode " << k + 1 << " direction " << j;
    }
    const double m = body.mass;
    EXPECT_THAT(body.report->rigidMasses,
                ::testing::ElementsAre(m, m, m, body.inertia[0], body.inertia[1], body.inertia[2]));
}

TEST_F(InterfacesTest, FullFrequenciesAreThoseOfTheWholeTiedModel) {
    for (const TieType right : {TieType::Rigid, TieType::Distributing}) {
        ReductionOptions options = twoEnds(TieType::Rigid, right, 24);
        options.numCheckedModes = 10;
        const ReducedBody body = reduce(*model, options);
        MatrixXd T = tieRigidly(model->mesh, "LEFT");
        if (right == TieType::Rigid) {
            // Only shapes with a rigid right end.
            const auto& nodes = model->mesh.nodeSets.at("RIGHT");
            const MatrixXd R = rigidMotions(model->mesh, meanOf(model->mesh, "RIGHT"), nodes);
            const MatrixXd others = nullSpace(R.transpose()).transpose();
            MatrixXd rows = MatrixXd::Zero(others.rows(), K.cols());
            for (size_t k = 0; k < nodes.size(); ++k)
                rows.middleCols<3>(3 * nodes[k]) = others.middleCols<3>(3 * Eigen::Index(k));
            T = T * nullSpace(rows * T);
        }
        const VectorXd expected = frequenciesOf(T.transpose() * K * T, T.transpose() * M * T);
        ASSERT_EQ(body.report->fullFrequencies.size(), 10u);
        for (int i = 0; i < 10; ++i) {
            EXPECT_NEAR(body.report->fullFrequencies[size_t(i)], expected[6 + i],
                        1e-8 * expected[6 + i]);
            // Ritz: a reduced part is never softer than its model.
            EXPECT_GT(hertzOf(body, i), expected[6 + i] * (1 - 1e-9));
        }
    }
}

TEST_F(InterfacesTest, FreePartsAreCheckedTooAndAgreeToTheLast) {
    ReductionOptions options;
    options.numModes = 20;
    options.numCheckedModes = 14;
    const ReducedBody body = reduce(*model, options);
    ASSERT_EQ(body.report->fullFrequencies.size(), 14u);
    for (int i = 0; i < 14; ++i)
        EXPECT_NEAR(body.report->fullFrequencies[size_t(i)], hertzOf(body, i),
                    1e-8 * hertzOf(body, i));
    EXPECT_TRUE(body.report->effectiveMasses.empty());
}

TEST_F(InterfacesTest, AHighestFrequencyTakesAllNormalModesBelowIt) {
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Rigid, 60);
    const auto all = reduce(*model, options).report->normalFrequencies;
    options.highestFrequency = 0.5 * (all[20] + all[21]);
    options.numModes = 1;  // not used
    const ReducedBody body = reduce(*model, options);
    ASSERT_EQ(body.report->normalFrequencies.size(), 21u);
    EXPECT_EQ(body.numModes, 21 + 12 - 6);
    options.highestFrequency = 0.5 * all[0];
    EXPECT_EQ(reduce(*model, options).numModes, 6);  // constraint modes alone
    options.highestFrequency = -1;
    EXPECT_THAT(errorOf(options), HasSubstr("highest frequency"));
}

TEST_F(InterfacesTest, AttachmentModesMakeLoadPointsBendAsTheFullModel) {
    // The middle of the brick's long edge; and a whole set along one axis.
    for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
        ReductionOptions options = twoEnds(tie, TieType::Distributing, 12 + 3 + 1 + 4);
        options.loadPoints = {{"node:5", "xyz"}, {"sphere:0.1,0.015,0.01,0.001", "z"}};
        const ReducedBody body = reduce(*model, options);
        EXPECT_EQ(body.report->numAttachmentModes, 4);
        EXPECT_EQ(body.numModes, 14);
        MatrixXd held = meanMotion(model->mesh, "LEFT");
        if (tie == TieType::Rigid) {
            held = MatrixXd::Zero(27, K.cols());
            Eigen::Index row = 0;
            for (const int node : model->mesh.nodeSets.at("LEFT"))
                for (int a = 0; a < 3; ++a) held(row++, 3 * node + a) = 1;
        }
        for (int axis = 0; axis < 3; ++axis) {
            VectorXd f = VectorXd::Zero(K.cols());
            f[3 * model->mesh.indexOf(5) + axis] = 50;
            const VectorXd expected = deflectDense(held, f), found = deflect(body, f, *model);
            EXPECT_LT((found - expected).norm(), 1e-8 * expected.norm()) << "axis " << axis;
        }
    }
}

TEST_F(InterfacesTest, OfALoadPointThatTouchesAnInterfaceTheRestIsLoaded) {
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Distributing, 12 + 1 + 4);
    options.loadPoints = {{"LINE", "z"}};  // from LEFT to RIGHT
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.report->numAttachmentModes, 1);
    MatrixXd held = MatrixXd::Zero(27, K.cols());
    Eigen::Index row = 0;
    for (const int node : model->mesh.nodeSets.at("LEFT"))
        for (int a = 0; a < 3; ++a) held(row++, 3 * node + a) = 1;
    VectorXd f = VectorXd::Zero(K.cols());
    for (const int node : model->mesh.nodeSets.at("LINE")) f[3 * node + 2] = 50;
    const VectorXd expected = deflectDense(held, f), found = deflect(body, f, *model);
    EXPECT_LT((found - expected).norm(), 1e-8 * expected.norm());
}

TEST_F(InterfacesTest, AttachmentModesThatNormalModesHoldAreDropped) {
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Rigid, 12 + 6 + 20);
    options.loadPoints = {{"node:5", "xyz"}, {"node:5", "xyz"}};
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.report->numAttachmentModes, 3);
    EXPECT_EQ(body.numModes, 12 + 3 + 20 - 6);
}

TEST_F(InterfacesTest, WithoutInterfacesAttachmentModesAreInertiaRelieved) {
    ReductionOptions options;
    options.numModes = 6 + 3 + 4;
    options.loadPoints = {{"node:5"}};
    const ReducedBody body = reduce(*model, options);
    EXPECT_EQ(body.numModes, 7);
    // The elastic deflection under a load balanced by inertia, K u = f − M R (RᵀMR)⁻¹ Rᵀ f.
    const MatrixXd R =
        rigidMotions(model->mesh, Eigen::Map<const Vector3d>(body.centerOfMass.data()));
    VectorXd f = VectorXd::Zero(K.cols());
    f[3 * model->mesh.indexOf(5) + 1] = 1;
    const MatrixXd MR = M * R, RMR = R.transpose() * MR;
    const VectorXd balanced = f - MR * RMR.ldlt().solve(R.transpose() * f);
    const VectorXd expected = deflectDense(MR.transpose(), balanced);
    const Eigen::Map<const MatrixXd> Phi(body.Phi.data(), K.cols(), body.numModes);
    const Eigen::Map<const VectorXd> omegaSquared(body.omegaSquared.data(), body.numModes);
    const VectorXd found = Phi * (Phi.transpose() * f).cwiseQuotient(omegaSquared);
    EXPECT_LT((found - expected).norm(), 1e-8 * expected.norm());
}

TEST_F(InterfacesTest, TheReportMeasuresWhatItSays) {
    const ReducedBody body = reduce(*model, twoEnds(TieType::Rigid, TieType::Distributing, 30));
    const Eigen::Map<const MatrixXd> Phi(body.Phi.data(), K.cols(), body.numModes);
    const MatrixXd mass = Phi.transpose() * M * Phi;
    EXPECT_LT((mass - MatrixXd::Identity(mass.rows(), mass.cols())).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_LT(body.report->massOrthogonality, 1e-10);
    EXPECT_LT(body.report->stiffnessOrthogonality, 1e-10);
    EXPECT_LT(body.report->rigidResidual, 1e-9);
    EXPECT_LT(body.report->rigidEnergy, 1e-6);  // ccx writes 14 digits of K
    EXPECT_EQ(body.report->numConstraintModes, 12);
    // The factored matrix is that of the coordinates left free by the rigid tie.
    const MatrixXd T = tieRigidly(model->mesh, "LEFT").rightCols(K.cols() - 27);
    const MatrixXd factored = T.transpose() * K * T;
    const double condition = factored.cwiseAbs().colwise().sum().maxCoeff() *
                             factored.inverse().cwiseAbs().colwise().sum().maxCoeff();
    EXPECT_GT(body.report->conditionNumber, 0.3 * condition);
    EXPECT_LT(body.report->conditionNumber, 1.0001 * condition);  // estimated from below
}

TEST_F(InterfacesTest, MastersFarFromTheirNodesAreToldOrRefused) {
    // The part is about 0.2 m long.
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Rigid, 24);
    EXPECT_TRUE(listInterfaceWarnings(*model, options).empty());
    options.interfaces[0].master = {0.2, 0, 0};  // at the other end
    const std::vector<std::string> warnings = listInterfaceWarnings(*model, options);
    ASSERT_EQ(warnings.size(), 1u);
    EXPECT_THAT(warnings[0], HasSubstr("interface 'left': the master point (0.2, 0, 0) is "));
    EXPECT_NO_THROW(reduce(*model, options));
    options.interfaces[0].master = {200, 0, 0};  // in millimetres
    EXPECT_THAT(errorOf(options), HasSubstr("it is given in metres"));
}

TEST_F(InterfacesTest, TheMasterOfACylinderIsOnItsAxis) {
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Rigid, 24);
    // About an axis off the end's centreline: the mean of its nodes is not on it.
    options.interfaces[0].nodes = "cylinder:-0.01,0.004,0,1,0,0,0.02,0.011";
    const auto master = reduce(*model, options).getInterface("left").position;
    EXPECT_NEAR(master[0], -0.1, 1e-12);
    EXPECT_NEAR(master[1], 0.004, 1e-12);
    EXPECT_NEAR(master[2], 0, 1e-12);
}

/** Returns a hollow journal about an oblique axis, of hexahedra that are finer on one side and at
one end; node set BORE: its inner nodes, HALF those on the finer half, BODY all, END a face. **/
Mesh makeGradedJournal(const Eigen::Vector3d& foot, const Eigen::Vector3d& axis) {
    constexpr int kRound = 24, kLong = 6, kThick = 2;
    const Eigen::Vector3d e = axis.unitOrthogonal(), f = axis.cross(e);
    Mesh mesh;
    const auto at = [](int i, int j, int k) { return i % kRound + kRound * (j + (kLong + 1) * k); };
    for (int k = 0; k <= kThick; ++k)
        for (int j = 0; j <= kLong; ++j)
            for (int i = 0; i < kRound; ++i) {
                const double s = double(i) / kRound, z = 0.04 * std::pow(double(j) / kLong, 2);
                const double angle = 2 * M_PI * (s + 0.1 * std::sin(2 * M_PI * s));
                const double r = 0.02 + 0.005 * k;
                const Eigen::Vector3d x =
                    foot + r * (std::cos(angle) * e + std::sin(angle) * f) + z * axis;
                const int node = mesh.numNodes();
                mesh.nodeNumbers.push_back(node + 1);
                mesh.positions.insert(mesh.positions.end(), x.data(), x.data() + 3);
                mesh.nodeSets["BODY"].push_back(node);
                if (k == 0) mesh.nodeSets["BORE"].push_back(node);
                if (k == 0 && std::cos(angle) < 0) mesh.nodeSets["HALF"].push_back(node);
                if (j == kLong) mesh.nodeSets["END"].push_back(node);
            }
    ElementBlock block;
    for (int k = 0; k < kThick; ++k)
        for (int j = 0; j < kLong; ++j)
            for (int i = 0; i < kRound; ++i)
                for (const auto& [a, b] : {std::pair(j, k), {j + 1, k}, {j + 1, k + 1}, {j, k + 1}})
                    block.nodes.insert(block.nodes.end(), {at(i, a, b), at(i + 1, a, b)});
    // CalculiX's order: around each end.
    for (size_t first = 0; first < block.nodes.size(); first += 8) {
        const std::vector<int> n(block.nodes.begin() + long(first),
                                 block.nodes.begin() + long(first) + 8);
        const int order[8] = {0, 1, 3, 2, 6, 7, 5, 4};
        for (size_t k = 0; k < 8; ++k) block.nodes[first + k] = n[size_t(order[k])];
    }
    mesh.elements = {block};
    return mesh;
}

TEST(FindMiddle, OfAGradedJournalIsOnItsAxisInTheMiddleOfItsLength) {
    const Eigen::Vector3d foot(0.3, -0.2, 0.1), axis = Eigen::Vector3d(1, 2, -0.5).normalized();
    const Mesh mesh = makeGradedJournal(foot, axis);
    const auto middle = [&](const char* set) {
        const auto x = findMiddle(mesh, set);
        return Eigen::Vector3d(x[0], x[1], x[2]);
    };
    const Eigen::Vector3d center = foot + 0.02 * axis;
    EXPECT_LT((middle("BORE") - center).norm(), 1e-12);
    // The mean of the nodes is off by millimetres.
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const int node : mesh.nodeSets.at("BORE"))
        mean += Eigen::Map<const Eigen::Vector3d>(&mesh.positions[3 * size_t(node)]) /
                double(mesh.nodeSets.at("BORE").size());
    EXPECT_GT((mean - center).norm(), 5e-3);
    // A ring and a volume are not cylinders: their centroids, to second order in the mesh size.
    EXPECT_LT((middle("END") - (foot + 0.04 * axis)).norm(), 1e-3);
    EXPECT_LT((middle("BODY") - center).norm(), 1e-3);
    // For a shell spanning less than half a turn, the axis is not its centre.
    EXPECT_GT((middle("HALF") - center).norm(), 1e-2);
}

TEST(FindMiddle, OfAFaceWithinThePartIsThatOfItsSurface) {
    // Two layers of bricks whose common faces are graded in both directions.
    const std::vector<double> steps = {0, 0.1, 0.15, 0.4, 1};
    const int n = int(steps.size());
    Mesh mesh;
    for (int k = 0; k < 3; ++k)
        for (int j = 0; j < n; ++j)
            for (int i = 0; i < n; ++i) {
                mesh.nodeNumbers.push_back(int(mesh.nodeNumbers.size()) + 1);
                for (const double x : {steps[size_t(i)], 2 * steps[size_t(j)], double(k)})
                    mesh.positions.push_back(x);
                if (k == 1) mesh.nodeSets["INNER"].push_back(int(mesh.nodeNumbers.size()) - 1);
                if (k == 2) mesh.nodeSets["TOP"].push_back(int(mesh.nodeNumbers.size()) - 1);
            }
    ElementBlock block;
    block.type = ElementType::Hex8;
    const auto at = [&](int i, int j, int k) { return i + n * (j + n * k); };
    for (int k = 0; k < 2; ++k)
        for (int j = 0; j + 1 < n; ++j)
            for (int i = 0; i + 1 < n; ++i)
                block.nodes.insert(block.nodes.end(),
                                   {at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k),
                                    at(i, j + 1, k), at(i, j, k + 1), at(i + 1, j, k + 1),
                                    at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)});
    mesh.elements = {block};
    const auto inner = findMiddle(mesh, "INNER"), top = findMiddle(mesh, "TOP");
    const double expected[3] = {0.5, 1, 1};
    for (size_t a = 0; a < 3; ++a) {
        EXPECT_NEAR(inner[a], expected[a], 1e-14);
        EXPECT_NEAR(top[a], expected[a] + (a == 2), 1e-14);
    }
}

TEST_F(InterfacesTest, WhatIsWrongWithALoadPointIsSaid) {
    ReductionOptions options = twoEnds(TieType::Rigid, TieType::Distributing, 30);
    options.loadPoints = {{"node:1"}};
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("node 1 "), HasSubstr("'left'")));
    options.loadPoints = {{"NOWHERE"}};
    EXPECT_THAT(errorOf(options), AllOf(HasSubstr("'NOWHERE'"), HasSubstr("RIGHT (9)")));
    options.loadPoints = {{"node:5", "w"}};
    EXPECT_THAT(errorOf(options), HasSubstr("xyz"));
}

/** Returns a brick cut in two at its middle, with duplicate nodes at the cut. **/
FeModel readCutBrick(bool joined) {
    TestFolder folder;
    Brick half;
    half.elements = {4, 2, 2};
    half.size[0] = 0.1;
    const std::string first = half.meshText();
    std::istringstream lines(half.meshText(1001, 1001));
    std::string second;
    bool inNodes = false;
    for (std::string line; std::getline(lines, line);) {
        if (line[0] == '*') {
            inNodes = line == "*NODE";
            const size_t at = line.find("NSET=");
            second +=
                (at == std::string::npos ? line : "*NSET, NSET=SECOND_" + line.substr(at + 5)) +
                "\n";
            continue;
        }
        if (inNodes) {
            const size_t from = line.find(',') + 1, to = line.find(',', from);
            std::ostringstream x;
            x << std::setprecision(15) << std::stod(line.substr(from)) + 0.1;
            line = line.substr(0, from) + x.str() + line.substr(to);
        }
        second += line + "\n";
    }
    testing::writeText(folder / "first.inp", first + half.materialText());
    if (!joined) return readCalculixDeck(folder / "first.inp");
    // Combine the separately assembled K and m of both pieces.
    testing::writeText(folder / "second.inp", second + half.materialText());
    FeModel a = readCalculixDeck(folder / "first.inp");
    const FeModel b = readCalculixDeck(folder / "second.inp");
    const int numFirst = a.mesh.numNodes();
    const auto join = [](SymmetricMatrix& A, const SymmetricMatrix& B) {
        A.columnStarts.pop_back();
        for (const auto start : B.columnStarts) A.columnStarts.push_back(A.numEntries() + start);
        for (const auto row : B.rows) A.rows.push_back(row + A.size);
        A.values.insert(A.values.end(), B.values.begin(), B.values.end());
        A.size += B.size;
    };
    join(a.K, b.K);
    join(a.m, b.m);
    a.mesh.nodeNumbers.insert(a.mesh.nodeNumbers.end(), b.mesh.nodeNumbers.begin(),
                              b.mesh.nodeNumbers.end());
    a.mesh.positions.insert(a.mesh.positions.end(), b.mesh.positions.begin(),
                            b.mesh.positions.end());
    a.mesh.elements.push_back(b.mesh.elements[0]);
    for (int& node : a.mesh.elements[1].nodes) node += numFirst;
    for (const auto& [name, nodes] : b.mesh.nodeSets)
        for (const int node : nodes) a.mesh.nodeSets[name].push_back(node + numFirst);
    // Each node of the second piece's left face coincides with a node of the first's right face.
    std::vector<int> coordinateOf(size_t(a.mesh.numNodes()), -1);
    int next = 0;
    for (int node = 0; node < a.mesh.numNodes(); ++node) {
        int twin = -1;
        for (int other = 0; other < numFirst && node >= numFirst; ++other) {
            double distance = 0;
            for (size_t axis = 0; axis < 3; ++axis)
                distance += std::abs(a.mesh.position(node)[axis] - a.mesh.position(other)[axis]);
            if (distance < 1e-9) twin = other;
        }
        coordinateOf[size_t(node)] = twin >= 0 ? coordinateOf[size_t(twin)] : next++;
    }
    NodalConstraints& T = a.constraints;
    T.numCoordinates = 3 * next;
    T.rowStarts = {0};
    for (int node = 0; node < a.mesh.numNodes(); ++node)
        for (int axis = 0; axis < 3; ++axis) {
            T.columns.push_back(3 * coordinateOf[size_t(node)] + axis);
            T.coefficients.push_back(1);
            T.rowStarts.push_back(std::int64_t(T.columns.size()));
        }
    return a;
}

TEST_F(InterfacesTest, PiecesJoinedByConstraintsAreOnePart) {
    const FeModel cut = readCutBrick(true);
    for (const TieType tie : {TieType::Rigid, TieType::Distributing}) {
        const ReducedBody whole = reduce(*model, twoEnds(tie, TieType::Rigid, 30));
        ReductionOptions options = twoEnds(tie, TieType::Rigid, 30);
        options.interfaces[1].nodes = "SECOND_RIGHT";
        const ReducedBody joined = reduce(cut, options);
        ASSERT_EQ(joined.numModes, whole.numModes);
        EXPECT_NEAR(joined.mass, whole.mass, 1e-12 * whole.mass);
        for (int i = 0; i < whole.numModes; ++i)
            EXPECT_NEAR(hertzOf(joined, i), hertzOf(whole, i), 1e-9 * hertzOf(whole, i));
        for (size_t c = 0; c < 6; ++c)
            EXPECT_NEAR(joined.inertia[c], whole.inertia[c], 1e-12 * whole.inertia[0]);
    }
}

TEST_F(InterfacesTest, ConstraintsToGroundAreRefused) {
    FeModel held = *model;
    NodalConstraints& T = held.constraints;
    T.numCoordinates = held.K.size - 1;
    T.rowStarts = {0, 0};  // the first translation is zero
    for (int dof = 1; dof < held.K.size; ++dof) {
        T.columns.push_back(dof - 1);
        T.coefficients.push_back(1);
        T.rowStarts.push_back(dof);
    }
    try {
        reduce(held, twoEnds(TieType::Rigid, TieType::Rigid, 30));
        FAIL() << "accepted";
    } catch (const std::invalid_argument& error) {
        EXPECT_THAT(error.what(), HasSubstr("constraints"));
    }
}

}  // namespace
}  // namespace simflex
