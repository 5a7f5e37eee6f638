#include "simflex/forces/ModalDamping.h"

#include <cmath>

#include "simflex/base/DenseAlgebra.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, Real ratio)
    : ModalDamping(subsystem, body, Vector(body.getNumModes(), ratio)) {}

ModalDamping::ModalDamping(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                           const Vector& ratios) {
    const ReducedBody& part = body.getPart();
    if (ratios.size() != part.numModes)
        throw std::invalid_argument("modal damping of '" + body.getName() +
                                    "': " + std::to_string(ratios.size()) + " ratios for " +
                                    std::to_string(part.numModes) + " modes");
    Array_<Real> coefficients;
    for (int i = 0; i < ratios.size(); ++i) {
        if (!(ratios[i] >= 0) || !std::isfinite(ratios[i]))
            throw std::invalid_argument("modal damping of '" + body.getName() +
                                        "': the ratio of mode " + std::to_string(i + 1) + " is " +
                                        std::to_string(ratios[i]) + "; it must be 0 or more");
        coefficients.push_back(2 * ratios[i] * std::sqrt(part.omegaSquared[i]));
    }
    subsystem.updGuts().addModalDamping(body.getIndex(), coefficients);
}

void ModalDamping::rayleigh(FlexibleBodySubsystem& subsystem, const FlexibleBody& body, Real alpha,
                            Real beta) {
    const std::string name = "modal damping of '" + body.getName() + "'";
    checkNotNegative(name, "alpha", alpha);
    checkNotNegative(name, "beta", beta);
    Array_<Real> coefficients;
    for (const double omegaSquared : body.getPart().omegaSquared)
        coefficients.push_back(alpha + beta * omegaSquared);
    subsystem.updGuts().addModalDamping(body.getIndex(), coefficients);
}

void ModalDamping::byFrequency(FlexibleBodySubsystem& subsystem, const FlexibleBody& body) {
    const std::vector<double>& omegaSquared = body.getPart().omegaSquared;
    Vector ratios(int(omegaSquared.size()));
    for (int i = 0; i < ratios.size(); ++i) {
        const Real frequency = std::sqrt(omegaSquared[size_t(i)]) / (2 * Pi);
        ratios[i] = frequency < 100 ? 0.01 : frequency < 1000 ? 0.1 : 1;
    }
    ModalDamping(subsystem, body, ratios);
}

void ModalDamping::matrix(FlexibleBodySubsystem& subsystem, const FlexibleBody& body,
                          const Matrix& D) {
    const std::string name = "modal damping of '" + body.getName() + "'";
    const int n = body.getNumModes();
    if (D.nrow() != n || D.ncol() != n)
        throw std::invalid_argument(name + ": the matrix is " + std::to_string(D.nrow()) + "x" +
                                    std::to_string(D.ncol()) + "; it must be " + std::to_string(n) +
                                    "x" + std::to_string(n));
    ::Eigen::MatrixXd matrix(n, n);
    for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
            checkFinite(name, "an entry of the matrix", D(i, j));
            matrix(i, j) = D(i, j);
        }
    const double roundOff = 1e-12 * matrix.cwiseAbs().maxCoeff();
    if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > roundOff)
        throw std::invalid_argument(name + ": the matrix is not symmetric");
    const double lowest = n ? calcSymmetricEigen(matrix).values[0] : 0;
    if (lowest < -n * roundOff)
        throw std::invalid_argument(name + ": the matrix has the eigenvalue " +
                                    std::to_string(lowest) + " 1/s; none may be negative");
    subsystem.updGuts().addDampingMatrix(body.getIndex(), matrix);
}

}  // namespace simflex
