#include "RigidMotion.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "simflex/base/DenseAlgebra.h"

namespace simflex {

namespace {

/** Length over thickness above which a part may be, and above which it certainly is, too thin for
the precision of K; the latter for solids and for other elements. **/
constexpr double Slender = 500;
constexpr int TooSlenderSolid = 2000, TooSlender = 100000;

}  // namespace

Eigen::MatrixXd symmetricGram(const Shapes& X, const Shapes& Y) {
    const Eigen::MatrixXd gram = X.transpose() * Y;
    return 0.5 * (gram + gram.transpose());
}

Eigen::Matrix<double, 3, 6> calcRigidMotion(const Eigen::Vector3d& arm) {
    Eigen::Matrix<double, 3, 6> R;
    R << 1, 0, 0, 0, arm.z(), -arm.y(),  //
        0, 1, 0, -arm.z(), 0, arm.x(),   //
        0, 0, 1, arm.y(), -arm.x(), 0;
    return R;
}

RigidMotion calcRigidMotions(const FeModel& model, const FeProducts& products) {
    RigidMotion rigid;
    rigid.mass = model.calcMass();
    const auto center = model.calcCenterOfMass();
    rigid.center = Eigen::Vector3d(center.data());
    rigid.R.resize(model.K.size, 6);
    for (int node = 0; node < model.mesh.numNodes(); ++node)
        rigid.R.middleRows<3>(3 * node) = calcRigidMotion(
            Eigen::Map<const Eigen::Vector3d>(&model.mesh.positions[3 * node]) - rigid.center);
    const Shapes MR = products.m.multiplyPerAxis(rigid.R);
    rigid.inertia = (rigid.R.rightCols<3>().transpose() * MR.rightCols<3>()).eval();
    rigid.inertia = 0.5 * (rigid.inertia + rigid.inertia.transpose()).eval();
    return rigid;
}

Eigen::MatrixXd removeRigidMotion(const RigidMotion& rigid, const FeProducts& products, Shapes& X) {
    const Shapes MR = products.m.multiplyPerAxis(rigid.R);
    const Eigen::MatrixXd RMR = symmetricGram(rigid.R, MR);
    const Eigen::LDLT<Eigen::MatrixXd> factored(RMR);
    Eigen::MatrixXd taken = Eigen::MatrixXd::Zero(6, X.cols());
    for (int pass = 0; pass < 2; ++pass) {
        const Eigen::MatrixXd part = factored.solve(MR.transpose() * X);
        X.noalias() -= rigid.R * part;
        taken += part;
    }
    return taken;
}

std::string describeSlenderness(const RigidMotion& rigid) {
    const Eigen::Vector3d inertias = calcSymmetricEigen(rigid.inertia).values,
                          spreads =  // ∑m of squares along each axis
                          Eigen::Vector3d::Constant(inertias.sum() / 2) - inertias;
    const double slenderness = std::sqrt(spreads.maxCoeff() / std::max(spreads.minCoeff(), 0.0));
    if (!(slenderness > Slender)) return {};
    std::ostringstream text;
    text << ". It is " << std::fixed << std::setprecision(0) << slenderness
         << " times as long as it is thick: round-off in the matrix outweighs what resists its "
            "bending from about "
         << TooSlenderSolid << " on if it is made of solid elements, from about " << TooSlender
         << " on if of shells or beams. Are its units right? Otherwise take shells or beams, or "
            "shorter pieces, a part each, and weld these";
    return text.str();
}

}  // namespace simflex
