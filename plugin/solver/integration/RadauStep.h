#pragma once
/** @file
The nonlinear system of a step of Radau IIA (private header): all stages simultaneously, by Newton's
method with one real and one complex block elimination per iteration. With U_i = u_i − u_n and a
matrix J = M ∂u̇ + D ∂u + K ∂q of one point for all stages,

    Σ_j (w_ij/h M + h a_ij K) ΔU_j + D ΔU_i + Gᵀ Δλ_i = −r_i,    G ΔU_i = −ġ_i

splits by ΔU = TΔV into (M μ + D + K/μ) ΔV + Gᵀ ΔΛ = −T⁻¹r for μ = γ̂/h and (α̂ + iβ̂)/h.

In long rigid trees M changes strongly between the stages, in terms of M⁻¹ΔM. There r_i is replaced
by M_m M_i⁻¹ r_i with the matrix's M_m (TreeInertias): Newton's method for u̇ = M⁻¹f, whose
derivatives are those of one stage.

The complex matrix is a combination of three real ones, as J is linear in 1/mass, 1 and stiffness of
NewtonFactors. Source: E. Hairer, G. Wanner, Solving ODEs II, IV.8 and VII.4. **/

#include <array>
#include <vector>

#include "simflex/solver/elimination/NewtonCombination.h"
#include "simflex/solver/equations/TreeInertias.h"
#include "simflex/solver/integration/ImplicitStep.h"
#include "simflex/solver/integration/RadauTableau.h"

namespace simflex {

class RadauStep : public ImplicitStep {
public:
    RadauStep(Evaluation& equations, IntegratorStatistics& statistics);

    /** The stages, the last of which is the step's end; predictions before solveStages(). **/
    SolutionPoint& updStage(int i) { return m_stages[size_t(i)]; }

    /** 1/(μ of the real system), for both factors of the step's real matrix. **/
    static NewtonFactors calcFactors(double h) { return h / radau::RealEigenvalue; }

    /** True if a matrix costs more than an iteration: then an old one is kept while it
    converges. **/
    bool keepsMatrices() const;

    /** Solves for u, λ and z of all stages, and with them q, q̇, u̇ and ż. **/
    Outcome solveStages(const SolutionPoint& start, double h);

    /** Computes power and work at all stages from those of the start. @returns false if couplers
    may slip between them. **/
    bool completeStages(const SolutionPoint& start, double h);

    /** Difference from the embedded formula of order 3, filtered by the real matrix so that it
    stays small in stiff directions.
    @param end  the last stage, after projection **/
    void calcError(const SolutionPoint& start, const SolutionPoint& end, double h,
                   ErrorNorm::Error& error);

    /** Reduces this error, of order 4, to the step's own, of order 6. The change of a part's error
    since the last step indicates how fast its solution changes, independently of other parts. **/
    void reduceError(double h, ErrorNorm::Error& error);
    /** Accepts the step with this error. **/
    void keepError() { std::swap(m_last, m_tried); }
    /** Removes the error of the last step. **/
    void forgetError() { m_last.h = 0; }

    /** Ratio of the next step to the last one at which the iteration converges well, for use where
    matrices are renewed in every step. **/
    double calcLargestRatio() const;

    void addInTiming() override;
    void visit(Checkpoint& checkpoint) override;

private:
    using Vectors = std::array<std::vector<double>, radau::NumStages>;

    void useThreads(int threads) override;
    /** Computes q and u̇ of all stages from their u, and prescribed u. **/
    void placeStages(const SolutionPoint& start, double h);
    /** One functional iteration for the uncoupled z of all stages. **/
    template <class Choice>
    void correctZ(const SolutionPoint& start, double h, const Choice& isChosen, bool byNewton);
    /** Computes r and c of all stages; the middle one last.
    @param forMatrix  a new matrix will be formed from them
    @param hasOtherFriction  contacts have changed mode since the matrix was formed
    @returns largest change of z **/
    double evaluateStages(const SolutionPoint& start, double h, bool forMatrix,
                          bool& hasOtherFriction);
    /** Whether contacts end in the assumed modes. **/
    bool isFrictionSettled(const SolutionPoint& start, double h);
    void formAndFactorBoth(const NewtonFactors& factors);
    void factorComplex();
    /** ΔU and Δλ of all stages from r and c. **/
    void solveBoth();

    std::array<SolutionPoint, radau::NumStages> m_stages;
    SolutionPoint m_trial;
    Vectors m_r, m_c, m_deltaU, m_deltaLambda;
    std::vector<int> m_accelerationRows;
    std::vector<double> m_history;       ///< for speeds whose accelerations are prescribed
    std::array<NewtonSystem, 3> m_real;  ///< components of the complex one
    ComplexNewtonSystem m_complex;
    ComplexBlockEliminationSolver m_complexSolver;
    ComplexBlockEliminationSolver::Timing m_complexTimed;
    std::vector<double> m_matrixQ;              ///< point of the matrix
    TreeInertias m_inertias{radau::NumStages};  ///< of the stages
    bool m_carriesForces = false;               ///< transforms r of long trees by m_inertias
    double m_slowestRate = 0;                   ///< of convergence, in the last step solved
    std::vector<double> m_zChange;              ///< by stage
    /** Error of the last step of length h; h = 0: none. **/
    struct Error : ErrorNorm::Error {
        double h = 0;
    };
    Error m_tried, m_last;
    ErrorNorm::Error m_change;
};

}  // namespace simflex
