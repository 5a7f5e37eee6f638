#include "RigidMotion.h"

namespace simflex {

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

}  // namespace simflex
