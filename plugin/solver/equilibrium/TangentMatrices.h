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

// SimTK has a class Eigen: where `using namespace SimTK` reaches, clang would not know which is
// meant.
namespace Eigen = ::Eigen;

/** Mass matrix and constraint Jacobian at the last realize(). **/
void calcMassAndJacobian(Evaluation& equations, Eigen::MatrixXd& M, Eigen::MatrixXd& G);

/** Where forces have no slopes: speeds along which they have a kink. **/
struct KinkedSpeeds {
    std::vector<int> byPosition, byJump;  ///< along δ; along δu or δz, where they jump
    bool any() const { return !byPosition.empty() || !byJump.empty(); }
};

/** What forces of inertia may change in each row of r over a step for differences, as `terms` of
differentiate(): of bodies that turn, and quicken, as each does.
@param mass  diagonal of the mass matrix **/
Eigen::VectorXd calcInertiaChanges(const Evaluation& equations, const CoordinateScales& scales,
                                   const SolutionPoint& point, const Eigen::VectorXd& mass);

/** ∂f/∂δ for the free speeds, zero in columns of prescribed ones.
@param evaluate  writes f for a displaced q
@param q  where to differentiate; the equations are left realized at `q` and `u`
@param kinks  null: they do not matter
@param terms  of f; see differentiate() **/
Eigen::MatrixXd differentiateByQ(
    Evaluation& equations, const CoordinateScales& scales, double t, const std::vector<double>& q,
    const std::vector<double>& u,
    const std::function<void(const std::vector<double>& q, Eigen::VectorXd& f)>& evaluate,
    KinkedSpeeds* kinks = nullptr, const Eigen::VectorXd& terms = {});

/** ∂r/∂u at a point, zero in columns of prescribed speeds. A damper that resists otherwise forth
than back counts by the mean of both, which is that of its first harmonic. **/
Eigen::MatrixXd calcDampingMatrix(Evaluation& equations, const CoordinateScales& scales,
                                  const SolutionPoint& point, KinkedSpeeds* kinks = nullptr,
                                  const Eigen::VectorXd& terms = {});

/** Small changes δz of the states that do not follow the motion, at a point:

    r + … + B δz,    δż = C δ + E δu + F δz **/
struct StateTangent {
    std::vector<int> states;  ///< numbers among z
    Eigen::MatrixXd B;        ///< n×s
    Eigen::MatrixXd C, E;     ///< s×n
    Eigen::MatrixXd F;        ///< s×s
    Eigen::VectorXd rates;    ///< ż
};
StateTangent calcStateTangent(Evaluation& equations, const CoordinateScales& scales,
                              const SolutionPoint& point, KinkedSpeeds* kinks = nullptr);

/** A(u) with δ̇ = δu − A δ: A δ = N⁻¹(Ṅ δ − ∂(N u)/∂q N δ), zero where q̇ = u; of each block. **/
std::vector<Eigen::MatrixXd> calcRateBlocks(Evaluation& equations, const CoordinateScales& scales,
                                            const SolutionPoint& point);

/** Says which body forces lead away from where it is, by more than 1e-4 of its size, and how far;
empty if none.
@param departure  δ to which the forces lead **/
std::string describeDeparture(const Evaluation& equations, const CoordinateScales& scales,
                              const Eigen::VectorXd& departure, const Eigen::VectorXd& forces);

/** Speeds that no lock or Motion prescribes. **/
std::vector<int> listFreeSpeeds(const Evaluation& equations);

/** The directions that constraints leave free, in scaled coordinates δ = s·x. Redundant rows are
 * allowed. **/
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
