#include "simflex/solver/equilibrium/ModeReport.h"

#include <sstream>

namespace simflex {

using SimTK::Complex;

Eigenmode makeEigenmode(Complex lambda, const Eigen::VectorXcd& x, const Eigen::VectorXcd& momentum,
                        const SimTK::Vector& metres) {
    Eigenmode mode;
    mode.eigenvalue = lambda;
    const double size = std::abs(lambda);
    mode.frequency = size / (2 * SimTK::Pi);
    mode.dampingRatio = size > 0 ? 0 - lambda.real() / size : 0;  // not −0
    if (lambda.imag() == 0 && size > 0) mode.dampingRatio = lambda.real() < 0 ? 1 : -1;
    double largest = 0;
    Complex phase = 1;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
        // The margin keeps equal displacements from swapping by round-off.
        const double displacement = std::abs(x[i]) * metres[int(i)];
        if (displacement <= 1.0001 * largest) continue;
        largest = displacement;
        phase = std::conj(x[i]) / std::abs(x[i]);
    }
    const double modalMass = x.dot(momentum).real();
    phase /= modalMass > 0 ? std::sqrt(modalMass) : 1.0;
    mode.shape.resize(int(x.size()));
    mode.momentum.resize(int(x.size()));
    for (int i = 0; i < mode.shape.size(); ++i) {
        mode.shape[i] = phase * x[i];
        mode.momentum[i] = phase * momentum[i];
    }
    return mode;
}

bool isTurned(const Eigen::VectorXcd& x, const Eigen::VectorXcd& later,
              const SimTK::Vector& metres) {
    constexpr double Turned = 0.1;
    double change = 0, all = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
        change += std::norm(metres[int(i)] * (later[i] - x[i]));
        all += std::norm(metres[int(i)] * x[i]);
    }
    return change > SimTK::square(Turned) * all;
}

void refuseImbalance(const std::string& imbalance) {
    throw NoEquilibrium("there are no natural modes about this State, which is no equilibrium: " +
                        imbalance + "; find a static equilibrium first");
}

void refuseUnsteadiness(const std::string& unsteady) {
    throw std::invalid_argument("there are no natural modes about this motion: " + unsteady);
}

std::string describeChange(double frequency, double later) {
    std::ostringstream text;
    text << "the equations of small motions change as the motion goes on: a natural frequency of "
         << frequency << " Hz is " << later
         << " Hz with the mean of their coefficients over a radian";
    return text.str();
}

}  // namespace simflex
