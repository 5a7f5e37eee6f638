#pragma once
/** @file
Analyses a Simbody system once, before any evaluation (private header). Only this class and
SimbodyBridge depend on the system. **/

#include <memory>
#include <string>
#include <vector>

#include "simflex/solver/equations/Blocks.h"
#include "simflex/solver/equations/ErrorNorm.h"
#include "simflex/solver/equations/FunctionsOfTime.h"
#include "simflex/solver/equations/SimbodyBridge.h"
#include "simflex/solver/equations/Topology.h"

namespace simflex {

class TopologyBuilder {
public:
    /** The parts of an Evaluation. **/
    struct Result {
        std::shared_ptr<const Topology> topology;
        std::unique_ptr<Blocks> blocks;
        std::unique_ptr<FunctionsOfTime> functions;
        std::unique_ptr<SimbodyBridge> simbody;
        std::unique_ptr<ErrorNorm> errorNorm;
    };

    /** @param state  copied; gives instance variables (gravity, disabled elements, locks)
    @param differentiated  foreign forces whose Jacobian is needed
    @throws std::invalid_argument that names an unsupported element. **/
    static Result build(const SimTK::MultibodySystem& system, const SimTK::State& state,
                        Topology::Setting setting,
                        const std::vector<ForceSelection>& differentiated);

private:
    TopologyBuilder(const SimTK::MultibodySystem& system, const SimTK::State& state,
                    Topology::Setting setting);

    void analyse(const SimTK::State& state, const std::vector<ForceSelection>& differentiated);
    void refuseUnsupported(const SimTK::State& state) const;
    void collectGravityAndForces(const SimTK::State& state,
                                 const std::vector<ForceSelection>& differentiated);
    /** Makes the blocks apply one of Simbody's force elements, if they can. **/
    bool takeGravity(const SimTK::Force& force);
    bool takeMobilityForce(const SimTK::Force& force);
    void makeBlocks(const SimTK::State& state);
    void makeBatches();
    void makeJoints();
    /** The system's enabled constraints that are not joints. **/
    std::vector<SimTK::ConstraintIndex> findSimbodyConstraints(const SimTK::State& state) const;
    void makeSimbodyConstraints();
    void makeFrictions();
    void makePrescribedMotion();
    void makeForceElements();
    /** Builds the private States, without elements evaluated by blocks. **/
    void preparePrivateStates(const SimTK::State& state);
    void makeLoadedBlocks();
    void makeForceDifferences(const std::vector<ForceSelection>& selections);
    void makeParts();

    FrameRef makeFrame(const Attachment& attachment);
    PrescribedMotion::Mobilizer findMobilizer(SimTK::MobilizedBodyIndex body) const;
    /** Simbody's speeds and the displacements that they cause. **/
    std::vector<ForceDifferences::Speed> listSimbodySpeeds() const;
    /** Simbody's speeds of a differenced force, as rows of its own block. **/
    std::vector<int> listOwnRows(const ForceDifferences& differences, int block) const;
    /** True if a differenced force acts on the block in a way for which an arrow has no columns: on
    its modes, or where no frame of its part provides them. **/
    bool hasDifferencedModes(int block) const;
    /** True for the modes of a body that is rigid: they have no speeds here. **/
    bool isHeld(SimTK::MobilizedBodyIndex body) const;
    bool sharesPart(int block, int other) const;
    /** Returns the group of a block with these shapes, a new one if none is suitable. **/
    int findPart(int b, const std::vector<const FrameShapes*>& used);

    const SimTK::MultibodySystem& m_system;
    std::string m_owner;  ///< for messages
    std::shared_ptr<Topology> m_shared;
    Result m_result;
    Topology& m_topology;
    Blocks& m_blocks;
    FunctionsOfTime& m_functions;
    SimbodyBridge& m_simbody;
};

/** @throws std::invalid_argument naming `method` if the system has changed since realizeTopology(),
or the State is empty, or has values that are not finite numbers. **/
void requireTopology(const SimTK::MultibodySystem& system, const SimTK::State& state,
                     const std::string& method);

}  // namespace simflex
