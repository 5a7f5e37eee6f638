#pragma once
/** @file
A beam rotated steadily about z by its root, and small motions about it: equilibrium and
linearization by central differences of the equations of motion.

Small motions are δ = (rotation in B, translation and ξ in the rotating frame):

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

    /** Returns the tip displacement in the rotating frame [m]. **/
    SimTK::Vec3 calcTipDisplacement() const;

    struct Mode {
        double frequency;  ///< [rad/s]
        bool isFlap;       ///< the tip moves along the axis of rotation rather than in the plane
    };
    /** Returns the lowest bending modes, ascending. **/
    std::vector<Mode> calcModes(int count) const;

private:
    /** Returns the residual of a motion that differs from the steady one by δ, δ̇, δ̈. **/
    Eigen::VectorXd calcResidual(const Eigen::VectorXd& d, const Eigen::VectorXd& dDot,
                                 const Eigen::VectorXd& dDotDot) const;
    Eigen::VectorXd calcErrors(const Eigen::VectorXd& d) const;
    SimTK::Vec3 calcTip(const Eigen::VectorXd& d) const;
    /** Sets q, u, u̇ and realizes the State. **/
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
    SimTK::Rotation m_R;  ///< steady pose of B when the root's angle is 0
    SimTK::Vec3 m_p{0};
    Eigen::VectorXd m_xi, m_lambda;
};

}  // namespace simflex::test
