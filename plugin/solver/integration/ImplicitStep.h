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

    /** What one Newton iteration came to. **/
    struct Outcome {
        bool converged = false;
        bool retryWorthwhile =
            false;  ///< not converged, but the next try of the same step has a better matrix
        int worstBlock = 0,
            worstRow =
                -1;  ///< block of the largest correction, row of the largest constraint residual
        double displacementChange = 0;  ///< last γΔu [m]
        double constraintResidual = 0;
        bool isFinite = true;  ///< false: worstBlock has forces or positions that are not numbers
    };

    ImplicitStep(Evaluation& equations, IntegratorStatistics& statistics);
    virtual ~ImplicitStep() = default;

    ImplicitIntegrator::NewtonTolerances tolerances;
    BlockForm blockForm = BlockForm::Automatic;
    double accuracy = 1e-6;
    double largestChange = SimTK::Infinity;  ///< of an iteration; beyond it is not gone on
    bool forceFullNewton = false;            ///< the matrix is formed in every iteration
    std::function<void(const NewtonSystem&)> observer;

    /** As many as these or one, whatever is faster. **/
    void setNumThreads(int most);

    /** Solves the equations of a step for u, λ and z (in `point`: predictions), and with them q, u̇
    and ż. Leaves the equations realized there, if it converges. **/
    Outcome solve(const StepFormula& formula, Formulation formulation, SolutionPoint& point);

    /** The same for StabilizedIndex2 near a singular position, where G changes faster than the
    iteration follows: solves the position equations, whose exact derivative G is, and leaves λ and
    what is across the constraints to projectStepSpeeds(). **/
    Outcome solveNearSingularity(const StepFormula& formula, SolutionPoint& point);

    /** Moves u onto the velocity constraints at the end of such a step, and u̇ and λ with it.
    @returns false if it cannot. **/
    bool projectStepSpeeds(const StepFormula& formula, SolutionPoint& point, int* worstRow);

    /** True if matrices are formed with all that is in a block now. **/
    bool useDense() const;
    /** See BlockEliminationSolver. **/
    bool hasLateBlocks() const { return m_solver.hasLateBlocks(); }

    /** Next solve() forms and factors its matrix anew. **/
    void invalidateMatrix() { m_reuse.forget(); }

    /** True once a matrix of the form M + mass·stiffness·K was factored, on which projections can
     * rest. **/
    bool canProject() const { return m_canProject; }

    /** Where the equations are when a projection begins. **/
    enum class Start {
        Elsewhere,
        AtStepsEnd  ///< as solve() has left them
    };
    /** Moves q onto the joints in the norm of the factored matrix, M + mass·stiffness·K, until
    errors are below the tolerance. Leaves the equations realized at the projected q. @returns
    largest error left; its row goes to `worstRow`. **/
    double projectPositions(double t, double tolerance, std::vector<double>& q,
                            const std::vector<double>& u, int* worstRow = nullptr,
                            Start from = Start::Elsewhere);

    /** The same for points between steps, which leaves no trace: whatever is looked at, the steps
    to come are the same. **/
    double projectBetweenSteps(double t, double tolerance, std::vector<double>& q,
                               const std::vector<double>& u);

    /** True if the last projectPositions() began so far off that couplers may lose their count. **/
    bool mayLoseCount() const { return m_mayLoseCount; }

    /** Moves u onto the velocity constraints in the same norm, and adds to λ what moves it: of
    steps, whose equations these are. Speeds that jump are applyImpulse()'s.
    @param worstRow  as above **/
    void projectSpeeds(double t, const std::vector<double>& q, std::vector<double>& u,
                       int* worstRow = nullptr, std::vector<double>* lambda = nullptr);

    /** Largest position error of the joints at q. **/
    double calcPositionError(double t, const std::vector<double>& q, const std::vector<double>& u);

    /** True if no position error is larger than the tolerance, and no joint is assembled with its
    axes opposed. **/
    bool isAssembled(double t, double tolerance, const std::vector<double>& q,
                     const std::vector<double>& u);

    /** Sets prescribed q and u and assembles the joints by least deformation (norm M + τ²K,
    τ = 1 s). Joints whose axes are more than 1 rad from their place are turned there first. Other
    speeds stay what they are.
    @throws std::runtime_error that names the worst joint and its error. **/
    void assemble(double t, double tolerance, std::vector<double>& q, std::vector<double>& u);

    struct Impulse {
        double work = 0;        ///< that it did: the change of kinetic energy [J]
        bool isDriven = false;  ///< something moves that a motion, lock or law prescribes
    };
    /** Speeds jump as in an impact, to where joints and prescribed speeds have them:

        M (u − before) + GᵀΛ = p,    ġ(q, u) = 0

    with impulses Λ of the joints and p where speeds are prescribed, and nothing else: springs,
    dampers, motors and stiffness are forces, and those have no time to act. So momentum is kept in
    every motion that joints leave free. Redundant constraints share Λ in the least-norm way.
    @param u       at first `before` but for prescribed speeds, which stay
    @param shapes  Free: bodies answer as they bend. Kept: as if rigid as far as joints allow, so
        that deformations keep their rates: a run that begins in motion has been moving before
    @throws std::runtime_error naming the joints if there are no such speeds, or if the equations of
        motion do not agree that momentum is kept **/
    enum class Shapes { Free, Kept };
    Impulse applyImpulse(double t, const std::vector<double>& q, const std::vector<double>& before,
                         std::vector<double>& u, Shapes shapes);

    /** M u̇ + Gᵀλ = f − b, G u̇ = −Ġu − …: exact accelerations and multipliers. **/
    void calcAccelerations(double t, const std::vector<double>& q, const std::vector<double>& u,
                           std::vector<double>& uDot, std::vector<double>& lambda);

    /** How far a point is from satisfying the equations as they are now. **/
    struct Imbalance {
        /** What the last step would add to make up for it [m]; infinite if there is no matrix. **/
        double displacement = SimTK::Infinity;
        double positionError = SimTK::Infinity;  ///< of constraints
        double speedError = SimTK::Infinity;     ///< of constraints, relative to calcSpeedScale()
    };
    /** Of such errors: where it is larger, there are no speeds that satisfy the constraints. **/
    static constexpr double LargestSpeedError = 1e-8;
    Imbalance calcImbalance(const SolutionPoint& point);

    /** How far the end of the last step solved would move, were loads and position errors other by
    these [m]. **/
    double calcResponse(double stiffness, const std::vector<double>& loads);

    /** What acts at this time, forces and prescribed accelerations, for comparison. **/
    std::vector<double> calcLoads(double t, const std::vector<double>& q,
                                  const std::vector<double>& u);

    /** One line for each redundancy that the last factorization found. **/
    std::vector<std::string> describeRedundancies() const;

    /** Adds the solver's phase times to the statistics. **/
    virtual void addInTiming();

    /** What the next step takes over from the last ones; the factors are made anew from the
    matrices they were made of. **/
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
    /** Counts it; where it fails there is no matrix.
    @throws UnusablePoint that names the body **/
    void runFactorization(const std::function<void()>& factorize);
    void solveLinear();
    /** The same in passes that have more to do. A block's part of r is there: notes its size, and
    eliminates the block unless there will be a new matrix. **/
    void finishBlock(int b, bool hasMatrix);
    /** Δλ. **/
    void solveForMultipliers(bool isEliminated);
    /** A block's Δu, which is added to u. **/
    void substituteBlock(int b, std::vector<double>& u);
    virtual void useThreads(int threads);
    bool mayDifferentiate() const;
    /** Derivatives of rigid trees' forces at this point, where a new matrix wants them.
    @returns true if there are any **/
    bool renewDerivatives(const std::vector<double>& q, const std::vector<double>& u,
                          const std::vector<double>& uDot);
    /** An iteration without a new matrix took so long. **/
    void noteDuration(double seconds);
    int findNonFiniteBlock() const;
    /** Largest |value|, or NaN if there is one; `where` receives its index. **/
    static double findLargest(const double* values, int size, int* where = nullptr);
    static double findLargest(const std::vector<double>& values, int* where = nullptr) {
        return findLargest(values.data(), int(values.size()), where);
    }
    /** The same of forces [N]: of r, of parts of it that begin at a speed, and of multipliers.
    Moments and modal forces count by the lengths over which they act, see m_perSpeed. **/
    double findLargestResidual() const;
    double findLargestForce(const double* r, int firstSpeed, int size) const;
    double findLargestForce(const double* multipliers) const;
    /** Largest rate of constraints' errors as one of displacements [m/s]: of angles by the lengths
    over which they act. **/
    double findLargestRate(const std::vector<double>& c) const;
    /** What errors of speeds are held against, in any unit [m/s]: the largest of u as it displaces,
    or what leaves the accuracy in a moment. **/
    double calcSpeedScale(const std::vector<double>& u) const;
    /** Whether such errors at speeds u are within tolerances.constraintResidual. **/
    bool areRatesSmall(const std::vector<double>& c, const std::vector<double>& u) const {
        return findLargestRate(c) <= tolerances.constraintResidual * calcSpeedScale(u);
    }
    /** Where friction follows multipliers: whether their last change is small against them, or
    round-off of the forces. **/
    bool areMultipliersGood(double change, const std::vector<double>& lambda,
                            double forceScale) const;

    /** Adds what was spent since then, and makes it now. **/
    template <class Timing>
    void book(const Timing& now, Timing& then) {
        m_statistics.factorSeconds += now.factor - then.factor;
        m_statistics.schurSeconds += now.schur - then.schur;
        m_statistics.backSubstitutionSeconds += now.backSubstitution - then.backSubstitution;
        then = now;
    }

    /** @name After an iteration **/
    /**@{**/
    /** True if it changes no less than the one before: it leads nowhere, or to round-off. **/
    static bool hasStalled(double change, double previousChange, double multiplierChange,
                           double previousMultiplierChange);
    /** True if it is slow and a new matrix may do better. **/
    bool needsBetterMatrix(int iteration, bool hasNewDerivatives);
    /** The step's end is known. **/
    void noteConvergence(const SolutionPoint& end);
    /** Prepares for the next try of the step. **/
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
    /** Whether M·jump + GᵀΛ is zero where speeds are free, and its work where they are not.
    @throws std::runtime_error if it is not **/
    double checkMomentum(double t, const std::vector<double>& q, const std::vector<double>& before,
                         const std::vector<double>& u, const std::vector<double>& multipliers,
                         Shapes shapes);
    bool isModal(const Block& block, size_t u) const;
    /** Of a matrix M, so that a solution leaves modal speeds as they are if it can. **/
    void makeModesHeavy();
    /** Of a joint whose friction depends on the multipliers of these rows, which are redundant. **/
    std::string describeUndetermined(const std::vector<int>& rows) const;
    /** One iteration for accelerations and multipliers; without friction there is one.
    @returns true if there need be no other **/
    bool improveAccelerations(double t, const std::vector<double>& q, const std::vector<double>& u,
                              std::vector<double>& uDot, std::vector<double>& lambda);
    /** The same; infinite where the joints cannot be looked at. **/
    double tryPositionError(double t, const std::vector<double>& q, const std::vector<double>& u);
    /** Gauss–Newton in q until no position error is larger; returns the error. **/
    double closeJoints(double t, double tolerance, int maxIterations, std::vector<double>& q,
                       const std::vector<double>& u);
    void alignJoints(double t, std::vector<double>& q, const std::vector<double>& u);
    /** On the way from afar bodies have bent a little: gives them back the shapes of the start and
    closes what opens by that, as long as it is less each time. **/
    void relaxShapes(double t, double tolerance, int maxIterations,
                     const std::vector<double>& start, std::vector<double>& q,
                     const std::vector<double>& u);
    enum class Purpose { Final, Projected };
    Outcome solve(const StepFormula& formula, Formulation formulation, Purpose purpose,
                  SolutionPoint& point);
    /** Newton's method on the topology's states, where the equations are. **/
    void correctStates(const StepFormula& formula, SolutionPoint& point);
    /** A functional iteration on other z; returns the largest weighted change of all. **/
    double updateZ(const StepFormula& formula, SolutionPoint& point);
    void factor();
    /** So that a moment counts as the force that does the same at the distance of a body's size:
    results do not depend on the unit of length. **/
    void calcForceScales();
    /** The arrow leaves gyroscopic and centrifugal terms out, that of rigid trees forces too: has
    them for a while, longer each time. **/
    void startDense();

    BlockEliminationSolver::Timing m_timed;
    StepEquations m_stepEquations;
    std::vector<double> m_lastUDot, m_residuals;  ///< the latter largest of r, by block
    /** Forces that a unit of each speed's r, and of each multiplier, amounts to [N]: the latter by
    the largest displacement that its row of G asks for. **/
    std::vector<double> m_perSpeed, m_perMultiplier;
    int m_numThreads = 1;
    ThreadChoice m_threadChoice;
    bool m_canProject = false;
    int m_denseStepsLeft = 0, m_densePeriod = 20;
};

}  // namespace simflex
