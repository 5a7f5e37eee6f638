#include "Stiffening.h"

#include "FixedInterfaces.h"
#include "StaticLoads.h"
#include "simflex/fe/elements/GeometricStiffness.h"

namespace simflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int TensorAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

std::vector<double> toVector(const MatrixXd& A) {
    return {A.data(), A.data() + A.size()};
}

/** Adds the forces by which a distributing interface puts unit forces and moments on its nodes, six
columns from `first` on. **/
void addSharedForces(const FeModel& model, const InterfaceTies::Tie& tie, const InterfaceTies& ties,
                     Eigen::Index first, Shapes& forces) {
    const MatrixXd mean = ties.calcMean(model.mesh, tie);
    for (size_t i = 0; i < tie.nodes.size(); ++i)
        forces.block<3, 6>(3 * tie.nodes[i], first) +=
            mean.middleCols<3>(3 * Eigen::Index(i)).transpose();
}

}  // namespace

ReducedBody::Stiffening calcStiffening(const FeModel& model, const FeProducts& products,
                                       const RigidMotion& rigid, const InterfaceTies& ties,
                                       const ModeBasis& basis, const MeanAxisModes& modes,
                                       const ProgressCallback& progress) {
    reportProgress(progress, "loads that stiffen", -1);
    const EquilibriumLoads loads = makeEquilibriumLoads(model, products, rigid, ties);
    const Shapes u = solveEquilibrium(products, ties, basis, loads).u;
    // Forces on the nodes of interfaces: c, and those that distributing ones share out.
    Shapes tieForces = products.K.multiply(u) - loads.applied;
    for (int node = 0; node < model.mesh.numNodes(); ++node)
        if (ties.rigidTieOf(node) < 0) tieForces.middleRows<3>(3 * node).setZero();
    for (size_t j = 0; j < ties.ties().size(); ++j)
        if (ties.ties()[j].type == TieType::Distributing)
            addSharedForces(model, ties.ties()[j], ties, 6 + 6 * Eigen::Index(j), tieForces);

    const Eigen::Index count = u.cols();
    const MatrixXd fields = u;  // column-major
    std::vector<MatrixXd> K{size_t(count)};
    calcGeometricStiffness(
        model, fields.data(), int(count), progress, [&](int load, const SymmetricMatrix& k) {
            K[size_t(load)] = modes.Phi.transpose() * FullRows(k).multiplyPerAxis(modes.Phi);
        });

    for (Eigen::Index c = 0; c < count; ++c) {
        MatrixXd& ofLoad = K[size_t(c)];
        for (size_t j = 0; j < ties.ties().size(); ++j) {
            const auto& tie = ties.ties()[j];
            Matrix3d S = Matrix3d::Zero();
            for (const int node : tie.nodes) {
                const Vector3d arm =
                    Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]) -
                    Eigen::Map<const Vector3d>(tie.master.data());
                const Vector3d force = tieForces.block<3, 1>(3 * node, c);
                S += 0.5 * (force * arm.transpose() + arm * force.transpose());
            }
            const MatrixXd Psi = modes.boundary.middleRows(6 * Eigen::Index(j) + 3, 3);
            ofLoad += Psi.transpose() * (S - S.trace() * Matrix3d::Identity()) * Psi;
        }
        ofLoad = 0.5 * (ofLoad + ofLoad.transpose()).eval();
    }

    ReducedBody::Stiffening stiffening;
    for (size_t c = 0; c < 6; ++c)
        stiffening.turning[c] = toVector(TensorAxes[c][0] == TensorAxes[c][1] ? K[c] : 0.5 * K[c]);
    stiffening.interfaces.resize(ties.ties().size());
    for (size_t k = 0; k < 6 * ties.ties().size(); ++k)
        stiffening.interfaces[k / 6][k % 6] = toVector(K[6 + k]);
    return stiffening;
}

}  // namespace simflex
