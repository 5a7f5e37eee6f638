#include "validation/RotatingCantilever.h"

#include <Eigen/Dense>
#include <cmath>

#include "simflex/body/Joint.h"
#include "simflex/solver/StaticEquilibrium.h"

namespace simflex::test {

using namespace SimTK;

BeamOptions getRotatingCantileverOptions() {
    BeamOptions options;
    options.height = 0.01;
    options.width = 0.0105;
    return options;
}

const std::shared_ptr<const ReducedBody>& getRotatingCantileverPart() {
    static const auto part = makeBeam(getRotatingCantileverOptions());
    return part;
}

double calcFrequencyUnit(double depth) {
    const BeamOptions o = getRotatingCantileverOptions();
    return std::sqrt(o.E * depth * depth / (12 * o.density)) / (o.length * o.length);
}

std::vector<double> calcFlapFrequencies(double eta, double radius, int count) {
    using ::Eigen::MatrixXd;
    using ::Eigen::VectorXd;
    constexpr int NumPoints = 80, NumShapes = 16;
    // Gauss points are the eigenvalues of the Jacobi matrix.
    MatrixXd jacobi = MatrixXd::Zero(NumPoints, NumPoints);
    for (int i = 1; i < NumPoints; ++i)
        jacobi(i, i - 1) = jacobi(i - 1, i) = i / std::sqrt(4.0 * i * i - 1);
    const ::Eigen::SelfAdjointEigenSolver<MatrixXd> gauss(jacobi);
    MatrixXd K = MatrixXd::Zero(NumShapes, NumShapes), M = K;
    for (int i = 0; i < NumPoints; ++i) {
        const double t = gauss.eigenvalues()[i], x = (t + 1) / 2,
                     weight = square(gauss.eigenvectors()(0, i));
        VectorXd p(NumShapes), d(NumShapes), dd(NumShapes);  // functions of t
        for (int k = 0; k < NumShapes; ++k) {
            p[k] = k == 0 ? 1 : k == 1 ? t : ((2 * k - 1) * t * p[k - 1] - (k - 1) * p[k - 2]) / k;
            d[k] = k == 0 ? 0 : k == 1 ? 1 : d[k - 2] + (2 * k - 1) * p[k - 1];
            dd[k] = k < 2 ? 0 : dd[k - 2] + (2 * k - 1) * d[k - 1];
        }
        const VectorXd w = x * x * p, slope = 2 * x * p + 2 * x * x * d,
                       bend = 2 * p + 8 * x * d + 4 * x * x * dd;
        const double tension = eta * eta * (radius * (1 - x) + (1 - x * x) / 2);
        K += weight * (bend * bend.transpose() + tension * slope * slope.transpose());
        M += weight * w * w.transpose();
    }
    const VectorXd squares =
        ::Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>(K, M).eigenvalues();
    std::vector<double> lambda;
    for (int k = 0; k < count; ++k) lambda.push_back(std::sqrt(squares[k]));
    return lambda;
}

RotatingModes calcRotatingModes(const std::shared_ptr<const ReducedBody>& part, double speed,
                                double hubRadius) {
    MultibodySystem system;
    SimbodyMatterSubsystem matter(system);
    FlexibleBodySubsystem flexible(system, matter);
    const FlexibleBody beam(flexible, part);
    const Attachment root = beam.interface("root", Transform(Vec3(-hubRadius, 0, 0))),
                     tip = beam.interface("tip");
    Joint::Pin bearing(flexible, matter.Ground(), root, "bearing");
    Joint::PrescribedRotation drive(
        flexible, matter.Ground(), root, [speed](Real t) { return Vec3(speed * t, speed, 0); },
        "drive");
    State state = system.realizeTopology();
    beam.setPoseByInterface(state, "root", Transform(Vec3(hubRadius, 0, 0)));
    StaticEquilibrium equilibrium(system);
    equilibrium.solveSteadyMotion(state);
    if (!equilibrium.getFreeMotions().empty())
        throw std::runtime_error("of the driven beam " + equilibrium.getFreeMotions()[0]);
    const Linearization linear = calcLinearization(system, equilibrium.getState());
    RotatingModes modes;
    modes.all = calcEigenmodes(linear);
    const Vec3 steady = tip.calcMotion(equilibrium.getState()).X.p();
    for (const Eigenmode& mode : modes.all) {
        const State moved = calcModeStates(system, linear, mode, 1e-4, 1)[0];
        system.realize(moved, Stage::Velocity);
        const Vec3 shift = tip.calcMotion(moved).X.p() - steady;
        (std::abs(shift[2]) > std::abs(shift[1]) ? modes.flap : modes.lag)
            .push_back(mode.eigenvalue.imag());
    }
    return modes;
}

}  // namespace simflex::test
