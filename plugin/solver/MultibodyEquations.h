#pragma once
/** @file
The equations of motion of a whole system, block by block, from q and u (private header):

    r = M(q) u̇ + b(q, u) − f(q, u, t) + G(q)ᵀλ,    g(q, t),    ġ = G u + ∂g/∂t

Flexible bodies, joints, gravity, the elements of simflex/forces and simple rigid mobilizers are
evaluated here; Simbody is asked only for rigid trees with other mobilizers and for foreign forces,
on a private State. **/

#include <memory>
#include <utility>
#include <vector>

#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/Block.h"
#include "simflex/solver/NewtonSystem.h"

namespace simflex {

class FlexibleBlock;
class RigidTree;

class MultibodyEquations {
public:
    /** Analyses the system; `state` gives instance variables (gravity, disabled elements) and is
    copied.
    @throws std::invalid_argument that names what cannot be supported. **/
    MultibodyEquations(const SimTK::MultibodySystem& system, const SimTK::State& state);
    ~MultibodyEquations();

    int numQ() const { return m_numQ; }
    int numU() const { return m_numU; }
    int numMultipliers() const { return m_numMultipliers; }
    int numBlocks() const { return int(m_blocks.size()); }
    const Block& getBlock(int b) const { return *m_blocks[b]; }

    /** First multiplier of a joint. **/
    int getFirstRow(JointIndex joint) const { return m_joints[joint].firstRow; }
    /** Name of the joint that owns a multiplier. **/
    const std::string& getJointName(int row) const;

    void setNumThreads(int threads) { m_numThreads = threads; }

    /** A Newton system of this topology, zero. **/
    NewtonSystem makeNewtonSystem() const;

    /** Positions, velocities, joint frames; first call of every evaluation. **/
    void realize(double time, const double* q, const double* u);

    /** @name After realize() **/
    /**@{**/
    void calcPositionErrors(double* g) const;
    void calcVelocityErrors(double* gDot) const;
    /** g̈ for the given accelerations. **/
    void calcAccelerationErrors(const double* u, const double* uDot, double* gDotDot) const;
    void calcResidual(const double* q, const double* u, const double* uDot, const double* lambda,
                      double* r);
    /** Power of applied loads, damping and prescribed motions [W]. **/
    double calcPower(const double* u, const double* lambda) const;
    /** Name of a joint that is assembled on the wrong branch, or null. **/
    const std::string* findFlippedJoint() const;
    /**@}**/

    /** @name After calcResidual() **/
    /**@{**/
    void formNewtonSystem(double gamma, bool dense, const double* u, const double* uDot,
                          NewtonSystem& system) const;
    /** J = M. **/
    void formMassSystem(NewtonSystem& system) const;
    /**@}**/

    /** Splits a vector of all speeds into the blocks' r. **/
    void setResidual(const double* r, NewtonSystem& system) const;

    void integrateQ(const double* qHist, double gamma, const double* u, double* q) const;
    void displaceQ(const double* delta, double* q) const;
    void normalizeQ(double* q) const;

    /** Largest displacement over the blocks [m]; `worst` receives the block. **/
    double calcDisplacement(const double* delta, int* worst = nullptr) const;
    double calcErrorDisplacement(const double* deltaQ, const double* deltaU, double h,
                                 int* worst = nullptr) const;

    void getFromState(const SimTK::State& state, double* q, double* u) const;
    void putIntoState(double time, const double* q, const double* u, SimTK::State& state) const;
    SimTK::Vector calcSimbodyUDot(const double* q, const double* uDot) const;

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
        FrameRef sides[2];
        SimTK::SpatialVec D[2][JointEquations::MaxEquations];
    };
    struct ElementRef {
        const ForceElement* element;
        std::vector<FrameRef> frames;
        SimTK::Array_<FrameMotion> motions;
        SimTK::Array_<SimTK::SpatialVec> forces;
    };
    /** A joint side that acts on a block, and its columns of the block's Gᵀ. **/
    struct BlockSide {
        int joint, side;
        int firstColumn;
        int partFrame = 0;  ///< of the block's part, if it has one
    };
    /** Flexible blocks of one part and damping, and the shapes that their joints act through. **/
    struct PartGroup {
        int firstBlock;
        std::vector<const FrameShapes*> frames;
        std::shared_ptr<const std::vector<double>> shapes;
    };

    void collectGravityAndForces(const SimTK::State& state);
    void refuseUnsupported(const SimTK::State& state) const;
    void makeBlocks(const SimTK::State& state);
    void makeJoints();
    void makeForceElements();
    FrameRef makeFrame(const Attachment& attachment);
    const FrameMotion& motionOf(const FrameRef& frame) const;
    void makeParts();
    bool sharesPart(int block, int other) const;
    void formConstraintBlock(int b, NewtonSystem::Block& block) const;
    void realizeSimbody(double time, const double* q, const double* u);

    const SimTK::MultibodySystem& m_system;
    const FlexibleBodySubsystem::Guts* m_guts = nullptr;
    SimTK::State m_private;
    GravityField m_gravity;
    bool m_hasForeignForces = false;
    bool m_needsSimbody = false;
    EvaluationContext m_context;

    std::vector<std::unique_ptr<Block>> m_blocks;
    std::vector<FlexibleBlock*> m_flexible;  ///< by FlexibleBodyIndex
    std::vector<RigidTree*> m_rigid;
    std::vector<JointRef> m_joints;
    std::vector<ElementRef> m_elements;
    std::vector<std::vector<int>> m_blockRows;  ///< constraint row of each block's columns
    std::vector<PartGroup> m_parts;
    std::vector<int> m_partOfBlock;  ///< −1: none
    std::vector<std::vector<BlockSide>> m_blockSides;
    int m_numQ = 0, m_numU = 0, m_numMultipliers = 0, m_numThreads = 1;
    double m_time = 0;
    double m_simbodySeconds = 0;
};

}  // namespace simflex
