#include "validation/SteadyRotation.h"

#include <algorithm>

#include "simflex/body/Joint.h"

namespace simflex::test {

using namespace SimTK;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct SteadyRotation::Model {
    MultibodySystem system;
    SimbodyMatterSubsystem matter{system};
    FlexibleBodySubsystem flexible{system, matter};
    std::unique_ptr<FlexibleBody> beam;
    std::unique_ptr<Evaluation> equations;
    State state;
};

SteadyRotation::SteadyRotation(const std::shared_ptr<const ReducedBody>& beam, double speed,
                               Stiffening stiffening)
    : m_model(std::make_unique<Model>()), m_speed(speed) {
    Model& model = *m_model;
    model.beam = std::make_unique<FlexibleBody>(model.flexible, beam);
    const Attachment root = model.beam->interface("root");
    Joint::Pin(model.flexible, model.matter.Ground(), root);
    Joint::PrescribedRotation(model.flexible, model.matter.Ground(), root,
                              [speed](Real t) { return Vec3(speed * t, speed, 0); });
    model.state = model.system.realizeTopology();
    model.beam->setPoseByInterface(model.state, "root", Transform());
    if (stiffening == Stiffening::Off) model.beam->disableStiffening(model.state);
    model.system.realize(model.state, Stage::Velocity);
    model.equations = std::make_unique<Evaluation>(model.system, model.state);

    m_size = 6 + beam->numModes;
    m_q.setZero(m_size + 1);
    m_u.setZero(m_size);
    m_uDot.setZero(m_size);
    m_p = model.beam->getFramePose(model.state).p();
    m_xi.setZero(beam->numModes);
    m_lambda.setZero(model.equations->getTopology().numMultipliers);
    m_length = beam->getInterface("tip").position[0] - beam->getInterface("root").position[0];
    findEquilibrium();
}

SteadyRotation::~SteadyRotation() = default;

void SteadyRotation::realize(const VectorXd& d, const VectorXd& dDot,
                             const VectorXd& dDotDot) const {
    const auto vec3 = [](const VectorXd& v, int first) {
        return Vec3(v[first], v[first + 1], v[first + 2]);
    };
    const Vec3 omega(0, 0, m_speed), turn = vec3(d, 0), p = m_p + vec3(d, 3);
    const Rotation R = m_R * calcExponential(turn);
    const Vec3 omega_B = ~R * omega;
    const Quaternion quaternion = R.convertRotationToQuaternion();
    for (int a = 0; a < 4; ++a) m_q[a] = quaternion[a];
    // ω_B = exp(−δθ)ω₀ + δθ̇, to first order.
    const Vec3 spin = omega_B + vec3(dDot, 0), v = omega % p + vec3(dDot, 3);
    const Vec3 spinDot = omega_B % vec3(dDot, 0) + vec3(dDotDot, 0);
    const Vec3 a = omega % (omega % p) + 2 * (omega % vec3(dDot, 3)) + vec3(dDotDot, 3);
    for (int k = 0; k < 3; ++k) {
        m_q[4 + k] = p[k];
        m_u[k] = spin[k];
        m_u[3 + k] = v[k];
        m_uDot[k] = spinDot[k];
        m_uDot[3 + k] = a[k];
    }
    const int n = m_size - 6;
    m_q.tail(n) = m_xi + d.tail(n);
    m_u.tail(n) = dDot.tail(n);
    m_uDot.tail(n) = dDotDot.tail(n);
    m_model->equations->realize(0, m_q.data(), m_u.data());
}

VectorXd SteadyRotation::calcResidual(const VectorXd& d, const VectorXd& dDot,
                                      const VectorXd& dDotDot) const {
    realize(d, dDot, dDotDot);
    VectorXd r(m_size);
    m_model->equations->calcResidual(m_q.data(), m_u.data(), m_uDot.data(), m_lambda.data(),
                                     r.data());
    return r;
}

VectorXd SteadyRotation::calcErrors(const VectorXd& d) const {
    const VectorXd zero = VectorXd::Zero(m_size);
    realize(d, zero, zero);
    VectorXd errors(m_lambda.size());
    m_model->equations->calcPositionErrors(errors.data());
    return errors;
}

Vec3 SteadyRotation::calcTip(const VectorXd& d) const {
    const VectorXd zero = VectorXd::Zero(m_size);
    realize(d, zero, zero);
    State& state = m_model->state;
    m_model->equations->getBlocks().putIntoState(0, m_q.data(), m_u.data(), state);
    m_model->system.realize(state, Stage::Velocity);
    return m_model->beam->interface("tip").calcMotion(state).X.p();
}

template <class Function>
MatrixXd SteadyRotation::differentiate(const Function& function) const {
    // Rotations and displacements relative to the size: half a millionth of the beam.
    const double h = 1e-6;
    MatrixXd derivative;
    for (int j = 0; j < m_size; ++j) {
        const auto& displacement = m_model->beam->getPart().calcLargestModeDisplacements();
        const double step = j < 3   ? h
                            : j < 6 ? h * m_length
                                    : h * m_length / displacement[size_t(j - 6)];
        const VectorXd d = step * VectorXd::Unit(m_size, j);
        const VectorXd column = (function(d) - function(-d)) / (2 * step);
        derivative.conservativeResize(column.size(), m_size);
        derivative.col(j) = column;
    }
    return derivative;
}

void SteadyRotation::findEquilibrium() {
    const VectorXd zero = VectorXd::Zero(m_size);
    const Eigen::Index m = m_lambda.size();
    double correction = 1;
    for (int iteration = 0; correction > 1e-12; ++iteration) {
        if (iteration == 20) throw std::runtime_error("no steady state was found");
        MatrixXd A = MatrixXd::Zero(m_size + m, m_size + m);
        A.topLeftCorner(m_size, m_size) =
            differentiate([&](const VectorXd& d) { return calcResidual(d, zero, zero); });
        A.bottomLeftCorner(m, m_size) =
            differentiate([&](const VectorXd& d) { return calcErrors(d); });
        A.topRightCorner(m_size, m) = A.bottomLeftCorner(m, m_size).transpose();
        VectorXd b(m_size + m);
        b << -calcResidual(zero, zero, zero), -calcErrors(zero);
        const VectorXd x = A.partialPivLu().solve(b);
        m_R = m_R * calcExponential(Vec3(x[0], x[1], x[2]));
        m_p += Vec3(x[3], x[4], x[5]);
        m_xi += x.segment(6, m_size - 6);
        m_lambda += x.tail(m);
        correction = x.head(m_size).norm() / (1e-3 + m_xi.norm());
    }
}

Vec3 SteadyRotation::calcTipDisplacement() const {
    return calcTip(VectorXd::Zero(m_size)) - Vec3(m_length, 0, 0);
}

std::vector<SteadyRotation::Mode> SteadyRotation::calcModes(int count) const {
    const VectorXd zero = VectorXd::Zero(m_size);
    const MatrixXd K =
        differentiate([&](const VectorXd& d) { return calcResidual(d, zero, zero); });
    const MatrixXd C =
        differentiate([&](const VectorXd& d) { return calcResidual(zero, d, zero); });
    const MatrixXd M =
        differentiate([&](const VectorXd& d) { return calcResidual(zero, zero, d); });
    const MatrixXd G = differentiate([&](const VectorXd& d) { return calcErrors(d); });
    const MatrixXd tip = differentiate([&](const VectorXd& d) {
        const Vec3 p = calcTip(d);
        return VectorXd(Eigen::Vector3d(p[0], p[1], p[2]));
    });
    const MatrixXd Z = G.fullPivLu().kernel().householderQr().householderQ() *
                       MatrixXd::Identity(m_size, m_size - G.rows());
    const Eigen::Index n = Z.cols();
    const MatrixXd mass = Z.transpose() * M * Z;
    MatrixXd A = MatrixXd::Zero(2 * n, 2 * n);
    A.topRightCorner(n, n).setIdentity();
    A.bottomLeftCorner(n, n) = -mass.ldlt().solve(Z.transpose() * K * Z);
    A.bottomRightCorner(n, n) = -mass.ldlt().solve(Z.transpose() * C * Z);
    const Eigen::EigenSolver<MatrixXd> solver(A);

    std::vector<Mode> modes;
    for (Eigen::Index k = 0; k < 2 * n; ++k) {
        const std::complex<double> value = solver.eigenvalues()[k];
        if (value.imag() <= 0) continue;
        const Eigen::Vector3cd motion = tip * Z * solver.eigenvectors().col(k).head(n);
        modes.push_back({value.imag(), std::abs(motion[2]) > std::abs(motion[1])});
    }
    std::sort(modes.begin(), modes.end(),
              [](const Mode& a, const Mode& b) { return a.frequency < b.frequency; });
    modes.resize(std::min(modes.size(), size_t(count)));
    return modes;
}

}  // namespace simflex::test
