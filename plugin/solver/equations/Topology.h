#pragma once
/** @file
What does not change while equations of motion are evaluated (private header): the blocks of a
system, where their coordinates and speeds stand, the rows and columns of constraints and forces,
which blocks are evaluated together and which share a part. A TopologyBuilder makes it; from then on
it is constant. **/

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
        Linearize,  ///< the same with all of Simbody's speeds
        Native      ///< within a realization of Simbody's own
    };

    struct Joint {
        const JointRecord* record;
        int firstRow;
        int drive;                    ///< among TimeValues
        std::vector<FrameRef> sides;  ///< F, M; of a coupler those of every coordinate

        int numRows() const { return record->equations->getNumEquations(); }
    };
    /** A contact of a joint's friction. A force has two rows each for what it does, first of all:
    the force's own, which is one of the multipliers, and one that stays zero. **/
    struct Friction {
        int joint;    ///< among `joints`
        int contact;  ///< of its FrictionEquations
        int firstRow, numRates;
        const FrictionEquations& getEquations(const Topology& topology) const {
            return *topology.joints[size_t(joint)].record->friction;
        }
        int numRows() const { return 2 * numRates; }
        /** Of the force along a rate, and the one beside it. **/
        int forceRow(int rate) const { return firstRow + rate; }
        int slopeRow(int rate) const { return firstRow + numRates + rate; }
    };
    struct Element {
        const ForceElement* element;
        std::vector<FrameRef> frames;
        int timedForce;  ///< among TimeValues
        int firstRow;    ///< of its Jacobian, after those of all constraints
        int numTerms;    ///< of the Jacobian, a row each
        int numPairs;    ///< two rows each

        int numRows() const { return numTerms + 2 * numPairs; }
        bool isLoad() const { return numRows() == 0; }
    };
    /** A joint's or force element's side that acts on a block, and its columns of the block's Gᵀ.
     * **/
    struct BlockSide {
        int owner, side;
        int firstColumn;
        int partFrame = 0;  ///< of the block's part, if it has one
    };
    /** The Jacobian of foreign forces; its terms in a block are columns of Gᵀ there. **/
    struct StateEquationRef {
        const StateEquation* equation;
        std::vector<FrameRef> frames;
    };
    struct DifferencedForce {
        int firstRow, numTerms;
        /** Blocks that it acts on: their first column for it, their speeds among its own. **/
        struct Side {
            int block, firstColumn;
            std::vector<int> speeds;
        };
        std::vector<Side> sides;
        /** A rigid block that all of it acts in, which its matrix is added to; −1: none. **/
        int ownBlock = -1;
        std::vector<int> ownRows;  ///< of that block, for each of its speeds
    };
    /** A block with loads that its own motion can change. **/
    struct LoadedBlock {
        int block;
        std::vector<int> elements;  ///< on frames of its own
        std::vector<double> steps;  ///< for differences, of each speed
    };
    /** Flexible blocks of one part and damping that are held at the same places, or nearly so, and
    the shapes that their joints and forces act through. **/
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
    int numZ = 0;                          ///< those of `states` among them
    std::vector<StateEquationRef> states;  ///< consecutive in z, from firstZ on
    int firstZ = 0;
    /** Whether Newton's method solves for it. **/
    bool isCoupled(int z) const {
        return hasCoupledStates && z >= firstZ && z < firstZ + int(states.size());
    }
    /** Numbers among z of those that do not follow the motion.
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
    std::vector<char>
        hasOwnColumns;             ///< by block: its constraints do not act through a part's shapes
    std::vector<int> partOfBlock;  ///< −1: none

    std::vector<Joint> joints;
    std::vector<std::vector<BlockSide>> blockSides;  ///< of joints, by block
    std::vector<std::pair<int, double>> periods;     ///< rows of couplers that have one

    std::vector<Friction> frictions;
    std::vector<std::vector<BlockSide>> frictionSides;  ///< by block
    int firstFrictionRow = 0;                           ///< after those of Simbody

    int firstSimbodyRow = 0;
    std::vector<SimbodyRow> simbodyRows;
    /** Columns of Gᵀ that Simbody's constraints have in each block: constraint row, column. **/
    std::vector<std::vector<std::pair<int, int>>> simbodyColumns;
    /** Bodies that one of Simbody's constraints joins, and its rows. **/
    std::vector<std::pair<std::array<FrameRef, 2>, int>> constrainedPairs;
    std::vector<char> isPrescribed;  ///< speeds that a lock or Motion prescribes, at whatever level

    std::vector<Element> elements;
    std::vector<std::vector<BlockSide>> elementSides;  ///< of their Jacobians, by block
    std::vector<DifferencedForce> differenced;
    int numElementRows = 0;  ///< of elements and differenced forces
    std::vector<LoadedBlock> loadedBlocks;

    bool hasForeignForces = false;   ///< of Simbody's elements that the blocks do not apply
    bool hasMobilityForces = false;  ///< of Simbody's elements that rigid trees apply
    /** Of Simbody's elements other than gravity. **/
    bool hasSimbodyForces() const { return hasForeignForces || hasMobilityForces; }
    bool areForcesHeld = false;    ///< which change with their variables only
    bool needsSimbody = false;     ///< N(q) or forces are asked of Simbody
    bool needsKinematics = false;  ///< and more than forces

    int numBlocks() const { return int(blockSizes.size()); }
    bool hasModes() const;
    int findBlock(SimTK::MobilizedBodyIndex body) const { return blockOfBody[size_t(body)]; }

    /** A Newton system of this topology, zero. **/
    NewtonSystem makeNewtonSystem() const;

    /** First multiplier of a Simbody constraint, after those of all joints, and their number; none
    if it is disabled or a joint's own. **/
    std::pair<int, int> findRows(SimTK::ConstraintIndex constraint) const;
    /** First multiplier of a joint; −1 if it is released: its Constraint is disabled. **/
    int findFirstRow(JointIndex joint) const;
    /** First row of a joint's friction, −1 if it has none. **/
    int findFirstFrictionRow(JointIndex joint) const;
    /** Level at which a constraint row holds; joints hold positions, and friction speeds. **/
    MotionLevel getRowLevel(int row) const;
    /** Name of the joint, its friction's too, or Simbody constraint that owns a multiplier. **/
    const std::string& getJointName(int row) const;
    /** "joint 'gudgeon pin'", or a Simbody constraint's kind and bodies. **/
    std::string describeConstraint(int row) const;
    /** "equation 4 of 'gudgeon pin'": a constraint row for people. **/
    std::string describeRow(int row) const;

    /** True if position errors of a step that began without are so large a part of a coupler's
    period that the next step, twice as long, might come out a whole period (a gear's tooth) off.
    @param scale  errors are g·scale **/
    bool mayLoseCount(const double* g, double scale = 1) const;

    /** Whether some states count turns, and whether there are others: Newton's method solves for
    all of them then. **/
    bool countsTurns = false, hasCoupledStates = false;
};

}  // namespace simflex
