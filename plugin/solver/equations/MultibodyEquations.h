#pragma once
/** @file
The equations of motion of a whole system, block by block, from q and u (private header):

    r = M(q) u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ,    g(q, t),    ġ = G u + ∂g/∂t

Flexible bodies, joints, gravity, the elements of simflex/forces and simple rigid mobilizers are
evaluated here; Simbody is asked only for rigid trees with other mobilizers and for foreign forces,
on a private State. Within a realization of Simbody's own (Setting::Native) all foreign forces,
gravity among them, are given, and Simbody is asked on the State that is being realized. **/

#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/equations/Block.h"
#include "simflex/solver/equations/ForceDifferences.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "simflex/solver/equations/PrescribedMotion.h"
#include "simflex/solver/equations/SimbodyConstraints.h"

namespace simflex {

class Checkpoint;
class FlexibleBlock;
class RigidTree;

class MultibodyEquations {
public:
    enum class Setting {
        Implicit,   ///< bodies that are rigid in the State have no modal speeds
        Linearize,  ///< the same with all of Simbody's speeds
        Native
    };

    /** Analyses the system; `state` gives instance variables (gravity, disabled elements, locks)
    and is copied.
    @param differentiated  foreign forces whose Jacobian is wanted
    @throws std::invalid_argument that names what cannot be supported. **/
    MultibodyEquations(const SimTK::MultibodySystem& system, const SimTK::State& state,
                       Setting setting = Setting::Implicit,
                       const std::vector<ForceSelection>& differentiated = {});
    ~MultibodyEquations();

    int numQ() const { return m_numQ; }
    int numU() const { return m_numU; }
    int numMultipliers() const { return m_numMultipliers; }
    int numBlocks() const { return int(m_blocks.size()); }
    const Block& getBlock(int b) const { return *m_blocks[b]; }

    /** First multiplier of a joint. **/
    int getFirstRow(JointIndex joint) const { return m_joints[joint].firstRow; }
    /** First multiplier of a Simbody constraint, after those of all joints, and their number;
    none if it is disabled or a joint's own. **/
    std::pair<int, int> findRows(SimTK::ConstraintIndex constraint) const;
    /** Name of the joint or Simbody constraint that owns a multiplier. **/
    const std::string& getJointName(int row) const;
    /** "joint 'gudgeon pin'", or a Simbody constraint's kind and bodies. **/
    std::string describeConstraint(int row) const;
    /** "equation 4 of 'gudgeon pin'": a constraint row for people. **/
    std::string describeRow(int row) const;

    /** Level at which a constraint row holds; joints hold positions. **/
    MotionLevel getRowLevel(int row) const;
    /** True if a lock or Motion prescribes this speed, at whatever level. **/
    bool isPrescribed(int speed) const;
    /** Blocks 0 … n−1 are flexible bodies: q = (quaternion, p_GB, ξ), u = (ω_B, v_G, ξ̇), without ξ
    and ξ̇ if the body is rigid (Setting::Implicit). **/
    int numFlexibleBlocks() const { return int(m_flexible.size()); }
    /** True if a body can bend. **/
    bool hasModes() const;
    const SimTK::SimbodyMatterSubsystem& getMatter() const { return m_system.getMatterSubsystem(); }
    /** Where a body's coordinates and speeds stand in the solver's vectors, if it belongs to a
     * rigid tree. @returns false if not. **/
    bool findRigidSlots(SimTK::MobilizedBodyIndex body, int& q0, int& nq, int& u0) const;

    /** Two frames that a joint, a constraint or a force element joins; frames in Ground have block
    −1. Motions are those of the last realize(). **/
    struct Link {
        int blocks[2];
        const FrameMotion* motions[2];
        int numEquations;  ///< none for force elements
    };
    /** Those between different blocks; of Simbody's constraints, those between two bodies of rigid
    trees or Ground. **/
    std::vector<Link> listLinks() const;

    /** Applies this part of gravity, of loads and of Simbody's force elements from the next
     * realize() on, springs between attachment frames in full; 1 unless told. **/
    void setLoadFraction(double fraction);

    /** From now on functions of time are evaluated at times within these only, the nearest ones;
    infinite unless told. **/
    void setSmoothSpan(double first, double last);

    /** Threads to use at most; models of few or small bodies get fewer. **/
    void setNumThreads(int most);
    int getNumThreads() const { return m_numThreads; }

    /** A Newton system of this topology, zero. **/
    NewtonSystem makeNewtonSystem() const;

    /** Writes the q and u that locks and Motions prescribe at this time; realize() must follow.
     * With `uHist`, prescribed accelerations make u = u_hist + γu̇. **/
    void prescribe(double time, double gamma, const double* uHist, double* q, double* u);
    /** Zeroes what is prescribed in errors of q and u. **/
    void clearPrescribedErrors(double* errorQ, double* errorU) const;

    /** Asks functions of time anew from now on, as their surroundings may have changed; they are
     * asked once for every time. **/
    void forgetFunctionValues() { m_functions.forget(); }

    /** Positions, velocities, joint frames; first call of every evaluation. **/
    void realize(double time, const double* q, const double* u);

    /** The same for Setting::Native: locks and Motions, rigid trees and Simbody's constraints are
    read from `state`, which must stay, as its matter subsystem is realized to Stage::Dynamics.
    @param bodyForces, mobilityForces  of all force elements but those of the flexible subsystem **/
    void realizeNatively(const SimTK::State& state,
                         const SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                         const SimTK::Vector& mobilityForces, const double* q, const double* u);

    /** @name After realize() **/
    /**@{**/
    /** (u − u_hist)/γ, or what is prescribed. **/
    void calcStepUDot(const double* q, const double* u, const double* uHist, double gamma,
                      double* uDot) const;
    /** u̇ = 0 where it is free. **/
    void calcPrescribedUDot(const double* q, double* uDot) const;

    /** Zero in rows that are not holonomic. **/
    void calcPositionErrors(double* g) const;
    /** True if position errors of a step that began without are so large a part of a coupler's
    period that the next step, twice as long, might come out a whole period (a gear's tooth) off.
    @param scale  errors are g·scale **/
    bool mayLoseCount(const double* g, double scale = 1) const;
    /** Zero in rows of acceleration-only constraints. **/
    void calcVelocityErrors(double* gDot) const;
    /** Constraint residual of a step: velocity errors, or position errors divided by the
    stiffness factor; rows that
    are not so deep at their own level. **/
    void calcStepErrors(MotionLevel level, const NewtonFactors& factors, const double* uDot,
                        const double* q, double* c) const;
    /** g̈ for the given accelerations. **/
    void calcAccelerationErrors(const double* q, const double* u, const double* uDot,
                                double* gDotDot) const;
    /** Zero in rows of prescribed speeds. **/
    void calcResidual(const double* q, const double* u, const double* uDot, const double* lambda,
                      double* r);
    /** Power of applied loads, damping, working constraints and prescribed motions [W]. **/
    double calcPower(const double* q, const double* u, const double* uDot, const double* lambda);
    /** Whether errors and derivatives of joints are those for axes far from their place, see
    JointEquations; for assembly. **/
    void setAligning(bool isAligning) {
        m_isAligning = isAligning;
        m_hasJacobians = false;
    }
    /** Largest angle that a joint's axes are away from their place [rad]. **/
    double calcMisalignment() const;
    /** Name of a joint that is assembled on the wrong branch, or null. **/
    const std::string* findFlippedJoint() const;
    /**@}**/

    /** @name After calcResidual() **/
    /**@{**/
    /** @param dense  with everything that depends on a block's own q and u: gyroscopic and
    centrifugal terms, and what its motion changes in loads on it (AttachmentForces and
    DistributedLoads, by differences)
    @param level  Position: only rows of holonomic constraints and only coordinates whose q is
    prescribed take part; Velocity: all but what is prescribed of accelerations only. **/
    void formNewtonSystem(const NewtonFactors& factors, bool dense, const double* q,
                          const double* u, const double* uDot, NewtonSystem& system,
                          MotionLevel level = MotionLevel::Acceleration);
    /** J = M. **/
    void formMassSystem(NewtonSystem& system) const;

    /** True if differentiateTrees() has a use: all is rigid, not too large, and something acts
    besides inertia and gravity. **/
    bool canDifferentiateTrees() const { return m_canDifferentiateTrees; }
    /** ∂r/∂u and ∂r/∂q·N of rigid trees by differences, at given u̇: forces of any kind,
    unsymmetric as they are, and gyroscopic terms. Forces of constraints are left out: near singular
    positions they grow without bound, and the matrix is the norm of projections too. The dense form
    of the Newton matrix has them from now on.
    @pre the last realize() was at this q and u, where it is left
    @returns false if a force is not a finite number nearby **/
    bool differentiateTrees(const double* q, const double* u, const double* uDot);
    bool hasTreeDerivatives() const { return m_hasTreeDerivatives; }
    void forgetTreeDerivatives() { m_hasTreeDerivatives = false; }
    /** Adds −ΔM u̇, what Simbody's mass matrix lacks of the flexible bodies'. **/
    void addInCouplingForces(const double* uDot, SimTK::Vector_<SimTK::SpatialVec>& bodyForces,
                             SimTK::Vector& mobilityForces) const;
    /**@}**/

    void integrateQ(const double* qHist, double gamma, const double* u, double* q) const;
    /** q̇ = N(q) u. @pre realize() at this q. **/
    void calcQDot(const double* q, const double* u, double* qDot) const;
    /** N(q) is that of the last realize(). **/
    void displaceQ(const double* delta, double* q) const;
    /** The same for a finite δ, exact to second order. **/
    void moveQ(const double* delta, double* q) const;
    void normalizeQ(double* q) const;

    /** Largest displacement over the blocks [m]; `worst` receives the block. **/
    double calcDisplacement(const double* delta, int* worst = nullptr) const;

    /** @name Size of errors, in metres or as SimTK::Integrator has it
    With Simbody's norms: the largest of three, infinity or root-mean-square norms of N W N⁺ δq with
    the State's weights W of speeds, and of δu and δz by the larger of value and 1/weight. **/
    /**@{**/
    enum class Norm { Displacement, Infinity, RootMeanSquare };
    /** @pre all is rigid, if not Displacement. **/
    void setErrorNorm(Norm norm);
    bool hasErrorsInMetres() const { return m_norm == Norm::Displacement; }
    /** Values that errors are relative to from now on. **/
    void setErrorReference(const double* q, const double* u, const double* z);
    /** Of a step's end. **/
    double calcErrorSize(const double* deltaQ, const double* deltaU, double h,
                         int* worst = nullptr) const;
    /** Of a change of u at a step's end, and of q by stiffness times that. **/
    double calcChangeSize(const double* deltaU, double stiffness, int* worst = nullptr) const;
    double calcZError(const double* deltaZ) const;
    /**@}**/

    void getFromState(const SimTK::State& state, double* q, double* u) const;
    void putIntoState(double time, const double* q, const double* u, SimTK::State& state) const;
    SimTK::Vector calcSimbodyUDot(const double* q, const double* uDot) const;

    /** @name How loads and motions depend on time alone, all else as at the last realize()
    Of Simbody's forces and constraints those that may: Force::Custom, Constraint::Custom and
    Constraint::PrescribedMotion. **/
    /**@{**/
    bool hasTimedLoads() const { return m_hasTimedLoads; }
    /** True if something is locked or moved by a Motion. **/
    bool hasPrescribed() const { return m_prescribed != nullptr; }
    bool hasTimedMotions() const { return m_prescribed && m_prescribed->hasMotions(); }
    /** What may depend on time, elsewhere zero.
    @param[out] r  forces in the equations' sign; of prescribed accelerations, what they add to
        speeds in a step
    @param[out] g  errors of constraints in positions; of those of speeds and accelerations, what a
        step makes of them **/
    void calcTimedLoads(double time, const NewtonFactors& factors, const double* q, const double* u,
                        const double* uDot, double* r, double* g);
    /** Writes the q and u that Motions prescribe at another time. **/
    void calcTimedMotions(double time, double* q, double* u);
    /**@}**/

    /** Weighs speeds and coordinates of rigid trees by what they move in the pose of the last
    realize(); cheap on the average. Flexible bodies have their own frames. **/
    void followPose();

    /** Simbody's force elements see these variables' values from the next realize() on. **/
    void takeVariables(const std::vector<SimTK::DiscreteVarKey>& keys, const SimTK::State& from);

    /** @name Auxiliary variables z, which belong to Simbody's elements and Measures **/
    /**@{**/
    int numZ() const { return m_numZ; }
    /** Elements see these z from the next realize() on. **/
    void setZ(const double* z);
    /** ż at the time of the last realize(); those that depend on accelerations see these u̇. **/
    void calcZDot(const double* q, const double* u, const double* uDot, const double* z,
                  double* zDot);
    /**@}**/

    /** What the next evaluation takes over from the last one: values of Motions, and where
    Simbody's N(q) was evaluated. **/
    void visit(Checkpoint& checkpoint);

    /** @name For messages about failures; empty: nothing to say **/
    /**@{**/
    /** "the load on 'boom.B' is not at t = 0.1 s": what gives numbers that are not finite. **/
    std::string findNonFinite(double time, const double* q, const double* u);
    /** "The motion of joint 'drive' jumps by …", if one does within some h. **/
    std::string findMotionJump(double time, double h, const double* q, const double* u);
    /** The largest force on a block, of simflex/forces and of Simbody's own elements. **/
    std::string findLargestElement(double time, const double* q, const double* u, int block);
    std::string findLargestForeignForce(double time, const double* q, const double* u,
                                        int block) const;
    /** A speed that moves no mass of its own. @pre realize() **/
    std::string findMassless(int block) const;
    /**@}**/

    /** True if N(q) or forces are asked of Simbody. **/
    bool needsSimbody() const { return m_needsSimbody; }
    /** True if N(q) is; it is that of the last realize(). **/
    bool asksForN() const;

    /** Wall time spent in Simbody since the last call. **/
    double takeSimbodySeconds() { return std::exchange(m_simbodySeconds, 0); }

private:
    /** A frame of a joint or force element: on a block, or fixed in Ground (block −1). **/
    struct FrameRef {
        int block = -1, frame = -1;
        FrameMotion fixed;
    };
    struct JointRef {
        const JointRecord* record;
        int firstRow;
        int drive;                    ///< among TimeValues
        std::vector<FrameRef> sides;  ///< F, M; of a coupler those of every coordinate
        std::vector<const FrameMotion*> motions;
        std::vector<SimTK::SpatialVec> D;  ///< rows of the first side, then of the next …

        int numRows() const { return record->equations->getNumEquations(); }
        const SimTK::SpatialVec* rowsOf(int side) const { return &D[size_t(side * numRows())]; }
    };
    struct ElementRef {
        const ForceElement* element;
        std::vector<FrameRef> frames;
        SimTK::Array_<FrameMotion> motions;
        SimTK::Array_<SimTK::SpatialVec> forces;
        int timedForce;  ///< among TimeValues
        int firstRow;    ///< of its Jacobian's terms, after those of all constraints
        SimTK::Array_<SimTK::Real> signs;
        SimTK::Array_<SimTK::SpatialVec> directions;
    };
    /** A joint side that acts on a block, and its columns of the block's Gᵀ. **/
    struct BlockSide {
        int joint, side;
        int firstColumn;
        int partFrame = 0;  ///< of the block's part, if it has one
    };
    /** The same for the Jacobian of a force element. **/
    struct ElementSide {
        int element, attachment;
        int firstColumn;
        int partFrame = 0;
    };
    /** The Jacobian of foreign forces; its terms in a block are columns of Gᵀ there. **/
    struct DifferencedForce {
        ForceDifferences differences;
        int firstRow;
        /** Blocks that it acts on: their first column for it, their speeds among its own. **/
        struct Side {
            int block, firstColumn;
            std::vector<int> speeds;
        };
        std::vector<Side> sides;
        /** A rigid block that all of it acts in, which its matrix is added to; −1: none. **/
        int ownBlock = -1;
    };
    /** A block with loads that its own motion can change. **/
    struct LoadedBlock {
        int block;
        std::vector<FlexibleBlock*> flexible;  ///< the block, if it is flexible
        std::vector<int> elements;             ///< on frames of its own
        std::vector<double> steps;             ///< for differences, of each speed
    };
    /** What loaded blocks share, one after the other. **/
    struct LoadScratch {
        std::vector<double> movedQ;  ///< the block's q, moved along each speed
        std::vector<double> q, u;    ///< of the whole system; the block's part counts
        std::vector<double> r, r0;
    };
    /** Blocks evaluated together: flexible ones of one part, or rigid trees. **/
    struct Batch {
        std::vector<int> blocks;
        std::vector<FlexibleBlock*> flexible;
    };
    /** Flexible blocks of one part and damping that are held at the same places, or nearly so, and
    the shapes that their joints and forces act through. **/
    struct PartGroup {
        int firstBlock;
        std::vector<const FrameShapes*> frames;
        std::shared_ptr<const std::vector<double>> shapes;
    };

    std::string describeElement(const ElementRef& element) const;
    /** Calls visit(force, bodyForces, mobilityForces) for Simbody's elements but gravity. **/
    template <class Visit>
    void visitForeignForces(double time, const double* q, const double* u, Visit visit) const;
    void collectGravityAndForces(const SimTK::State& state);
    /** The private States without what is evaluated here. **/
    void preparePrivateStates(const SimTK::State& state);
    /** What functions of time are there, from now on. **/
    void moveFunctions(double time);
    void realizeBlocks(const double* q, const double* u);
    const JointEquations::Drive& driveOf(const JointRef& joint) const {
        return m_functions.get().drives[size_t(joint.drive)];
    }
    /** Of one element, anew. **/
    static void calcElementForces(const ElementRef& element, const TimeValues& values,
                                  SimTK::Array_<SimTK::SpatialVec>& forces);
    void refuseUnsupported(const SimTK::State& state) const;
    /** The system's enabled constraints that are not joints. **/
    std::vector<SimTK::ConstraintIndex> findSimbodyConstraints(const SimTK::State& state) const;
    void makeBlocks(const SimTK::State& state);
    void makeBatches();
    void makeJoints();
    void makeForceElements();
    void makeLoadedBlocks();
    void findTimedLoads();
    void makeForceDifferences(const std::vector<ForceSelection>& selections);
    /** True if a differenced force acts on the block in a way that an arrow has no columns for:
     * on its modes, or where no frame of its part stands for the columns. **/
    bool hasDifferencedModes(int block) const;
    void takeWeights(const SimTK::State& state);
    void updateGravity(const SimTK::State& state);
    void makeTreeDerivatives();
    void addInTreeDerivatives(const NewtonFactors& factors, NewtonSystem& system) const;
    /** Simbody's speeds and what they move. **/
    std::vector<ForceDifferences::Speed> listSimbodySpeeds() const;
    /** True for the modes of a body that is rigid: they have no speeds here. **/
    bool isHeld(SimTK::MobilizedBodyIndex body) const;
    PrescribedMotion::Mobilizer findMobilizer(SimTK::MobilizedBodyIndex body) const;
    FrameRef makeFrame(const Attachment& attachment);
    void linkJointsToFrames();
    void updateJacobians() const;
    const FrameMotion& motionOf(const FrameRef& frame) const;
    void makeParts();
    bool sharesPart(int block, int other) const;
    /** Writes (or, in a block without part, adds) a column of Gᵀ. **/
    void setColumn(int b, int frame, int column, const SimTK::SpatialVec& d,
                   NewtonSystem::Block& block) const;
    void formConstraintBlock(int b, NewtonSystem::Block& block) const;
    void makeSimbodyConstraints();
    void makePrescribedMotion();
    int findBlock(SimTK::MobilizedBodyIndex mobod) const;
    void subtractJointForces(int b, const double* lambda, double* r) const;
    void calcUnclearedResidual(const double* q, const double* u, const double* uDot,
                               const double* lambda, double* r);
    /** Columns of Simbody's constraints, and the identity for what is prescribed. **/
    void formElementColumns(const NewtonFactors& factors, NewtonSystem& system) const;
    void addInLoadJacobian(const LoadedBlock& loaded, const NewtonFactors& factors, const double* q,
                           const double* u, NewtonSystem::Block& block);
    /** Moves a block to q and u of the whole system and writes −Q of the loads on it. **/
    void calcLoadResidual(const LoadedBlock& loaded, const double* q, const double* u, double* r);
    void formDifferencedColumns(const NewtonFactors& factors, NewtonSystem& system) const;
    void addInDifferencedMatrices(const NewtonFactors& factors, NewtonSystem& system) const;
    /** Simbody's speeds of a differenced force, as rows of its own block. **/
    std::vector<int> listOwnRows(const DifferencedForce& forces) const;
    void formSimbodyColumns(MotionLevel level, NewtonSystem& system) const;
    /** Asks Simbody for what Motions prescribe at this time, unless it is known. **/
    void updatePrescribed(double time, const double* q, const double* u);
    void realizeSimbody(double time, const double* q, const double* u);

    const SimTK::MultibodySystem& m_system;
    const FlexibleBodySubsystem::Guts* m_guts = nullptr;
    Setting m_setting;
    std::string m_owner;                     ///< for messages
    SimTK::State m_private;                  ///< empty if Simbody is never asked
    const SimTK::State* m_now = &m_private;  ///< on which Simbody is asked
    SimTK::State m_zState;  ///< on which Simbody evaluates ż; empty if there are no z
    int m_numZ = 0, m_numSimbodyU = 0;
    GravityField m_gravity, m_fullGravity;
    std::vector<const SimTK::Force::Gravity*> m_gravityForces;  ///< enabled ones
    double m_loadFraction = 1;
    bool m_hasForeignForces = false;
    bool m_needsSimbody = false;
    EvaluationContext m_context;
    FunctionsOfTime m_functions;

    std::vector<std::unique_ptr<Block>> m_blocks;
    std::vector<FlexibleBlock*> m_flexible;  ///< by FlexibleBodyIndex
    std::vector<RigidTree*> m_rigid;
    std::vector<Batch> m_batches;
    mutable std::vector<JointRef> m_joints;  ///< Jacobians are made when first asked for
    mutable bool m_hasJacobians = false;
    bool m_isAligning = false;
    std::vector<std::pair<int, double>> m_periods;   ///< rows of couplers that have one
    mutable std::vector<FrameMotion> m_accelerated;  ///< of one joint's sides
    mutable std::vector<const FrameMotion*> m_acceleratedFrames;
    mutable std::vector<ElementRef> m_elements;  ///< Jacobians are made with the Newton matrix
    mutable std::vector<DifferencedForce> m_differenced;
    /** n×n matrices of one rigid tree. **/
    struct TreeDerivatives {
        int block;
        std::vector<double> byQ, byU;
    };
    std::vector<TreeDerivatives> m_treeDerivatives;
    std::vector<double> m_metres;  ///< displacement per unit of each speed
    Norm m_norm = Norm::Displacement;
    std::vector<double> m_uWeights, m_zWeights;  ///< the State's
    std::vector<double> m_referenceQ, m_uScales, m_zScales;
    mutable std::vector<double> m_weighed;  ///< numQ, used within calcErrorSize()
    double calcNorm(int size, const double* values, const double* scales, int* worst) const;
    bool m_canDifferentiateTrees = false, m_hasTreeDerivatives = false;
    std::vector<LoadedBlock> m_loadedBlocks;
    LoadScratch m_loadScratch;
    int m_numElementRows = 0;                   ///< of elements and differenced forces
    std::vector<std::vector<int>> m_blockRows;  ///< constraint row of each block's columns
    std::vector<PartGroup> m_parts;
    std::vector<int> m_blockOfBody;  ///< by MobilizedBodyIndex; −1: Ground
    std::vector<int> m_partOfBlock;  ///< −1: none
    std::vector<std::vector<BlockSide>> m_blockSides;
    std::vector<std::vector<ElementSide>> m_elementSides;
    /** Columns of Gᵀ that Simbody's constraints have in each block: constraint row, column. **/
    std::vector<std::vector<std::pair<int, int>>> m_simbodyColumns;
    std::unique_ptr<SimbodyConstraints> m_constraints;
    std::unique_ptr<PrescribedMotion> m_prescribed;
    double m_prescribedTime = SimTK::NaN;  ///< at which Motions were asked of Simbody last
    int m_firstSimbodyRow = 0;
    /** Bodies that one of Simbody's constraints joins, and its rows. **/
    std::vector<std::pair<std::array<FrameRef, 2>, int>> m_constrainedPairs;
    SimTK::Vector_<SimTK::SpatialVec> m_bodyForces;  ///< of Simbody's elements and constraints
    SimTK::Vector m_mobilityForces;
    std::vector<double> m_scratch;
    int m_numQ = 0, m_numU = 0, m_numMultipliers = 0, m_numThreads = 1;
    double m_time = 0;
    bool m_hasTimedLoads = false, m_hasTimedConstraints = false;
    std::vector<const SimTK::Force::Custom::Implementation*> m_timedForces;
    SimTK::State m_timedState;  ///< on which Simbody evaluates these at other times
    SimTK::Vector_<SimTK::SpatialVec> m_timedBodyForces;
    SimTK::Vector m_timedMobilityForces;
    SimTK::Vector_<SimTK::Vec3> m_timedParticleForces;
    SimTK::Array_<SimTK::SpatialVec> m_timedElementForces;  ///< of one element
    std::unique_ptr<PrescribedMotion> m_timedMotion;
    double m_firstTime = -SimTK::Infinity, m_lastTime = SimTK::Infinity;
    mutable double m_simbodySeconds = 0;
};

/** @throws std::invalid_argument naming `method` if the system has changed since realizeTopology(),
or the State is empty. **/
void requireTopology(const SimTK::MultibodySystem& system, const SimTK::State& state,
                     const std::string& method);

}  // namespace simflex
