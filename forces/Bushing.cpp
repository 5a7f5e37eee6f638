#include "simflex/forces/Bushing.h"

#include <Eigen/Dense>

#include "simflex/base/NumberText.h"
#include "simflex/forces/ElementParameters.h"

namespace simflex {

using namespace SimTK;

namespace {

namespace Eigen = ::Eigen;

/** Inverse of the left Jacobian of the rotation vector θ: θ̇ = J_l⁻¹(θ) ω, both in the base frame.
 **/
Mat33 calcInverseLeftJacobian(const Vec3& theta) {
    const Real squared = theta.normSqr();
    // 1/t² − (1 + cos t)/(2t sin t) by series near zero.
    Real factor = 1. / 12 + squared / 720 + squared * squared / 30240;
    if (squared > 1e-3) {
        const Real t = std::sqrt(squared);
        factor = (1 - 0.5 * t * std::cos(0.5 * t) / std::sin(0.5 * t)) / squared;
    }
    const Mat33 skew = crossMat(theta);
    return Mat33(1) - 0.5 * skew + factor * skew * skew;
}

/** Relative pose e = (θ, p) of M in F, and its rate as a linear map of the twists. **/
struct RelativePose {
    explicit RelativePose(const Array_<FrameMotion>& frames) : R_GF(frames[0].X.R()) {
        const Transform X_FM = ~frames[0].X * frames[1].X;
        const Vec4 angleAxis = X_FM.R().convertRotationToAngleAxis();
        theta = angleAxis[0] * angleAxis.getSubVec<3>(1);
        p = X_FM.p();
        inverseJacobian = calcInverseLeftJacobian(theta);
        const Vec3 omega = ~R_GF * (frames[1].V[0] - frames[0].V[0]);
        const Vec3 apart = frames[1].X.p() - frames[0].X.p();
        thetaDot = inverseJacobian * omega;
        pDot = ~R_GF * (frames[1].V[1] - frames[0].V[1] - frames[0].V[0] % apart);
    }

    /** Twists (on F, on M) of the generalized force (a, b): the transpose of the rate's map. **/
    void spread(const Vec3& a, const Vec3& b, SpatialVec& onF, SpatialVec& onM) const {
        const Vec3 torque = R_GF * (~inverseJacobian * a), force = R_GF * b;
        onM = SpatialVec(torque, force);
        onF = SpatialVec(-torque - (R_GF * p) % force, -force);
    }

    Rotation R_GF;
    Vec3 theta, p, thetaDot, pDot;
    Mat33 inverseJacobian;
};

Vec6 join(const Vec3& a, const Vec3& b) {
    return Vec6(a[0], a[1], a[2], b[0], b[1], b[2]);
}

class BushingElement : public ForceElement {
public:
    BushingElement(const Attachment& F, const Attachment& M, const Mat66& stiffness,
                   const Mat66& damping)
        : m_stiffness(stiffness), m_damping(damping) {
        m_attachments.push_back(F);
        m_attachments.push_back(M);
    }

    void addInForces(const ElementInputs&, const Array_<FrameMotion>& frames,
                     Array_<SpatialVec>& forces_G) const override {
        const RelativePose pose(frames);
        const Vec6 force =
            -(m_stiffness * join(pose.theta, pose.p) + m_damping * join(pose.thetaDot, pose.pDot));
        SpatialVec onF, onM;
        pose.spread(force.getSubVec<3>(0), force.getSubVec<3>(3), onF, onM);
        forces_G[0] += onF;
        forces_G[1] += onM;
    }

    Real calcPotentialEnergy(const ElementInputs&,
                             const Array_<FrameMotion>& frames) const override {
        const RelativePose pose(frames);
        const Vec6 e = join(pose.theta, pose.p);
        return 0.5 * (~e * (m_stiffness * e));
    }

    Real calcPower(const ElementInputs&, const Array_<FrameMotion>& frames,
                   const Array_<SpatialVec>&) const override {
        const RelativePose pose(frames);
        const Vec6 rate = join(pose.thetaDot, pose.pDot);
        return -(~rate * (m_damping * rate));
    }

    /** A bushing that does not resist rotation is valid at any angle. **/
    bool hasRange() const override {
        for (int i = 0; i < 3; ++i)
            if (m_stiffness.row(i).normSqr() > 0 || m_damping.row(i).normSqr() > 0) return true;
        return false;
    }
    std::string describeOutOfRange(const Array_<FrameMotion>& frames, Real elapsed) const override {
        const RelativePose pose(frames);
        const Vec3 omega = ~pose.R_GF * (frames[1].V[0] - frames[0].V[0]);
        const Real turn = pose.theta.norm(), turned = omega.norm() * elapsed;
        if (!(std::max(turn, turned) > Bushing::LargestTurn) || !isTorqueWrong(pose, omega))
            return {};
        return (turn > Bushing::LargestTurn
                    ? "is turned by " + writeGeneral(turn, 3) + " rad"
                    : "turns by " + writeGeneral(turned, 3) + " rad within " +
                          writeGeneral(elapsed, 3) + " s, the length of a step") +
               "; a bushing's torque is right up to " + writeGeneral(Bushing::LargestTurn, 3) +
               " rad and changes its sign at half a turn: let a joint or a torsion spring take the "
               "turning";
    }

    int getNumJacobianTerms() const override { return 6; }

    void calcJacobian(const ElementInputs&, const Array_<FrameMotion>& frames, Real gamma,
                      Array_<Real>&, Array_<SpatialVec>& directions) const override {
        // γK + C = Σ vᵢ √λᵢ (…)ᵀ
        const RelativePose pose(frames);
        Eigen::Matrix<double, 6, 6> sum;
        for (int i = 0; i < 6; ++i)
            for (int j = 0; j < 6; ++j) sum(i, j) = gamma * m_stiffness(i, j) + m_damping(i, j);
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(sum);
        for (int i = 0; i < 6; ++i) {
            const Eigen::Matrix<double, 6, 1> d =
                std::sqrt(std::max(0.0, eigen.eigenvalues()[i])) * eigen.eigenvectors().col(i);
            pose.spread(Vec3(d[0], d[1], d[2]), Vec3(d[3], d[4], d[5]), directions[unsigned(2 * i)],
                        directions[unsigned(2 * i + 1)]);
        }
    }

private:
    /** Pure damping gives the right torque as long as the rotation is about one axis. **/
    bool isTorqueWrong(const RelativePose& pose, const Vec3& omega) const {
        constexpr Real Negligible = 0.1;  // of the torque
        for (int i = 0; i < 3; ++i)
            if (m_stiffness.row(i).normSqr() > 0) return true;
        const Mat33 damping = m_damping.getSubMat<3, 3>(0, 0);
        const Vec3 damper = damping * omega,
                   torque = ~pose.inverseJacobian * (damping * pose.thetaDot);
        return (torque - damper).norm() > Negligible * damper.norm();
    }

    Mat66 m_stiffness, m_damping;
};

void check(const std::string& element, const char* name, const Mat66& matrix) {
    Eigen::Matrix<double, 6, 6> A;
    for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) {
            checkFinite(element, name, matrix(i, j));
            A(i, j) = matrix(i, j);
        }
    const double scale = A.cwiseAbs().maxCoeff(), roundOff = 1e-12 * scale;
    if ((A - A.transpose()).cwiseAbs().maxCoeff() > roundOff)
        throw std::invalid_argument(element + ": the " + name + " matrix is not symmetric");
    const double lowest =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(A).eigenvalues()[0];
    if (lowest < -roundOff)
        throw std::invalid_argument(element + ": the " + name + " matrix has the eigenvalue " +
                                    std::to_string(lowest) + "; none may be negative");
}

}  // namespace

Bushing::Bushing(FlexibleBodySubsystem& subsystem, const Attachment& F, const Attachment& M,
                 const Mat66& stiffness, const Mat66& damping, const std::string& name) {
    const std::string who = nameElement("Bushing", F, M, name);
    check(who, "stiffness", stiffness);
    check(who, "damping", damping);
    adoptNamed(subsystem, std::make_unique<BushingElement>(F, M, stiffness, damping), name);
}

Mat66 Bushing::diagonal(const Vec6& values) {
    Mat66 matrix(0);
    for (int i = 0; i < 6; ++i) matrix(i, i) = values[i];
    return matrix;
}

}  // namespace simflex
