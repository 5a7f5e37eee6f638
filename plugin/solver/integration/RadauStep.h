#pragma once
/** @file
The nonlinear system of a step of Radau IIA (private header): all stages at once, by a Newton
iteration whose system is one real and one complex block elimination. With U_i = u_i − u_n and a
matrix J = M ∂u̇ + D ∂u + K ∂q of one point for all stages,

    Σ_j (w_ij/h M + h a_ij K) ΔU_j + D ΔU_i + Gᵀ Δλ_i = −r_i,    G ΔU_i = −ġ_i

falls by ΔU = TΔV into (M μ + D + K/μ) ΔV + Gᵀ ΔΛ = −T⁻¹r for μ = γ̂/h and (α̂ + iβ̂)/h.

In long rigid trees M changes much between the stages, in terms of M⁻¹ΔM. There M_m M_i⁻¹ r_i with
the matrix's M_m stands for r_i (TreeInertias): Newton's method for u̇ = M⁻¹f, whose derivatives are
those of one stage.

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

    /** Of the stages, the last of which is the step's end: before solveStages() predictions. **/
    SolutionPoint& updStage(int i) { return m_stages[size_t(i)]; }

    /** 1/(μ of the real system), both factors of the step's real matrix. **/
    static NewtonFactors calcFactors(double h) { return h / radau::RealEigenvalue; }

    /** True where a matrix costs more than an iteration: an old one serves as long as it converges.
     **/
    bool keepsMatrices() const;

    /** Solves for u, λ and z of all stages, and with them q, q̇, u̇ and ż. **/
    Outcome solveStages(const SolutionPoint& start, double h);

    /** Power and work at all stages, from those of the start. @returns false if couplers may lose
    their count between them. **/
    bool completeStages(const SolutionPoint& start, double h);

    /** Difference to the embedded formula of order 3, solved for with the real matrix so that it
    stays small in stiff directions.
    @param end  the last stage, after projection **/
    void calcError(const SolutionPoint& start, const SolutionPoint& end, double h,
                   ErrorNorm::Error& error);

    /** The step's own error, of order 6, is smaller than this one of order 4: reduces it to that.
    How far the error of a part has changed since the last step says how fast its solution is; it
    tells nothing of other parts. **/
    void reduceError(double h, ErrorNorm::Error& error);
    /** The step with this error was taken. **/
    void keepError() { std::swap(m_last, m_tried); }
    /** The next step has no past. **/
    void forgetError() { m_last.h = 0; }

    /** Of the next step to the last one solved, so that its iteration converges well: to be taken
    where matrices are renewed in every step. **/
    double calcLargestRatio() const;

    void addInTiming() override;
    void visit(Checkpoint& checkpoint) override;

private:
    using Vectors = std::array<std::vector<double>, radau::NumStages>;

    void useThreads(int threads) override;
    /** q and u̇ of all stages, from u of all; u where it is prescribed. **/
    void placeStages(const SolutionPoint& start, double h);
    /** One iteration on the chosen z of all stages. **/
    template <class Choice>
    void correctZ(const SolutionPoint& start, double h, const Choice& isChosen, bool byNewton);
    /** r and c of all stages; the middle one last.
    @param forMatrix  a new matrix will be formed from them
    @param hasOtherFriction  joints stick or slide otherwise than when the matrix was formed
    @returns largest change of z **/
    double evaluateStages(const SolutionPoint& start, double h, bool forMatrix,
                          bool& hasOtherFriction);
    /** Whether contacts do at the end what they were taken to do. **/
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
    std::array<NewtonSystem, 3> m_real;  ///< what the complex one is made of
    ComplexNewtonSystem m_complex;
    ComplexBlockEliminationSolver m_complexSolver;
    ComplexBlockEliminationSolver::Timing m_complexTimed;
    std::vector<double> m_matrixQ;              ///< where it was formed
    TreeInertias m_inertias{radau::NumStages};  ///< of the stages
    bool m_carriesForces = false;               ///< r of long trees, by m_inertias
    double m_slowestRate = 0;                   ///< of convergence, in the last step solved
    std::vector<double> m_zChange;              ///< by stage
    /** Of a step of length h; zero: there was none. **/
    struct Error : ErrorNorm::Error {
        double h = 0;
    };
    Error m_tried, m_last;
    ErrorNorm::Error m_change;
};

}  // namespace simflex
