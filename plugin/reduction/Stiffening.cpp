#include "Stiffening.h"

#include <cmath>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "FixedInterfaces.h"
#include "Memory.h"
#include "StaticLoads.h"
#include "simflex/fe/calculix/GeometricStiffness.h"

namespace simflex {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

constexpr int TensorAxes[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};

std::vector<double> toVector(const MatrixXd& A) {
    return {A.data(), A.data() + A.size()};
}

/** Memory of a run of CalculiX 2.20 with SPOOLES, 1.4 times what was measured on boxes of 7000 to
52000 degrees of freedom: for an entry of the factor (by CHOLMOD's order) and of K, and for each
degree of freedom. **/
constexpr double BytesPerFactorEntry = 12, BytesPerStiffness = 40, BytesPerDof = 500;

}  // namespace

double predictCalculixMemory(double numFactorEntries, double numDofs, double numStiffnessEntries) {
    return BytesPerFactorEntry * numFactorEntries + BytesPerDof * numDofs +
           BytesPerStiffness * numStiffnessEntries;
}

int chooseNumProcesses(int wanted, double bytesPerRun, double available) {
    const int most = wanted > 0 ? wanted : int(std::max(1u, std::thread::hardware_concurrency()));
    const double fitting = std::floor(available / bytesPerRun);
    if (fitting >= 1) return fitting < most ? int(fitting) : most;
    std::ostringstream text;
    text << "geometric stiffness needs about " << formatMemory(bytesPerRun)
         << " of memory for a run of CalculiX, but there are " << formatMemory(available)
         << "; take a coarser mesh or a larger machine, or set the memory limit (--memory) if you "
            "know better";
    throw std::invalid_argument(text.str());
}

ReducedBody::Stiffening calcStiffening(const FeModel& model, const FeProducts& products,
                                       const RigidMotion& rigid, const InterfaceTies& ties,
                                       const ModeBasis& basis, const MeanAxisModes& modes,
                                       const ReductionOptions& options,
                                       const ProgressCallback& progress) {
    const double available =
        options.memoryLimit ? *options.memoryLimit : double(calcAvailableMemory());
    const int numProcesses = chooseNumProcesses(
        options.stiffening->numProcesses,
        predictCalculixMemory(double(basis.held->numFactorEntries()), double(model.K.size),
                              double(model.K.numEntries())),
        available);
    reportProgress(progress, "loads that stiffen", -1);
    const EquilibriumLoads loads = makeEquilibriumLoads(model, products, rigid, ties);
    Shapes tieForces = Shapes::Zero(model.K.size, loads.applied.cols());  // c, on tied nodes alone
    if (!ties.ties().empty()) {
        tieForces =
            products.K.multiply(solveEquilibrium(products, ties, basis, loads).u) - loads.applied;
        for (int node = 0; node < model.mesh.numNodes(); ++node)
            if (ties.rigidTieOf(node) < 0) tieForces.middleRows<3>(3 * node).setZero();
    }
    const Shapes total = loads.applied + tieForces;

    const Eigen::Index count = total.cols();
    std::vector<PrestressLoad> prestress;
    for (Eigen::Index c = 0; c < count; ++c) {
        const Eigen::VectorXd force = total.col(c);
        prestress.push_back({loads.names[size_t(c)], {force.data(), force.data() + force.size()}});
    }
    std::vector<MatrixXd> K{size_t(count)};
    PrestressOptions prestressOptions;
    prestressOptions.program = options.stiffening->program;
    prestressOptions.numProcesses = numProcesses;
    prestressOptions.progress = progress;
    calcGeometricStiffness(
        model, prestress, prestressOptions, [&](int load, const SymmetricMatrix& k) {
            K[size_t(load)] = modes.Phi.transpose() * FullRows(k).multiplyPerAxis(modes.Phi);
        });

    for (Eigen::Index c = 0; c < count; ++c) {
        MatrixXd& ofLoad = K[size_t(c)];
        for (size_t j = 0; j < ties.ties().size(); ++j) {
            const auto& tie = ties.ties()[j];
            if (tie.type == TieType::Distributing) continue;
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
