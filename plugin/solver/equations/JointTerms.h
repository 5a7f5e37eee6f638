#pragma once
/** @file
Joints in the equations of motion (private header): errors g, ġ and g̈ and their rows of G, from
the motions of the connected frames. **/

#include <string>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/FunctionsOfTime.h"

namespace simflex {

class JointTerms {
public:
    JointTerms(const Topology& topology, const Blocks& blocks, const FunctionsOfTime& functions);

    /** Invalidates errors after the frames have moved. **/
    void forgetJacobians() { m_hasJacobians = false; }
    void updateJacobians();
    /** Computes Jacobian and errors at this level for one joint whose frames have moved. Call
    noteJacobians() after all of them. **/
    void update(int joint, MotionLevel level, double* errors);
    void noteJacobians() { m_hasJacobians = true; }
    /** Selects errors and derivatives for strongly misaligned axes, see JointEquations; for
    assembly. **/
    void setAligning(bool isAligning) {
        m_isAligning = isAligning;
        m_hasJacobians = false;
    }

    void calcErrors(double* g) const;
    /** For one joint; not while aligning. **/
    void calcErrors(int joint, double* g) const;
    void calcErrorDots(double* gDot) const;
    void calcErrorDotDots(const double* u, const double* uDot, double* gDotDot);
    /** Errors of time-dependent joints at another time. **/
    void calcErrorsAt(const TimeValues& values, double* g) const;

    /** @name After updateJacobians(), for one block **/
    /**@{**/
    /** r += Gᵀλ. **/
    void addInForces(int block, const double* lambda, double* r) const;
    void formColumns(int b, NewtonSystem::Block& block) const;
    /**@}**/

    /** Adds the power of motions prescribed by joints [W]. **/
    void addInPower(const double* lambda, double& power) const;
    /** Largest misalignment of a joint's axes [rad]. **/
    double calcMisalignment() const;
    /** Name of a joint that is assembled on the wrong branch, or null. **/
    const std::string* findFlipped() const;

    /** Rows of a joint's second side. @pre updateJacobians(). **/
    const SimTK::SpatialVec* getJacobianOfM(int joint) const {
        return m_D.data() + m_workspaces[size_t(joint)].firstD +
               size_t(m_topology.joints[size_t(joint)].numRows());
    }

    const std::vector<const FrameMotion*>& getMotions(int joint) const {
        return m_workspaces[size_t(joint)].motions;
    }
    const JointEquations::Drive& getDrive(int joint) const {
        return m_functions.get().drives[size_t(m_topology.joints[size_t(joint)].drive)];
    }

private:
    struct Workspace {
        std::vector<const FrameMotion*> motions;
        size_t firstD;
    };
    /** A joint's side that acts on a block. **/
    struct Side {
        int frame, firstColumn;  ///< of the block
        int firstRow, numRows;
        size_t firstD;
    };
    SimTK::SpatialVec* updD(int joint) { return m_D.data() + m_workspaces[size_t(joint)].firstD; }
    template <class Visit>
    void visitAll(Visit visit) const;

    const Topology& m_topology;
    const Blocks& m_blocks;
    const FunctionsOfTime& m_functions;
    std::vector<Workspace> m_workspaces;  ///< by joint
    std::vector<SimTK::SpatialVec>
        m_D;                    ///< joint after joint: rows of the first side, then of the next …
    std::vector<Side> m_sides;  ///< block after block
    std::vector<int> m_firstSide;            ///< by block; total number last
    std::vector<int> m_timed;                ///< time-dependent joints
    std::vector<FrameMotion> m_accelerated;  ///< of one joint's sides
    std::vector<const FrameMotion*> m_acceleratedFrames;
    bool m_hasJacobians = false;
    bool m_isAligning = false;
};

}  // namespace simflex
