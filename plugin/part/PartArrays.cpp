#include "simflex/part/PartArrays.h"

#include <Eigen/Dense>
#include <cmath>

#include "simflex/part/ArrayFile.h"

namespace simflex {
namespace {

FileArray toArray(const std::string& name, const Eigen::MatrixXd& A) {
    return makeArray(name, A.rows(), A.cols(), {A.data(), A.data() + A.size()});
}

}  // namespace

void writePartArrays(const std::string& path, const ReducedBody& body) {
    body.validate();
    const Eigen::Index n = body.numModes, numInterfaces = Eigen::Index(body.interfaces.size());
    const Eigen::Map<const Eigen::Vector3d> center(body.centerOfMass.data());
    Eigen::Matrix3d inertia;
    const auto& I = body.inertia;  // xx yy zz xy xz yz
    inertia << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(6 + n, 6 + n),
                    M = Eigen::MatrixXd::Identity(6 + n, 6 + n);
    M.topLeftCorner<3, 3>() *= body.mass;
    M.block<3, 3>(3, 3) = inertia;
    Eigen::MatrixXd frequencies(n, 1);
    for (Eigen::Index k = 0; k < n; ++k) {
        K(6 + k, 6 + k) = body.omegaSquared[size_t(k)];
        frequencies(k, 0) = std::sqrt(body.omegaSquared[size_t(k)]) / (2 * M_PI);
    }
    Eigen::MatrixXd L = Eigen::MatrixXd::Zero(6 * numInterfaces, 6 + n),
                    positions(numInterfaces, 3);
    FileArray names;
    names.name = "interface_names";
    for (Eigen::Index k = 0; k < numInterfaces; ++k) {
        const ReducedBody::Interface& interface = body.interfaces[size_t(k)];
        const Eigen::Map<const Eigen::Vector3d> s(interface.position.data());
        L.block<6, 6>(6 * k, 0).setIdentity();
        L.block<3, 3>(6 * k, 3) << 0, s[2], -s[1], -s[2], 0, s[0], s[1], -s[0], 0;
        L.block(6 * k, 6, 3, n) = Eigen::Map<const Eigen::MatrixXd>(interface.Phi.data(), 3, n);
        L.block(6 * k + 3, 6, 3, n) = Eigen::Map<const Eigen::MatrixXd>(interface.Psi.data(), 3, n);
        positions.row(k) = (s + center).transpose();
        names.texts.push_back(interface.name);
    }
    const Eigen::Index numNodes = body.mesh.numNodes();
    Eigen::MatrixXd nodes(numNodes, 4);
    for (Eigen::Index k = 0; k < numNodes; ++k) {
        const auto s = body.mesh.position(int(k));
        nodes.row(k) << body.mesh.nodeNumbers[size_t(k)], s[0] + center[0], s[1] + center[1],
            s[2] + center[2];
    }
    std::vector<FileArray> arrays = {toArray("K", K),
                                     toArray("M", M),
                                     toArray("L", L),
                                     toArray("interface_positions", positions),
                                     toArray("mass", Eigen::MatrixXd::Constant(1, 1, body.mass)),
                                     toArray("center_of_mass", center.transpose()),
                                     toArray("inertia", inertia),
                                     toArray("frequencies", frequencies),
                                     toArray("nodes", nodes),
                                     makeArray("Phi", 3 * numNodes, n, body.Phi)};
    if (numInterfaces > 0) arrays.push_back(names);
    writeArrayFile(path, arrays);
}

}  // namespace simflex
