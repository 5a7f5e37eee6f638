#pragma once
/** @file
A beam turned steadily about z by its root, and small motions about that: equilibrium and
linearisation by central differences of the equations of motion.

Small motions are δ = (rotation in B, translation and ξ as the rotating frame sees them):

    M δ̈ + C δ̇ + K δ + Gᵀδλ = 0,   G δ = 0 **/

#include <Eigen/Dense>
#include <memory>

#include "simflex/body/FlexibleBody.h"
#include "simflex/solver/equations/Evaluation.h"

namespace simflex::test {

class SteadyRotation {
public:
    enum class Stiffening { Off, On };

    /** Finds the equilibrium. @param speed  [rad/s] **/
    SteadyRotation(const std::shared_ptr<const ReducedBody>& beam, double speed,
                   Stiffening stiffening);
    ~SteadyRotation();

    /** Of the tip from where it is undeformed, in the rotating frame [m]. **/
    SimTK::Vec3 calcTipDisplacement() const;

    struct Mode {
        double frequency;  ///< [rad/s]
        bool isFlap;       ///< the tip moves along the axis of rotation, else in the plane
    };
    /** The lowest modes of bending, ascending. **/
    std::vector<Mode> calcModes(int count) const;

private:
    /** Residual of the motion that departs by δ, δ̇, δ̈ from the steady one. **/
    Eigen::VectorXd calcResidual(const Eigen::VectorXd& d, const Eigen::VectorXd& dDot,
                                 const Eigen::VectorXd& dDotDot) const;
    Eigen::VectorXd calcErrors(const Eigen::VectorXd& d) const;
    SimTK::Vec3 calcTip(const Eigen::VectorXd& d) const;
    /** Writes q, u, u̇ and realizes. **/
    void realize(const Eigen::VectorXd& d, const Eigen::VectorXd& dDot,
                 const Eigen::VectorXd& dDotDot) const;
    template <class Function>
    Eigen::MatrixXd differentiate(const Function& function) const;
    void findEquilibrium();

    struct Model;
    std::unique_ptr<Model> m_model;
    double m_speed, m_length;
    int m_size;  ///< of δ
    mutable Eigen::VectorXd m_q, m_u, m_uDot;
    SimTK::Rotation m_R;  ///< steady pose of B at the time when the root is at angle 0
    SimTK::Vec3 m_p{0};
    Eigen::VectorXd m_xi, m_lambda;
};

}  // namespace simflex::test
