#pragma once
/** @file
Derivatives of the equations of motion about a point, and motions tangent to the constraints
(private header):

    D = ∂r/∂u,   K = ∂r/∂q·N,   G,   δ = Z y + …  with G Z = 0

D and K are differences of the residual (see Differences.h), column by column along moveQ(): with
displacements of 3e-4 of the body's size their relative error is below 1e-8 where forces are smooth
(truncation h⁴/30 and round-off 1e-16/h alone would give 1e-12). O(n²) for n speeds. **/

#include <Eigen/Dense>
#include <functional>
#include <vector>

#include "simflex/solver/equations/CoordinateScales.h"
#include "simflex/solver/equations/Evaluation.h"
#include "simflex/solver/equilibrium/Differences.h"
#include "simflex/solver/integration/SolutionHistory.h"

namespace simflex {

// SimTK declares a class Eigen, which makes the name ambiguous for clang after
// `using namespace SimTK`.
namespace Eigen = ::Eigen;

/** Mass matrix and constraint Jacobian at the last realize(). **/
void calcMassAndJacobian(Evaluation& equations, Eigen::MatrixXd& M, Eigen::MatrixXd& G);

/** Speeds along which forces have a kink. **/
struct KinkedSpeeds {
    std::vector<int> byPosition, byJump;  ///< along δ; along δu or δz, where they jump
    bool any() const { return !byPosition.empty() || !byJump.empty(); }
};

/** Bound of the change of inertial forces in each row of r over a difference step, as `terms` of
differentiate(), due to rotating and accelerating bodies.
@param mass  diagonal of the mass matrix **/
Eigen::VectorXd calcInertiaChanges(const Evaluation& equations, const CoordinateScales& scales,
                                   const SolutionPoint& point, const Eigen::VectorXd& mass);

/** ∂f/∂δ for the free speeds, zero in columns of prescribed ones.
@param evaluate  writes f for a displaced q
@param q  where to differentiate; the equations are left realized at `q` and `u`
@param kinks  receives kinks; null: ignored
@param terms  of f; see differentiate() **/
Eigen::MatrixXd differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, double t, const std::vector<double>& q,
    const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& f)>& evaluate,
    KinkedSpeeds* kinks = nullptr, const Eigen::VectorXd& terms = {});

/** ∂r/∂u at a point, zero in columns of prescribed speeds. A damper that differs in the two
directions counts by their mean, as in its first harmonic. **/
Eigen::MatrixXd calcDampingMatrix(Evaluation& equations, const CoordinateScales& scales,
                                  const SolutionPoint& point, KinkedSpeeds* kinks = nullptr,
                                  const Eigen::VectorXd& terms = {});

/** Small changes δz of the states that do not follow the motion, at a point:

    r + … + B δz,    δż = C δ + E δu + F δz **/
struct StateTangent {
    std::vector<int> states;  ///< indices in z
    Eigen::MatrixXd B;        ///< n×s
    Eigen::MatrixXd C, E;     ///< s×n
    Eigen::MatrixXd F;        ///< s×s
    Eigen::VectorXd rates;    ///< ż
};
StateTangent calcStateTangent(Evaluation& equations, const CoordinateScales& scales,
                              const SolutionPoint& point, KinkedSpeeds* kinks = nullptr);

/** A(u) in δ̇ = δu − A δ: A δ = N⁻¹(Ṅ δ − ∂(N u)/∂q N δ), zero where q̇ = u; by blocks. **/
std::vector<Eigen::MatrixXd> calcRateBlocks(Evaluation& equations, const CoordinateScales& scales,
                                            const SolutionPoint& point);

/** Describes which body is displaced by forces by more than 1e-4 of its size, and how far; empty if
none is.
@param departure  displacement δ caused by the forces **/
std::string describeDeparture(const Evaluation& equations, const CoordinateScales& scales,
                              const Eigen::VectorXd& departure, const Eigen::VectorXd& forces);

/** Speeds that are not prescribed by a lock or Motion. **/
std::vector<int> listFreeSpeeds(const Evaluation& equations);

/** The directions left free by the constraints, in scaled coordinates δ = s·x. Redundant rows are
allowed. **/
class TangentSpace {
public:
    /** @param G  m×n, scaled columns: G·diag(s) **/
    explicit TangentSpace(const Eigen::MatrixXd& G);

    const Eigen::MatrixXd& getBasis() const { return m_Z; }  ///< n×(n − rank), orthonormal
    int getRank() const { return m_rank; }

    /** x of least norm with G x = g, in the least-squares sense. **/
    Eigen::VectorXd solveForMotion(const Eigen::VectorXd& g) const;
    /** λ with Gᵀλ = f, in the least-squares sense. **/
    Eigen::VectorXd solveForMultipliers(const Eigen::VectorXd& f) const;

private:
    int m_rank = 0;
    Eigen::VectorXd m_rowScale;
    Eigen::MatrixXd m_Z, m_inverse;  // m_inverse: pseudo-inverse of the row-scaled Gᵀ, m×n
};

}  // namespace simflex
