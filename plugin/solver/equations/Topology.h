#pragma once
/** @file
Structure of a system's equations of motion, constant during evaluation (private header): blocks,
the indices of their coordinates and speeds, the rows and columns of constraints and forces, which
blocks are evaluated together and which share a part. Built by TopologyBuilder. **/

#include <array>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "Simbody.h"
#include "simflex/body/FlexibleBodySubsystemGuts.h"
#include "simflex/solver/NewtonSystem.h"
#include "simflex/solver/equations/SimbodyConstraints.h"

namespace simflex {

/** A frame of a joint or force element: on a block, or fixed in Ground (block −1). **/
struct FrameRef {
    int block = -1, frame = -1;
    FrameMotion fixed;
};

struct Topology {
    enum class Setting {
        Implicit,   ///< bodies that are rigid in the State have no modal speeds
        Linearize,  ///< the same, but with all of Simbody's speeds
        Native      ///< within Simbody's own realization
    };

    struct Joint {
        const JointRecord* record;
        int firstRow;
        int drive;                    ///< index among TimeValues
        std::vector<FrameRef> sides;  ///< F, M; for a coupler, those of every coordinate

        int numRows() const { return record->equations->getNumEquations(); }
    };
    /** A contact of a joint's friction. Each rate has two rows: that of the friction force, which
    is one of the multipliers, and one whose multiplier stays zero. **/
    struct Friction {
        int joint;    ///< index in `joints`
        int contact;  ///< index in its FrictionEquations
        int firstRow, numRates;
        const FrictionEquations& getEquations(const Topology& topology) const {
            return *topology.joints[size_t(joint)].record->friction;
        }
        int numRows() const { return 2 * numRates; }
        /** Rows of the force along a rate, and of its slopes. **/
        int forceRow(int rate) const { return firstRow + rate; }
        int slopeRow(int rate) const { return firstRow + numRates + rate; }
    };
    struct Element {
        const ForceElement* element;
        std::vector<FrameRef> frames;
        int timedForce;  ///< index among TimeValues
        int firstRow;    ///< of its Jacobian, after those of all constraints
        int numTerms;    ///< of the Jacobian, one row each
        int numPairs;    ///< two rows each

        int numRows() const { return numTerms + 2 * numPairs; }
        bool isLoad() const { return numRows() == 0; }
    };
    /** A side of a joint or force element acting on a block, and its columns of the block's Gᵀ. **/
    struct BlockSide {
        int owner, side;
        int firstColumn;
        int partFrame = 0;  ///< index in the block's part, if it has one
    };
    struct StateEquationRef {
        const StateEquation* equation;
        std::vector<FrameRef> frames;
    };
    /** Jacobian of foreign forces; its terms in a block are columns of Gᵀ there. **/
    struct DifferencedForce {
        int firstRow, numTerms;
        /** A block that it acts on: first column there, and the speeds that it depends on. **/
        struct Side {
            int block, firstColumn;
            std::vector<int> speeds;
        };
        std::vector<Side> sides;
        /** Rigid block that contains the whole force, whose matrix it is added to; −1: none. **/
        int ownBlock = -1;
        std::vector<int> ownRows;  ///< rows of that block, for each of its speeds
    };
    /** A block with loads that depend on its own motion. **/
    struct LoadedBlock {
        int block;
        std::vector<int> elements;  ///< on its own frames
        std::vector<double> steps;  ///< difference steps, by speed
    };
    /** Flexible blocks of the same part and damping with nearly the same attachment points, and the
    shapes through which their joints and forces act. **/
    struct PartGroup {
        int firstBlock;
        std::vector<const FrameShapes*> frames;
        std::shared_ptr<const std::vector<double>> shapes;
    };
    /** A row of Simbody's constraints. **/
    struct SimbodyRow {
        SimTK::ConstraintIndex constraint;
        MotionLevel level;
        std::string name;
    };

    const SimTK::MultibodySystem* system = nullptr;
    const FlexibleBodySubsystem::Guts* guts = nullptr;  ///< null: no flexible bodies or joints
    Setting setting = Setting::Implicit;

    int numQ = 0, numU = 0, numMultipliers = 0;
    int numZ = 0;                          ///< including those of `states`
    std::vector<StateEquationRef> states;  ///< consecutive in z from firstZ on
    int firstZ = 0;
    /** Whether Newton's method solves for this z. **/
    bool isCoupled(int z) const {
        return hasCoupledStates && z >= firstZ && z < firstZ + int(states.size());
    }
    /** Returns the indices of z that do not follow the motion.
    @throws std::runtime_error if one is held between events. **/
    std::vector<int> listOwnStates() const;
    bool hasForeignZ() const { return numZ > int(states.size()); }
    int numSimbodyU = 0;
    /** Blocks 0 … n−1 are flexible bodies: q = (quaternion, p_GB, ξ), u = (ω_B, v_G, ξ̇), without ξ
    and ξ̇ if the body is rigid (Setting::Implicit). **/
    int numFlexible = 0;
    std::vector<int> blockSizes;   ///< speeds
    std::vector<int> blockOfBody;  ///< by MobilizedBodyIndex; −1: Ground
    /** Blocks evaluated together: flexible ones of one part, or rigid trees. **/
    std::vector<std::vector<int>> batches;
    std::vector<std::vector<int>> blockRows;  ///< constraint row of each block's columns
    std::vector<PartGroup> parts;
    std::vector<char> hasOwnColumns;  ///< by block: constraints do not act through a part's shapes
    std::vector<int> partOfBlock;     ///< −1: none

    std::vector<Joint> joints;
    std::vector<std::vector<BlockSide>> blockSides;  ///< of joints, by block
    std::vector<std::pair<int, double>> periods;     ///< row and period of periodic couplers

    std::vector<Friction> frictions;
    std::vector<std::vector<BlockSide>> frictionSides;  ///< by block
    int firstFrictionRow = 0;                           ///< after Simbody's rows

    int firstSimbodyRow = 0;
    std::vector<SimbodyRow> simbodyRows;
    /** Columns of Simbody's constraints in each block: constraint row, column. **/
    std::vector<std::vector<std::pair<int, int>>> simbodyColumns;
    /** Bodies connected by one of Simbody's constraints, and its rows. **/
    std::vector<std::pair<std::array<FrameRef, 2>, int>> constrainedPairs;
    std::vector<char> isPrescribed;  ///< speeds prescribed by a lock or Motion, at any level

    std::vector<Element> elements;
    std::vector<std::vector<BlockSide>> elementSides;  ///< of their Jacobians, by block
    std::vector<DifferencedForce> differenced;
    int numElementRows = 0;  ///< rows of elements and differenced forces
    std::vector<LoadedBlock> loadedBlocks;

    bool hasForeignForces = false;   ///< Simbody's force elements not applied by the blocks
    bool hasMobilityForces = false;  ///< Simbody's force elements applied by rigid trees
    /** Whether Simbody's elements other than gravity act. **/
    bool hasSimbodyForces() const { return hasForeignForces || hasMobilityForces; }
    bool areForcesHeld = false;    ///< foreign forces change only with their variables
    bool needsSimbody = false;     ///< N(q) or forces come from Simbody
    bool needsKinematics = false;  ///< as does more than forces

    int numBlocks() const { return int(blockSizes.size()); }
    bool hasModes() const;
    int findBlock(SimTK::MobilizedBodyIndex body) const { return blockOfBody[size_t(body)]; }

    /** Returns a zero Newton system of this topology. **/
    NewtonSystem makeNewtonSystem() const;

    /** First multiplier of a Simbody constraint, after those of all joints, and their number; none
    if it is disabled or belongs to a joint. **/
    std::pair<int, int> findRows(SimTK::ConstraintIndex constraint) const;
    /** First multiplier of a joint; −1 if its Constraint is disabled. **/
    int findFirstRow(JointIndex joint) const;
    /** First row of a joint's friction, −1 if it has none. **/
    int findFirstFrictionRow(JointIndex joint) const;
    /** Level at which a constraint row holds: position for joints, velocity for friction. **/
    MotionLevel getRowLevel(int row) const;
    /** Name of the joint (also for its friction) or Simbody constraint that owns a multiplier. **/
    const std::string& getJointName(int row) const;
    /** "joint 'gudgeon pin'", or a Simbody constraint's kind and bodies. **/
    std::string describeConstraint(int row) const;
    /** "equation 4 of 'gudgeon pin'": a constraint row in messages. **/
    std::string describeRow(int row) const;

    /** True if a step that began without position errors has so large an error, relative to a
    coupler's period, that the next step, twice as long, could slip by a period (a gear's tooth).
    @param scale  errors are g·scale **/
    bool mayLoseCount(const double* g, double scale = 1) const;

    /** Whether some states count turns, and whether there are others; if so, Newton's method solves
    for all of them. **/
    bool countsTurns = false, hasCoupledStates = false;
};

}  // namespace simflex
