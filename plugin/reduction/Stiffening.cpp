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

/** Adds the nodal forces by which a distributing interface applies unit forces and moments, in six
columns from `first` on. **/
void addSharedForces(const FeModel& model, const InterfaceTies::Tie& tie, const InterfaceTies& ties,
                     Eigen::Index first, Shapes& forces) {
    const MatrixXd mean = ties.calcMean(model.mesh, tie);
    for (size_t i = 0; i < tie.nodes.size(); ++i)
        forces.block<3, 6>(3 * tie.nodes[i], first) +=
            mean.middleCols<3>(3 * Eigen::Index(i)).transpose();
}

/** Nodes that turn by θ about a point move by ½ θ×(θ×r) to second order: the work of forces on them
is ½ θᵀ(S − tr S) θ, S = Σ sym(f rᵀ). **/
class TurningForces {
public:
    void add(const Vector3d& force, const Vector3d& arm) {
        m_S += 0.5 * (force * arm.transpose() + arm * force.transpose());
    }
    /** @param Psi  θ of each mode **/
    MatrixXd calcStiffness(const MatrixXd& Psi) const {
        return Psi.transpose() * (m_S - m_S.trace() * Matrix3d::Identity()) * Psi;
    }

private:
    Matrix3d m_S = Matrix3d::Zero();
};

/** Rigid bodies of the deck between the nodes of elements: what they do to each other. **/
struct DeckBody {
    const std::vector<int>* nodes;
    Vector3d point;  ///< the interface that it belongs to, if any
    MatrixXd Psi;    ///< its turn in each mode
};

std::vector<DeckBody> listBodies(const FeModel& model, const InterfaceTies& ties,
                                 const MeanAxisModes& modes) {
    std::vector<DeckBody> bodies;
    for (const auto& nodes : model.elements->beside.rigidBodies) {
        const auto placeOf = [&](int node) {
            return Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]);
        };
        DeckBody body{&nodes, placeOf(nodes[0]), {}};
        for (const int node : nodes) {
            const int tie = ties.tieOf()[size_t(node)];
            if (tie == -1) continue;
            const auto& master = ties.ties()[size_t(tie >= 0 ? tie : -2 - tie)].master;
            body.point = Eigen::Map<const Vector3d>(master.data());
        }
        // u = t + θ×r; no turn about a line on which all nodes lie.
        Vector3d middle = Vector3d::Zero();
        for (const int node : nodes) middle += placeOf(node) / double(nodes.size());
        Matrix3d moments = Matrix3d::Zero();
        MatrixXd sum = MatrixXd::Zero(3, modes.Phi.cols());
        for (const int node : nodes) {
            const Vector3d r = placeOf(node) - middle;
            moments += r.squaredNorm() * Matrix3d::Identity() - r * r.transpose();
            const MatrixXd u = modes.Phi.middleRows(3 * node, 3);
            for (Eigen::Index k = 0; k < u.cols(); ++k) sum.col(k) += r.cross(Vector3d(u.col(k)));
        }
        constexpr double OnALine = 1e-10;
        const Eigen::SelfAdjointEigenSolver<Matrix3d> principal(moments);
        body.Psi.setZero(3, modes.Phi.cols());
        for (int k = 0; k < 3; ++k) {
            const double moment = principal.eigenvalues()[k];
            if (!(moment > OnALine * principal.eigenvalues()[2])) continue;
            const Vector3d axis = principal.eigenvectors().col(k);
            body.Psi += axis * (axis.transpose() * sum) / moment;
        }
        bodies.push_back(std::move(body));
    }
    return bodies;
}

}  // namespace

ReducedBody::Stiffening calcStiffening(const FeModel& model, const FeProducts& products,
                                       const RigidMotion& rigid, const InterfaceTies& ties,
                                       const ModeBasis& basis, const MeanAxisModes& modes,
                                       const ProgressCallback& progress) {
    reportProgress(progress, "loads that stiffen", -1);
    const EquilibriumLoads loads = makeEquilibriumLoads(model, products, rigid, ties);
    const Shapes u = solveEquilibrium(products, ties, basis, loads).u;
    // Forces on the nodes of interfaces: c, and those distributed by distributing ties.
    Shapes tieForces = products.K.multiply(u) - loads.applied;
    for (int node = 0; node < model.mesh.numNodes(); ++node)
        if (ties.rigidTieOf(node) < 0) tieForces.middleRows<3>(3 * node).setZero();
    const std::vector<DeckBody> bodies = listBodies(model, ties, modes);
    Shapes bodyForces;  // of rigid bodies in the deck, on nodes that no rigid interface holds
    if (!bodies.empty()) bodyForces = products.K.multiply(u) - loads.applied - tieForces;
    for (size_t j = 0; j < ties.ties().size(); ++j)
        if (ties.ties()[j].type == TieType::Distributing)
            addSharedForces(model, ties.ties()[j], ties, 6 + 6 * Eigen::Index(j), tieForces);

    const auto placeOf = [&](int node) {
        return Eigen::Map<const Vector3d>(&model.mesh.positions[3 * size_t(node)]);
    };
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
            TurningForces forces;
            for (const int node : tie.nodes)
                forces.add(tieForces.block<3, 1>(3 * node, c),
                           placeOf(node) - Eigen::Map<const Vector3d>(tie.master.data()));
            ofLoad += forces.calcStiffness(modes.boundary.middleRows(6 * Eigen::Index(j) + 3, 3));
        }
        for (const DeckBody& body : bodies) {
            TurningForces forces;
            for (const int node : *body.nodes)
                forces.add(bodyForces.block<3, 1>(3 * node, c), placeOf(node) - body.point);
            ofLoad += forces.calcStiffness(body.Psi);
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
