#pragma once
/** @file
The nonlinear systems of an integration, all solved by the same block elimination (private header):
implicit steps, projection of positions and speeds onto the joints, consistent accelerations. **/

#include <functional>

#include "simflex/solver/BlockEliminationSolver.h"
#include "simflex/solver/ImplicitIntegrator.h"
#include "simflex/solver/equations/StepEquations.h"
#include "simflex/solver/integration/NewtonMatrixReuse.h"
#include "simflex/solver/integration/SolutionHistory.h"
#include "simflex/solver/integration/ThreadChoice.h"

namespace simflex {

class ImplicitStep {
public:
    using Formulation = ImplicitIntegrator::Formulation;
    using BlockForm = ImplicitIntegrator::BlockForm;

    /** Result of a Newton solve. **/
    struct Outcome {
        bool converged = false;
        bool retryWorthwhile =
            false;  ///< not converged, but the next attempt of the step has a better matrix
        int worstBlock = 0,
            worstRow =
                -1;  ///< block of the largest correction, row of the largest constraint residual
        double displacementChange = 0;  ///< last γΔu [m]
        double constraintResidual = 0;
        bool isFinite = true;  ///< false: worstBlock has non-finite forces or positions
    };

    ImplicitStep(Evaluation& equations, IntegratorStatistics& statistics);
    virtual ~ImplicitStep() = default;

    ImplicitIntegrator::NewtonTolerances tolerances;
    BlockForm blockForm = BlockForm::Automatic;
    double accuracy = 1e-6;
    double largestChange = SimTK::Infinity;  ///< of an iteration; larger ones count as divergence
    bool forceFullNewton = false;            ///< forms the matrix in every iteration
    std::function<void(const NewtonSystem&)> observer;

    /** Uses one thread or this many, whichever is faster. **/
    void setNumThreads(int most);

    /** Solves the equations of a step for u, λ and z (in `point`: predictions), and with them q, u̇
    and ż. If it converges, the equations are left realized there. **/
    Outcome solve(const StepFormula& formula, Formulation formulation, SolutionPoint& point);

    /** The same for StabilizedIndex2 near a singular position, where G changes faster than the
    iteration can follow: solves the position constraints, since G is their exact derivative, and
    leaves λ and the components normal to the constraints to projectStepSpeeds(). **/
    Outcome solveNearSingularity(const StepFormula& formula, SolutionPoint& point);

    /** Projects u at the end of such a step onto the velocity constraints, with u̇ and λ.
    @returns false if it cannot. **/
    bool projectStepSpeeds(const StepFormula& formula, SolutionPoint& point);
    /** Errors of all constraints where they were evaluated last. **/
    const std::vector<double>& getConstraintErrors() const { return m_system.c; }

    /** True if matrices currently contain all terms of a block. **/
    bool useDense() const;
    /** See BlockEliminationSolver. **/
    bool hasLateBlocks() const { return m_solver.hasLateBlocks(); }

    /** Makes the next solve() form and factor a new matrix. **/
    void invalidateMatrix() { m_reuse.forget(); }

    /** True once a matrix of the form M + mass·stiffness·K, as needed by projections, was
    factored. **/
    bool canProject() const { return m_canProject; }

    /** Point at which the equations are realized when a projection begins. **/
    enum class Start {
        Elsewhere,
        AtStepsEnd  ///< as left by solve()
    };
    /** Projects q onto the joints in the norm of the factored matrix, M + mass·stiffness·K, until
    errors are below the tolerance. Leaves the equations realized at the projected q.
    @returns largest error left; its row goes to `worstRow`. **/
    double projectPositions(double t, double tolerance, std::vector<double>& q,
                            const std::vector<double>& u, int* worstRow = nullptr,
                            Start from = Start::Elsewhere);

    /** The same for points between steps, without any effect on later steps. **/
    double projectBetweenSteps(double t, double tolerance, std::vector<double>& q,
                               const std::vector<double>& u);

    /** True if the last projectPositions() began with errors so large that couplers may slip. **/
    bool mayLoseCount() const { return m_mayLoseCount; }

    /** Moves u onto the velocity constraints in the same norm, and adds to λ what moves it: of
    steps, whose equations these are. Speeds that jump are applyImpulse()'s. **/
    void projectSpeeds(double t, const std::vector<double>& q, std::vector<double>& u,
                       std::vector<double>* lambda = nullptr);

    /** Largest position error of the joints at q. **/
    double calcPositionError(double t, const std::vector<double>& q, const std::vector<double>& u);

    /** True if no position error exceeds the tolerance, and no joint is assembled with opposed
    axes. **/
    bool isAssembled(double t, double tolerance, const std::vector<double>& q,
                     const std::vector<double>& u);

    /** Sets prescribed q and u and assembles the joints by least deformation (norm M + τ²K,
    τ = 1 s). Joint axes misaligned by more than 1 rad are turned first. Other speeds are unchanged.
    @throws std::runtime_error that names the worst joint and its error. **/
    void assemble(double t, double tolerance, std::vector<double>& q, std::vector<double>& u);

    struct Impulse {
        double work = 0;        ///< change of kinetic energy [J]
        bool isDriven = false;  ///< some speed is nonzero by a motion, lock or law
    };
    /** Computes the speeds after an impact that satisfies joints and prescribed speeds:

        M (u − before) + GᵀΛ = p,    ġ(q, u) = 0

    with impulses Λ of the joints and p at prescribed speeds only: springs, dampers, motors and
    elasticity are finite forces and have no impulse. Momentum is conserved in every motion that
    joints leave free. Redundant constraints share Λ in the least-norm way.
    @param u       initially `before`, except for prescribed speeds, which stay
    @param shapes  Free: bodies deform. Kept: as if rigid as far as joints allow, so that the rates
        of deformations stay; for a run that begins in motion
    @throws std::runtime_error naming the joints if there are no such speeds, or if the equations of
        motion show that momentum is not conserved **/
    enum class Shapes { Free, Kept };
    Impulse applyImpulse(double t, const std::vector<double>& q, const std::vector<double>& before,
                         std::vector<double>& u, Shapes shapes);

    /** M u̇ + Gᵀλ = f − b, G u̇ = −Ġu − …: exact accelerations and multipliers. **/
    void calcAccelerations(double t, const std::vector<double>& q, const std::vector<double>& u,
                           std::vector<double>& uDot, std::vector<double>& lambda);

    /** Residual of the current equations at a point. **/
    struct Imbalance {
        /** Displacement by which the last step would correct it [m]; infinite without a matrix. **/
        double displacement = SimTK::Infinity;
        double positionError = SimTK::Infinity;  ///< of constraints
        double speedError = SimTK::Infinity;     ///< of constraints, relative to calcSpeedScale()
    };
    /** Of such errors: where it is larger, there are no speeds that satisfy the constraints. **/
    static constexpr double LargestSpeedError = 1e-8;
    Imbalance calcImbalance(const SolutionPoint& point);

    /** Displacement of the end of the last solved step by a change of loads and position errors
    [m]. **/
    double calcResponse(double stiffness, const std::vector<double>& loads);

    /** Forces and prescribed accelerations at this time, for comparison. **/
    std::vector<double> calcLoads(double t, const std::vector<double>& q,
                                  const std::vector<double>& u);

    /** One line for each redundancy found by the last factorization. **/
    std::vector<std::string> describeRedundancies() const;

    /** Adds the solver's phase times to the statistics. **/
    virtual void addInTiming();

    /** Saves or restores what the next step depends on; factors are recomputed from their
    matrices. **/
    virtual void visit(Checkpoint& checkpoint);

protected:
    /** Matrices in a step that give Newton's iteration more time: friction may ask for others for
    ever, as where a load keeps changing sides. **/
    static constexpr int MostMatrices = 25;

    /** Newton's correction of the states among all z of some points, in place: solves
    (1 − A⊗F) δz = residual with F = ∂ż/∂z, where the equations are.
    @param A          numPoints×numPoints: how much of each point's ż is in each point's z
    @param residuals  of all z, point after point **/
    void correctStates(const double* A, int numPoints, std::vector<double>& residuals);
    void formAndFactor(const NewtonFactors& factors, const std::vector<double>& q,
                       const std::vector<double>& u, const std::vector<double>& uDot,
                       MotionLevel level = MotionLevel::Acceleration);
    /** Runs and counts a factorization; on failure there is no matrix.
    @throws UnusablePoint that names the body **/
    void runFactorization(const std::function<void()>& factorize);
    void solveLinear();
    /** Steps of solveLinear() for passes over the blocks. Records the size of a block's part of r,
    and eliminates the block unless a new matrix will be formed. **/
    void finishBlock(int b, bool hasMatrix);
    /** Computes Δλ. **/
    void solveForMultipliers(bool isEliminated);
    /** Computes a block's Δu and adds it to u. **/
    void substituteBlock(int b, std::vector<double>& u);
    virtual void useThreads(int threads);
    bool mayDifferentiate() const;
    /** Updates derivatives of rigid trees' forces at this point, if a new matrix needs them.
    @returns true if there are any **/
    bool renewDerivatives(const std::vector<double>& q, const std::vector<double>& u,
                          const std::vector<double>& uDot);
    /** Records the duration of an iteration without a new matrix. **/
    void noteDuration(double seconds);
    int findNonFiniteBlock() const;
    /** Largest |value|, or NaN if there is one; `where` receives its index. **/
    static double findLargest(const double* values, int size, int* where = nullptr);
    static double findLargest(const std::vector<double>& values, int* where = nullptr) {
        return findLargest(values.data(), int(values.size()), where);
    }
    /** The same for forces [N]: of r, of a part of it from a speed on, and of multipliers. Moments
    and modal forces are scaled by the lengths over which they act, see m_perSpeed. **/
    double findLargestResidual() const;
    double findLargestForce(const double* r, int firstSpeed, int size) const;
    double findLargestForce(const double* multipliers) const;
    /** Largest rate of constraints' errors as one of displacements [m/s]: of angles by the lengths
    over which they act. **/
    double findLargestRate(const std::vector<double>& c) const;
    /** What errors of speeds are held against, in any unit [m/s]: the largest of u as it displaces,
    or what leaves the accuracy in a moment. **/
    double calcSpeedScale(const std::vector<double>& u) const;
    /** Whether such errors at speeds u are within a tenth of tolerances.constraintResidual: it is
    one of angles [rad/s], too, which may act over short lengths. **/
    bool areRatesSmall(const std::vector<double>& c, const std::vector<double>& u) const {
        return findLargestRate(c) <= 0.1 * tolerances.constraintResidual * calcSpeedScale(u);
    }
    /** Where friction follows multipliers: whether their last change is small against them, or
    round-off of the forces. **/
    bool areMultipliersGood(double change, const std::vector<double>& lambda,
                            double forceScale) const;

    /** Adds the time spent from `then` to `now`, and sets `then` to `now`. **/
    template <class Timing>
    void book(const Timing& now, Timing& then) {
        m_statistics.factorSeconds += now.factor - then.factor;
        m_statistics.schurSeconds += now.schur - then.schur;
        m_statistics.backSubstitutionSeconds += now.backSubstitution - then.backSubstitution;
        then = now;
    }

    /** @name After an iteration **/
    /**@{**/
    /** True if a change is no smaller than the previous one: stagnation, or round-off. **/
    static bool hasStalled(double change, double previousChange, double multiplierChange,
                           double previousMultiplierChange);
    /** True if convergence is slow and a new matrix may help. **/
    bool needsBetterMatrix(int iteration, bool hasNewDerivatives);
    /** Records the converged end of a step. **/
    void noteConvergence(const SolutionPoint& end);
    /** Prepares for the next attempt of the step. **/
    void noteFailure(bool hasNewDerivatives, Outcome& outcome);
    /**@}**/

    Evaluation& m_equations;
    IntegratorStatistics& m_statistics;
    NewtonSystem m_system;
    BlockEliminationSolver m_solver;
    std::vector<double> m_deltaZ;
    Eigen::MatrixXd m_stateSlopes;
    NewtonMatrixReuse m_reuse;
    double m_multiplierFloor = 0;  ///< a ten-thousandth of the largest λ of any solved step [N]
    bool m_renewsDerivatives = false;  ///< when the next matrix is formed
    bool m_mayLoseCount = false;

private:
    /** Checks that M·jump + GᵀΛ is zero where speeds are free; returns its work elsewhere.
    @throws std::runtime_error if it is not **/
    double checkMomentum(double t, const std::vector<double>& q, const std::vector<double>& before,
                         const std::vector<double>& u, const std::vector<double>& multipliers,
                         Shapes shapes);
    bool isModal(const Block& block, size_t u) const;
    /** Modifies a matrix M so that a solution leaves modal speeds unchanged if possible. **/
    void makeModesHeavy();
    /** Describes a joint whose friction depends on the multipliers of these redundant rows. **/
    std::string describeUndetermined(const std::vector<int>& rows) const;
    /** Where a motion holds a sticking contact, too, its force is open, and round-off of
    accelerations asks for the same correction of multipliers in every iteration. **/
    struct Repetition {
        std::vector<double> correction;  ///< by the last iteration
        int numIterations = 0;           ///< with the same matrix
    };
    /** One iteration for accelerations and multipliers; a single one suffices without friction.
    @returns true if it has converged; repeated corrections are taken back **/
    bool improveAccelerations(double t, const std::vector<double>& q, const std::vector<double>& u,
                              std::vector<double>& uDot, std::vector<double>& lambda,
                              Repetition& repetition);
    /** Position error; infinite where joints cannot be evaluated. **/
    double tryPositionError(double t, const std::vector<double>& q, const std::vector<double>& u);
    /** Gauss–Newton in q until no position error is larger; returns the error. **/
    double closeJoints(double t, double tolerance, int maxIterations, std::vector<double>& q,
                       const std::vector<double>& u);
    void alignJoints(double t, std::vector<double>& q, const std::vector<double>& u);
    /** After assembly from far away has bent bodies slightly: restores their initial shapes and
    closes the resulting gaps, as long as these decrease. **/
    void relaxShapes(double t, double tolerance, int maxIterations,
                     const std::vector<double>& start, std::vector<double>& q,
                     const std::vector<double>& u);
    enum class Purpose { Final, Projected };
    Outcome solve(const StepFormula& formula, Formulation formulation, Purpose purpose,
                  SolutionPoint& point);
    /** Newton's method for the topology's states, where the equations are realized. **/
    void correctStates(const StepFormula& formula, SolutionPoint& point);
    /** Functional iteration for the other z; returns the largest weighted change of all. **/
    double updateZ(const StepFormula& formula, SolutionPoint& point);
    void factor();
    /** Scales moments by a body's size to equivalent forces, so that results do not depend on the
    unit of length. **/
    void calcForceScales();
    /** Uses dense forms, which include gyroscopic and centrifugal terms and the forces on rigid
    trees, for a number of steps that grows each time. **/
    void startDense();

    BlockEliminationSolver::Timing m_timed;
    StepEquations m_stepEquations;
    std::vector<double> m_lastUDot, m_residuals;  ///< the latter: largest of r, by block
    /** Force per unit of each speed's r and of each multiplier [N]; for multipliers by the largest
    displacement in their row of G. **/
    std::vector<double> m_perSpeed, m_perMultiplier;
    int m_numThreads = 1;
    ThreadChoice m_threadChoice;
    bool m_canProject = false;
    int m_denseStepsLeft = 0, m_densePeriod = 20;
};

}  // namespace simflex
