#include "ModalInvariants.h"

#include <sstream>
#include <stdexcept>

namespace simflex {
namespace {

/** Largest ∑m φ relative to √m and ∑m s×φ relative to √I for a mode of unit modal mass. **/
constexpr double ZeroPart = 1e-9;

/** Returns the rows 3·node + axis of shapes. **/
auto axisRows(const Shapes& X, int axis) {
    using Stride = Eigen::OuterStride<>;
    return Eigen::Map<const Shapes, 0, Stride>(X.data() + axis * X.cols(), X.rows() / 3, X.cols(),
                                               Stride(3 * X.cols()));
}

void checkZero(const std::string& part, const char* quantity, int mode, double found,
               double scale) {
    if (std::abs(found) <= ZeroPart * scale) return;
    std::ostringstream text;
    text << "part '" << part << "': " << quantity << " of mode " << mode + 1 << " is " << found
         << ", must vanish to " << ZeroPart * scale << " in the mean-axis frame";
    throw std::invalid_argument(text.str());
}

/** Returns the entries column by column. **/
template <class Matrix>
std::vector<double> listEntries(const Eigen::MatrixBase<Matrix>& A) {
    std::vector<double> entries(size_t(A.size()));
    Eigen::Map<Eigen::MatrixXd>(entries.data(), A.rows(), A.cols()) = A;
    return entries;
}

}  // namespace

void setModalInvariants(const FeModel& model, const FeProducts& products, const RigidMotion& rigid,
                        const MeanAxisModes& modes, const InterfaceTies& ties, ReducedBody& body) {
    const int n = int(modes.Phi.cols()), numNodes = model.mesh.numNodes();
    body.mass = rigid.mass;
    body.centerOfMass = {rigid.center.x(), rigid.center.y(), rigid.center.z()};
    const Eigen::Matrix3d& I0 = rigid.inertia;
    body.inertia = {I0(0, 0), I0(1, 1), I0(2, 2), I0(0, 1), I0(0, 2), I0(1, 2)};
    body.numModes = n;
    body.omegaSquared = listEntries(modes.omegaSquared);
    body.mesh = model.mesh;
    for (int row = 0; row < 3 * numNodes; ++row) body.mesh.positions[row] -= rigid.center[row % 3];
    body.Phi = listEntries(modes.Phi);

    const Shapes MPhi = products.m.multiplyPerAxis(modes.Phi);
    const Eigen::Map<const Shapes> s(body.mesh.positions.data(), 3 * numNodes, 1);

    // ∑m s, ∑m φ and ∑m s×φ vanish in the mean-axis frame.
    const double length = std::sqrt(I0.trace() / rigid.mass);
    const Eigen::MatrixXd RMPhi = rigid.R.transpose() * MPhi;
    const Eigen::VectorXd firstMoment =
        rigid.R.leftCols<3>().transpose() * products.m.multiplyPerAxis(s);
    for (int a = 0; a < 3; ++a)
        if (std::abs(firstMoment[a]) > ZeroPart * rigid.mass * length)
            throw std::invalid_argument("part '" + body.name +
                                        "': the origin is not the centre of mass");
    for (int i = 0; i < n; ++i)
        for (int a = 0; a < 3; ++a) {
            checkZero(body.name, "∑m φ", i, RMPhi(a, i), std::sqrt(rigid.mass));
            checkZero(body.name, "∑m s×φ", i, RMPhi(3 + a, i), std::sqrt(I0.trace()));
        }

    // P(a,b) = s_aᵀ m φ_b per mode, G[a][b] = Φ_aᵀ m Φ_b.
    std::array<std::array<Eigen::VectorXd, 3>, 3> P;
    std::array<std::array<Eigen::MatrixXd, 3>, 3> G;
    for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b) {
            P[a][b] = axisRows(MPhi, b).transpose() * axisRows(s, a).col(0);
            if (a <= b) G[a][b] = axisRows(modes.Phi, a).transpose() * axisRows(MPhi, b);
        }
    constexpr int TensorAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    body.I1.resize(6 * size_t(n));
    Eigen::Map<Eigen::MatrixXd> I1(body.I1.data(), 6, n);
    for (int c = 0; c < 6; ++c) {
        const int a = TensorAxes[c][0], b = TensorAxes[c][1];
        Eigen::MatrixXd I2;
        if (a == b) {
            const int p = (a + 1) % 3, q = (a + 2) % 3;
            I1.row(c) = 2 * (P[p][p] + P[q][q]).transpose();
            I2 = G[p][p] + G[q][q];
            I2 = 0.5 * (I2 + I2.transpose()).eval();
        } else {
            I1.row(c) = -(P[a][b] + P[b][a]).transpose();
            I2 = -0.5 * (G[a][b] + G[a][b].transpose());
        }
        body.I2[c] = listEntries(I2);
    }
    body.N[0] = listEntries(G[1][2] - G[1][2].transpose());
    body.N[1] = listEntries(G[0][2].transpose() - G[0][2]);
    body.N[2] = listEntries(G[0][1] - G[0][1].transpose());

    body.interfaces.clear();
    for (size_t k = 0; k < ties.ties().size(); ++k) {
        const auto& tie = ties.ties()[k];
        ReducedBody::Interface interface;
        interface.name = tie.name;
        interface.nodes = tie.nodes;
        interface.tie = tie.type;
        if (tie.type == TieType::Distributing)
            interface.weights.assign(tie.nodes.size(), 1 / double(tie.nodes.size()));
        for (int a = 0; a < 3; ++a) interface.position[a] = tie.master[a] - rigid.center[a];
        interface.Phi = listEntries(modes.boundary.middleRows(6 * k, 3));
        interface.Psi = listEntries(modes.boundary.middleRows(6 * k + 3, 3));
        body.interfaces.push_back(std::move(interface));
    }
}

}  // namespace simflex
